# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact score of each dot by the membrane's force balance; the contour at 0.5 is the border of the contact. Free dots beside an object's
edge carry a part of its line load; they are recognised by their height above the object's face."""
from __future__ import annotations

import math

import cv2
import numpy as np
from scipy.linalg import lapack

from ...common.statistics import SIGMA_PER_MAD, upper_median
from .loads import DotLoads
from ..membrane.solver import Membrane

_SMALLEST_PATCH = 8  # dots; chosen: two more than a paraboloid has coefficients
_ROUNDS = 4  # of reweighting; chosen
_FINEST = 1e-5  # m, smallest scale of the residuals; chosen, about the noise of a position
_RIDGE = 1e-6 * np.eye(6)
_HALF = 0.5
_EDGE_HEIGHT = 0.1  # pitches, height above the face of a dot in contact on an object's rounded edge; chosen


def heights_over_face(loaded: np.ndarray, xyz: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Heights (rows, columns), m, outward positive, of loaded dots (rows, columns) bool above a paraboloid fitted to their patch.

    xyz, normal: (rows, columns, 3). NaN for unloaded dots and in patches of less than eight dots.
    """
    heights = np.full(loaded.size, np.nan)
    mask = loaded.view(np.uint8)
    count, patches = cv2.connectedComponents(mask)
    patches, points, normals = patches.ravel(), xyz.reshape(-1, 3), normal.reshape(-1, 3)
    neighbours = cv2.boxFilter(mask, -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT).ravel()
    for patch in range(1, count):
        member = np.flatnonzero(patches == patch)
        if len(member) >= _SMALLEST_PATCH:
            heights[member] = _patch_heights(points.take(member, axis=0), normals.take(member, axis=0), neighbours.take(member) - 1.0)
    return heights.reshape(loaded.shape)


def _patch_heights(points: np.ndarray, normals: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """Heights (N,) of points (N, 3) above a robustly fitted paraboloid; points with many neighbours (N,) and low points weigh more."""
    up = normals.sum(0)
    x, y, z = (up / math.sqrt(up @ up)).tolist()
    flat = math.hypot(x, z)
    along = z / flat, 0.0, -x / flat
    frame = np.array([along, (y * along[2], z * along[0] - x * along[2], -y * along[0]), (x, y, z)])
    terms = np.empty((6, len(points)))
    terms[1:4] = frame @ (points - points.sum(0) / len(points)).T
    height = terms[3].copy()
    terms[0] = 1.0
    terms[1:3] /= np.abs(terms[1:3]).max()
    np.multiply(terms[1], terms[1:3], out=terms[3:5])
    np.multiply(terms[2], terms[2], out=terms[5])
    weight = np.minimum(np.maximum((neighbours - 3) / 5, .05), 1)**2
    for _ in range(_ROUNDS):
        weighted = terms * weight
        residual = height - lapack.dposv(weighted @ terms.T + _RIDGE, weighted @ height)[1] @ terms
        scale = max(SIGMA_PER_MAD * upper_median(np.abs(residual)), _FINEST)
        # high dots may be beyond the edge and lose weight sooner; low dots are only noisy
        square = residual * (1 / scale)
        square *= square
        weight = np.where(residual > 0, 1 / (1 + square)**2, 1 / (1 + square / 4))
    return residual


def contact_score(membrane: Membrane, state: DotLoads) -> np.ndarray:
    """Score (K,) of each dot, from 0, free, to 1, well inside: its load over that further inside, reduced by its height above the face.

    Above 0.5 the dot is in contact. The outermost dots of the grid have no balance and score 0.
    """
    mesh = membrane.mesh
    shape = (mesh.rows, mesh.columns)
    share = load_share(state.load.reshape(shape))
    loaded = share > _HALF
    if not loaded.any():
        return share.ravel()
    heights = heights_over_face(loaded, state.xyz.reshape(*shape, 3), state.normal.reshape(*shape, 3))
    face = 1 - np.nan_to_num(heights) / (2 * _EDGE_HEIGHT * membrane.pitch)
    return _without_single_dots(np.minimum(share, np.clip(face, 0, 1))).ravel()


def _without_single_dots(score: np.ndarray) -> np.ndarray:
    """score (rows, columns) with isolated dots above 0.5 set to 0.5: a single dot is an error of its range."""
    over = score > _HALF
    return np.where(over & (around(over.astype(np.uint8)) == 0), _HALF, score)


def load_share(load: np.ndarray) -> np.ndarray:
    """Load (rows, columns), over the fluid's pressure, as a share of that in full contact, 0 to 1.

    Full contact is 1 under a flat face and 2 to 4 under a ball or an edge: inside a patch at most 1, at its border the mean of the loaded
    neighbours, weighted by their loads because dots beside an edge carry only a spread part of its load.
    """
    loaded = load > _HALF
    if not loaded.any():
        return np.clip(load, 0, 1)
    carried = np.where(loaded, load, 0.0)
    mean = around(carried * carried) / np.maximum(around(carried), 1e-9)
    return np.clip(load / np.where(around(loaded.astype(np.uint8)) == 8, 1.0, np.maximum(mean, 1.0)), 0, 1)


def around(values: np.ndarray) -> np.ndarray:
    """Sum (rows, columns) of values (rows, columns) over the eight neighbours of each dot; nothing outside the grid counts as 0."""
    return cv2.boxFilter(values, -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT) - values
