# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where a frame of /tf was in another one, at the time of an image; tf2_ros needs a C++ extension that not every installation has."""
from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

_KEPT_S = 5.0  # chosen: images are waited for no longer


class UnknownFrame(LookupError):
    """No chain of transforms joins two frames; the message lists the known ones."""


class Frames:
    """Transforms as they come, in a tree: child -> parent with the latest seconds of poses, or one that stays."""

    def __init__(self):
        self._parents: dict[str, str] = {}
        self._poses: dict[str, deque[tuple[float, np.ndarray, Rotation]]] = {}
        self._static: set[str] = set()

    def add(self, parent: str, child: str, stamp_s: float, translation: Sequence[float], quaternion: Sequence[float],
            static: bool = False) -> None:
        """A transform: pose of child in parent; quaternion: x, y, z, w. One without numbers is left out."""
        if not (np.isfinite([*translation, *quaternion]).all() and np.linalg.norm(quaternion) > 0):
            return
        if self._parents.get(child, parent) != parent:
            self._poses.pop(child, None)
        self._parents[child] = parent
        poses = self._poses.setdefault(child, deque())
        if static:
            poses.clear()
            self._static.add(child)
        elif poses and stamp_s <= poses[-1][0]:
            return
        poses.append((stamp_s, np.asarray(translation, float), Rotation.from_quat(quaternion)))
        while stamp_s - poses[0][0] > _KEPT_S:
            poses.popleft()

    def pose(self, frame: str, target: str, stamp_s: float) -> tuple[np.ndarray, Rotation] | None:
        """(position (3,) m, rotation) of frame in target at a time; None where the poses do not reach there, yet or any more.

        Raises UnknownFrame.
        """
        ours, theirs = self._chain(frame), self._chain(target)
        if ours[-1] != theirs[-1]:
            known = ', '.join(sorted({*self._parents, *self._parents.values()})) or 'none at all'
            raise UnknownFrame(f'/tf does not join {frame!r} and {target!r}; its frames are: {known}')
        up, down = self._to_root(ours, stamp_s), self._to_root(theirs, stamp_s)
        if up is None or down is None:
            return None
        back = down[1].inv()
        return back.apply(up[0] - down[0]), back * up[1]

    def _chain(self, frame: str) -> list[str]:
        chain = [frame]
        while chain[-1] in self._parents and len(chain) <= len(self._parents):
            chain.append(self._parents[chain[-1]])
        return chain

    def _to_root(self, chain: list[str], stamp_s: float) -> tuple[np.ndarray, Rotation] | None:
        position, rotation = np.zeros(3), Rotation.identity()
        for frame in chain[:-1]:
            found = self._at(frame, stamp_s)
            if found is None:
                return None
            position, rotation = found[1].apply(position) + found[0], found[1] * rotation
        return position, rotation

    def _at(self, frame: str, stamp_s: float) -> tuple[np.ndarray, Rotation] | None:
        poses = self._poses[frame]
        if frame in self._static:
            return poses[0][1:]
        after = next((k for k, pose in enumerate(poses) if pose[0] >= stamp_s), None)
        if after is None or (after == 0 and poses[0][0] > stamp_s):
            return None
        if poses[after][0] == stamp_s:
            return poses[after][1:]
        (t0, p0, r0), (t1, p1, r1) = poses[after - 1], poses[after]
        share = (stamp_s - t0) / (t1 - t0)
        return p0 + share * (p1 - p0), Slerp([0, 1], Rotation.concatenate([r0, r1]))(share)
