# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots beside an object's edge that carry part of its line load and yet do not touch: they stand off the object's face.

Along an edge the membrane turns sharply and the object presses in a line. The mesh of dots spreads that line over the dots on both sides of
it, so that load alone calls the outer ones touched. The membrane leaves a face on the object's side: a loaded dot that stands out from the
smooth surface through the others (a paraboloid for each patch, fitted robustly) is beyond the edge.
"""
from __future__ import annotations

import math

import cv2
import numpy as np
from scipy.linalg import lapack

_SMALLEST_PATCH = 8
_ROUNDS = 4
_FINEST = 1e-5
_RIDGE = 1e-6 * np.eye(6)


def heights_over_face(loaded: np.ndarray, xyz: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Heights (rows, columns), m, of loaded dots (rows, columns) bool over the face through the loaded dots around them, outward positive.

    xyz, normal: (rows, columns, 3). NaN for dots that are not loaded and in patches too small to tell a face (less than eight dots).
    """
    heights = np.full(loaded.size, np.nan)
    mask = loaded.view(np.uint8)
    count, patches = cv2.connectedComponents(mask)
    patches, points, normals = patches.ravel(), xyz.reshape(-1, 3), normal.reshape(-1, 3)
    crowd = cv2.boxFilter(mask, -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT).ravel()
    for patch in range(1, count):
        member = np.flatnonzero(patches == patch)
        if len(member) >= _SMALLEST_PATCH:
            heights[member] = _patch_heights(points.take(member, axis=0), normals.take(member, axis=0), crowd.take(member) - 1.0)
    return heights.reshape(loaded.shape)


def _patch_heights(points: np.ndarray, normals: np.ndarray, crowd: np.ndarray) -> np.ndarray:
    """Heights (N,) of points (N, 3) over a paraboloid that those inside the patch (many neighbours, crowd (N,)) and the lower ones
    determine."""
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
    middle = len(points) // 2
    weight = np.minimum(np.maximum((crowd - 3) / 5, .05), 1)**2
    for _ in range(_ROUNDS):
        weighted = terms * weight
        residual = height - lapack.dposv(weighted @ terms.T + _RIDGE, weighted @ height)[1] @ terms
        scale = max(1.4826 * float(np.partition(np.abs(residual), middle)[middle]), _FINEST)
        # dots that stand out may be beyond the edge and count little; dots below are only noisy
        square = residual * (1 / scale)
        square *= square
        weight = np.where(residual > 0, 1 / (1 + square)**2, 1 / (1 + square / 4))
    return residual
