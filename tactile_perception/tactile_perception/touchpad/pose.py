# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The object's pose since it touched (paper touchpad_contact_region, eq 4): its motions, one after the other."""
from __future__ import annotations

import numpy as np

from ..common.rigid_motion import RigidMotion

_SAME_S = 1e-6  # s, up to which two stamps are one
_KEPT_S = 4.5   # s, that poses are kept: motions reach back over 4 s at most (published.py: _HORIZON_S)

Pose = tuple[np.ndarray, np.ndarray]


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
