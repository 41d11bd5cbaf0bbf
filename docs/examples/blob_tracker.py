# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""dot_tracker_node with one more method to find dots."""
import cv2
import numpy as np

from tactile_perception.common.dots import Dots
from tactile_perception.core.errors import BadFrame
from tactile_perception.dots.detect import METHODS


class SimpleBlobs:
    """Dots by cv2.SimpleBlobDetector. sign: 1 for bright dots, -1 for dark."""

    def __init__(self, sign):
        wanted = cv2.SimpleBlobDetector_Params()
        wanted.minArea, wanted.maxArea, wanted.minDistBetweenBlobs = 10, 400, 5
        wanted.blobColor = 255 if sign > 0 else 0
        self._detector = cv2.SimpleBlobDetector_create(wanted)

    def detect(self, image):
        """Dots of a grey image (H, W) uint8. Raises BadFrame if there is none."""
        found = self._detector.detect(image)
        if not found:
            raise BadFrame('no blob in the image: check light, focus and the parameter polarity')
        size = np.array([point.size for point in found])
        return Dots(np.array([point.pt for point in found], float), np.pi / 4 * size**2, np.full(len(found), np.nan))


METHODS['simple_blobs'] = SimpleBlobs

from tactile_perception.core.node import main  # noqa: E402  after the table: parameters list its names

if __name__ == '__main__':
    main(node='dot_tracker_node')
