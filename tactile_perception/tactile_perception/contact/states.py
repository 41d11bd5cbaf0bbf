# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Each dot's state - none, sticking, slipping - from the loads on the dots and their motion, with the friction unknown.

While some dots stick, they carry the object's motion: a dot that lags behind it slips. In gross slip no dot tells the motion: all stand still, or nearly,
under the greatest friction there is. So the motion is followed from frame to frame and kept when the dots leave it all together in the direction in
which they are dragged, at the friction ratio that slipping dots have shown; it is found anew when they move otherwise or the ratio falls.
"""
from __future__ import annotations

import numpy as np
from scipy import ndimage

from ..surface.membrane import MembraneState
from .carried_motion import DotMotions, moved_to

NON_CONTACT, STICKING, SLIPPING = 0, 1, 2
_FEWEST = 5


class DotStates:
    """Follows the dots of a rows x columns grid seen from origin (3,) m, the camera's centre.

    tolerance: m a dot may lag behind the object in a frame and still stick; noise: standard deviation of a dot's motion across its ray, m.
    """

    def __init__(self, rows: int, columns: int, origin: np.ndarray, tolerance: float = 10e-6, noise: float = 2e-6):
        self.shape, self.origin = (rows, columns), np.asarray(origin, float)
        self.tolerance, self.noise = tolerance, noise
        self.reset()

    def reset(self):
        """Forget what came before."""
        self._last, self._last_touched = None, None
        self._twist, self._centre = None, np.zeros(3)
        self.friction = np.nan
        self._slipping_share = 0.0
        self._gross = False

    def update(self, state: MembraneState, score: np.ndarray) -> np.ndarray:
        """States (K,) uint8 in this frame; score (K,): above 0.5 in contact."""
        touched = score > .5
        states = np.where(touched, STICKING, NON_CONTACT).astype(np.uint8)
        if self._last is None or touched.sum() < _FEWEST:
            self._forget_motion(state, touched)
            return states
        both = np.flatnonzero(touched & self._last_touched & state.seen & self._last.seen)
        if len(both) >= _FEWEST:
            slips = self._judge(state, touched, both)
            states[both[slips]] = SLIPPING
            new = touched & ~self._last_touched
            states[new] = SLIPPING if self._gross else STICKING
        self._last, self._last_touched = state, touched
        return states

    def _forget_motion(self, state, touched):
        self._last, self._last_touched = state, touched
        self._twist, self._gross, self._slipping_share = None, False, 0.0

    def _judge(self, state, touched, both):
        ratio, drag = self._friction(state, touched)
        ratio, drag = ratio[both], drag[both]
        motions = DotMotions(self._last.xyz[both], state.xyz[both], self.origin, self.noise, 20e-6)
        bound = 1.3 * self.tolerance
        held = None if self._twist is None else moved_to(self._twist, self._centre, motions.centre)
        twist, self._gross = self._motion(motions, held, ratio, drag)
        left = np.linalg.norm(motions.off(twist), axis=1)
        slips = left > bound
        self._twist, self._centre = twist, motions.centre
        self._slipping_share = slips.mean()
        self._learn(ratio, slips)
        return slips

    def _motion(self, motions, held, ratio, drag):
        """The object's twist, and whether no dot carries it any more."""
        fine = self.tolerance
        grip = np.clip((self.friction - ratio) / (.4 * self.friction), .05, 1)**2 if self.friction > 0 else np.ones(len(ratio))
        if held is not None:
            near = motions.follow(held, drag, 4 * fine, fine, 2.0, grip)
            agree = (np.linalg.norm(motions.off(near), axis=1) < 1.3 * fine).sum()
            if agree >= max(_FEWEST - 1, .1 * len(ratio)) and not self._gross:
                return near, False
            if self._left_behind(motions, held, ratio, drag):
                return held, True
        return motions.follow(None, drag, 30 * fine, fine, 0.0, grip), False

    def _left_behind(self, motions, held, ratio, drag):
        """Whether the dots have all left the held motion as gross slip leaves it."""
        lag = -motions.off(held)
        size = np.linalg.norm(lag, axis=1)
        along = (lag * drag).sum(1) / np.maximum(size * np.linalg.norm(drag, axis=1), 1e-12)
        dragged = np.average(along, weights=size + 1e-12) > .5
        depth = abs(np.median(motions.off_along(held))) < max(3 * self.tolerance, .3 * np.median(size))
        loaded = np.median(ratio) > .8 * self.friction
        return bool(dragged and depth and loaded and (self._gross or self._slipping_share > .3))

    def _learn(self, ratio, slips):
        """Friction that slipping dots show, a slow mean over frames."""
        if slips.sum() >= _FEWEST:
            seen = float(np.median(ratio[slips]))
            self.friction = seen if not self.friction > 0 else self.friction + .2 * (seen - self.friction)

    def _friction(self, state, touched):
        """Ratio (K,) of tangential to normal load and tangential load (K, 3), summed over each dot and its eight neighbours in contact."""
        normal = -(state.force * state.normal).sum(1)
        tangential = state.force + normal[:, None] * state.normal
        loads = np.column_stack([normal, tangential]) * touched[:, None]
        near = ndimage.uniform_filter(loads.reshape(*self.shape, 4), (3, 3, 1), mode='constant').reshape(-1, 4) * 9
        return np.linalg.norm(near[:, 1:], axis=1) / np.maximum(near[:, 0], 1e-9), near[:, 1:]
