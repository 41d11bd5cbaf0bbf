# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The force of a reading of force taxels, fitted to known loads."""
from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core.errors import BadCalibration
from .constants import FORCE_TAXEL
from .taxels import Taxels


class Load(NamedTuple):
    """reading: (N, 3) mean above the untouched one, along two tangents and inwards; force: (3,) N; name: recording and time."""

    reading: np.ndarray
    force: np.ndarray
    name: str


def fit_response(taxels: Taxels, loads: list[Load]) -> tuple[np.ndarray, float, np.ndarray]:
    """The matrix (3, 3) from reading to force, the relative error of one taxel, and those (K,) of the loads, each left out of the fit.

    Least squares: the force of a load is the sum over all taxels of the transposed axes times the matrix times the reading. Raises
    BadCalibration for loads that do not show all axes.
    """
    design = np.array([_design(taxels, load.reading) for load in loads])  # (K, 3, 9)
    forces = np.array([load.force for load in loads])
    sizes = np.linalg.norm(forces, axis=1)
    scaled, wanted = design / sizes[:, None, None], forces / sizes[:, None]
    if not _determines(scaled, scaled):
        raise BadCalibration('the loads do not show all three axes: record a weight that presses, one that pulls along x and one along y')
    everything = np.arange(len(loads))
    matrix = _solve(scaled, wanted, everything)
    errors, spread = np.zeros(len(loads)), []
    for k in everything:
        others = np.delete(everything, k)
        is_enough = len(others) >= 3 and _determines(scaled[others], scaled)
        fitted = _solve(scaled, wanted, others) if is_enough else matrix
        errors[k] = float(np.linalg.norm(scaled[k] @ fitted.ravel() - wanted[k]))
        if is_enough:
            share = np.linalg.norm(loads[k].reading @ matrix.T, axis=1)
            spread.append(errors[k]**2 / 3 * share.sum()**2 / (share @ share))  # by how many taxels the load averages over
    # Weights that cover the whole sensor do not show how unequal its taxels are.
    error = max(float(np.sqrt(np.mean(spread))) if spread else FORCE_TAXEL.usual_error, 0.5 * FORCE_TAXEL.usual_error)
    return matrix, error, errors


def _design(taxels: Taxels, reading: np.ndarray) -> np.ndarray:
    """(3, 9): the total force as a linear function of the entries of the matrix, row by row."""
    return np.einsum('nri,nc->irc', taxels.axes, reading).reshape(3, -1)


def _determines(some: np.ndarray, everything: np.ndarray) -> bool:
    """Whether some of the loads (K, 3, 9) determine all entries of the matrix."""
    return np.linalg.matrix_rank(np.concatenate(some), tol=1e-3 * np.abs(everything).max()) == some.shape[2]


def _solve(design: np.ndarray, wanted: np.ndarray, used: np.ndarray) -> np.ndarray:
    return np.linalg.lstsq(np.concatenate(design[used]), wanted[used].ravel(), rcond=None)[0].reshape(3, 3)
