# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""One frame of the membrane: measured ranges, the present estimate, and a step from it towards the answer."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import lapack

from ...common.vectors import dot
from .forces import MembraneForces
from .load import confirm, expectation, judge, likelihood_gain

_LARGEST_STEP, _LARGEST_PRESSURE_STEP = 4e-4, 400.0
# m: how loosely dots are held to where they were; it matters to those that nothing else holds.
_WEAK_HOLD = 1e-3
# A range this many standard deviations off its neighbours', and off by this share of how far they went, has been spoiled.
_STRAY_SIGMA, _STRAY_SHARE = 5.0, 0.7
# m: slopes serve until this share of the dots has gone that far from where they were found (glare sends single ones astray).
_NEAR, _MANY = 5e-4, 0.02
# How much the weights of a step's equations may have changed for these to be kept: of any dot, and of all but some of them (the ranges'
# weights vary by themselves, and hardly matter beside the loads').
_LARGEST_RISE, _RISE, _FALL, _SOME_LOADS, _SOME_RANGES = 8.0, 1.6, 0.6, 16, 60


class Slopes:
    """How the loads of a membrane change with the ranges: costly to find and slow to change, so kept from step to step and frame to
    frame."""

    def __init__(self, forces: MembraneForces):
        self._forces = forces
        self._places: np.ndarray | None = None
        self._slopes: np.ndarray | None = None
        self._kept: dict[float, tuple[Equations, np.ndarray, np.ndarray]] = {}

    def at(self, places: np.ndarray, normal: np.ndarray, rays: np.ndarray, pressure: float) -> np.ndarray:
        """(9, K) N/m as MembraneForces.slopes, for these or for close places (3, K)."""
        if self._places is not None:
            gone = places - self._places
            if np.count_nonzero(dot(gone, gone) > _NEAR**2) <= _MANY * gone.shape[1]:
                return self._slopes
        self._places, self._slopes = places, self._forces.slopes(places, normal, rays, pressure)
        self._kept = {}
        return self._slopes

    def equations(self, slopes: np.ndarray, weight: np.ndarray, by_pressure: np.ndarray, trust: np.ndarray,
                  keep: float | None) -> Equations | None:
        """Equations of loads with slopes (9, K), weights weight (K,) and derivatives by_pressure (K,), and of ranges with weights trust
        (K,); None where they have no solution.

        keep: under which they are kept, if at all. They say where a step goes, not where steps end, so that they serve from frame to frame
        while about the same.
        """
        kept = self._kept.get(keep)
        if kept and _alike(weight, kept[1], _SOME_LOADS) and _alike(trust, kept[2], _SOME_RANGES):
            return kept[0]
        mesh = self._forces.mesh
        band = mesh.normal_band(slopes, weight)
        band[0] += trust
        factor, failed = lapack.dpbtrf(band, lower=1)
        if failed:
            return None
        border = mesh.transpose(slopes, weight * by_pressure)
        by_border = lapack.dpbtrs(factor, border, lower=1)[0]
        found = Equations(factor, border, by_border, max(float(weight @ by_pressure**2 - border @ by_border), 1e-12))
        if keep is not None:
            self._kept[keep] = found, weight, trust
        return found


@dataclass(frozen=True)
class Equations:
    """Of all ranges and the fluid's pressure: Cholesky factor of the ranges' part, a lower band; border (K,), the pressure's column;
    by_border (K,), the factor's answer to it; stiffness: of the pressure with the ranges free."""

    factor: np.ndarray
    border: np.ndarray
    by_border: np.ndarray
    stiffness: float

    def solve(self, by_ranges: np.ndarray, by_pressure: float) -> tuple[np.ndarray, float]:
        """How ranges (K,) and pressure answer a gradient (K,) by the ranges and one by the pressure: moves down along it; the pressure's
        part is not yet in the ranges'."""
        moved = lapack.dpbtrs(self.factor, by_ranges, lower=1)[0]
        return moved, -(by_pressure - float(self.border @ moved)) / self.stiffness


def _alike(now: np.ndarray, then: np.ndarray, some: int) -> bool:
    """Whether weights now (K,) are about those of then (K,) but for some, so that no step by their factor goes far beyond its end."""
    if (now > _LARGEST_RISE * then).any():
        return False
    return np.count_nonzero(now > _RISE * then) + np.count_nonzero(now < _FALL * then) <= some


class MembraneFrame:
    """Ranges (N,) m with weights 1/sigma^2 along unit rays (N, 3) from origin (3,) to the dots ids (N,), and where the solution starts.

    forces, slopes: of the membrane; start: (3, K) m, where the dots were; touched: (K,) their probabilities or None; pressure: Pa. variance
    (K,), of the loads by errors of the ranges, is set by whoever knows it.
    """

    def __init__(self, forces: MembraneForces, slopes: Slopes, origin, rays, ranges, sigma, ids, start, touched, pressure):
        self.mesh, self.forces, self._slopes = forces.mesh, forces, slopes
        size = self.mesh.size
        self.origin = np.asarray(origin, float)[:, None]
        self.seen = np.zeros(size, bool)
        self.seen[ids] = True
        away = start - self.origin
        self.ranges = np.sqrt(dot(away, away))
        self.rays = self._all_rays(away / self.ranges, rays, ids)
        self.measured, self.weight = np.zeros(size), np.zeros(size)
        with np.errstate(divide='ignore', invalid='ignore'):
            weight = 1 / np.square(sigma)
        good = np.isfinite(ranges) & np.isfinite(weight)
        self.measured[ids] = np.where(good, ranges, 0.0)
        self.weight[ids] = np.where(good, weight, 0.0)
        self.pressure, self.misfit, self.variance = pressure, 1.0, np.zeros(size)
        self._system = None
        self._begin(touched)

    def _all_rays(self, last, rays, ids):
        """Unit rays (3, K): measured ones, and for dots not seen their last direction, last (3, K), moved as their neighbours moved."""
        if self.seen.all():
            full = np.empty_like(last)
            full[:, ids] = rays.T
            return full
        moved = np.zeros_like(last)
        moved[:, ids] = rays.T - last[:, ids]
        full = last + self.mesh.fill(moved.T, self.seen).T
        return full / np.sqrt(dot(full, full))

    def _begin(self, touched):
        """Start from the last frame, moved as the ranges of each dot and its neighbours have changed in the mean.

        Where the surface has jumped (or there is no last frame) start from the measured ranges.
        """
        gone = np.where(self.weight > 0, self.measured - self.ranges, 0.0)
        self._leave_out_strays(gone)
        has = self.weight > 0
        gone *= has
        self.cold = touched is None or np.count_nonzero(np.abs(gone) > 2 * _LARGEST_STEP) > 3
        self.touched = np.zeros(len(gone)) if self.cold else touched
        self.ranges = self.ranges + (gone if self.cold else self.mesh.around(gone) / np.maximum(self.mesh.around(has.astype(float)), 1))
        self.anchor = self.ranges

    def _leave_out_strays(self, gone):
        """Take the weight off ranges that went, by gone (K,) m, where at most one neighbour went: along an edge there are two, glare spoils
        one or two dots."""
        off = np.abs(gone - gone.take(self.mesh.around_index))
        with np.errstate(divide='ignore'):
            alone = np.flatnonzero(np.count_nonzero(off > _STRAY_SIGMA / np.sqrt(self.weight), axis=0) >= len(off) - 1)
        if len(alone) == 0:
            return
        second = np.argsort(off[:, alone], axis=0)[1]
        nearest, there = off[second, alone], gone[self.mesh.around_index[second, alone]]
        self.weight[alone[nearest > _STRAY_SHARE * np.abs(there)]] = 0

    @property
    def places(self) -> np.ndarray:
        """(3, K) m."""
        return self.origin + self.ranges * self.rays

    def step(self, misfit: float, renew: bool, doubt: bool, final: bool):
        """One Gauss-Newton step with this misfit of free dots.

        renew: find the dots' probabilities anew first; doubt: give less weight to ranges that do not fit; final: drop patches without
        proof.
        """
        places = self.places
        leftover, by_pressure, normal, area = self.forces.balance(places, self.pressure)
        scale = 1 / (self.pressure * area)
        load = leftover * scale
        if renew:
            self._judge(load, misfit, final)
        self.misfit = misfit
        weight, pull = (part * self.mesh.inner for part in expectation(load, self.touched, misfit))
        slopes = self._slopes.at(places, normal, self.rays, self.pressure)
        self._move(slopes * scale, weight, pull, by_pressure * scale, doubt)

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
        trust = self.weight / (1 + misfit**2 * self.weight / 16) if doubt else self.weight
        hold = 1 / _WEAK_HOLD**2
        gradient = self.mesh.transpose(slopes, weighted_load) + trust * misfit + hold * (self.ranges - self.anchor)
        equations = self._slopes.equations(slopes, weight, by_pressure, trust + hold, None if self.cold else self.misfit)
        if equations is None:
            return
        moved, change = equations.solve(gradient, float(weighted_load @ by_pressure))
        change = min(max(change, -_LARGEST_PRESSURE_STEP), _LARGEST_PRESSURE_STEP)
        self.ranges = self.ranges - np.minimum(np.maximum(moved + change * equations.by_border, -_LARGEST_STEP), _LARGEST_STEP)
        self.pressure += change
        self._system = equations, trust

    def answer(self, change: np.ndarray) -> tuple[np.ndarray, float]:
        """How ranges (K,) m and pressure (Pa) would answer a change (K,), m, of all measured ranges, to first order."""
        if self._system is None:
            return np.zeros_like(change), 0.0
        equations, trust = self._system
        moved, lifted = equations.solve(trust * change, 0.0)
        return moved + lifted * equations.by_border, -lifted
