# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A last look at numbers: dots whose step to a neighbour on the grid is unlike those around it lose theirs.

Where all steps of a dot are off, less is enough: so is one half of two merged dots that stands where the other one is missing.
"""
from __future__ import annotations

import cv2
import numpy as np

AROUND = 5  # rows and columns over which steps are averaged
JUMP = 0.6  # of the step around: a step that differs more joins two dots of which one has a wrong number
BESIDE = 0.25  # of the step around: a dot all of whose steps differ more is not the one that belongs there
_SQUARE = np.ones((3, 3), np.uint8)


def leave_out_jumps(id: np.ndarray, uv: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """id (N,) int64 of dots at uv (N, 2) px on a grid of shape (rows, columns), -1 for dots at either end of a jump and next to one, and
    for dots beside their place."""
    numbered = np.flatnonzero(id >= 0)
    places = np.full(shape[0] * shape[1], np.nan + 0j)
    places[id[numbered]] = uv[numbered, 0] + 1j * uv[numbered, 1]
    places = places.reshape(shape)
    bad, placed = np.zeros(shape, bool), np.zeros(shape, bool)
    for z, ends, held in ((places, bad, placed), (places.T, bad.T, placed.T)):
        off = _off(z[1:] - z[:-1])
        jump, even = off > JUMP, off < BESIDE
        ends[:-1] |= jump
        ends[1:] |= jump
        held[:-1] |= even
        held[1:] |= even
    if bad.any():  # what hangs on the wrong number too
        placed &= cv2.dilate(bad.astype(np.uint8), _SQUARE) == 0
    cleaned = id.copy()
    cleaned[numbered[~placed.ravel()[id[numbered]]]] = -1
    return cleaned


def _off(step: np.ndarray) -> np.ndarray:
    """(...) by how much complex steps (...), NaN where not known, differ from the mean around them, as a share of it."""
    known = np.isfinite(step.real)
    layers = np.stack([np.where(known, step.real, 0), np.where(known, step.imag, 0), known], axis=2)
    sums = cv2.boxFilter(layers, -1, (AROUND, AROUND), normalize=False, borderType=cv2.BORDER_CONSTANT)
    mean = (sums[:, :, 0] + 1j * sums[:, :, 1]) / np.maximum(sums[:, :, 2], 1)
    return np.abs(step - mean) / np.maximum(np.abs(mean), 1e-9)
