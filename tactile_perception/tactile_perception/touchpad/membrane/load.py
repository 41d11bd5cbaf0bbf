# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Which dots carry a load: a free dot has none but the mesh's misfit, a touched one about the fluid's pressure or more, and neighbours are
alike."""
from __future__ import annotations

import cv2
import numpy as np

from .mesh import GridMesh

# A touched dot's pressure over the fluid's: 1 under a flat face, 2 to 3 under a ball or along an edge.
TOUCHED_MEAN, TOUCHED_SPREAD = 1.3, 0.8
# Log odds of a dot among touched neighbours (minus that: among free ones).
_COUPLING = 4.0
# Log likelihood ratio below which a patch may be noise (once in some 10^7 dots), and the most that one dot can add: a patch takes three
# dots.
_EVIDENCE, _LARGEST_VOICE = 18.0, 7.5


def likelihood_gain(load: np.ndarray, misfit: float, variance: np.ndarray | float = 0.0) -> np.ndarray:
    """Log likelihood (K,) of being touched over that of being free, of loads (K,) over the fluid's pressure.

    misfit: standard deviation of a free dot's load; variance: of load by errors of measurement.
    """
    wide, narrow = TOUCHED_SPREAD**2 + variance, misfit**2 + variance
    return (load**2 / narrow - (load - TOUCHED_MEAN)**2 / wide + np.log(narrow / wide)) / 2


def expectation(load: np.ndarray, touched: np.ndarray, misfit: float) -> tuple[np.ndarray, np.ndarray]:
    """Weights (K,) of loads (K,) that are free or touched with probabilities touched (K,), and these times what is off: none, or a
    touched dot's."""
    free, held = (1 - touched) / misfit**2, touched / TOUCHED_SPREAD**2
    return free + held, (free + held) * load - held * TOUCHED_MEAN


def judge(mesh: GridMesh, gain: np.ndarray, touched: np.ndarray) -> np.ndarray:
    """Probability (K,) that a dot is touched, from its likelihood_gain (K,) and its neighbours' last probabilities touched (K,)."""
    odds = np.clip(gain + _COUPLING * (2 * mesh.neighbour_mean(touched) - 1), -30, 30)
    return np.where(mesh.inner, 1 / (1 + np.exp(-odds)), 0.0)


def confirm(mesh: GridMesh, gain: np.ndarray, touched: np.ndarray) -> np.ndarray:
    """touched (K,) without the patches of touched dots whose gains (K,) together are no proof; one spoiled range alone is none."""
    held = touched > .5
    if not held.any():
        return np.zeros_like(touched)
    count, patch = cv2.connectedComponents(held.reshape(mesh.rows, mesh.columns).astype(np.uint8), connectivity=8)
    patch = patch.ravel()
    proof = np.bincount(patch, np.minimum(gain, _LARGEST_VOICE), count) > _EVIDENCE
    proof[0] = True
    return np.where(proof.take(patch), touched, 0.0)
