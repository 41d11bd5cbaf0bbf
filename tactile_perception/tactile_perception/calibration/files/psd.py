# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of a PSD finger as a file."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ...errors import BadCalibration
from .format import AGAIN, CalibrationFile, Specimen, read_calibration, write_calibration
from ...psd.creep import Creep
from ...psd.light_shift import LightShift
from ...psd.maps import SmoothMap
from ...psd.model import FingerModel
from ...psd.model_fit import FingerFit
from ...psd.equidistant_map import EquidistantMap

SENSOR = 'psd_finger'
UNITS = {'places': 'half widths of the detector', 'angles and errors, slopes': 'rad', 'light, level, room': 'V',
         'typical': 'logarithm of V', 'force': 'logarithm of N', 'depth': 'logarithm of m', 'force_relative, depth_relative': '1',
         'creep': 'share of a place that comes late, and its time constant, s'}
_ARRAYS = {'level': None, 'cross': (6,), 'force': (8,), 'depth': (8,), 'room': (4,)}
_NUMBERS = ('deviation', 'reach', 'cross_volts', 'shot')
_SMOOTH_NUMBERS, _SMOOTH_ARRAYS = ('length', 'amplitude', 'extra'), ('place', 'slopes', 'weights', 'noise', 'left_out')


def write_psd(path: str | Path, fit: FingerFit, left_out: list[str], specimen: Specimen = Specimen(), outliers: Sequence[str] = ()) -> None:
    """Write a fit; left_out, outliers: one line each. Raises BadCalibration or OSError as write_calibration does."""
    model = fit.model
    fitted = {'paper': {'offset': model.paper.offset.tolist(), 'beta': model.paper.beta}}
    if model.smooth is not None:
        fitted['map'] = {name: float(getattr(model.smooth, name)) for name in _SMOOTH_NUMBERS} | {
            name: getattr(model.smooth, name).tolist() for name in _SMOOTH_ARRAYS}
    if model.shift is not None:
        fitted['light_shift'] = {'typical': model.shift.typical.tolist(), 'slopes': model.shift.slopes.tolist()}
    fitted |= {name: float(getattr(model, name)) for name in _NUMBERS}
    fitted |= {name: np.asarray(getattr(model, name)).tolist() for name in _ARRAYS if getattr(model, name) is not None}
    if model.creep is not None:
        fitted['creep'] = [model.creep.share, model.creep.seconds]
    if model.level is not None:
        fitted['level_limits'] = [float(v) for v in model.level_limits]
    write_calibration(path, CalibrationFile(SENSOR, UNITS, fitted, fit.residuals, fit.span, [*fit.notes, *left_out], serial=specimen.serial,
                                            parameters=specimen.parameters(SENSOR), outliers=list(outliers)))


def read_psd(path: str | Path, values: Mapping | None = None) -> FingerModel:
    """Read the model; values: as of read_calibration. Raises BadCalibration for a bad file (read_calibration) and for fitted numbers that
    are missing or of a wrong shape.
    """
    fitted = read_calibration(path, SENSOR, values).fitted
    try:
        paper = EquidistantMap(_array(fitted['paper']['offset'], (2,)), float(fitted['paper']['beta']))
        smooth = _smooth(fitted['map']) if 'map' in fitted else None
        shift = _shift(fitted['light_shift']) if 'light_shift' in fitted else None
        arrays = {name: _array(fitted[name], shape) for name, shape in _ARRAYS.items() if name in fitted}
        limits = tuple(_array(fitted['level_limits'], (3,)).tolist()) if 'level' in arrays else FingerModel.level_limits
        creep = _creep(fitted['creep']) if 'creep' in fitted else None
        numbers = {name: float(fitted[name]) for name in _NUMBERS}
    except (KeyError, TypeError, ValueError) as error:
        raise BadCalibration(f'{path}: fitted numbers are missing or wrong ({error}); {AGAIN}') from None
    return FingerModel(paper=paper, smooth=smooth, shift=shift, level_limits=limits, creep=creep, **numbers, **arrays)


def _array(values, shape: tuple[int, ...] | None) -> np.ndarray:
    found = np.array(values, float)
    if shape is not None and found.shape != shape or found.ndim == 0:
        raise ValueError(f'shape {found.shape} instead of {shape}')
    return found


def _shift(fitted: dict) -> LightShift:
    return LightShift(_array(fitted['typical'], (5,)), _array(fitted['slopes'], (4, 2)))


def _creep(fitted: list) -> Creep:
    share, seconds = _array(fitted, (2,)).tolist()
    if not (0 <= share < 1 and seconds > 0):
        raise ValueError('creep: the share is from 0 to 1, the time constant above 0')
    return Creep(share, seconds)


def _smooth(fitted: dict) -> SmoothMap:
    place, slopes, weights, noise, left_out = (np.array(fitted[name], float) for name in _SMOOTH_ARRAYS)
    count = len(place)
    pairs, singles = (place, weights), (noise, left_out)
    if any(part.shape != (count, 2) for part in pairs) or any(part.shape != (count,) for part in singles) or \
            slopes.shape not in ((3, 2), (5, 2)):
        raise ValueError('the map of the distortion does not fit together')
    return SmoothMap(place, slopes, weights, *(float(fitted[name]) for name in _SMOOTH_NUMBERS), noise, left_out)
