# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a reference looks untouched.

At rest the places of a printed grid are a smooth function of row and column, and mirrored through its middle they differ from themselves
only as a tilted view makes them. What is left of either is printing errors, which neighbours do not share; a press leaves what they share.
"""
from __future__ import annotations

import numpy as np

FEWEST = 30  # dots: with fewer, printing errors cannot be told from a press
DEGREE = 5  # of the polynomial in row and column: a lens and a dome are smoother than that, a press is not
SHARED_PART = 0.2  # of the remainder's square that neighbours share
SHARED_SIZE = 0.01  # pitches that neighbours share
ROUNDS, KEPT = 3, 85  # fits, each to the best so many percent of dots: the press is what must not be fitted


def rest_suspicion(id: np.ndarray, uv: np.ndarray, columns: int) -> str:
    """A reason to doubt that dots id (N,) at uv (N, 2) px on a grid of so many columns are untouched; empty if there is none."""
    if len(id) < FEWEST:
        return ''
    places = _on_grid(id, uv, columns)
    steps = np.linalg.norm(np.diff(places, axis=1), axis=2)
    pitch = np.nanmedian(steps) if np.isfinite(steps).any() else np.nan
    mirrored = (places + places[::-1, ::-1]) / 2
    for name, grid, degree, even in (('is not symmetric', mirrored, 2, True), ('has a dent or a bulge', places, _degree(places), False)):
        size, part = _shared(_remainder(grid, degree, even))
        if part > SHARED_PART and size > SHARED_SIZE * pitch:
            return (f'the grid of dots {name} ({size:.2f} px shared by neighbours): was it touched when the reference was taken? '
                    'Release it, then call set_reference')
    return ''


def _on_grid(id, uv, columns) -> np.ndarray:
    """(rows, columns, 2) places, NaN where none, from the first row and column seen to the last: symmetric however much is printed."""
    row, column = np.divmod(id, columns)
    places = np.full((np.ptp(row) + 1, np.ptp(column) + 1, 2), np.nan)
    places[row - row.min(), column - column.min()] = uv
    return places


def _degree(places) -> int:
    return max(1, min(DEGREE, min(places.shape[:2]) - 3))


def _remainder(places, degree, even) -> np.ndarray:
    """places less a robustly fitted polynomial in row and column, of all terms or the even ones."""
    row, column = np.nonzero(np.isfinite(places[:, :, 0]))
    remainder = np.full_like(places, np.nan)
    y, x = (2 * k / max(n - 1, 1) - 1 for k, n in zip((row, column), places.shape))
    terms = [x**i * y**j for i in range(degree + 1) for j in range(degree + 1 - i) if not even or (i + j) % 2 == 0]
    if len(row) < 2 * len(terms):
        return remainder
    basis, values = np.stack(terms, axis=1), places[row, column]
    kept = np.ones(len(row), bool)
    for _ in range(ROUNDS):
        off = values - basis @ np.linalg.lstsq(basis[kept], values[kept], rcond=None)[0]
        distance = np.hypot(off[:, 0], off[:, 1])
        kept = distance <= np.percentile(distance, KEPT)
    remainder[row, column] = off
    return remainder


def _shared(remainder) -> tuple[float, float]:
    """(size px, part) of the remainder that neighbours share: their mean product, against the mean square."""
    products = [(remainder[1:] * remainder[:-1]).sum(axis=2), (remainder[:, 1:] * remainder[:, :-1]).sum(axis=2)]
    products = np.concatenate([p[np.isfinite(p)] for p in products])
    square = np.nanmean((remainder**2).sum(axis=2)) if np.isfinite(remainder).any() else 0.0
    if not len(products) or not square > 0:
        return 0.0, 0.0
    return float(np.sqrt(max(products.mean(), 0.0))), float(products.mean() / square)
