# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots beside an object's edge that carry part of its line load and yet do not touch: they stand off the object's face.

Along an edge the membrane turns sharply and the object presses in a line. The mesh of dots spreads that line over the dots on both sides of
it, so that load alone calls the outer ones touched. The membrane leaves a face on the object's side: a loaded dot that stands out from the
smooth surface through the others (a paraboloid for each patch, fitted robustly) is beyond the edge.
"""
from __future__ import annotations

import cv2
import numpy as np
from scipy.linalg import lapack

from .grid_surface import cross

_SMALLEST_PATCH = 8
_ROUNDS = 4
_FINEST = 1e-5
_RIDGE = 1e-6 * np.eye(6)


def heights_over_face(loaded: np.ndarray, xyz: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Heights (rows, columns), m, of loaded dots (rows, columns) bool over the face through the loaded dots around them, outward positive.

    xyz, normal: (rows, columns, 3). NaN for dots that are not loaded and in patches too small to tell a face (less than eight dots).
    """
    heights = np.full(loaded.shape, np.nan)
    if loaded.sum() < _SMALLEST_PATCH:
        return heights
    mask = loaded.view(np.uint8)
    count, patches = cv2.connectedComponents(mask)
    crowd = cv2.boxFilter(mask, -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT) - 1.0
    for patch in range(1, count):
        member = np.nonzero(patches == patch)
        if len(member[0]) >= _SMALLEST_PATCH:
            heights[member] = _patch_heights(xyz[member], normal[member], crowd[member])
    return heights


def _patch_heights(points: np.ndarray, normals: np.ndarray, crowd: np.ndarray) -> np.ndarray:
    """Heights (N,) of points (N, 3) over a paraboloid that those inside the patch (many neighbours, crowd (N,)) and the lower ones
    determine."""
    up = normals.mean(0)
    up /= np.sqrt(up @ up)
    along = np.array([up[2], 0.0, -up[0]]) / np.hypot(up[0], up[2])
    a, b, height = ((points - points.mean(0)) @ np.stack([along, cross(up, along), up]).T).T
    size = max(np.abs(a).max(), np.abs(b).max())
    a, b = a / size, b / size
    terms = np.stack([np.ones_like(a), a, b, a * a, a * b, b * b])
    middle = len(points) // 2
    weight = np.clip((crowd - 3) / 5, .05, 1)**2
    for _ in range(_ROUNDS):
        weighted = terms * weight
        found = lapack.dposv(weighted @ terms.T + _RIDGE, weighted @ height)[1]
        residual = height - found @ terms
        scale = max(1.4826 * np.partition(np.abs(residual), middle)[middle], _FINEST)
        # dots that stand out may be beyond the edge and count little; dots below are only noisy
        square = (residual / scale)**2
        weight = np.where(residual > 0, 1 / (1 + square)**2, 1 / (1 + square / 4))
    return residual
