# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""markers_node: RViz markers and image_annotated of an optical sensor."""
from __future__ import annotations

import sys

import numpy as np
from sensor_msgs.msg import CameraInfo, Image
from tactile_driver.errors import BadArgument
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.nodes.runtime.host import AdaptiveSubscription, Host
from tactile_driver.nodes.runtime.ros_defaults import LATCHED_QOS
from tactile_driver.nodes.runtime.run import run_node
from tactile_driver.stitching.calibration import Stitching, load_stitching
from tactile_msgs.msg import DotTracks
from tactile_perception.nodes.messages.conversions import RESULTS, camera_matrices

from .drawing_node import DrawingNode
from ..parameters.table import MARKERS_PARAMETERS
from ..visualization.pictures import annotate
from ..visualization.annotation import Projection, annotation_of
from ..visualization.markers import MarkerSet

_INPUTS = {'dots': DotTracks, **RESULTS}


class MarkersNode(DrawingNode):
    """Draws the markers of every stamp, pictures at most at the rate that parameter picture_rate sets."""

    marked, pictured, picture_rate = _INPUTS, {**_INPUTS, 'image_raw': Image}, 'picture_rate'

    def __init__(self, host: Host | None = None):
        super().__init__('markers_node', MARKERS_PARAMETERS, host)
        if any(len(self.settings[f'camera.{name}']) != 3 for name in ('rotation', 'translation')):
            raise BadArgument('parameters camera.rotation and camera.translation must have three numbers each')
        self.markers = MarkerSet(self.settings)
        self._camera: Projection | None = None
        self._info: AdaptiveSubscription | None = None
        self._stitching = _stitching_in(self.settings['calibration'])

    def follow_demand(self) -> None:
        """See DrawingNode; with images comes camera_info."""
        super().follow_demand()
        if 'image_raw' in self.inputs and self._info is None:
            self._info = AdaptiveSubscription(self, CameraInfo, 'camera_info', self._on_camera_info, LATCHED_QOS)
        elif 'image_raw' not in self.inputs and self._info is not None:
            self._info.close()
            self._info = None

    def _on_camera_info(self, message: CameraInfo, _received_ns: int) -> None:
        self.try_message('camera_info', message, lambda: self._take_camera(message))

    def _take_camera(self, message: CameraInfo) -> None:
        if self._camera is None or self._camera.key != Projection.key_of(message):
            self._camera = Projection(message, camera_matrices(message), self.settings['camera.rotation'],
                                      self.settings['camera.translation'], self._stitching)

    def picture(self, found: dict) -> np.ndarray:
        """See DrawingNode."""
        return annotate(image_to_array(found['image_raw']), annotation_of(found, self._camera))


def _stitching_in(calibration: str) -> Stitching | None:
    """Stitching of a calibration file; None without one or for a bad file, which the estimating node reports."""
    try:
        return load_stitching(calibration) if calibration else None
    except BadArgument:
        return None


def main(args: list[str] | None = None) -> None:
    """Run the process markers_node."""
    sys.exit(run_node(MarkersNode, args))


if __name__ == '__main__':
    main()
