# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Regression of force and depth on the light, and of the light at which the cover touches the waveguide."""
from __future__ import annotations

import numpy as np

from ..errors import BadCalibration

_FEWEST = 12  # contacts. Chosen: 1.5 for each of the 8 coefficients
_SPREAD = 1.3  # largest load over the smallest one. Chosen: less does not determine the slope
LOAD_TERMS = 8  # of features
_RIDGE = 1e-4  # for each contact; keeps the normal equations definite where all light is alike. Chosen
_LEVEL_TERMS = {12: 5, 6: 3, 3: 1}  # presses -> coefficients. Chosen: two presses or more for each
_RISING = 0.35  # of a press's brightest light: a brighter onset was labelled late. Chosen
_USABLE = 0.6  # part of the onsets that must be labelled in time. Chosen


def features(place: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Basis (N, 8) of the logarithm of a load at positions (N, 2), half widths, with light (N,), V."""
    x, y = place.T
    square, log = x * x + y * y, np.log(np.maximum(light, 1e-6))
    return np.column_stack([np.ones(len(place)), log, log * log, square, square * square, x, y, square * log])


def place_part(fitted: np.ndarray, place: np.ndarray) -> np.ndarray:
    """The part (N,) of features @ fitted that depends on the position alone."""
    x, y = place.T
    square = x * x + y * y
    return fitted[0] + fitted[3] * square + fitted[4] * square**2 + fitted[5] * x + fitted[6] * y


def fit_load(place: np.ndarray, light: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, float]:
    """Coefficients (8,) for known loads (N,), N or m, at positions (N, 2) with light (N,), V, and the median leave-one-out relative error.

    Raises BadCalibration for loads that are too few, too much alike or not positive.
    """
    if len(known) < _FEWEST or not (known > 0).all() or known.max() < _SPREAD * known.min():
        raise BadCalibration(f'{len(known)} contacts with known loads from {known.min(initial=np.inf):.3g} to {known.max(initial=0):.3g}; '
                             f'{_FEWEST} are needed, the largest {_SPREAD} times the smallest')
    basis = features(place, light)
    scale = _RIDGE * len(basis) * np.eye(LOAD_TERMS)
    scale[0, 0] = 0.0
    hat = basis @ np.linalg.solve(basis.T @ basis + scale, basis.T)
    fitted = np.linalg.solve(basis.T @ basis + scale, basis.T @ np.log(known))
    error = (np.log(known) - hat @ np.log(known)) / (1 - np.diag(hat)).clip(1e-3)
    return fitted, float(np.median(np.abs(np.expm1(error))))


def fit_touch_level(place: np.ndarray, level: np.ndarray, brightest: np.ndarray, noise: float) -> tuple[np.ndarray, tuple]:
    """Coefficients (terms,) of the light at first contact; its 5th and 95th percentile, V, and the largest distance from the centre.

    level: (N,) V, light at each press's onset at position (N, 2); brightest: (N,) V, of each press; noise: V, of the total. Raises
    BadCalibration where onsets were labelled too late or too early.
    """
    usable = (level > noise) & (level < _RISING * brightest)
    if usable.sum() < max(3, _USABLE * len(level)):
        raise BadCalibration(f'light at the onset: only {usable.sum()} of {len(level)} presses are labelled in time')
    terms = next(t for fewest, t in _LEVEL_TERMS.items() if usable.sum() >= fewest)
    basis = level_basis(place[usable], terms)
    fitted = np.linalg.lstsq(basis, level[usable], rcond=None)[0]
    rest = level[usable] - basis @ fitted
    if np.std(rest) > max(2 * noise, 0.5 * np.median(level[usable])):
        raise BadCalibration(f'light at the onsets differs by {np.std(rest):.3f} V from press to press')
    low, high = np.percentile(level[usable], [5, 95]).tolist()
    return fitted, (low, high, float(np.hypot(*place[usable].T).max()) + 1e-6)


def level_basis(place: np.ndarray, terms: int) -> np.ndarray:
    """Basis (N, terms) of the light at first contact at positions (N, 2)."""
    x, y = place.T
    square = x * x + y * y
    return np.column_stack([np.ones(len(place)), square, square * square, x, y])[:, :terms]
