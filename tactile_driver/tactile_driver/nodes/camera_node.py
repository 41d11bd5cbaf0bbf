# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""camera_node: publishes image_raw and camera_info from a camera, a recording or a simulated sensor; a lifecycle node."""
from __future__ import annotations

import sys
from functools import partial

from .driver_node import DriverNode
from ..frame import load_calibration
from ..parameters.camera import CAMERA_PARAMETERS, known_pose
from .runtime.host import Host
from .runtime.run import run_node
from ..sources.registry import CAMERA_SOURCES, make_source
from .streams.image import ImagePublishers, ImageStream


class CameraNode(DriverNode):
    """One camera."""

    def __init__(self, host: Host | None = None):
        super().__init__('camera_node', CAMERA_PARAMETERS, 'camera', host)
        self._outputs = ImagePublishers(self)

    def open_stream(self, values: dict) -> ImageStream:
        """See DriverNode."""
        given = load_calibration(values['camera_info_path']) if values['camera_info_path'] else None
        poses = known_pose(values)
        source = self.opened(partial(make_source, CAMERA_SOURCES), values)
        self._outputs.place_cameras(values['frame_id'], poses)
        return ImageStream(self, self._outputs, source, values, given or source.calibration())


def main(args: list[str] | None = None) -> None:
    """Entry point of camera_node."""
    sys.exit(run_node(CameraNode, args))


if __name__ == '__main__':
    main()
