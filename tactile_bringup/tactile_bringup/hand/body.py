# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""RViz markers of what carries a hand's sensors: a rod from behind the parent's frame to behind each sensor, and one up to it."""
from __future__ import annotations

import numpy as np
from geometry_msgs.msg import Point, Quaternion, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from .description import Hand

_BEHIND, _THICK = 0.04, 0.012  # m, chosen: below a palm of sheets, thinner than a finger
_GREY = ColorRGBA(r=0.45, g=0.46, b=0.5, a=1.0)


def body_markers(hand: Hand) -> MarkerArray:
    """Rods in the parent frame of each sensor, of stamp 0, for which RViz takes the newest transforms."""
    made = []
    for sensor in hand.sensors:
        place = np.array(sensor.xyz)
        corner = place - _BEHIND * _outwards(np.array(sensor.quaternion))
        for start, end in ((np.array([0.0, 0.0, -_BEHIND]), corner), (corner, place)):
            if np.linalg.norm(end - start) > _THICK:
                made.append(_rod(start, end))
                made[-1].header.frame_id, made[-1].id = sensor.parent, len(made)
    return MarkerArray(markers=made)


def _outwards(quaternion: np.ndarray) -> np.ndarray:
    """The z axis (3,) of a frame that a quaternion x, y, z, w turns. scipy.spatial would take a second of each start."""
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    return np.array([2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)])


def _rod(start: np.ndarray, end: np.ndarray) -> Marker:
    """A cylinder between two places (3,), m."""
    length, middle = float(np.linalg.norm(end - start)), 0.5 * (start + end)
    rod = Marker(ns='body', type=Marker.CYLINDER, scale=Vector3(x=_THICK, y=_THICK, z=length), color=_GREY)
    x, y, z = (end - start) / length
    turn = np.array([-y, x, 0.0, 1 + z]) if z > -1 + 1e-9 else np.array([1.0, 0.0, 0.0, 0.0])  # from the z axis by the shortest way
    turn /= np.linalg.norm(turn)
    rod.pose.position = Point(x=middle[0], y=middle[1], z=middle[2])
    rod.pose.orientation = Quaternion(x=turn[0], y=turn[1], z=turn[2], w=turn[3])
    return rod
