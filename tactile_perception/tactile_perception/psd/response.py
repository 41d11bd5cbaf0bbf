# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the light tells besides the place: force and depth of a contact, and at which light the cover touches the waveguide."""
from __future__ import annotations

import math

import numpy as np

from ..errors import BadCalibration

_LARGEST_LOG = 50.0
_FEWEST = 12  # contacts, of three loads or more
_SPREAD = 1.3  # largest load over the smallest one
_TERMS = 8
_LEVEL_TERMS = {12: 5, 6: 3, 3: 1}  # presses -> terms: more where there are more
_RISING = 0.35  # of a press's light: an onset that is brighter was noted late


def features(place: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Basis (N, 8) of a load's logarithm at places (N, 2), half widths, and light (N,), V."""
    x, y = place.T
    square, log = x * x + y * y, np.log(np.maximum(light, 1e-6))
    return np.column_stack([np.ones(len(place)), log, log * log, square, square * square, x, y, square * log])


def place_part(fitted: np.ndarray, place: np.ndarray) -> np.ndarray:
    """What of features @ fitted depends on the place alone, (N,)."""
    x, y = place.T
    square = x * x + y * y
    return fitted[0] + fitted[3] * square + fitted[4] * square**2 + fitted[5] * x + fitted[6] * y


def load(fitted: np.ndarray, at_place: float, square: float, light: float) -> float:
    """The load for light, V, where place_part is at_place and the squared distance to the centre is square."""
    log = math.log(max(light, 1e-6))
    return math.exp(min(at_place + (fitted[1] + fitted[7] * square + fitted[2] * log) * log, _LARGEST_LOG))


def fit_load(place: np.ndarray, light: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, float]:
    """Coefficients (8,) for loads known (N,) of places (N, 2) with light (N,), and the median relative error of those left out one by
    one. Raises BadCalibration for loads that are too few, too much alike or not positive."""
    if len(known) < _FEWEST or not (known > 0).all() or known.max() < _SPREAD * known.min():
        raise BadCalibration(f'{len(known)} contacts with known loads from {known.min(initial=np.inf):.3g} to {known.max(initial=0):.3g}; '
                             f'{_FEWEST} are needed, the largest {_SPREAD} times the smallest')
    basis = features(place, light)
    scale = 1e-4 * len(basis) * np.eye(_TERMS)
    scale[0, 0] = 0.0
    hat = basis @ np.linalg.solve(basis.T @ basis + scale, basis.T)
    fitted = np.linalg.solve(basis.T @ basis + scale, basis.T @ np.log(known))
    error = (np.log(known) - hat @ np.log(known)) / (1 - np.diag(hat)).clip(1e-3)
    return fitted, float(np.median(np.abs(np.expm1(error))))


def fit_touch_level(place: np.ndarray, level: np.ndarray, brightest: np.ndarray, noise: float) -> tuple[np.ndarray, tuple]:
    """Coefficients (terms,) of the light at which the waveguide is touched, the range of the levels, V, and how far out they were.

    level: (N,) light at each press's onset at place (N, 2); brightest: (N,) light when pressed; noise: V, of the total. Raises
    BadCalibration where the onsets were noted too late or too early to tell.
    """
    usable = (level > noise) & (level < _RISING * brightest)
    if usable.sum() < max(3, 0.6 * len(level)):
        raise BadCalibration(f'light at the onset of {len(level)} presses is not told by their ground truth ({usable.sum()} usable)')
    terms = next(t for fewest, t in _LEVEL_TERMS.items() if usable.sum() >= fewest)
    basis = level_basis(place[usable], terms)
    fitted = np.linalg.lstsq(basis, level[usable], rcond=None)[0]
    rest = level[usable] - basis @ fitted
    if np.std(rest) > max(2 * noise, 0.5 * np.median(level[usable])):
        raise BadCalibration(f'light at the onsets differs by {np.std(rest):.3f} V from press to press')
    low, high = np.percentile(level[usable], [5, 95]).tolist()
    return fitted, (low, high, float(np.hypot(*place[usable].T).max()) + 1e-6)


def level_basis(place: np.ndarray, terms: int) -> np.ndarray:
    """Basis (N, terms) of the light at touch."""
    x, y = place.T
    square = x * x + y * y
    return np.column_stack([np.ones(len(place)), square, square * square, x, y])[:, :terms]
