# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots beside an object's edge that carry part of its line load and yet do not touch: they stand off the object's face.

Along an edge the membrane turns sharply and the object presses in a line. The mesh of dots spreads that line over the dots on both sides of
it, so that load alone calls the outer ones touched. The membrane leaves a face on the object's side: a loaded dot that stands out from the
smooth surface through the others (a paraboloid for each patch, fitted robustly) is beyond the edge.
"""
from __future__ import annotations

import numpy as np
from scipy import ndimage

_EIGHT = np.ones((3, 3))
_SMALLEST_PATCH = 8
_ROUNDS = 6
_FINEST = 1e-5


def heights_over_face(loaded: np.ndarray, xyz: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Heights (rows, columns), m, of loaded dots (rows, columns) bool over the face through the loaded dots around them, outward positive.

    xyz, normal: (rows, columns, 3). NaN for dots that are not loaded and in patches too small to tell a face (less than eight dots).
    """
    heights = np.full(loaded.shape, np.nan)
    if loaded.sum() < _SMALLEST_PATCH:
        return heights
    patches, count = ndimage.label(loaded, _EIGHT)
    crowd = ndimage.correlate(loaded.astype(float), _EIGHT, mode='constant') - 1
    for patch in range(1, count + 1):
        member = patches == patch
        if member.sum() >= _SMALLEST_PATCH:
            heights[member] = _patch_heights(xyz[member], normal[member], crowd[member])
    return heights


def _patch_heights(points: np.ndarray, normals: np.ndarray, crowd: np.ndarray) -> np.ndarray:
    """Heights (N,) of points (N, 3) over a paraboloid that those inside the patch (many neighbours, crowd (N,)) and the lower ones
    determine."""
    up = normals.mean(0)
    up /= np.linalg.norm(up)
    along = np.cross([0.0, 1.0, 0.0], up)
    along /= np.linalg.norm(along)
    offset = points - points.mean(0)
    a, b = offset @ along, offset @ np.cross(up, along)
    size = max(np.abs(a).max(), np.abs(b).max())
    a, b, height = a / size, b / size, offset @ up
    terms = np.stack([np.ones_like(a), a, b, a * a, a * b, b * b], axis=1)
    middle = len(points) // 2
    weight = np.clip((crowd - 3) / 5, .05, 1)**2
    for _ in range(_ROUNDS):
        weighted = terms * weight[:, None]
        matrix = weighted.T @ terms + 1e-6 * np.eye(6)
        residual = height - terms @ np.linalg.solve(matrix, weighted.T @ height)
        scale = max(1.4826 * np.partition(np.abs(residual), middle)[middle], _FINEST)
        # dots that stand out may be beyond the edge and count little; dots below are only noisy
        weight = np.where(residual > 0, 1 / (1 + (residual / scale)**2)**2, 1 / (1 + (residual / scale)**2 / 4))
    return residual
