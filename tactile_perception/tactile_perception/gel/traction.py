# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Pressure and shear on a gel's surface from the displacements of its dots."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import BadArgument
from .layer import Layer

_UNEVEN = 0.3  # prior: how far the shear of a place may lie from the shear that the contact shares, over its pressure; of friction's order
_NEIGHBOURS = 1.0  # steps: prior: a place is pressed about as hard as those within this standard deviation
_ROUNDS = 5  # of the prior's amplitudes; three more change forces by 1 %
_FAINT = 3e-3  # of the greatest amplitude: fainter places are left out; a tenth of it changes forces by a thousandth
_OUTLIER = 6.0  # robust standard deviations of the residual: a dot farther off is mistaken for another
_MODEL = 0.03  # of the force: what the model and the prior leave, without noise, on simulated gels (docs/gel.md)


@dataclass(frozen=True)
class Tractions:
    """Loads on the surface that explain the displacements of the dots, in units of the shear modulus.

    force: (P, 3) m^2, of the object on each place of the surface; used: (D,) bool, dots that were not left out as outliers; covariance:
    (3, 3) m^4, of total; place_covariance: (2, 2) m^2, of the pressure's middle.
    """

    force: np.ndarray
    used: np.ndarray
    covariance: np.ndarray
    place_covariance: np.ndarray

    @property
    def total(self) -> np.ndarray:
        """(3,) m^2, the sum of the loads."""
        return self.force.sum(axis=0)


class TractionFit:
    """The most likely loads at places (P, 2), m, of the surface of a layer.

    step: m, from place to place; distance: m, from the camera over the origin to the dots, inf for one that does not see how deep they are
    pressed. Raises BadArgument for a distance that is not positive.

    blur: standard deviation of a load's Gaussian profile, in steps.
    """

    blur = 0.6  # neighbours add up to an even pressure

    def __init__(self, layer: Layer, places: np.ndarray, step: float, distance: float = np.inf):
        if not distance > 0:
            raise BadArgument(f'gel: the distance of the camera must be positive, got {distance}')
        self.places, self._loads, self._distance = places, layer.loads(self.blur * step), distance
        near = np.exp(-((places[:, None] - places)**2).sum(axis=2) / (2 * (_NEIGHBOURS * step)**2))
        self._smooth = near / near.sum(axis=1, keepdims=True)

    def rows(self, dots: np.ndarray) -> np.ndarray:
        """(D, 2, P, 3): apparent displacements, m, of dots (D, 2) m under unit loads along x, along y and pressing."""
        moves = self._loads.matrix(dots, self.places)
        return moves[:, :2] - (dots / self._distance)[:, :, None, None] * moves[:, 2:]

    def solve(self, rows: np.ndarray, moved: np.ndarray, sigma: float) -> Tractions:
        """Loads from displacements (D, 2), m, with standard deviation sigma, m, a coordinate; rows: of the same dots."""
        used = np.ones(len(moved), bool)
        found = self._fit(rows, moved, sigma, used)
        off = np.abs(moved - np.einsum('dipj,pj->di', rows, found.force * [1, 1, -1])).max(axis=1)
        used = off <= _OUTLIER * max(1.4826 * np.median(off), sigma)
        return found if used.all() else self._fit(rows, moved, sigma, used)

    def _fit(self, rows: np.ndarray, moved: np.ndarray, sigma: float, used: np.ndarray) -> Tractions:
        """The loads: pressure p >= 0 at each place, shear (lean + uneven) p, of which uneven is as the prior says.

        Pressures are normal with variances spread, which are those of their neighbourhood in the round before (iterated reweighting, as in
        sparse Bayesian learning); in the first round pressure and shear are alike everywhere. Given lean and spread, the pressures are a
        least-squares fit without negatives, with the uneven shear as noise.
        """
        from scipy.linalg import solve_triangular  # needed here alone
        from scipy.optimize import nnls
        rows, data = rows[used].reshape(-1, len(self.places), 3), moved[used].ravel()
        spread, uneven, lean = np.full(len(self.places), data @ data / (rows**2).sum()), 1.0, np.zeros(2)
        for _ in range(_ROUNDS):
            at = np.flatnonzero(spread > _FAINT**2 * spread.max())
            along, weight = rows[:, at, :2], 1 / np.sqrt(spread[at])
            loose = along.reshape(len(data), -1) * (uneven / np.repeat(weight, 2))
            noise = np.linalg.cholesky(loose @ loose.T + sigma**2 * np.eye(len(data)))
            white = solve_triangular(noise, np.column_stack([data, rows[:, at, 2], along.reshape(len(data), -1)]), lower=True)
            goal, press, pull = white[:, 0], white[:, 1:1 + len(at)], white[:, 1 + len(at):].reshape(len(data), -1, 2)
            model = np.concatenate([press + pull @ lean, np.diag(weight)])
            share = nnls(model, np.concatenate([goal, np.zeros(len(at))]))[0]
            shared = np.einsum('npi,p->ni', pull, share)
            lean = np.linalg.lstsq(shared, goal - press @ share, rcond=1e-6)[0]
            if not share.any():
                break
            spread, uneven = (self._smooth[:, at] @ share)**2, _UNEVEN
        return self._loads_of(rows[:, at], data, sigma, share, lean, weight, at, used)

    def _loads_of(self, rows, data, sigma, share, lean, weight, at, used) -> Tractions:
        """The loads with the uneven shear, and their covariances: of the linear fit of pressures, lean and uneven shear about the solution;
        rows: (2D, A, 3), of the places with the indices at (A,)."""
        force, total, count = np.zeros((len(self.places), 3)), share.sum(), len(at)
        if not total > 0:
            return Tractions(force, used, np.full((3, 3), np.nan), np.full((2, 2), np.nan))
        along = rows[:, :, :2].reshape(len(data), -1)
        model = np.concatenate([rows[:, :, 2] + rows[:, :, :2] @ lean, np.einsum('npi,p->ni', rows[:, :, :2], share), along], axis=1) / sigma
        prior = np.concatenate([weight, [0, 0], np.repeat(weight, 2) / _UNEVEN])
        known = np.linalg.pinv(model.T @ model + np.diag(prior**2), hermitian=True)
        rest = data / sigma - model[:, :count] @ share
        uneven = np.linalg.solve(along.T @ along / sigma**2 + np.diag(prior[count + 2:]**2), along.T @ rest / sigma)
        force[at, :2], force[at, 2] = share[:, None] * lean + uneven.reshape(-1, 2), -share
        sums = np.zeros((5, len(known)))
        sums[:2, :count], sums[2, :count] = lean[:, None], -1.0
        sums[3:, :count] = (self.places[at] - share @ self.places[at] / total).T / total
        for axis in (0, 1):
            sums[axis, count + axis], sums[axis, count + 2 + axis::2] = total, 1.0
        both = sums @ known @ sums.T
        return Tractions(force, used, both[:3, :3] + np.diag((_MODEL * force.sum(axis=0))**2), both[3:, 3:])
