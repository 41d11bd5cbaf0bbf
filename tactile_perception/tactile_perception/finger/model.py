# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The calibrated model of one finger, as a table for the kernel and as a file.

Map from detector to sphere, light at first contact, force and depth from light, creep of the cover.
"""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from ..calibration.files.format import AGAIN, CalibrationFile, Specimen, fitted_arrays, read_calibration
from ..errors import BadCalibration
from .map import NOMINAL_BETA, EquidistantMap, LightShift, SmoothMap, exp_map, level_basis, tabulated

LOAD_TERMS = 8  # of features
_NOMINAL_DEVIATION = np.pi / 18  # rad, of the uncalibrated map. Chosen: 10 degrees, above the largest error of the paper (6 degrees, fig 8)


@dataclass(frozen=True)
class Creep:
    """share: of a place that comes late; seconds: its time constant."""

    share: float
    seconds: float


def features(place: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Basis (N, 8) of the logarithm of a load at positions (N, 2), half widths, with light (N,), V."""
    x, y = place.T
    square, log = x * x + y * y, np.log(np.maximum(light, 1e-6))
    return np.column_stack([np.ones(len(place)), log, log * log, square, square * square, x, y, square * log])


@dataclass(frozen=True)
class FingerModel:
    """Parameters of one finger; those that were not calibrated are None.

    paper: the equidistant map of the paper; smooth: the map that replaces it, to tangent vectors at the pole, rad; shift: what a contact's
    light adds to it; deviation: rad, standard deviation of the paper's map; reach: half widths, distance from a calibrated contact within
    which positions are in range; level: coefficients of the light at first contact, V; level_limits: its smallest and largest value, V, and
    the largest calibrated distance from the detector's centre, half widths; cross: coefficients of the cross term over the total for a
    single contact; cross_volts: V, standard deviation; force, depth: coefficients of log N and log m (features); room:
    (4,) V, untouched outputs at the calibration; creep: of the cover.
    """

    paper: EquidistantMap = field(default_factory=lambda: EquidistantMap(np.zeros(2), NOMINAL_BETA))
    smooth: SmoothMap | None = None
    shift: LightShift | None = None
    deviation: float = _NOMINAL_DEVIATION
    reach: float = 0.25
    level: np.ndarray | None = None
    level_limits: tuple[float, float, float] = (0.0, np.inf, np.inf)
    cross: np.ndarray | None = None
    cross_volts: float = 0.0
    force: np.ndarray | None = None
    depth: np.ndarray | None = None
    room: np.ndarray | None = None
    creep: Creep | None = None

    def normals(self, place: np.ndarray, light: np.ndarray | None = None) -> np.ndarray:
        """Unit normals (N, 3) at detector positions (N, 2), half widths, of contacts with light (N,), V, None for the typical one."""
        if self.smooth is None:
            return self.paper.normals(place)
        values = self.smooth.values(place)
        if self.shift is not None and light is not None:
            values = values + self.shift.values(place, light)
        return exp_map(values)

    def levels(self, place: np.ndarray) -> np.ndarray:
        """Light at first contact (N,), V, clipped to the calibrated range; NaN without calibration."""
        if self.level is None:
            return np.full(len(place), np.nan)
        low, high, reach = self.level_limits
        inner = place * np.minimum(1.0, reach / np.maximum(np.hypot(*place.T), 1e-9))[:, None]
        return np.clip(level_basis(inner, len(self.level)) @ self.level, low, high)

    @cached_property
    def table(self) -> np.ndarray:
        """Table (nodes, nodes, channels) of the model by detector position, made on first use; channels: src/finger/detector.hpp."""
        return tabulated(self._channels)

    def _channels(self, place: np.ndarray) -> np.ndarray:
        nothing = np.full(len(place), np.nan)
        if self.smooth is None:
            deviation, inside = np.full(len(place), self.deviation), np.ones(len(place))
        else:
            deviation = self.smooth.deviation(place)
            inside = self._inside(place)
        cross = nothing if self.cross is None else cross_basis(place) @ self.cross
        parts = [nothing if fitted is None else features(place, np.ones(len(place))) @ fitted for fitted in (self.force, self.depth)]
        return np.column_stack([self.normals(place), deviation, inside, self.levels(place), cross, *parts, *self._bend(place)])

    def _bend(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Light (N,), V, of typical contacts, and what the normals (N, 3) change by with twice that light, from half to one and a half."""
        if self.shift is None:
            return np.ones(len(place)), np.zeros((len(place), 3))
        light = self.shift.light(place)
        return light, self.normals(place, 1.5 * light) - self.normals(place, 0.5 * light)

    def _inside(self, place: np.ndarray) -> np.ndarray:
        """(N,) 1 where a calibrated contact is within reach, else 0."""
        nearest = np.min([np.square(place - known).sum(axis=1) for known in self.smooth.place], axis=0)
        return (nearest <= self.reach**2).astype(float)

    @cached_property
    def load_terms(self) -> np.ndarray:
        """(2, 8) coefficients of force and depth; NaN where not calibrated."""
        return np.stack([np.full(LOAD_TERMS, np.nan) if fitted is None else fitted for fitted in (self.force, self.depth)])


def cross_basis(place: np.ndarray) -> np.ndarray:
    """Basis (N, 6) of the cross term at detector positions (N, 2)."""
    x, y = place.T
    return np.column_stack([np.ones(len(place)), x, y, x * y, x * x, y * y])


@dataclass(frozen=True)
class FingerFit:
    """model; places: number of positions; errors: (N,) rad, leave-one-out errors, NaN where undetermined; paper_errors: (N,) rad, of the
    equidistant map; residuals: name -> number for the file; span: name -> [lowest, highest]; notes: on what was not determined; normal:
    (N, 3) of the positions; when: (N,) their recordings and times."""

    model: FingerModel
    places: int
    errors: np.ndarray
    paper_errors: np.ndarray
    residuals: dict
    span: dict
    notes: list[str]
    normal: np.ndarray
    when: np.ndarray


SENSOR = 'psd_finger'
UNITS = {'places': 'half widths of the detector', 'angles and errors, slopes': 'rad', 'light, level, room': 'V',
         'typical': 'logarithm of V', 'force': 'logarithm of N', 'depth': 'logarithm of m', 'force_relative, depth_relative': '1',
         'creep': 'share of a place that comes late, and its time constant, s'}
#: Parts of a model by name, and the shapes of their numbers.
_PARTS = {'paper': (EquidistantMap, {'offset': (2,), 'beta': ()}), 'creep': (Creep, {'share': (), 'seconds': ()}),
          'shift': (LightShift, {'typical': (5,), 'slopes': (4, 2)}),
          'smooth': (SmoothMap, {'place': (None, 2), 'slopes': (None, 2), 'weights': (None, 2), 'length': (), 'amplitude': (), 'extra': (),
                                 'noise': (None,)})}
_SHAPES = {'deviation': (), 'reach': (), 'cross_volts': (), 'level': (None,), 'level_limits': (3,), 'cross': (6,), 'force': (8,),
           'depth': (8,), 'room': (4,)}
_NEEDED = 'paper', 'deviation', 'reach', 'cross_volts'


def psd_file(fit: FingerFit, left_out: list[str], specimen: Specimen = Specimen()) -> CalibrationFile:
    """The calibration file of a fit; left_out: one line each."""
    known = {name: getattr(fit.model, name) for name in (*_PARTS, *_SHAPES) if getattr(fit.model, name) is not None}
    fitted = {name: {own: np.asarray(number, float).tolist() for own, number in vars(value).items()} if name in _PARTS else
              np.asarray(value, float).tolist() for name, value in known.items() if name in _PARTS or np.isfinite(value).all()}
    return CalibrationFile(SENSOR, UNITS, fitted, fit.residuals, fit.span, [*fit.notes, *left_out], serial=specimen.serial,
                           parameters=specimen.parameters(SENSOR))


def read_psd(path: str | Path, values: Mapping | None = None) -> FingerModel:
    """Read the model; values: as of read_calibration. Raises BadCalibration for a bad file (read_calibration) and for fitted numbers that
    are missing or of a wrong shape.
    """
    fitted = read_calibration(path, SENSOR, values).fitted
    parts = {name: kind(**fitted_arrays(fitted[name], shapes, path)) for name, (kind, shapes) in _PARTS.items() if name in fitted}
    numbers = fitted_arrays(fitted, {name: shape for name, shape in _SHAPES.items() if name in fitted}, path)
    missing, smooth, creep = set(_NEEDED) - set(fitted), parts.get('smooth'), parts.get('creep', Creep(0.0, 1.0))
    if missing or not (0 <= creep.share < 1 and creep.seconds > 0) or smooth and not (
            len(smooth.place) == len(smooth.weights) == len(smooth.noise) and len(smooth.slopes) in (3, 5)):
        raise BadCalibration(f'{path}: fitted numbers are missing ({", ".join(missing) or "none"}) or do not fit together; {AGAIN}')
    return FingerModel(**parts, **numbers)
