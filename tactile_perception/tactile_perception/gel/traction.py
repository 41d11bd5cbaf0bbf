# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Pressure and shear on a gel's surface from the displacements of its dots."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import nnls
from scipy.sparse.linalg import lsqr

from ..common.statistics import robust_sigma
from ..errors import BadArgument
from .layer import Layer, Loads

_UNEVEN = 0.3  # prior: how far the shear of a place may lie from the shear that the contact shares, over its pressure; of friction's order
_NEIGHBOURS = 1.0  # steps: prior: a place is pressed about as hard as those within this standard deviation
_ROUNDS = 4  # of the prior's amplitudes; three more change forces by 1 %
_FOLLOWING = 2  # of them from a fit that was near: of the frame before, or with all dots
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
        self.places, self._loads, self._distance = places, Loads(layer, self.blur * step), distance
        near = np.exp(-((places[:, None] - places)**2).sum(axis=2) / (2 * (_NEIGHBOURS * step)**2))
        self._smooth = near / near.sum(axis=1, keepdims=True)

    def rows(self, dots: np.ndarray) -> np.ndarray:
        """(D, 2, P, 3): apparent displacements, m, of dots (D, 2) m under unit loads along x, along y and pressing."""
        moves = self._loads.matrix(dots, self.places)
        return moves[:, :2] - (dots / self._distance)[:, :, None, None] * moves[:, 2:]

    def solve(self, rows: np.ndarray, moved: np.ndarray, sigma: float, before: np.ndarray | None = None) -> Tractions:
        """Loads from displacements (D, 2), m, with standard deviation sigma, m, a coordinate; rows: of the same dots; before: (P, 3) m^2,
        loads a frame before, None where nothing touched."""
        used = np.ones(len(moved), bool)
        found = self._fit(rows, moved, sigma, used, before)
        off = np.abs(moved - _moved(rows, found.force))
        seen = robust_sigma(off)  # a dot on a tilted, lit skin is seen less well than at rest
        used = off.max(axis=1) <= _OUTLIER * max(seen, sigma)
        return found if used.all() and seen <= sigma else self._fit(rows, moved, max(seen, sigma), used, found.force)

    def _fit(self, rows: np.ndarray, moved: np.ndarray, sigma: float, used: np.ndarray, before: np.ndarray | None) -> Tractions:
        """The loads: pressure p >= 0 at each place, shear (lean + uneven) p, of which uneven is as the prior says.

        Pressures are normal with variances spread, which are those of their neighbourhood in the round before (iterated reweighting, as in
        sparse Bayesian learning); the first ones are those before, and what a linear fit, alike everywhere, adds to explain the rest. Given
        lean and spread, the pressures are a least-squares fit without negatives, with the uneven shear integrated out.
        """
        rounds, before = (_ROUNDS, np.zeros((len(self.places), 3))) if before is None else (_FOLLOWING, before)
        moved, rows = moved[used], rows[used]
        sigma = np.repeat(np.hypot(sigma, _LINEAR * np.linalg.norm(moved, axis=1)), 2)
        rest = (moved - _moved(rows, before)).ravel() / sigma
        rows, data = rows.reshape(-1, len(self.places), 3) / sigma[:, None, None], moved.ravel() / sigma
        alike = 1 / np.sqrt(rest @ rest / (rows**2).sum())
        loads = before * [1, 1, -1] + lsqr(rows.reshape(len(data), -1), rest, damp=alike, iter_lim=_STEPS)[0].reshape(-1, 3)
        share, at = np.maximum(loads[:, 2], 0), np.arange(len(loads))
        lean = loads[:, :2].sum(axis=0) / max(share.sum(), np.finfo(float).tiny)
        for _ in range(rounds):
            spread = (self._smooth[:, at] @ share)**2
            at = np.flatnonzero(spread > _FAINT**2 * spread.max())
            if not len(at):
                return Tractions(np.zeros((len(spread), 3)), used, np.full((3, 3), np.nan), np.full((2, 2), np.nan))
            white = _Whitened(rows[:, at], data, 1 / spread[at])
            share = white.pressures(lean)
            lean = white.lean(share)
        return self._loads_of(white, share, lean, at, used)

    def _loads_of(self, white: _Whitened, share: np.ndarray, lean: np.ndarray, at: np.ndarray, used: np.ndarray) -> Tractions:
        """The loads with the uneven shear, and their covariances; share: (A,) m^2, pressures of the places with the indices at (A,)."""
        force, total, count = np.zeros((len(self.places), 3)), share.sum(), len(at)
        if not total > 0:
            return Tractions(force, used, np.full((3, 3), np.nan), np.full((2, 2), np.nan))
        force[at, :2], force[at, 2] = share[:, None] * lean + white.uneven(share, lean), -share
        of_pressure, of_lean, of_uneven = np.zeros((5, count)), np.zeros((5, 2)), np.zeros((5, 2 * count))
        of_pressure[:2], of_pressure[2] = lean[:, None], -1.0
        of_pressure[3:] = (self.places[at] - share @ self.places[at] / total).T / total
        for axis in (0, 1):
            of_lean[axis, axis], of_uneven[axis, axis::2] = total, 1.0
        both = white.covariance(share, lean, of_pressure, of_lean, of_uneven)
        return Tractions(force, used, both[:3, :3] + np.diag((_MODEL * force.sum(axis=0))**2), both[3:, 3:])


def _moved(rows: np.ndarray, force: np.ndarray) -> np.ndarray:
    """(D, 2) m, displacements of dots under forces (P, 3) on the places."""
    return np.einsum('dipj,pj->di', rows, force * [1, 1, -1])


class _Whitened:
    """Loads at A places, with the uneven shear as noise that dots beside each other share; its covariance and that of the displacements is
    whitened. rows: (N, A, 3), data: (N,), both over sigma; weight: (A,), one over variances."""

    def __init__(self, rows: np.ndarray, data: np.ndarray, weight: np.ndarray):
        self._rows, self._weight, self._variance = rows, weight, np.repeat(_UNEVEN**2 / weight, 2)
        self._shear = rows[:, :, :2].reshape(len(data), -1)
        self._root = np.linalg.cholesky(np.eye(len(data)) + (self._shear * self._variance) @ self._shear.T)
        self._data = self._white(data)

    def _white(self, columns: np.ndarray, transposed: bool = False) -> np.ndarray:
        return solve_triangular(self._root, columns, lower=True, trans=int(transposed), check_finite=False)

    def pressures(self, lean: np.ndarray) -> np.ndarray:
        """(A,) m^2: the pressures, none negative, with the shear that they share."""
        rows = self._white(self._rows @ np.append(lean, 1.0))
        root = np.linalg.cholesky(rows.T @ rows + np.diag(self._weight))
        return nnls(root.T, np.linalg.solve(root, rows.T @ self._data))[0]

    def lean(self, share: np.ndarray) -> np.ndarray:
        """(2,): the shear over the pressure that the places share, given their pressures (A,)."""
        rows = self._white(share @ self._rows)
        return np.linalg.lstsq(rows[:, :2], self._data - rows[:, 2], rcond=1e-4)[0]

    def uneven(self, share: np.ndarray, lean: np.ndarray) -> np.ndarray:
        """(A, 2) m^2: the rest of the shear."""
        rest = self._data - self._white(share @ self._rows @ np.append(lean, 1.0))
        return (self._variance * (self._white(rest, transposed=True) @ self._shear)).reshape(-1, 2)

    def covariance(self, share: np.ndarray, lean: np.ndarray, of_pressure: np.ndarray, of_lean: np.ndarray,
                   of_uneven: np.ndarray) -> np.ndarray:
        """(K, K) of sums of pressures (K, A), of the lean (K, 2), which has no prior, and of uneven shears (K, 2 A) about a solution."""
        rows, leans = self._white(self._rows @ np.append(lean, 1.0)), self._white((share @ self._rows)[:, :2])
        pressure, uneven = of_pressure / self._weight, of_uneven * self._variance
        root = np.linalg.cholesky(np.eye(len(rows)) + (rows / self._weight) @ rows.T)
        seen = np.linalg.solve(root, rows @ pressure.T + self._white(self._shear @ uneven.T))
        leans = np.linalg.solve(root, leans)
        rest = of_lean - seen.T @ leans
        return of_pressure @ pressure.T + of_uneven @ uneven.T - seen.T @ seen + rest @ np.linalg.solve(leans.T @ leans, rest.T)
