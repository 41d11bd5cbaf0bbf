# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of a sheet or a dome as a file: fitted numbers of each method, its cross-validation errors, the stiffness of the skin, from
which a model's wrench follows."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..calibration.files.format import CalibrationFile, Specimen, read_calibration, write_calibration
from ..errors import BadCalibration
from .estimate import TouchMethod
from .presses import Presses

UNITS = {'lengths': 'm', 'areas': 'px^2 or their logarithms', 'force': 'N', 'moment': 'N m', 'stitching': 'm and px', 'pattern': 'px',
         'rest': 'px', 'residuals': 'm; normalised squared error and errors of the wrench 1'}
WRENCH, STIFFNESS, STITCHING, METHODS, PATTERN, REST = 'wrench', 'stiffness', 'stitching', 'methods', 'pattern', 'rest'
_PLACE, _DEPTH = 'place_median', 'depth_median'
_AHEAD = {'model': 2.0}  # chosen: a method is preferred unless its errors are larger by more than this factor


@dataclass(frozen=True)
class TouchCalibration:
    """Calibration read from a file.

    methods: fitted numbers by method; stiffness: N/m, of the skin, NaN without recorded wrenches; stitching: fitted numbers, None without
    them; best: method with the smallest cross-validation error, '' for a file with a stitching only; file: the whole content
    pattern: (K, 2) px, untouched positions of markers that form no grid, by which they are identified; None for a grid
    rest: (K, 2) px, untouched positions of all markers, NaN for one never seen; None for a file without them
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
            raise BadCalibration('the calibration holds the stitching alone; record presses at known places and calibrate again')
        if method not in self.methods:
            raise BadCalibration(f'the calibration holds no method {method}; it has {", ".join(self.methods)}; choose one of them')
        return self.methods[method]


def write_touch(path: str | Path, sensor: str, fitted: dict, scores: dict[str, dict], wrench_errors: dict, span: dict,
                left_out: list[str], specimen: Specimen = Specimen(), outliers: Sequence[str] = ()) -> None:
    """Write fitted ({'methods': ..., 'wrench': ..., 'stitching': ..., 'pattern': ..., 'rest': ...}) and the cross-validation scores.

    wrench_errors: median relative errors of the wrench by name, NaN when unknown; span: [lowest, highest] of depth, x, y, m, by name;
    specimen: the sensor; outliers: one line each.
    Raises BadCalibration or OSError as write_calibration does.
    """
    residuals = scores | {WRENCH: wrench_errors}
    write_calibration(path, CalibrationFile(sensor, UNITS, fitted, residuals, span, left_out, serial=specimen.serial,
                                            parameters=specimen.parameters(sensor), outliers=list(outliers)))


def read_touch(path: str | Path, sensor: str, values: Mapping | None = None) -> TouchCalibration:
    """Read a calibration; values: as of read_calibration. Raises BadCalibration for a bad file (read_calibration) and for one with neither
    a method nor a stitching.
    """
    file = read_calibration(path, sensor, values)
    methods, stitching = file.fitted.get(METHODS, {}), file.fitted.get(STITCHING)
    if not isinstance(methods, dict) or not (methods or stitching):
        raise BadCalibration(f'{path}: no touch method under fitted; calibrate again')
    best = best_method(file.residuals, methods) if methods else ''
    pattern = _places(file.fitted, PATTERN, path)
    return TouchCalibration(methods, _stiffness(file.fitted, path), stitching, best, file, pattern, _places(file.fitted, REST, path))


def _stiffness(fitted: dict, path: str | Path) -> float:
    try:
        return float(fitted[WRENCH][STIFFNESS]) if WRENCH in fitted else np.nan
    except (KeyError, TypeError, ValueError):
        raise BadCalibration(f'{path}: no {STIFFNESS} under {WRENCH}; calibrate again') from None


def _places(fitted: dict, name: str, path: str | Path) -> np.ndarray | None:
    if name not in fitted:
        return None
    places = fitted[name]
    if not isinstance(places, np.ndarray) or places.ndim != 2 or places.shape[1] != 2:
        raise BadCalibration(f'{path}: {name} must be an array of pairs of numbers; calibrate again')
    return places.astype(float)


def best_method(residuals: dict, methods) -> str:
    """Method with the smallest cross-validation error: the sum of its median errors of position and depth, each over the smallest of all
    methods, after the penalty for missed and split presses (_typical).

    Medians are used because presses too shallow to be located dominate the mean, and another method misses those altogether. A method
    derived from mechanics is preferred unless it is clearly worse, because presses with one tip do not test other tip sizes or several
    touches.
    """
    known = {name: _typical(residuals[name]) for name in methods if isinstance(residuals.get(name), dict)}
    known = {name: errors for name, errors in known.items() if np.isfinite(errors).all()}
    if not known:
        return next(iter(methods))
    least = np.maximum(np.min(list(known.values()), axis=0), 1e-9)
    return min(known, key=lambda name: float(np.sum(known[name] / least)) / _AHEAD.get(name, 1.0))


def _typical(numbers: dict) -> np.ndarray:
    """Median errors (2,), m, of position and depth over the square of the share of presses estimated as exactly one touch; NaN when
    unknown. A missed press therefore counts more than an inaccurate one.
    """
    errors = np.array([numbers.get(name, np.nan) for name in (_PLACE, _DEPTH)], float)
    presses = numbers.get('presses', 0)
    reported = presses - numbers.get('missed', 0) - numbers.get('split', 0)
    return errors * (presses / reported)**2 if reported > 0 else np.full(2, np.nan)


FEWEST = 6     # presses needed for a fit. Chosen
SHALLOWEST = 0.02  # of the deepest press: shallower presses are left out. Chosen


def fit_stiffness(presses: Presses, method: TouchMethod) -> tuple[float, dict]:
    """The stiffness, N/m, and the median relative errors of force and moment at the presses with a recorded wrench. Raises BadCalibration
    for fewer than FEWEST of these that the method estimates as one touch."""
    deepest = float(presses.depth.max(initial=0.0))
    known = presses.touching & np.isfinite(presses.wrench).all(1) & (presses.wrench[:, 2] < 0) & (presses.depth > SHALLOWEST * deepest)
    presses = presses.select(known)
    found = [(touches[0].wrench, wrench) for touches, wrench in zip(map(method.estimate, presses.fields), presses.wrench)
             if len(touches) == 1 and np.isfinite(touches[0].wrench).all()]
    if len(found) < FEWEST:
        raise BadCalibration(f'{len(found)} presses with a recorded wrench are too few for the stiffness; {FEWEST} are needed')
    estimated, truth = np.swapaxes(found, 0, 1)
    stiffness = float(np.median(truth[:, 2] / estimated[:, 2]))
    return stiffness, {name: _relative(stiffness * estimated[:, part] - truth[:, part], truth[:, part])
                       for name, part in (('force', slice(3)), ('moment', slice(3, 6)))}


def _relative(error: np.ndarray, truth: np.ndarray) -> float:
    """Median relative error over the samples whose truth is at least 5 % of the largest."""
    size = np.linalg.norm(truth, axis=1)
    good = size > 0.05 * size.max()
    return float(np.median(np.linalg.norm(error[good], axis=1) / size[good])) if good.any() else float('nan')
