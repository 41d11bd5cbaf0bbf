# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""State of each dot (free, sticking, slipping) from loads and motions, without a known friction coefficient.

Sticking dots move with the object; a dot that lags behind it slips. In gross slip no dot moves with the object: all are nearly at rest
under the largest friction. So the object's motion is propagated from frame to frame, and kept when all dots lag behind it in the direction
of their drag at the friction ratio of earlier slip; it is estimated again once they move otherwise or the ratio falls.
"""
from __future__ import annotations

import cv2
import numpy as np

from ...common.statistics import median, robust_sigma
from .loads import DotLoads
from .twist_fit import DotMotions, across_rays, lengths, twist_about

NON_CONTACT, STICKING, SLIPPING = 0, 1, 2
_FEWEST = 5  # dots that determine a motion; chosen: two more than three
_SMOOTHING = 0.2  # weight of a new value in the running means of noise and friction; chosen
# Frames for which dots may be at rest while the object moves on: in gross slip (as of a disc that turns about its axis), and after a
# frame in which many dots slipped; chosen.
_REST_AFTER_GROSS, _REST_AFTER_SLIP = 15, 3
_LEAST_FRICTION = 0.05  # friction coefficient; smaller estimates are not used; chosen
_MANY = 0.3  # share of slipping dots from which gross slip may follow; chosen
_CALMEST = 5  # the quantile 1/5 of the motions is used as noise, of which it is 0.668 standard deviations (2D Gaussian: sqrt(-2 ln 0.8))


class StickSlipTracker:
    """Classifies the dots of a rows x columns grid frame by frame; origin: (3,) m, camera centre.

    tolerance: m, lag of a sticking dot behind the object in a frame; noise: m, standard deviation of a dot's motion across its ray, an
    initial value: it is measured while nothing touches.
    """

    def __init__(self, rows: int, columns: int, origin: np.ndarray, tolerance: float = 10e-6, noise: float = 2e-6):
        self.shape, self.origin = (rows, columns), np.asarray(origin, float)
        self.tolerance, self.noise = tolerance, noise
        self.depth_noise = 2 * tolerance
        self.reset()

    def reset(self):
        """Forget all frames."""
        self._last, self._last_touched = None, None
        self._twist, self._centre = None, np.zeros(3)
        self.friction = np.nan
        self._slipping_share, self._gross, self._still_frames = 0.0, False, 0

    def update(self, state: DotLoads, score: np.ndarray) -> np.ndarray:
        """States (K,) uint8 in this frame; score (K,): above 0.5 in contact."""
        touched = score > .5
        states = np.where(touched, STICKING, NON_CONTACT).astype(np.uint8)
        if not touched.any():
            self.observe_free(state.xyz, state.seen)
            return states
        if self._last is None or np.count_nonzero(touched) < _FEWEST:
            self._last, self._last_touched = (state.xyz, state.seen), touched
            self._twist, self._gross, self._slipping_share = None, False, 0.0
            return states
        both = np.flatnonzero(touched & self._last_touched & state.seen & self._last[1])
        if len(both) >= _FEWEST:
            slips = self._classify(state, touched, both)
            states[both[slips]] = SLIPPING
            states[touched & ~self._last_touched] = SLIPPING if self._gross else STICKING
        self._last, self._last_touched = (state.xyz, state.seen), touched
        return states

    def observe_free(self, xyz: np.ndarray, seen: np.ndarray) -> None:
        """A frame without contact: dots at xyz (K, 3) m; seen: (K,) bool. Forgets the motion and updates the noise from the motions."""
        if self._last is not None and not self._last_touched.any():
            moved = lengths(across_rays(self._last[0], xyz, self.origin)[0])[seen & self._last[1]]
            # a low quantile: a touch below the detection limit moves many dots
            here = np.partition(moved, len(moved) // _CALMEST)[len(moved) // _CALMEST] / 0.668 if len(moved) else np.nan
            if here > 0:
                self.noise += (_SMOOTHING if here < self.noise else _SMOOTHING / 4) * (here - self.noise)
        self._last, self._last_touched = (xyz, seen), np.zeros(len(seen), bool)
        self._twist, self._gross, self._slipping_share = None, False, 0.0

    def _classify(self, state, touched, both):
        """(N,) bool: which of the dots both (N,), in contact and seen now and in the last frame, slip."""
        motions = DotMotions(self._last[0][both], state.xyz[both], state.normal[both], self.origin, self.noise, self.depth_noise)
        predicted = None if self._twist is None else twist_about(self._twist, self._centre, motions.centre)
        if predicted is not None and not self._in_touch(motions, predicted):
            predicted = motions.constrained_to_normals(predicted)
        ratio, drag = self._friction(state, touched, both, motions, predicted)
        twist, self._gross = self._motion(motions, predicted, ratio, drag)
        slips = lengths(motions.residuals(twist)) > np.hypot(1.3 * self.tolerance, 3 * self.noise)
        self._twist, self._centre = twist, motions.centre
        self._slipping_share = slips.mean()
        self._learn(motions, twist, ratio, slips)
        return slips

    def _motion(self, motions, predicted, ratio, drag):
        """The object's twist (6,), and whether it slips grossly."""
        fine = self.tolerance
        grip = np.clip((self.friction - ratio) / (.4 * self.friction), .05, 1)**2 if self.friction > 0 else np.ones(len(ratio))
        self._still_frames = self._still_frames + 1 if self._still(motions) else 0
        if self._still_frames >= self._rest_frames():
            return np.zeros(6), False
        if predicted is not None:
            near = motions.fit_robust(predicted, drag, 4 * fine, fine, max(3.0, .1 * len(ratio)), grip)
            agree = np.count_nonzero(lengths(motions.residuals(near)) < 1.3 * fine)
            if agree >= max(_FEWEST - 1, .1 * len(ratio)) and not self._gross and self._in_touch(motions, near):
                return near, False
            if self._slides_on(motions, predicted, ratio, drag):
                return predicted, True
        return motions.fit_robust(None, drag, 30 * fine, fine, 0.0, grip), False

    def _rest_frames(self):
        """Frames for which dots must be at rest before the object counts as at rest."""
        if self._gross:
            return _REST_AFTER_GROSS
        return _REST_AFTER_SLIP if self._slipping_share > _MANY else 1

    def _still(self, motions):
        """Whether the dots' mean square motion is within three standard deviations of noise."""
        across = motions.moved_across
        excess = np.vdot(across, across) / (2 * len(across)) / self.noise**2 - 1
        return excess < 3 / np.sqrt(len(across)) and self._in_touch(motions, np.zeros(6))

    def _in_touch(self, motions, twist):
        """Whether the dots follow the object along the normal, as all dots in contact must."""
        off = motions.normal_residuals(twist)
        return abs(median(off)) < 2 * self.depth_noise and median(np.abs(off)) < 3 * self.depth_noise

    def _slides_on(self, motions, predicted, ratio, drag):
        """Whether the dots lag behind the predicted motion as in gross slip: all along their drag, at the friction of earlier slip."""
        lag = -motions.residuals(predicted)
        size = lengths(lag) + 1e-12
        along = np.einsum('ij,ij->i', lag, drag) / np.maximum(lengths(drag), 1e-12)
        dragged = along.sum() / size.sum() > (.25 if self._gross else .5)
        loaded = median(ratio) > (.65 if self._gross else .8) * self.friction
        return bool(dragged and loaded and self._in_touch(motions, predicted) and (self._gross or self._slipping_share > _MANY))

    def _learn(self, motions, twist, ratio, slips):
        """Update the running means of the slipping dots' friction and of the noise along the normal."""
        spread = robust_sigma(motions.normal_residuals(motions.constrained_to_normals(twist)))
        self.depth_noise += _SMOOTHING * (max(spread, self.tolerance / 2) - self.depth_noise)
        seen = median(ratio[slips]) if slips.sum() >= _FEWEST else 0.0
        if seen > _LEAST_FRICTION:
            self.friction = seen if not self.friction > 0 else self.friction + _SMOOTHING * (seen - self.friction)

    def _friction(self, state, touched, both, motions, predicted):
        """Ratio (N,) of tangential to normal load, and tangential load (N, 3), of the dots both (N,), summed over 3 x 3 dots.

        Where the object slides over the surface, only the load in that direction counts: it may differ from dot to dot.
        """
        normal = -np.einsum('ij,ij->i', state.force, state.normal)
        loads = np.empty((len(normal), 5))
        loads[:, 0] = normal
        loads[:, 1:4] = state.force + normal[:, None] * state.normal
        loads[~touched] = 0
        direction = self._sliding_direction(motions, predicted, state.normal[both])
        loads[:, 4] = 0
        loads[both, 4] = np.einsum('ij,ij->i', loads[both, 1:4], direction)
        near = cv2.boxFilter(loads.reshape(*self.shape, 5), -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT)
        near = near.reshape(-1, 5)[both]
        load = np.where(direction.any(1), near[:, 4], lengths(near[:, 1:4]))
        return load / np.maximum(near[:, 0], 1e-9), near[:, 1:4]

    def _sliding_direction(self, motions, predicted, normals):
        """Unit vectors (N, 3) of the object's tangential motion, by the twist predicted, over surfaces with normals (N, 3); 0: unknown."""
        if predicted is None:
            return np.zeros_like(normals)
        moved = motions.rows @ predicted
        moved = moved - np.einsum('ij,ij->i', moved, normals)[:, None] * normals
        size = lengths(moved)[:, None]
        return np.where(size > self.tolerance / 2, moved / np.maximum(size, 1e-12), 0)
