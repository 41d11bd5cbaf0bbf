# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Probability that a dot carries a load: a mixture of free dots (load about 0) and touched ones (about the fluid's pressure or more), with
coupled neighbours."""
from __future__ import annotations

import cv2
import numpy as np

from .mesh import GridMesh

# Mean and standard deviation of a touched dot's load over the fluid's pressure; chosen: 1 under a face, 2 to 3 under a ball or an edge.
TOUCHED_MEAN, TOUCHED_SPREAD = 1.3, 0.8
_COUPLING = 4.0  # log odds of a dot among touched neighbours (minus that: among free ones); chosen
# Log likelihood ratio that a patch must exceed (e^-18: noise in about one of 10^7 dots), and the most that one dot contributes: three dots
# are needed.
_EVIDENCE, _LARGEST_GAIN = 18.0, 7.5


def log_likelihood_ratio(load: np.ndarray, misfit: float, variance: np.ndarray | float = 0.0) -> np.ndarray:
    """Log likelihood ratio (K,), touched over free, of loads (K,) over the fluid's pressure.

    misfit: standard deviation of a free dot's load; variance: of the loads from measurement errors.
    """
    wide, narrow = TOUCHED_SPREAD**2 + variance, misfit**2 + variance
    return (load**2 / narrow - (load - TOUCHED_MEAN)**2 / wide + np.log(narrow / wide)) / 2


def expectation(load: np.ndarray, touched: np.ndarray, misfit: float) -> tuple[np.ndarray, np.ndarray]:
    """Weights (K,) of loads (K,) that are touched with probability touched (K,), and the weights times the loads' residuals from their
    expected values (0 if free, TOUCHED_MEAN if touched)."""
    free, held = (1 - touched) / misfit**2, touched / TOUCHED_SPREAD**2
    return free + held, (free + held) * load - held * TOUCHED_MEAN


def contact_probability(mesh: GridMesh, gain: np.ndarray, touched: np.ndarray) -> np.ndarray:
    """Probability (K,) that a dot is touched, from its log_likelihood_ratio gain (K,) and the last probabilities touched (K,)."""
    odds = np.clip(gain + _COUPLING * (2 * mesh.neighbour_mean(touched) - 1), -30, 30)
    return np.where(mesh.inner, 1 / (1 + np.exp(-odds)), 0.0)


def drop_weak_patches(mesh: GridMesh, gain: np.ndarray, touched: np.ndarray) -> np.ndarray:
    """touched (K,) with 0 in connected patches whose summed log likelihood ratios gain (K,) are not significant."""
    held = touched > .5
    if not held.any():
        return np.zeros_like(touched)
    count, patch = cv2.connectedComponents(held.reshape(mesh.rows, mesh.columns).astype(np.uint8), connectivity=8)
    patch = patch.ravel()
    significant = np.bincount(patch, np.minimum(gain, _LARGEST_GAIN), count) > _EVIDENCE
    significant[0] = True
    return np.where(significant.take(patch), touched, 0.0)
