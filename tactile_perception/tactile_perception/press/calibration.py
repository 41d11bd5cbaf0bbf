# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of a sheet or a dome: identification of the skin and the tip, and the calibration file.

The file has the fitted numbers of each method, its cross-validation errors, and the stiffness of the skin, which scales the model's wrench.
"""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import TypeVar, get_args, get_origin, get_type_hints

import numpy as np

from ..core.calibration_file import CalibrationFile, read_calibration
from ..core.errors import BadArgument, BadCalibration
from .constants import PRESS
from .estimate import TouchMethod
from .presses import Presses

UNITS = {'lengths': 'm', 'areas': 'px^2 or their logarithms', 'force': 'N', 'moment': 'N m', 'stitching': 'm and px', 'pattern': 'px',
         'rest': 'px', 'residuals': 'm; normalised squared error and errors of the wrench 1'}
WRENCH, STIFFNESS, STITCHING, METHODS, PATTERN, REST = 'wrench', 'stiffness', 'stitching', 'methods', 'pattern', 'rest'
_MEDIANS = 'place_median', 'depth_median'


@dataclass(frozen=True)
class TouchCalibration:
    """Calibration read from a file.

    Attributes
    ----------
    methods : dict
        Fitted numbers by method.
    stiffness : float
        Stiffness of the skin in N/m; NaN without recorded wrenches.
    stitching : dict or None
        Fitted numbers of the stitching; None without them.
    best : str
        Method with the smallest cross-validation error; empty for a file with a stitching only.
    file : CalibrationFile
        The whole content.
    pattern : ndarray, shape (K, 2), or None
        Untouched positions in px of markers that form no grid, by which they are identified; None for a grid.
    rest : ndarray, shape (K, 2), or None
        Untouched positions of all markers in px, NaN for a marker never seen; None for a file without them.
    """

    methods: dict
    stiffness: float
    stitching: dict | None
    best: str
    file: CalibrationFile
    pattern: np.ndarray | None = None
    rest: np.ndarray | None = None

    def fitted(self, method: str) -> dict:
        """Fitted numbers of a method. Raises BadCalibration for a method that was not fitted."""
        if not self.methods:
            raise BadCalibration('the calibration holds the stitching alone; record presses at known positions and calibrate again')
        if method not in self.methods:
            raise BadCalibration(f'the calibration holds no method {method}; it has {", ".join(self.methods)}; choose one of them')
        return self.methods[method]


def read_touch(path: str | Path, sensor: str, values: Mapping | None = None) -> TouchCalibration:
    """Read a calibration.

    values: as in read_calibration. Raises BadCalibration for a bad file (read_calibration) and for one with neither a method nor a
    stitching.
    """
    file = read_calibration(path, sensor, values)
    methods, stitching = file.fitted.get(METHODS, {}), file.fitted.get(STITCHING)
    if not isinstance(methods, dict) or not (methods or stitching):
        raise BadCalibration(f'{path}: no touch method under fitted; calibrate again')
    best = best_method(file.residuals, methods) if methods else ''
    pattern = _positions(file.fitted, PATTERN, path)
    return TouchCalibration(methods, _stiffness(file.fitted, path), stitching, best, file, pattern, _positions(file.fitted, REST, path))


def _stiffness(fitted: dict, path: str | Path) -> float:
    try:
        return float(fitted[WRENCH][STIFFNESS]) if WRENCH in fitted else np.nan
    except (KeyError, TypeError, ValueError):
        raise BadCalibration(f'{path}: no {STIFFNESS} under {WRENCH}; calibrate again') from None


def _positions(fitted: dict, name: str, path: str | Path) -> np.ndarray | None:
    if name not in fitted:
        return None
    positions = fitted[name]
    if not isinstance(positions, np.ndarray) or positions.ndim != 2 or positions.shape[1] != 2:
        raise BadCalibration(f'{path}: {name} must be an array of pairs of numbers; calibrate again')
    return positions.astype(float)


def best_method(residuals: dict, methods) -> str:
    """Select the method with the smallest cross-validation error.

    The error is the sum of the median errors of position and depth, each over the smallest of all methods, after the penalty for missed
    and split presses (_typical).

    Medians are used because presses too shallow to be located dominate the mean, and another method misses those altogether. A method
    derived from mechanics is preferred unless it is clearly worse, because presses with one tip test neither other tip sizes nor several
    contacts.
    """
    known = {name: _typical(residuals[name]) for name in methods if isinstance(residuals.get(name), dict)}
    known = {name: errors for name, errors in known.items() if np.isfinite(errors).all()}
    if not known:
        return next(iter(methods))
    smallest = np.maximum(np.min(list(known.values()), axis=0), 1e-9)
    return min(known, key=lambda name: float(np.sum(known[name] / smallest)) / (PRESS.model_preference if name == 'model' else 1.0))


def _typical(numbers: dict) -> np.ndarray:
    """Median errors (2,), m, of position and depth over the square of the share of presses estimated as exactly one contact.

    A missed press therefore counts more than an inaccurate one. NaN if unknown.
    """
    errors = np.array([numbers.get(name, np.nan) for name in _MEDIANS], float)
    presses = numbers.get('presses', 0)
    reported = presses - numbers.get('missed', 0) - numbers.get('split', 0)
    return errors * (presses / reported)**2 if reported > 0 else np.full(2, np.nan)


def fit_stiffness(presses: Presses, method: TouchMethod) -> tuple[float, dict]:
    """Fit the stiffness, N/m, and compute the median relative errors of force and moment at the presses with a recorded wrench.

    Raises BadCalibration for too few presses that the method estimates as one contact.
    """
    deepest = float(presses.depth.max(initial=0.0))
    known = presses.touching & np.isfinite(presses.wrench).all(1) & (presses.wrench[:, 2] < 0) & \
        (presses.depth > PRESS.min_press_depth * deepest)
    presses = presses.select(known)
    found = [(touches[0].wrench, wrench) for touches, wrench in zip(map(method.estimate, presses.fields), presses.wrench)
             if len(touches) == 1 and np.isfinite(touches[0].wrench).all()]
    if len(found) < PRESS.min_presses:
        raise BadCalibration(f'{len(found)} presses with a recorded wrench are too few for the stiffness; {PRESS.min_presses} are needed')
    estimated, truth = np.swapaxes(found, 0, 1)
    stiffness = float(np.median(truth[:, 2] / estimated[:, 2]))
    return stiffness, {name: _relative(stiffness * estimated[:, part] - truth[:, part], truth[:, part])
                       for name, part in (('force', slice(3)), ('moment', slice(3, 6)))}


def _relative(error: np.ndarray, truth: np.ndarray) -> float:
    """Median relative error over the samples whose truth is at least 5 % of the largest."""
    size = np.linalg.norm(truth, axis=1)
    good = size > 0.05 * size.max()
    return float(np.median(np.linalg.norm(error[good], axis=1) / size[good])) if good.any() else float('nan')


Kind = TypeVar('Kind')


def stored(value):
    """Convert a dataclass, and the dataclasses in it, to a dict by the names of the fields."""
    if is_dataclass(value):
        return {part.name: stored(getattr(value, part.name)) for part in fields(value)}
    return [stored(part) for part in value] if isinstance(value, (list, tuple)) else value


def restored(kind: type[Kind], numbers: Mapping) -> Kind:
    """Inverse of stored, for a dataclass. Raises BadCalibration if a value is missing or invalid."""
    try:
        return _restored(kind, numbers)
    except (KeyError, TypeError, ValueError, AttributeError, BadArgument) as wrong:
        raise BadCalibration(f'{kind.__name__} in the calibration file cannot be read ({wrong!r}); run calibrate again') from wrong


def _restored(kind, value):
    origin = get_origin(kind)
    if origin in (list, tuple):
        return origin(_restored(get_args(kind)[0], part) for part in value)
    if is_dataclass(kind):
        hints = get_type_hints(kind)
        return kind(**{part.name: _restored(hints[part.name], value[part.name]) for part in fields(kind)})
    if kind is np.ndarray:
        array = np.asarray(value)
        return array if array.dtype == np.float32 else array.astype(float)
    return kind(value)


Residuals = Callable[[list[np.ndarray]], list[np.ndarray]]


@dataclass(frozen=True)
class Prior:
    """Prior of V numbers: mean, standard deviation, and bounds, (V,) each."""

    mean: np.ndarray
    sigma: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


def identify(residuals: Residuals, starts: list[np.ndarray], prior: Prior) -> np.ndarray:
    """Find the numbers (V,) of least squares, with the prior, from the best of starts.

    residuals: computes (N,) residuals, in standard deviations, for several sets of numbers at once, so that all cores are busy. A trust
    region in units of the prior limits the steps (scipy.optimize.least_squares). The Jacobian is computed by finite differences at the
    start and then updated from the steps (Broyden 1965), because each evaluation of the residuals simulates presses.
    """
    low, high = ((bound - prior.mean) / prior.sigma for bound in (prior.lower, prior.upper))

    def with_prior(several: list[np.ndarray]) -> list[np.ndarray]:
        """Residuals (N + V,) each, those of the prior last."""
        found = residuals([prior.mean + prior.sigma * units for units in several])
        return [np.append(rest, units) for rest, units in zip(found, several)]

    begin = [np.clip((start - prior.mean) / prior.sigma, low + 1e-6, high - 1e-6) for start in starts]
    tried = with_prior(begin)
    best = int(np.argmin([rest @ rest for rest in tried]))
    start, residual = begin[best], tried[best]
    step = 0.15  # of the finite difference over the prior's standard deviation; simulations converge to less
    steps = np.where(start + step > high, -step, step)
    jacobian = (np.array(with_prior([start + step for step in np.diag(steps)])) - residual).T / steps
    return prior.mean + prior.sigma * _least_squares(lambda units: with_prior([units])[0], start, jacobian, (low, high))


def _least_squares(residual: Callable[[np.ndarray], np.ndarray], start: np.ndarray, jacobian: np.ndarray, bounds: tuple) -> np.ndarray:
    """Minimise the sum of squares of residual; jacobian: at the start."""
    from scipy.optimize import least_squares  # calibration alone needs it
    known, last = {}, []

    def value(units: np.ndarray) -> np.ndarray:
        known[units.tobytes()] = residual(units)
        return known[units.tobytes()]

    def slopes(units: np.ndarray) -> np.ndarray:
        """Update the Jacobian at units whose residual is known."""
        nonlocal jacobian, last
        now = known[units.tobytes()]
        for before, then in last:
            step = units - before
            jacobian = jacobian + np.outer(now - then - jacobian @ step, step) / (step @ step)
        last = [(units.copy(), now)]
        return jacobian

    # A step that gains less than 0.5 % of the cost is the last. The evaluations are in addition to those for the first derivatives.
    return least_squares(value, start, slopes, bounds=bounds, ftol=0.005, xtol=1e-3, max_nfev=10).x


def noise_at_rest(values: list[np.ndarray], default: float, minimum: float) -> float:
    """Compute the standard deviation of values of untouched fields, NaN if unknown, whose own mean is the reference.

    default: result for fewer than two fields; minimum: lower bound of the result.
    """
    if len(values) < 2:
        return default
    return max(float(np.sqrt(np.nanmean(np.square(values)) * len(values) / (len(values) - 1))), minimum)


def excess_sigma(errors: np.ndarray, variances: np.ndarray) -> float:
    """Compute the standard deviation of errors (N, axes) in addition to their variances (N, axes), by the median."""
    return float(np.sqrt(max(np.median(np.mean(errors**2 - variances, axis=1)), 0.0)))
