# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Motion of the object between two frames, and its pose since it touched (paper touchpad_contact_region, eq 4)."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..common.geometry import lie_on_a_line

_SAME_S = 1e-6  # s, up to which two stamps are one
_KEPT_S = 4.5   # s, that poses are kept: motions reach back over 4 s at most (published/touchpad_contact_region.py:MAX_INTERVAL_S)
_NARROW = 1e-3  # least width over length of points; below, the turn about their line is open. Chosen

Pose = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class RigidMotion:
    """q = rotation @ p + translation. rotation: (3, 3); translation: (3,) m."""

    rotation: np.ndarray
    translation: np.ndarray


def fit_rigid(p: np.ndarray, q: np.ndarray) -> RigidMotion | None:
    """Least squares over p (N, 3) and q (N, 3), m, finite (Kabsch 1976); None where fewer than three points, or points on a line, leave it
    open."""
    if len(p) < 3 or any(lie_on_a_line(points, thinnest=_NARROW) for points in (p, q)):
        return None
    u, _, v = np.linalg.svd((p - p.mean(axis=0)).T @ (q - q.mean(axis=0)))
    rotation = (u * [1, 1, np.sign(np.linalg.det(u @ v))] @ v).T
    return RigidMotion(rotation, q.mean(axis=0) - rotation @ p.mean(axis=0))


class ObjectPose:
    """Accumulates motions from an earlier frame to now. The pose is that of the first frame of a touch, and before it, until a motion from
    there is known; where the motion, or the pose that it starts from, is unknown, so is the pose."""

    def __init__(self):
        self._known: list[tuple[float, Pose]] = []

    def process(self, touches: bool, motion: RigidMotion | None, interval: float, stamp_s: float) -> Pose | None:
        """Rotation (3, 3) and translation (3,) m that bring a point of the object from where it was at first touch to where it is at
        stamp_s; None where unknown. motion: over the last interval, s, None where unknown."""
        if not touches:
            self._known = []
            return None
        pose = self._moved(motion, stamp_s - interval) if self._known else (np.eye(3), np.zeros(3))
        if pose is not None:
            self._known = [one for one in self._known if one[0] > stamp_s - _KEPT_S] + [(stamp_s, pose)]
        return pose

    def _moved(self, motion: RigidMotion | None, since: float) -> Pose | None:
        if motion is None:
            return None
        first, pose = self._known[0]
        if since > first + _SAME_S:
            pose = next((pose for stamp, pose in self._known if abs(stamp - since) < _SAME_S), None)
        return pose and (motion.rotation @ pose[0], motion.rotation @ pose[1] + motion.translation)
