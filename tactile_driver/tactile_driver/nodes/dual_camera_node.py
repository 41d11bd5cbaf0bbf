# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""dual_camera_node: two cameras over one sheet, on left/ and right/image_raw, and stitched on image_raw, as a lifecycle node."""
from __future__ import annotations

import sys

from .driver_node import DriverNode
from ..frame import load_calibration
from ..parameters.camera import LIVE
from ..parameters.dual_camera import DUAL_CAMERA_PARAMETERS, check_together
from .runtime.host import Host
from .runtime.run import run_node
from ..sources.dual_camera.registry import make_dual_source
from ..stitching.calibration import load_stitching
from .streams.dual_camera import DualPublishers, DualStream
from .streams.topic_source import TopicSource


class DualCameraNode(DriverNode):
    """Two cameras."""

    def __init__(self, host: Host | None = None):
        super().__init__('dual_camera_node', DUAL_CAMERA_PARAMETERS, LIVE, self._opened, host=host)
        self._outputs = DualPublishers(self)

    def _opened(self, values: dict) -> DualStream:
        check_together(values)
        stitching = load_stitching(values['stitching_path']) if values['stitching_path'] else None
        given = [load_calibration(path) if path else None for path in (values['camera_info_path'], values['right_camera_info_path'])]
        self._outputs.choose_views(published=values['source'] != 'topics')
        source = make_dual_source(values, self.now_ns, lambda topic: TopicSource(self, topic))
        source.open()
        calibrations = tuple(mine or known for mine, known in zip(given, source.calibrations()))
        return DualStream(self, self._outputs, source, values, stitching, calibrations)


def main(args: list[str] | None = None) -> None:
    """The process dual_camera_node."""
    sys.exit(run_node(DualCameraNode, args))


if __name__ == '__main__':
    main()
