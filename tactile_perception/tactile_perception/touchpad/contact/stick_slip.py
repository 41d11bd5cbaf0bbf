# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Each dot's state - none, sticking, slipping - from the loads on the dots and their motion, with the friction unknown.

While some dots stick, they carry the object's motion: a dot that lags behind it slips. In gross slip no dot tells the motion: all stand
still, or nearly, under the greatest friction there is. So the motion is followed from frame to frame and kept when the dots leave it all
together in the direction in which they are dragged, at the friction ratio that slipping dots have shown; it is found anew when they move
otherwise or the ratio falls.
"""
from __future__ import annotations

import cv2
import numpy as np

from ...common.statistics import median, robust_sigma
from .loads import DotLoads
from .twist_fit import DotMotions, across_rays, lengths, twist_about

NON_CONTACT, STICKING, SLIPPING = 0, 1, 2
_FEWEST = 5
_SLOW = 0.2
# Frames that slipping dots may stand still though the object moves on: in gross slip (a disc that turns about its axis) and before it.
_REST_AFTER_GROSS, _REST_AFTER_SLIP = 15, 3
_LEAST_FRICTION = 0.05
# Share of slipping dots from which the whole face may be about to go.
_MANY = 0.3


class StickSlipTracker:
    """Follows the dots of a rows x columns grid seen from origin (3,) m, the camera's centre.

    tolerance: m a dot may lag behind the object in a frame and still stick; noise: standard deviation of a dot's motion across its ray, m
    (a first guess: it is measured while nothing touches).
    """

    def __init__(self, rows: int, columns: int, origin: np.ndarray, tolerance: float = 10e-6, noise: float = 2e-6):
        self.shape, self.origin = (rows, columns), np.asarray(origin, float)
        self.tolerance, self.noise = tolerance, noise
        self.depth_noise = 2 * tolerance
        self.reset()

    def reset(self):
        """Forget what came before."""
        self._last, self._last_touched = None, None
        self._twist, self._centre = None, np.zeros(3)
        self.friction = np.nan
        self._slipping_share, self._gross, self._still_frames = 0.0, False, 0

    def update(self, state: DotLoads, score: np.ndarray) -> np.ndarray:
        """States (K,) uint8 in this frame; score (K,): above 0.5 in contact."""
        touched = score > .5
        states = np.where(touched, STICKING, NON_CONTACT).astype(np.uint8)
        if not touched.any():
            self.rest(state.xyz, state.seen)
            return states
        if self._last is None or np.count_nonzero(touched) < _FEWEST:
            self._last, self._last_touched = (state.xyz, state.seen), touched
            self._twist, self._gross, self._slipping_share = None, False, 0.0
            return states
        both = np.flatnonzero(touched & self._last_touched & state.seen & self._last[1])
        if len(both) >= _FEWEST:
            slips = self._judge(state, touched, both)
            states[both[slips]] = SLIPPING
            states[touched & ~self._last_touched] = SLIPPING if self._gross else STICKING
        self._last, self._last_touched = (state.xyz, state.seen), touched
        return states

    def rest(self, xyz: np.ndarray, seen: np.ndarray) -> None:
        """A frame in which nothing carries a load: dots at xyz (K, 3) m, those seen (K,) bool. The motion is forgotten, and the noise
        learnt from how untouched dots seem to move."""
        if self._last is not None and not self._last_touched.any():
            moved = lengths(across_rays(self._last[0], xyz, self.origin)[0])[seen & self._last[1]]
            # the calmest fifth of the dots (0.668 standard deviations in a plane): a touch too light to be found moves many dots already
            here = np.partition(moved, len(moved) // 5)[len(moved) // 5] / 0.668 if len(moved) else np.nan
            if here > 0:
                self.noise += (_SLOW if here < self.noise else _SLOW / 4) * (here - self.noise)
        self._last, self._last_touched = (xyz, seen), np.zeros(len(seen), bool)
        self._twist, self._gross, self._slipping_share = None, False, 0.0

    def _judge(self, state, touched, both):
        motions = DotMotions(self._last[0][both], state.xyz[both], state.normal[both], self.origin, self.noise, self.depth_noise)
        held = None if self._twist is None else twist_about(self._twist, self._centre, motions.centre)
        if held is not None and not self._in_touch(motions, held):
            held = motions.constrained_to_normals(held)
        ratio, drag = self._friction(state, touched, both, motions, held)
        twist, self._gross = self._motion(motions, held, ratio, drag)
        slips = lengths(motions.residuals(twist)) > np.hypot(1.3 * self.tolerance, 3 * self.noise)
        self._twist, self._centre = twist, motions.centre
        self._slipping_share = slips.mean()
        self._learn(motions, twist, ratio, slips)
        return slips

    def _motion(self, motions, held, ratio, drag):
        """The object's twist, and whether no dot carries it any more."""
        fine = self.tolerance
        grip = np.clip((self.friction - ratio) / (.4 * self.friction), .05, 1)**2 if self.friction > 0 else np.ones(len(ratio))
        self._still_frames = self._still_frames + 1 if self._still(motions) else 0
        if self._still_frames >= self._rest_frames():
            return np.zeros(6), False
        if held is not None:
            near = motions.fit_robust(held, drag, 4 * fine, fine, max(3.0, .1 * len(ratio)), grip)
            agree = np.count_nonzero(lengths(motions.residuals(near)) < 1.3 * fine)
            if agree >= max(_FEWEST - 1, .1 * len(ratio)) and not self._gross and self._in_touch(motions, near):
                return near, False
            if self._slides_on(motions, held, ratio, drag):
                return held, True
        return motions.fit_robust(None, drag, 30 * fine, fine, 0.0, grip), False

    def _rest_frames(self):
        """For how many frames dots must stand still before the object is taken to rest."""
        if self._gross:
            return _REST_AFTER_GROSS
        return _REST_AFTER_SLIP if self._slipping_share > _MANY else 1

    def _still(self, motions):
        """Whether the dots' motions are no more than noise (within three standard deviations of its mean square)."""
        across = motions.moved_across
        excess = np.vdot(across, across) / (2 * len(across)) / self.noise**2 - 1
        return excess < 3 / np.sqrt(len(across)) and self._in_touch(motions, np.zeros(6))

    def _in_touch(self, motions, twist):
        """Whether the dots keep to the object along the normal, as all that touch must."""
        off = motions.normal_residuals(twist)
        return abs(median(off)) < 2 * self.depth_noise and median(np.abs(off)) < 3 * self.depth_noise

    def _slides_on(self, motions, held, ratio, drag):
        """Whether the dots have all left the held motion as gross slip leaves it."""
        lag = -motions.residuals(held)
        size = lengths(lag) + 1e-12
        along = np.einsum('ij,ij->i', lag, drag) / np.maximum(lengths(drag), 1e-12)
        dragged = along.sum() / size.sum() > (.25 if self._gross else .5)
        loaded = median(ratio) > (.65 if self._gross else .8) * self.friction
        return bool(dragged and loaded and self._in_touch(motions, held) and (self._gross or self._slipping_share > _MANY))

    def _learn(self, motions, twist, ratio, slips):
        """Friction that slipping dots show, and the noise along the normal: slow means over frames."""
        spread = robust_sigma(motions.normal_residuals(motions.constrained_to_normals(twist)))
        self.depth_noise += _SLOW * (max(spread, self.tolerance / 2) - self.depth_noise)
        seen = median(ratio[slips]) if slips.sum() >= _FEWEST else 0.0
        if seen > _LEAST_FRICTION:
            self.friction = seen if not self.friction > 0 else self.friction + _SLOW * (seen - self.friction)

    def _friction(self, state, touched, both, motions, held):
        """Ratio (N,) of load across the surface to normal load, and load across (N, 3), of the dots both (N,), summed over them and their
        neighbours.

        Where the object is known to move along the surface, the load counts in that direction: it may turn from dot to dot.
        """
        normal = -np.einsum('ij,ij->i', state.force, state.normal)
        loads = np.empty((len(normal), 5))
        loads[:, 0] = normal
        loads[:, 1:4] = state.force + normal[:, None] * state.normal
        loads[~touched] = 0
        way = self._way(motions, held, state.normal[both])
        loads[:, 4] = 0
        loads[both, 4] = np.einsum('ij,ij->i', loads[both, 1:4], way)
        near = cv2.boxFilter(loads.reshape(*self.shape, 5), -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT)
        near = near.reshape(-1, 5)[both]
        load = np.where(way.any(1), near[:, 4], lengths(near[:, 1:4]))
        return load / np.maximum(near[:, 0], 1e-9), near[:, 1:4]

    def _way(self, motions, held, normals):
        """Unit vectors (N, 3) along which the object moves over the surface with these normals (N, 3), by the twist held; 0: not known."""
        if held is None:
            return np.zeros_like(normals)
        moved = motions.rows @ held
        moved = moved - np.einsum('ij,ij->i', moved, normals)[:, None] * normals
        size = lengths(moved)[:, None]
        return np.where(size > self.tolerance / 2, moved / np.maximum(size, 1e-12), 0)
