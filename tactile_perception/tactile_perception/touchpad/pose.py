# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Motion of the object between two frames, and its pose since first contact (paper touchpad_contact_region, eq 4)."""
from __future__ import annotations

import numpy as np

from .._core.touchpad import RigidMotion, StickingReference, fit_rigid

__all__ = 'ObjectPose', 'RigidMotion', 'StickingReference', 'fit_rigid'

Pose = tuple[np.ndarray, np.ndarray]


class ObjectPose:
    """Accumulates the motions of an object into its pose relative to first contact.

    The pose is the identity until a motion is known: while a contact forms, too few dots touch, and the pose counts from the last frame
    before the first known motion. After that it is unknown while the motion, or the pose at the start of the motion, is unknown.
    """

    def __init__(self):
        self._history: list[tuple[float, Pose]] = []

    def process(self, touches: bool, motion: RigidMotion | None, interval: float, stamp_s: float) -> Pose | None:
        """Pose of the object at stamp_s, s, relative to first contact: rotation (3, 3) and translation (3,) m; None if unknown.

        touches: whether the object is in contact; motion: over the last interval, s, None if unknown.
        """
        if not touches:
            self._history = []
            return None
        if motion is None and len(self._history) == 1:
            self._history = []
        pose = self._moved(motion, stamp_s - interval) if self._history else (np.eye(3), np.zeros(3))
        if pose is not None:
            # s; motions reach back over 4 s at most (published/constants.py:TouchpadConstants)
            self._history = [one for one in self._history if one[0] > stamp_s - 4.5] + [(stamp_s, pose)]
        return pose

    def _moved(self, motion: RigidMotion | None, since: float) -> Pose | None:
        if motion is None:
            return None
        first, pose = self._history[0]
        if since > first + 1e-6:  # s; stamps that differ by less are equal
            pose = next((pose for stamp, pose in self._history if abs(stamp - since) < 1e-6), None)
        return pose and (motion.rotation @ pose[0], motion.rotation @ pose[1] + motion.translation)
