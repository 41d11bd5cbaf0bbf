# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Motion of the object between two frames, and its pose since first contact (paper touchpad_contact_region, eq 4)."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ..common.geometry import are_collinear
from .constants import TOUCHPAD

Pose = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class RigidMotion:
    """The motion q = rotation @ p + translation.

    Attributes
    ----------
    rotation : ndarray, shape (3, 3)
        Rotation matrix.
    translation : ndarray, shape (3,)
        Translation in m.
    """

    rotation: np.ndarray
    translation: np.ndarray


def fit_rigid(p: np.ndarray, q: np.ndarray) -> RigidMotion | None:
    """Rigid motion from points p (N, 3) to q (N, 3), m, by least squares (Kabsch 1976).

    None if the points do not determine it: fewer than three, or collinear.
    """
    if len(p) < 3 or any(are_collinear(points) for points in (p, q)):
        return None
    u, _, v = np.linalg.svd((p - p.mean(axis=0)).T @ (q - q.mean(axis=0)))
    rotation = (u * [1, 1, np.sign(np.linalg.det(u @ v))] @ v).T
    return RigidMotion(rotation, q.mean(axis=0) - rotation @ p.mean(axis=0))


class StickingReference:
    """Refers the motions of an object to the dots that have stuck to it since a common start, so that their errors do not add up.

    The motion from frame to frame is precise, but its tilt has a bias of some 0.01 degrees a frame. A rigid fit to the positions of the
    same dots at the start has none, and more noise. A fixed part of their difference corrects each motion: the gain of a Kalman filter in
    its steady state. The start is the last frame before one in which enough dots stick; a new one begins when too few are left.
    """

    def __init__(self):
        self.reset()

    def reset(self) -> None:
        """Drop all earlier frames."""
        self._before: tuple[np.ndarray, np.ndarray] | None = None
        self._start, self._common = np.zeros((0, 3)), np.zeros(0, bool)
        self._pose: Pose = np.eye(3), np.zeros(3)  # since the start

    def corrected(self, xyz: np.ndarray, sticks: np.ndarray, motion: RigidMotion) -> RigidMotion:
        """Correct the motion of the object since the last frame.

        xyz: (K, 3) m, positions of all dots, NaN of unseen ones; sticks: (K,) bool, those that stick to the object.
        """
        before, self._before = self._before, (xyz, sticks)
        sticks = sticks & np.isfinite(xyz[:, 0])
        if len(self._common) != len(sticks) or np.count_nonzero(self._common & sticks) < TOUCHPAD.min_sticking:
            if before is None:
                return motion
            self._start, self._common, self._pose = before[0], before[1] & np.isfinite(before[0][:, 0]), (np.eye(3), np.zeros(3))
        self._common = self._common & sticks
        rotation, translation = motion.rotation @ self._pose[0], motion.rotation @ self._pose[1] + motion.translation
        if np.count_nonzero(self._common) >= TOUCHPAD.min_sticking:
            start, now = self._start[self._common], xyz[self._common]
            fitted, middle = fit_rigid(start, now), start.mean(axis=0)
            if fitted is not None:
                turn = cv2.Rodrigues(TOUCHPAD.gain * cv2.Rodrigues(fitted.rotation @ rotation.T)[0])[0]
                moved = rotation @ middle + translation
                rotation = turn @ rotation
                translation = moved + TOUCHPAD.gain * (now.mean(axis=0) - moved) - rotation @ middle
        last, self._pose = self._pose, (rotation, translation)
        step = rotation @ last[0].T
        return RigidMotion(step, translation - step @ last[1])


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
