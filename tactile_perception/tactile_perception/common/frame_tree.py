# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Relative poses of frames from the newest transforms on /tf and /tf_static."""
from __future__ import annotations

import numpy as np

from .rotations import matrix_of_quaternion
from ..errors import BadFrame

Pose = tuple[np.ndarray, np.ndarray]
_SHORTEST = 1e-6  # norm of a quaternion: chosen; publishers normalise, and a shorter one is a message that was not filled
_FARTHEST = 1e9  # m, of a translation: chosen, beyond any robot; chains of transforms stay finite


class FrameTree:
    """Pose of each frame in its parent. changes: number of transforms taken.

    The newest transform counts as current; none is interpolated.
    """

    def __init__(self):
        self._links: dict[str, tuple[str, np.ndarray, np.ndarray]] = {}
        self.changes = 0

    def take(self, parent: str, child: str, quaternion: np.ndarray, translation: np.ndarray) -> None:
        """child lies in parent with quaternion (4,) x, y, z, w and translation (3,) m. Raises BadFrame for a quaternion whose norm is
        near 0 or overflows, a translation beyond 1e9 m, numbers that are not finite, and a child that is its own parent."""
        quaternion, translation = np.asarray(quaternion, float), np.asarray(translation, float)
        with np.errstate(over='ignore'):  # refused just below
            length = float(np.linalg.norm(quaternion))
        if not (_SHORTEST < length < np.inf and (np.abs(translation) <= _FARTHEST).all() and parent != child):
            raise BadFrame(f'transform from {parent!r} to {child!r} is none: rotation {quaternion.tolist()}, translation '
                           f'{translation.tolist()}; it is skipped')
        self._links[child] = parent, matrix_of_quaternion(quaternion / length), translation
        self.changes += 1

    def pose(self, frame: str, reference: str) -> Pose | None:
        """(rotation (3, 3), translation (3,) m) that take a point of frame to reference; None where they do not hang together."""
        here, there = self._above(frame), self._above(reference)
        common = next((name for name in here if name in there), None)
        if common is None:
            return None
        (rotation, translation), (back, offset) = here[common], there[common]
        return back.T @ rotation, back.T @ (translation - offset)

    def _above(self, frame: str) -> dict[str, Pose]:
        """The frame's pose in itself and in each frame above it, nearest first."""
        poses, pose = {}, (np.eye(3), np.zeros(3))
        while frame not in poses:
            poses[frame] = pose
            if frame in self._links:
                frame, rotation, translation = self._links[frame]
                pose = rotation @ pose[0], rotation @ pose[1] + translation
        return poses
