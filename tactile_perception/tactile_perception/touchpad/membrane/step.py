# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""One frame of the membrane: measured ranges, the current estimate, and its Gauss-Newton steps."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import lapack

from ...common.vectors import dot
from .forces import MembraneForces
from .load import contact_probability, drop_weak_patches, expectation, log_likelihood_ratio

_LARGEST_STEP, _LARGEST_PRESSURE_STEP = 4e-4, 400.0  # m and Pa largest change in a step; chosen, about 0.3 pitches and 0.2 rest pressures
_WEAK_HOLD = 1e-3  # m, standard deviation of the prior at the last position, for dots without other constraints; chosen
# A range is an outlier if it is this many standard deviations and this share of its change off its neighbours; chosen.
_OUTLIER_SIGMA, _OUTLIER_SHARE = 5.0, 0.7
_NEAR, _MANY = 5e-4, 0.02  # m; chosen: the Jacobian is kept until more than this share of the dots has moved by more
# Change of the weights up to which the factorisation is kept: of any dot, and of all but some dots; chosen. The weights of the ranges vary
# more and matter less than those of the loads.
_LARGEST_RISE, _RISE, _FALL, _SOME_LOADS, _SOME_RANGES = 8.0, 1.6, 0.6, 16, 60


class Slopes:
    """Jacobian of the loads by the ranges and its factorised normal equations, kept from step to step and frame to frame while nearly
    constant."""

    def __init__(self, forces: MembraneForces):
        self._forces = forces
        self._places: np.ndarray | None = None
        self._slopes: np.ndarray | None = None
        self._kept: dict[float, tuple[Equations, np.ndarray, np.ndarray]] = {}

    def at(self, places: np.ndarray, normal: np.ndarray, rays: np.ndarray, pressure: float) -> np.ndarray:
        """(9, K) N/m as MembraneForces.slopes, at these places (3, K) or at near ones."""
        if self._places is not None:
            moved = places - self._places
            if np.count_nonzero(dot(moved, moved) > _NEAR**2) <= _MANY * moved.shape[1]:
                return self._slopes
        self._places, self._slopes = places, self._forces.slopes(places, normal, rays, pressure)
        self._kept = {}
        return self._slopes

    def equations(self, slopes: np.ndarray, weight: np.ndarray, by_pressure: np.ndarray, trust: np.ndarray,
                  keep: float | None) -> Equations | None:
        """Normal equations of loads with slopes (9, K), weights weight (K,) and derivatives by_pressure (K,), and of ranges with weights
        trust (K,); None where they are singular.

        keep: key under which they are kept, None: not. Old equations change the path of the steps, not their fixed point.
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
    """Bordered normal equations of all ranges and the fluid's pressure. factor: Cholesky factor of the ranges' part, a lower band;
    border: (K,) the pressure's column; by_border: (K,) the ranges' part solved for it; stiffness: Schur complement of the pressure."""

    factor: np.ndarray
    border: np.ndarray
    by_border: np.ndarray
    stiffness: float

    def solve(self, by_ranges: np.ndarray, by_pressure: float) -> tuple[np.ndarray, float]:
        """Descent step of ranges (K,) and pressure for a gradient by both; the ranges' step still lacks the pressure's part."""
        moved = lapack.dpbtrs(self.factor, by_ranges, lower=1)[0]
        return moved, -(by_pressure - float(self.border @ moved)) / self.stiffness


def _alike(now: np.ndarray, then: np.ndarray, some: int) -> bool:
    """Whether weights now (K,) are close enough to those of then (K,), but for some, for their factorisation to be used."""
    if (now > _LARGEST_RISE * then).any():
        return False
    return np.count_nonzero(now > _RISE * then) + np.count_nonzero(now < _FALL * then) <= some


class MembraneFrame:
    """Ranges (N,) m with standard deviations sigma (N,) m along unit rays (N, 3) from origin (3,) to the dots ids (N,), and the estimate.

    forces, slopes: of the membrane; start: (3, K) m, last positions; touched: (K,) their probabilities or None; pressure: Pa. The caller
    sets variance (K,), of the loads by range errors.
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
        self._initialise(touched)

    def _all_rays(self, last, rays, ids):
        """Unit rays (3, K): measured ones; of unseen dots the last direction, last (3, K), plus the interpolated motion of neighbours."""
        if self.seen.all():
            full = np.empty_like(last)
            full[:, ids] = rays.T
            return full
        moved = np.zeros_like(last)
        moved[:, ids] = rays.T - last[:, ids]
        full = last + self.mesh.fill(moved.T, self.seen).T
        return full / np.sqrt(dot(full, full))

    def _initialise(self, touched):
        """Start from the last ranges plus their change, averaged over 3 x 3 dots; from the measured ranges without a last frame or where
        the change is large."""
        gone = np.where(self.weight > 0, self.measured - self.ranges, 0.0)
        self._reject_outliers(gone)
        has = self.weight > 0
        gone *= has
        self.cold = touched is None or np.count_nonzero(np.abs(gone) > 2 * _LARGEST_STEP) > 3
        self.touched = np.zeros(len(gone)) if self.cold else touched
        self.ranges = self.ranges + (gone if self.cold else self.mesh.around(gone) / np.maximum(self.mesh.around(has.astype(float)), 1))
        self.anchor = self.ranges

    def _reject_outliers(self, gone):
        """Give no weight to ranges whose change gone (K,) m is shared by at most one neighbour: glare spoils one or two dots, an edge moves
        more."""
        off = np.abs(gone - gone.take(self.mesh.around_index))
        with np.errstate(divide='ignore'):
            alone = np.flatnonzero(np.count_nonzero(off > _OUTLIER_SIGMA / np.sqrt(self.weight), axis=0) >= len(off) - 1)
        if len(alone) == 0:
            return
        second = np.argsort(off[:, alone], axis=0)[1]
        nearest, there = off[second, alone], gone[self.mesh.around_index[second, alone]]
        self.weight[alone[nearest > _OUTLIER_SHARE * np.abs(there)]] = 0

    @property
    def places(self) -> np.ndarray:
        """(3, K) m."""
        return self.origin + self.ranges * self.rays

    def step(self, misfit: float, classify: bool, robust: bool, final: bool):
        """One Gauss-Newton step; misfit: standard deviation of a free dot's load.

        classify: update the contact probabilities first; robust: reweight ranges by their residuals; final: drop insignificant patches.
        """
        places = self.places
        residual, by_pressure, normal, area = self.forces.balance(places, self.pressure)
        scale = 1 / (self.pressure * area)
        load = residual * scale
        if classify:
            self._classify(load, misfit, final)
        self.misfit = misfit
        weight, pull = (part * self.mesh.inner for part in expectation(load, self.touched, misfit))
        slopes = self._slopes.at(places, normal, self.rays, self.pressure)
        self._move(slopes * scale, weight, pull, by_pressure * scale, robust)

    def _classify(self, load, misfit, final):
        """Update the contact probabilities from the measurements alone: without the pull of the dot's own prior in the last step."""
        pull = expectation(load, self.touched, self.misfit)[1]
        gain = log_likelihood_ratio(load + self.variance * pull, misfit, self.variance)
        self.touched = contact_probability(self.mesh, gain, self.touched)
        if final:
            self.touched = drop_weak_patches(self.mesh, gain, self.touched)

    def _move(self, slopes, weight, weighted_load, by_pressure, robust):
        """Solve for ranges and pressure together: banded Cholesky, bordered by the pressure."""
        misfit = self.ranges - self.measured
        trust = self.weight / (1 + misfit**2 * self.weight / 16) if robust else self.weight
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
        """First-order change of ranges (K,) m and pressure, Pa, for a change (K,), m, of all measured ranges."""
        if self._system is None:
            return np.zeros_like(change), 0.0
        equations, trust = self._system
        moved, lifted = equations.solve(trust * change, 0.0)
        return moved + lifted * equations.by_border, -lifted
