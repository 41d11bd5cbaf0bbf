# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""camera_node: a camera, a recording or a simulated sensor on image_raw and camera_info, as a lifecycle node."""
from __future__ import annotations

import sys

from .driver_node import DriverNode
from ..frame import load_calibration
from ..parameters.camera import CAMERA_PARAMETERS, LIVE, check_together
from .runtime.host import Host
from .runtime.run import run_node
from ..sources.camera.registry import make_source
from .streams.image import ImagePublishers, ImageStream


class CameraNode(DriverNode):
    """One camera."""

    def __init__(self, host: Host | None = None):
        super().__init__('camera_node', CAMERA_PARAMETERS, LIVE, self._opened, host=host)
        self._outputs = ImagePublishers(self)

    def _opened(self, values: dict) -> ImageStream:
        check_together(values)
        calibration = load_calibration(values['camera_info_path']) if values['camera_info_path'] else None
        source = make_source(values, self.now_ns)
        source.open()
        return ImageStream(self, self._outputs, source, values, calibration or source.calibration())


def main(args: list[str] | None = None) -> None:
    """The process camera_node."""
    sys.exit(run_node(CameraNode, args))


if __name__ == '__main__':
    main()
