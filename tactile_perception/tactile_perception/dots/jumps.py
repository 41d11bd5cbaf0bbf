# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A last look at numbers: dots whose step to a neighbour on the grid is unlike those around it lose theirs."""
from __future__ import annotations

import cv2
import numpy as np

AROUND = 5  # rows and columns over which steps are averaged
JUMP = 0.6  # of the step around: a step that differs more joins two dots of which one has a wrong number


def leave_out_jumps(id: np.ndarray, uv: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """id (N,) int64 of dots at uv (N, 2) px on a grid of shape (rows, columns), -1 for dots at either end of a jump and next to one."""
    numbered = np.flatnonzero(id >= 0)
    places = np.full((shape[0] * shape[1], 2), np.nan)
    places[id[numbered]] = uv[numbered]
    places = places.reshape(*shape, 2)
    bad = np.zeros(shape, bool)
    for axis in (0, 1):
        jump = _jumps(np.diff(places, axis=axis))
        bad[tuple(slice(None, -1) if k == axis else slice(None) for k in (0, 1))] |= jump
        bad[tuple(slice(1, None) if k == axis else slice(None) for k in (0, 1))] |= jump
    near = cv2.dilate(bad.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)  # what hangs on the wrong number too
    cleaned = id.copy()
    cleaned[numbered[near.ravel()[id[numbered]]]] = -1
    return cleaned


def _jumps(step: np.ndarray) -> np.ndarray:
    """(...) bool of steps (..., 2), NaN where not known: those unlike the mean around them."""
    known = np.isfinite(step[:, :, 0])
    layers = np.dstack([np.where(known[:, :, None], step, 0), known])
    sums = cv2.boxFilter(layers, -1, (AROUND, AROUND), normalize=False, borderType=cv2.BORDER_CONSTANT)
    mean = sums[:, :, :2] / np.maximum(sums[:, :, 2:], 1)
    off = np.hypot(*np.moveaxis(np.where(known[:, :, None], step - mean, 0), 2, 0))
    return off > JUMP * np.hypot(mean[:, :, 0], mean[:, :, 1])
