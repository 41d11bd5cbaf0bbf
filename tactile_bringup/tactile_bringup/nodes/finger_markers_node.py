# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""finger_markers_node: RViz markers and image_annotated of a PSD finger, and the frame at its tip on /tf_static."""
from __future__ import annotations

import math
import sys
from collections.abc import Mapping

import cv2
import numpy as np
from std_msgs.msg import ColorRGBA, Header
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.run import run_node
from tactile_msgs.msg import Contacts
from visualization_msgs.msg import Marker, MarkerArray

from ..parameters.table import FINGER_MARKERS_PARAMETERS
from ..visualization import pictures as colours
from ..visualization.markers import MarkerSet, points_of, touch_words
from ..visualization.pictures import Annotation, annotate
from .drawing_node import DrawingNode

_GLASS = np.array([0.80, 0.86, 0.92])  # colour of the hemisphere, chosen


def finger_picture(message: Contacts) -> np.ndarray:
    """The hemisphere seen along -z, x right, y down, with its contacts and their depth and force in words; (H, W, 3) uint8 BGR."""
    middle, radius = 180, 160
    picture = np.full((2 * middle, 2 * middle, 3), 32, np.uint8)
    for degrees in (30, 60, 90):
        ring, colour = round(radius * math.sin(math.radians(degrees))), colours.bgr(0.4 * _GLASS if degrees < 90 else _GLASS)
        cv2.circle(picture, (middle, middle), ring, colour, 1, cv2.LINE_AA)
    places = np.array([(contact.normal.x, contact.normal.y) for contact in message.contacts], float).reshape(-1, 2)
    words = ', '.join(touch_words({'contacts': message})) or ('touched' if message.contacts else 'nothing touches')
    return annotate(picture, Annotation(contacts=middle + radius * places, text=[words], legend=[('contact', colours.CONTACT)]))


class FingerMarkers(MarkerSet):
    """Markers of a finger; sizes: radius, point_size and normal_length (m)."""

    def __init__(self, sizes: Mapping):
        super().__init__({'dot_size': 0.5 * sizes['point_size'], 'normal_length': sizes['normal_length']})
        self._finger = sizes

    def frame(self, header: Header, found: Mapping) -> MarkerArray:
        """Markers for {'contacts': message} under its header."""
        self._header, self._made = header, []
        wide, size = 2 * self._finger['radius'], self._finger['point_size']
        red, green, blue = _GLASS.tolist()
        self._add('finger', Marker.SPHERE, (wide, wide, wide), ColorRGBA(r=red, g=green, b=blue, a=0.4), [])
        self._contacts(found['contacts'])
        places = [np.array([c.position.x, c.position.y, c.position.z]) for c in found['contacts'].contacts]
        places = [place for place in places if np.isfinite(place).all()]
        if places:
            self._add('points', Marker.SPHERE_LIST, (size, size, size), ColorRGBA(r=1.0, g=0.35, b=0.1, a=1.0), points_of(np.array(places)))
        return self._array(found, np.full(2, self._finger['radius']))


class FingerMarkersNode(DrawingNode):
    """Draws the contacts."""

    marked = pictured = {'contacts': Contacts}
    marker_rate = picture_rate = 'rate'

    def __init__(self, host: Host | None = None):
        super().__init__('finger_markers_node', FINGER_MARKERS_PARAMETERS, host)
        self.markers = FingerMarkers(self.settings)
        self.publish_place('tip', (0.0, 0.0, self.settings['radius']))

    def picture(self, found: Mapping) -> np.ndarray:
        """See DrawingNode."""
        return finger_picture(found['contacts'])


def main(args: list[str] | None = None) -> None:
    """Run the process finger_markers_node."""
    sys.exit(run_node(FingerMarkersNode, args))


if __name__ == '__main__':
    main()
