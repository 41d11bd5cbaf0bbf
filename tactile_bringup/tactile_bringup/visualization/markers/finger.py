# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""RViz markers of a finger: hemisphere, contacts with normals and covariances, trails."""
from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping

import numpy as np
from geometry_msgs.msg import Vector3
from std_msgs.msg import ColorRGBA, Header
from tactile_msgs.msg import Contacts
from visualization_msgs.msg import Marker, MarkerArray

from .. import colours
from .messages import MarkerSet, points_of

_RINGS, _AROUND = 8, 32  # mesh of the hemisphere: steps from pole to rim, and around; chosen


def hemisphere(radius: float) -> np.ndarray:
    """Triangle corners (3 T, 3), m, of the hemisphere z >= 0."""
    theta, phi = np.meshgrid(np.linspace(0, math.pi / 2, _RINGS + 1), np.linspace(0, 2 * math.pi, _AROUND + 1), indexing='ij')
    grid = radius * np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    return np.stack([a, b, c, a, c, d], axis=2).reshape(-1, 3)


class FingerMarkers(MarkerSet):
    """Markers of a finger; sizes: radius, point_size, normal_length (m) and trail (s)."""

    def __init__(self, sizes: Mapping):
        super().__init__({'dot_size': 0.5 * sizes['point_size'], 'normal_length': sizes['normal_length']})
        self._finger = sizes
        self._way: deque[tuple[float, int, np.ndarray]] = deque()  # time (s), contact id, position (m)

    def note(self, message: Contacts) -> None:
        """Add the contacts of one stamp to the trails; a stamp that goes back by more than 1 s clears them."""
        now = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        if self._way and now < self._way[-1][0] - 1.0:
            self._way.clear()
        for contact in message.contacts:
            place = np.array([contact.position.x, contact.position.y, contact.position.z])
            if np.isfinite(place).all():
                self._way.append((now, contact.id, place))
        while self._way and now - self._way[0][0] > self._finger['trail']:
            self._way.popleft()

    def frame(self, header: Header, found: Mapping) -> MarkerArray:
        """Markers for {'contacts': message} under its header."""
        self._header, self._made = header, []
        body = self._add('finger', Marker.TRIANGLE_LIST, (1.0, 1.0, 1.0), ColorRGBA(r=0.7, g=0.75, b=0.8, a=0.35),
                         points_of(hemisphere(self._finger['radius'])))
        body.scale = Vector3(x=1.0, y=1.0, z=1.0)
        self._contacts(found['contacts'])
        size = self._finger['point_size']
        places = [np.array([c.position.x, c.position.y, c.position.z]) for c in found['contacts'].contacts]
        places = [place for place in places if np.isfinite(place).all()]
        if places:
            self._add('points', Marker.SPHERE_LIST, (size, size, size), ColorRGBA(r=1.0, g=0.35, b=0.1, a=1.0), points_of(np.array(places)))
        self._trails()
        return MarkerArray(markers=self._gone() + self._made)

    def _trails(self) -> None:
        """Draw a line strip for each contact seen within the trail time."""
        for number in sorted({contact for _, contact, _ in self._way}):
            places = np.array([place for _, contact, place in self._way if contact == number])
            if len(places) > 1:
                red, green, blue = colours.ARROW
                self._add('trail', Marker.LINE_STRIP, (0.3 * self._finger['point_size'], 0.0, 0.0),
                          ColorRGBA(r=red, g=green, b=blue, a=0.9), points_of(1.002 * places), number)
