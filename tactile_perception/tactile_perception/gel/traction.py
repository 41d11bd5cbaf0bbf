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
_ROUNDS = 4  # of the prior's amplitudes; three more change forces by 1 %
_STEPS = 30  # of the linear fit before them, which only has to find the place
_FAINT = 3e-3  # of the greatest amplitude: fainter places are left out; a tenth of it changes forces by a thousandth
_LINEAR = 0.05  # of a dot's displacement: what a linear layer leaves at strains of a tenth
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
        sparse Bayesian learning); the first ones are of a linear fit of pressures and shears that are alike everywhere. Given lean and
        spread, the pressures are a least-squares fit without negatives, with the uneven shear integrated out.
        """
        from scipy.optimize import nnls  # needed here alone
        from scipy.sparse.linalg import lsqr
        moved = moved[used]
        sigma = np.repeat(np.hypot(sigma, _LINEAR * np.linalg.norm(moved, axis=1)), 2)
        rows, data = rows[used].reshape(-1, len(self.places), 3) / sigma[:, None, None], moved.ravel() / sigma
        alike = 1 / np.sqrt(data @ data / (rows**2).sum())
        share = np.maximum(lsqr(rows.reshape(len(data), -1), data, damp=alike, iter_lim=_STEPS)[0][2::3], 0)
        at, lean = np.arange(len(share)), np.zeros(2)
        for _ in range(_ROUNDS):
            spread = (self._smooth[:, at] @ share)**2
            at = np.flatnonzero(spread > _FAINT**2 * spread.max())
            if not len(at):
                return Tractions(np.zeros((len(spread), 3)), used, np.full((3, 3), np.nan), np.full((2, 2), np.nan))
            normal = _Normal(rows[:, at], data, 1 / spread[at])
            matrix, goal = normal.of_pressure(lean)
            root = np.linalg.cholesky(matrix)
            share = nnls(root.T, np.linalg.solve(root, goal))[0]
            lean = normal.lean(share)
        return self._loads_of(normal, share, lean, at, used)

    def _loads_of(self, normal: _Normal, share: np.ndarray, lean: np.ndarray, at: np.ndarray, used: np.ndarray) -> Tractions:
        """The loads with the uneven shear, and their covariances; share: (A,) m^2, pressures of the places with the indices at (A,)."""
        force, total, count = np.zeros((len(self.places), 3)), share.sum(), len(at)
        if not total > 0:
            return Tractions(force, used, np.full((3, 3), np.nan), np.full((2, 2), np.nan))
        force[at, :2], force[at, 2] = share[:, None] * lean + normal.uneven(share, lean), -share
        sums = np.zeros((5, 3 * count + 2))
        sums[:2, :count], sums[2, :count] = lean[:, None], -1.0
        sums[3:, :count] = (self.places[at] - share @ self.places[at] / total).T / total
        for axis in (0, 1):
            sums[axis, count + axis], sums[axis, count + 2 + axis::2] = total, 1.0
        both = sums @ np.linalg.solve(normal.about(share, lean), sums.T)
        return Tractions(force, used, both[:3, :3] + np.diag((_MODEL * force.sum(axis=0))**2), both[3:, 3:])


class _Normal:
    """Normal equations of loads at A places. rows: (N, A, 3), data: (N,), both over sigma; weight: (A,), one over variances."""

    def __init__(self, rows: np.ndarray, data: np.ndarray, weight: np.ndarray):
        count = len(weight)
        flat = rows.reshape(len(data), -1)
        self._square = (flat.T @ flat).reshape(count, 3, count, 3)
        self._data = (flat.T @ data).reshape(count, 3)
        self._weight = weight
        self._free = self._square[:, :2, :, :2].reshape(2 * count, -1) + np.diag(np.repeat(weight, 2) / _UNEVEN**2)
        self._cross = self._square[:, :, :, :2].reshape(count, 3, -1)
        taken = np.linalg.solve(self._free, np.column_stack([self._cross.reshape(3 * count, -1).T, self._data[:, :2].ravel()]))
        self._taken, self._taken_data = taken[:, :-1].reshape(-1, count, 3), taken[:, -1]

    def of_pressure(self, lean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(A, A) and (A,): of the pressures with the shear that they share, the uneven shear integrated out."""
        mix = np.append(lean, 1.0)
        cross = np.einsum('akr,k->ar', self._cross, mix)
        matrix = np.einsum('akbl,k,l->ab', self._square, mix, mix, optimize=True) - cross @ (self._taken @ mix)
        return matrix + np.diag(self._weight), self._data @ mix - cross @ self._taken_data

    def lean(self, share: np.ndarray) -> np.ndarray:
        """(2,): the shear over the pressure that the places share, given their pressures (A,)."""
        cross = np.einsum('akr,a->kr', self._cross, share)
        square = np.einsum('akbl,a,b->kl', self._square, share, share, optimize=True) - cross @ np.einsum('rak,a->rk', self._taken, share)
        goal = share @ self._data - cross @ self._taken_data
        return np.linalg.lstsq(square[:2, :2], goal[:2] - square[:2, 2], rcond=1e-9)[0]

    def uneven(self, share: np.ndarray, lean: np.ndarray) -> np.ndarray:
        """(A, 2) m^2: the rest of the shear."""
        return (self._taken_data - np.einsum('rak,a,k->r', self._taken, share, np.append(lean, 1.0))).reshape(-1, 2)

    def about(self, share: np.ndarray, lean: np.ndarray) -> np.ndarray:
        """(3 A + 2,) square: of changes of pressures, lean and uneven shears about a solution."""
        count, mix = len(share), np.append(lean, 1.0)
        turn = np.zeros((count, 3, 3 * count + 2))
        turn[np.arange(count), :, np.arange(count)] = mix
        turn[:, [0, 1], [count, count + 1]] = share[:, None]
        turn[np.repeat(np.arange(count), 2), np.tile([0, 1], count), count + 2 + np.arange(2 * count)] = 1.0
        turn = turn.reshape(3 * count, -1)
        prior = np.concatenate([self._weight, [0, 0], np.repeat(self._weight, 2) / _UNEVEN**2])
        return turn.T @ self._square.reshape(3 * count, -1) @ turn + np.diag(prior)
