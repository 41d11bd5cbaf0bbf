# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""One frame of the membrane: measured ranges, the present estimate, and a step from it towards the answer."""
from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

from .membrane_forces import MembraneForces
from .membrane_load import confirm, expectation, judge, likelihood_gain

_LARGEST_STEP, _LARGEST_PRESSURE_STEP = 4e-4, 400.0
# m: how loosely dots are held to where they were; it matters to those that nothing else holds.
_WEAK_HOLD = 1e-3
# A range this many standard deviations off its neighbours', and off by this share of how far they went, has been spoiled.
_STRAY_SIGMA, _STRAY_SHARE = 5.0, 0.7
_NEIGHBOURS = [0, 1, 2, 3, 5, 6, 7, 8]


class MembraneFrame:
    """Ranges (N,) m with weights 1/sigma^2 along unit rays (N, 3) from origin (3,) to the dots ids (N,), and where the solution starts.

    forces: of the membrane; start: (K, 3) m, where the dots were; touched: (K,) their probabilities or None; pressure: Pa. variance (K,),
    of the loads by errors of the ranges, is set by whoever knows it.
    """

    def __init__(self, forces: MembraneForces, origin, rays, ranges, sigma, ids, start, touched, pressure):
        self.mesh, self.forces = forces.mesh, forces
        size = self.mesh.size
        self.origin = np.asarray(origin, float)[:, None]
        self.seen = np.zeros(size, bool)
        self.seen[ids] = True
        self.rays = self._all_rays(start, rays, ids)
        self.measured, self.weight = np.zeros(size), np.zeros(size)
        good = np.isfinite(ranges) & np.isfinite(sigma) & (np.asarray(sigma) > 0)
        self.measured[ids[good]] = np.asarray(ranges)[good]
        self.weight[ids[good]] = 1 / np.asarray(sigma)[good]**2
        self.pressure, self.misfit, self.variance = pressure, 1.0, np.zeros(size)
        self._slopes, self._by_pressure, self._system = None, None, None
        self._begin(start, touched)

    def _all_rays(self, start, rays, ids):
        """Unit rays (3, K): measured ones, and for dots not seen their last direction moved as their neighbours moved."""
        last = start.T - self.origin
        last /= np.sqrt((last * last).sum(0))
        if self.seen.all():
            full = np.empty_like(last)
            full[:, ids] = rays.T
            return full
        moved = np.zeros_like(last)
        moved[:, ids] = rays.T - last[:, ids]
        full = last + self.mesh.fill(moved.T, self.seen).T
        return full / np.sqrt((full * full).sum(0))

    def _begin(self, start, touched):
        """Start from the last frame, moved as the ranges of each dot and its neighbours have changed in the mean.

        Where the surface has jumped (or there is no last frame) start from the measured ranges.
        """
        last = start.T - self.origin
        self.ranges = np.sqrt((last * last).sum(0))
        self._leave_out_strays()
        has = self.weight > 0
        moved = np.sort(np.abs(self.measured - self.ranges)[has])
        self.cold = touched is None or (len(moved) > 3 and moved[-4] > 2 * _LARGEST_STEP)
        self.touched = np.zeros(len(self.ranges)) if self.cold else touched
        if self.cold:
            self.ranges = np.where(has, self.measured, self.ranges)
        else:
            gone = (self.measured - self.ranges) * has
            self.ranges = self.ranges + gone[self.mesh.stencil].sum(0) / np.maximum(has[self.mesh.stencil].sum(0), 1)
        self.anchor = self.ranges

    def _leave_out_strays(self):
        """Take the weight off ranges that went where at most one neighbour went: along an edge there are two, glare spoils one or two
        dots."""
        gone = np.where(self.weight > 0, self.measured - self.ranges, 0.0)
        around = gone[self.mesh.stencil[_NEIGHBOURS]]
        off = np.abs(gone - around)
        second = np.argpartition(off, 1, axis=0)[1]
        nearest, there = np.take_along_axis(off, second[None], 0)[0], np.take_along_axis(around, second[None], 0)[0]
        stray = (nearest**2 * self.weight > _STRAY_SIGMA**2) & (nearest > _STRAY_SHARE * np.abs(there))
        self.weight[stray] = 0

    @property
    def places(self) -> np.ndarray:
        """(3, K) m."""
        return self.origin + self.ranges * self.rays

    def step(self, misfit: float, refresh: bool, renew: bool, doubt: bool, final: bool):
        """One Gauss-Newton step with this misfit of free dots.

        refresh: find the slopes anew (else those of the last step serve: the surface has hardly moved); renew: find the dots' probabilities
        anew first; doubt: give less weight to ranges that do not fit; final: drop patches without proof.
        """
        if refresh or self._slopes is None:
            leftover, slopes, by_pressure, _, area = self.forces.along_rays(self.places, self.rays, self.pressure)
            scale = 1 / (self.pressure * area)
            self._slopes, self._by_pressure = slopes * scale, by_pressure * scale
        else:
            leftover, area = self.forces.leftover(self.places, self.pressure)
            scale = 1 / (self.pressure * area)
        load, slopes, by_pressure = leftover * scale, self._slopes, self._by_pressure
        if renew:
            self._judge(load, misfit, final)
        self.misfit = misfit
        weight, pull = (np.where(self.mesh.inner, part, 0.0) for part in expectation(load, self.touched, misfit))
        self._move(slopes, weight, pull, by_pressure, doubt)

    def _judge(self, load, misfit, final):
        """What the measurements alone say of each load: without the pull of the dot's own expectation in the last step."""
        pull = expectation(load, self.touched, self.misfit)[1]
        gain = likelihood_gain(load + self.variance * pull, misfit, self.variance)
        self.touched = judge(self.mesh, gain, self.touched)
        if final:
            self.touched = confirm(self.mesh, gain, self.touched)

    def _move(self, slopes, weight, weighted_load, by_pressure, doubt):
        """Solve for the ranges and the pressure together: the banded part by Cholesky, the pressure as its border."""
        misfit = self.ranges - self.measured
        trust = self.weight / (1 + (misfit**2) * self.weight / 16) if doubt else self.weight
        hold = 1 / _WEAK_HOLD**2
        gradient = self.mesh.transpose(slopes, weighted_load) + trust * misfit + hold * (self.ranges - self.anchor)
        border = self.mesh.transpose(slopes, weight * by_pressure)
        band = self.mesh.normal_band(slopes, weight)
        band[0] += trust + hold
        factor, failed = lapack.dpbtrf(band, lower=1)
        if failed:
            return
        solved = lapack.dpbtrs(factor, np.stack([gradient, border], axis=1), lower=1)[0]
        stiffness = max((weight * by_pressure**2).sum() - border @ solved[:, 1], 1e-12)
        change = -((weighted_load * by_pressure).sum() - border @ solved[:, 0]) / stiffness
        change = float(np.clip(change, -_LARGEST_PRESSURE_STEP, _LARGEST_PRESSURE_STEP))
        self.ranges = self.ranges + np.clip(-solved[:, 0] - change * solved[:, 1], -_LARGEST_STEP, _LARGEST_STEP)
        self.pressure += change
        self._system = factor, trust, border, solved[:, 1], stiffness

    def answer(self, change: np.ndarray) -> tuple[np.ndarray, float]:
        """How ranges (K,) m and pressure (Pa) would answer a change (K,), m, of all measured ranges, to first order."""
        if self._system is None:
            return np.zeros_like(change), 0.0
        factor, trust, border, by_border, stiffness = self._system
        moved = lapack.dpbtrs(factor, trust * change, lower=1)[0]
        lifted = -(border @ moved) / stiffness
        return moved - lifted * by_border, lifted
