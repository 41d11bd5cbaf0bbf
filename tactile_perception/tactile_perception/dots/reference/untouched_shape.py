# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Plausibility of a reference as untouched, by the shape of the printed grid alone.

An untouched grid is a smooth function of row and column and, up to the tilt of the view, point symmetric. The residuals are printing
errors, which are independent between neighbours; a press leaves residuals that are correlated.
"""
from __future__ import annotations

import numpy as np

FEWEST = 30  # dots. Chosen
DEGREE = 5  # of the polynomial in row and column. Chosen: fits a lens and a dome, not a press
SHARED_PART = 0.2  # correlation of neighbours' residuals, beyond which a press is suspected. Chosen
SHARED_SIZE = 0.01  # pitches, and its least size. Chosen
ROUNDS, KEPT = 3, 85  # fits, and percent of the dots with the least residuals that each uses, to exclude a press. Chosen


def rest_suspicion(id: np.ndarray, uv: np.ndarray, columns: int) -> str:
    """Why dots id (N,) at uv (N, 2) px on a grid with that many columns may be touched; empty if nothing suggests it."""
    if len(id) < FEWEST:
        return ''
    places = _on_grid(id, uv, columns)
    steps = np.linalg.norm(np.diff(places, axis=1), axis=2)
    pitch = np.nanmedian(steps) if np.isfinite(steps).any() else np.nan
    mirrored = (places + places[::-1, ::-1]) / 2
    for name, grid, degree, even in (('is not symmetric', mirrored, 2, True), ('has a dent or a bulge', places, _degree(places), False)):
        size, part = _shared(_residual(grid, degree, even))
        if part > SHARED_PART and size > SHARED_SIZE * pitch:
            return (f'the grid of dots {name} ({size:.2f} px shared by neighbours): it may have been touched when the reference was taken. '
                    'Release it, then call set_reference')
    return ''


def _on_grid(id, uv, columns) -> np.ndarray:
    """(rows, columns, 2) positions, NaN where none, from the first to the last row and column seen."""
    row, column = np.divmod(id, columns)
    places = np.full((np.ptp(row) + 1, np.ptp(column) + 1, 2), np.nan)
    places[row - row.min(), column - column.min()] = uv
    return places


def _degree(places) -> int:
    return max(1, min(DEGREE, min(places.shape[:2]) - 3))


def _residual(places, degree, even) -> np.ndarray:
    """Residuals of a robust polynomial fit of places in row and column, of all terms or the even ones."""
    row, column = np.nonzero(np.isfinite(places[:, :, 0]))
    residual = np.full_like(places, np.nan)
    y, x = (2 * k / max(n - 1, 1) - 1 for k, n in zip((row, column), places.shape))
    terms = [x**i * y**j for i in range(degree + 1) for j in range(degree + 1 - i) if not even or (i + j) % 2 == 0]
    if len(row) < 2 * len(terms):
        return residual
    basis, values = np.stack(terms, axis=1), places[row, column]
    kept = np.ones(len(row), bool)
    for _ in range(ROUNDS):
        off = values - basis @ np.linalg.lstsq(basis[kept], values[kept], rcond=None)[0]
        distance = np.hypot(off[:, 0], off[:, 1])
        kept = distance <= np.percentile(distance, KEPT)
    residual[row, column] = off
    return residual


def _shared(residual) -> tuple[float, float]:
    """(size, px, and correlation) of the residuals of neighbours: mean product, over the mean square."""
    products = [(residual[1:] * residual[:-1]).sum(axis=2), (residual[:, 1:] * residual[:, :-1]).sum(axis=2)]
    products = np.concatenate([p[np.isfinite(p)] for p in products])
    square = np.nanmean((residual**2).sum(axis=2)) if np.isfinite(residual).any() else 0.0
    if not len(products) or not square > 0:
        return 0.0, 0.0
    return float(np.sqrt(max(products.mean(), 0.0))), float(products.mean() / square)
