# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Quantities compared, their units, and the statistics of their errors."""
from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

_BINS = 12  # chosen: intervals of time in the statistics over time
_CELLS = 5  # chosen: cells along the longer side of the touched surface


@dataclass(frozen=True)
class Quantity:
    """text: description; unit: for display; factor: display units per SI unit; low: whether low values are good; signed: whether errors
    keep their sign, so that a bias is reported.
    """

    text: str
    unit: str
    factor: float
    low: bool = True
    signed: bool = False


QUANTITIES = {
    'place': Quantity('place of the touch', 'mm', 1e3),
    'depth': Quantity('depth of the touch', 'mm', 1e3, signed=True),
    'normal': Quantity('normal of the touched surface', 'degrees', 180 / np.pi),
    'touch_force': Quantity('normal force of the touch', 'N', 1.0, signed=True),
    'region_overlap': Quantity('overlap of the regions (intersection over union)', '1', 1.0, low=False),
    'region_area': Quantity('area of the region', '% of it', 100.0, signed=True),
    'region_centroid': Quantity('centroid of the region', 'mm', 1e3),
    'slipping_fraction': Quantity('part of the contact that slips', '%', 100.0, signed=True),
    'slip_velocity': Quantity('velocity of the slip', 'mm/s', 1e3),
    'force': Quantity('force of the wrench', 'N', 1.0),
    'force_relative': Quantity('force of the wrench', '% of it', 100.0),
    'moment': Quantity('moment of the wrench', 'N mm', 1e3),
    'moment_relative': Quantity('moment of the wrench', '% of it', 100.0),
}


@dataclass
class Errors:
    """Errors of one quantity, SI units. rows: (stamp s, x m, y m of the contact, error); untold: number of frames without an estimate."""

    rows: list[tuple[float, float, float, float]] = field(default_factory=list)
    untold: int = 0

    def add(self, stamp: float, place: np.ndarray, error: float) -> None:
        """Add an error; NaN: no estimate. place: (2,) m."""
        if np.isnan(error):
            self.untold += 1
        else:
            self.rows.append((stamp, *place.tolist(), float(error)))

    def table(self) -> np.ndarray:
        """The rows as (N, 4)."""
        return np.array(self.rows, float).reshape(-1, 4)


def spread(values: np.ndarray, quantity: Quantity) -> dict[str, float]:
    """Statistics of errors (N,), in the quantity's unit: median, within_95 (95 % of the errors are no worse), worst and count of the
    absolute errors; for a signed quantity also bias, the median of the signed errors. NaN without errors.
    """
    found = {'median': np.nan, 'within_95': np.nan, 'worst': np.nan, 'count': len(values)}
    if len(values):
        sizes = quantity.factor * np.abs(values)
        middle, most = np.percentile(sizes, [50, 95 if quantity.low else 5])
        found.update(median=float(middle), within_95=float(most), worst=float(sizes.max() if quantity.low else sizes.min()))
        if quantity.signed:
            found['bias'] = float(quantity.factor * np.median(values))
    return found


def over_time(table: np.ndarray, quantity: Quantity) -> list[dict[str, float]]:
    """Statistics (spread) of each of _BINS intervals that has errors, with its begin and end, s. table: (N, 4)."""
    if not len(table):
        return []
    edges = np.linspace(table[:, 0].min(), table[:, 0].max(), _BINS + 1)
    which = np.clip(np.searchsorted(edges, table[:, 0], side='right') - 1, 0, _BINS - 1)
    return [{'from_s': float(edges[k]), 'to_s': float(edges[k + 1]), **spread(table[which == k, 3], quantity)} for k in np.unique(which)]


def over_surface(table: np.ndarray, quantity: Quantity) -> list[dict[str, float]]:
    """Statistics (spread) of each square cell that has errors, with its centre, mm. table: (N, 4)."""
    known = table[np.isfinite(table[:, 1:3]).all(axis=1)]
    if not len(known):
        return []
    low = known[:, 1:3].min(axis=0)
    side = max(float(np.ptp(known[:, 1:3], axis=0).max()) / _CELLS, 1e-6)
    cell = np.minimum(((known[:, 1:3] - low) / side).astype(int), _CELLS - 1)
    return [{'x_mm': 1e3 * float(low[0] + (x + 0.5) * side), 'y_mm': 1e3 * float(low[1] + (y + 0.5) * side),
             **spread(known[(cell == (x, y)).all(axis=1), 3], quantity)} for x, y in np.unique(cell, axis=0).tolist()]
