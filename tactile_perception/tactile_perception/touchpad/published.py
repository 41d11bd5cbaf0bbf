# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact states of dots by the motion of a rigid object (paper touchpad_contact_region, sections 3.2 and 3.3)."""
from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from ..common.surface import grid_normals, to_grid
from .pose import RigidMotion, fit_rigid

NON_CONTACT, STICKING, SLIPPING = 0, 1, 2
_HORIZON_S = 4.0  # s, in which t_p is searched
_AROUND = 9  # dots around the reference dot that are assumed to stick (section 3.2: "at least a set of nine dots")


@dataclass(frozen=True)
class PaperStates:
    """state: (N,) uint8 of NON_CONTACT, STICKING, SLIPPING; reference_id: number of the contact reference dot, -1 without one;
    motion: the object's from t_p to t_c, None when unknown; interval: t_c - t_p, s, NaN when unknown."""

    state: np.ndarray
    reference_id: int
    motion: RigidMotion | None
    interval: float


def smooth_shape(moved: np.ndarray) -> np.ndarray:
    """Medians (rows, columns, 3) of how dots and those around them moved, (rows, columns, 3) m, NaN for unseen ones.

    The paper takes places from a smooth shape of the touchpad. Here each dot has a range of its own: a single wrong one would be the
    reference dot, and determine t_p.
    """
    rows, columns, _ = moved.shape
    around = np.pad(np.nan_to_num(moved), ((1, 1), (1, 1), (0, 0)), mode='edge')
    return np.median([around[r:r + rows, c:c + columns] for r in range(3) for c in range(3)], axis=0)


class PaperRegion:
    """States of dots on a rows x columns grid, frame by frame.

    d_max: m, largest displacement that makes an interval long enough (D_max, eq 10); delta_d: m, threshold of the tests (eqs 12, 14):
    the paper's 12.0 and 2.5 px in m. While no frame of the last seconds is d_max away, the states stay; once no dot is d_max from its
    untouched position, none is in contact.
    """

    def __init__(self, rows: int, columns: int, d_max: float = 0.91e-3, delta_d: float = 0.19e-3):
        self.rows, self.columns, self.d_max, self.delta_d = rows, columns, d_max, delta_d
        self._past: deque[tuple[float, np.ndarray]] = deque()
        self._state = np.zeros(rows * columns, np.uint8)

    def process(self, ids: np.ndarray, xyz: np.ndarray, rest_xyz: np.ndarray, stamp_s: float) -> PaperStates:
        """States of the dots ids (N,) at xyz (N, 3), untouched at rest_xyz (N, 3), sensor frame, m, at stamp_s.

        Dots with NaN in xyz count as unseen.
        """
        now, rest = (to_grid(ids, places, self.rows, self.columns).reshape(-1, 3) for places in (xyz, rest_xyz))
        found = self._judge(ids, now, np.linalg.norm(now - rest, axis=1), stamp_s)
        self._past.append((stamp_s, now))
        while self._past[0][0] < stamp_s - _HORIZON_S:
            self._past.popleft()
        return found

    def _judge(self, ids, now, moved, stamp_s) -> PaperStates:
        if not np.isfinite(moved).any() or np.nanmax(moved) < self.d_max:
            self._state[:] = NON_CONTACT
            return PaperStates(self._state[ids], -1, None, np.nan)
        before, since = self._previous(now)
        if before is None:
            return PaperStates(self._state[ids], self._reference(moved), None, np.nan)
        both = np.isfinite(before[:, 0]) & np.isfinite(now[:, 0])
        reference = self._reference(np.where(both, moved, np.nan))
        motion = self._object_motion(reference, before, now, both)
        if motion is None:
            return PaperStates(self._state[ids], reference, None, np.nan)
        self._decide(reference, motion, before, now, both)
        return PaperStates(self._state[ids], reference, motion, stamp_s - since)

    def _previous(self, now: np.ndarray) -> tuple[np.ndarray | None, float]:
        """Positions at t_p, and t_p: the newest frame from which some dot has moved by more than d_max (eq 10)."""
        for stamp, places in reversed(self._past):
            step = now - places
            if (np.einsum('ki,ki->k', step, step) > self.d_max**2).any():
                return places, stamp
        return None, np.nan

    @staticmethod
    def _reference(moved: np.ndarray) -> int:
        """Number of the dot farthest from its untouched position (eq 2); -1 if no dot can be compared."""
        return int(np.nanargmax(moved)) if np.isfinite(moved).any() else -1

    def _object_motion(self, reference: int, before, now, both) -> RigidMotion | None:
        """The object's motion from the seen dots nearest to the reference dot on the grid, assumed to stick (eq 3)."""
        seen = np.flatnonzero(both)
        row, column = np.divmod(seen, self.columns)
        distance = (row - reference // self.columns)**2 + (column - reference % self.columns)**2
        around = seen[np.argsort(distance, kind='stable')[:_AROUND]]
        return fit_rigid(before[around], now[around])

    def _decide(self, reference: int, motion: RigidMotion, before, now, both) -> None:
        """Eq 12 for dots that were free, eqs 12 and 14 for dots that were in contact."""
        displacement = now - before
        # Right side of eq 7; R(-w) is the transpose of the object's rotation.
        predicted = displacement + (now[reference] - now) @ (np.eye(3) - motion.rotation.T).T
        difference = displacement[reference] - predicted
        normals = grid_normals(now.reshape(self.rows, self.columns, 3)).reshape(-1, 3)
        limit = self.delta_d * np.sqrt(np.nanmax(np.sum(displacement**2, axis=1))) / self.d_max
        sticks = np.linalg.norm(difference, axis=1) < limit
        touches = np.abs(np.sum(difference * normals, axis=1)) < limit
        contact = np.where(self._state == NON_CONTACT, sticks, touches | sticks)
        state = np.where(contact, np.where(sticks, STICKING, SLIPPING), NON_CONTACT)
        self._state = np.where(both, state, self._state).astype(np.uint8)
