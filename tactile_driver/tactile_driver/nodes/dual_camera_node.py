# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""dual_camera_node: publishes the images of two cameras over one sheet, and the picture stitched from both; a lifecycle node."""
from __future__ import annotations

import sys

from .driver_node import DriverNode
from ..frame import load_calibration
from ..parameters.dual_camera import DUAL_CAMERA_PARAMETERS, check_pair
from .runtime.host import Host
from .runtime.run import run_node
from ..sources.registry import make_dual_source
from ..stitching.calibration import load_stitching
from .streams.dual_camera import DualPublishers, DualStream
from .streams.topic_source import TopicSource


class DualCameraNode(DriverNode):
    """Two cameras: left/image_raw, right/image_raw and the stitched image_raw."""

    def __init__(self, host: Host | None = None):
        super().__init__('dual_camera_node', DUAL_CAMERA_PARAMETERS, 'camera', host)
        self._outputs = DualPublishers(self)

    def open_stream(self, values: dict) -> DualStream:
        """See DriverNode."""
        check_pair(values)
        stitching = load_stitching(values['stitching_path']) if values['stitching_path'] else None
        given = [load_calibration(path) if path else None for path in (values['camera_info_path'], values['right_camera_info_path'])]
        self._outputs.choose_views(published=values['source'] != 'topics')
        source = self.opened(lambda parameters, clock: make_dual_source(parameters, clock, lambda topic: TopicSource(self, topic)), values)
        self._outputs.place_cameras(values['frame_id'], {} if stitching is None else stitching.poses())
        calibrations = tuple(mine or known for mine, known in zip(given, source.calibrations()))
        return DualStream(self, self._outputs, source, values, stitching, calibrations)


def main(args: list[str] | None = None) -> None:
    """Entry point of dual_camera_node."""
    sys.exit(run_node(DualCameraNode, args))


if __name__ == '__main__':
    main()
