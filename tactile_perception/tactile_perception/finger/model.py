# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The calibrated model of one finger, as a table for the kernel and as a file.

Map from detector to sphere, light at first contact, force and depth from light, creep of the cover.
"""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path

import numpy as np

from ..core.calibration_file import AGAIN, CalibrationFile, Specimen, fitted_arrays, read_calibration
from ..core.errors import BadCalibration
from .constants import FINGER
from .map import EquidistantMap, LightShift, SmoothMap, exp_map, level_basis, tabulated


@dataclass(frozen=True)
class Creep:
    """Creep of a soft cover.

    Parameters
    ----------
    share : float
        Share of a displacement that the cover shows late.
    seconds : float
        Time constant in s.
    """

    share: float
    seconds: float


def features(spot: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Basis of the logarithm of a load.

    Parameters
    ----------
    spot : ndarray, shape (N, 2)
        Centroids of the light on the detector, in half widths.
    light : ndarray, shape (N,)
        Light of the contacts in V.

    Returns
    -------
    ndarray, shape (N, 8)
    """
    x, y = spot.T
    square, log = x * x + y * y, np.log(np.maximum(light, 1e-6))
    return np.column_stack([np.ones(len(spot)), log, log * log, square, square * square, x, y, square * log])


@dataclass(frozen=True)
class FingerModel:
    """Calibrated model of one finger. What was not calibrated is None.

    Parameters
    ----------
    paper : EquidistantMap
        Map of the paper.
    smooth : SmoothMap, optional
        Map that replaces it, to tangent vectors at the pole in rad.
    shift : LightShift, optional
        What the light of a contact adds to that map.
    deviation : float
        Standard deviation of the paper's map in rad.
    reach : float
        Distance from a calibrated spot within which spots are in range, in half widths of the detector.
    level : ndarray, optional
        Coefficients of the light at first contact in V.
    level_limits : tuple of float
        Its smallest and largest value in V, and the largest calibrated distance from the centre of the detector in half widths.
    cross : ndarray, shape (6,), optional
        Coefficients of the cross term over the total for a single contact.
    cross_volts : float
        Standard deviation of the cross term in V.
    force, depth : ndarray, shape (8,), optional
        Coefficients of the logarithm of a force in N and of a depth in m (`features`).
    room : ndarray, shape (4,), optional
        Untouched outputs at the calibration in V.
    creep : Creep, optional
        Creep of the cover.

    Examples
    --------
    >>> FingerModel().normals(np.zeros((1, 2)))  # without a calibration the pole is at the centre of the detector
    array([[0., 0., 1.]])
    """

    paper: EquidistantMap = field(default_factory=lambda: EquidistantMap(np.zeros(2), FINGER.nominal_beta))
    smooth: SmoothMap | None = None
    shift: LightShift | None = None
    deviation: float = np.pi / 18  # rad, of the uncalibrated map: above the largest error of the paper (6 degrees, fig 8)
    reach: float = 0.25
    level: np.ndarray | None = None
    level_limits: tuple[float, float, float] = (0.0, np.inf, np.inf)
    cross: np.ndarray | None = None
    cross_volts: float = 0.0
    force: np.ndarray | None = None
    depth: np.ndarray | None = None
    room: np.ndarray | None = None
    creep: Creep | None = None

    def normals(self, spot: np.ndarray, light: np.ndarray | None = None) -> np.ndarray:
        """Compute the normals of contacts.

        Parameters
        ----------
        spot : ndarray, shape (N, 2)
            Centroids of the light on the detector, in half widths.
        light : ndarray, shape (N,), optional
            Light of the contacts in V; by default that of a typical contact.

        Returns
        -------
        ndarray, shape (N, 3)
            Unit vectors.
        """
        if self.smooth is None:
            return self.paper.normals(spot)
        values = self.smooth.values(spot)
        if self.shift is not None and light is not None:
            values = values + self.shift.values(spot, light)
        return exp_map(values)

    def levels(self, spot: np.ndarray) -> np.ndarray:
        """Light at first contact.

        Parameters
        ----------
        spot : ndarray, shape (N, 2)
            Centroids of the light on the detector, in half widths.

        Returns
        -------
        ndarray, shape (N,)
            In V, clipped to the calibrated range; NaN without a calibration.
        """
        if self.level is None:
            return np.full(len(spot), np.nan)
        low, high, reach = self.level_limits
        inner = spot * np.minimum(1.0, reach / np.maximum(np.hypot(*spot.T), 1e-9))[:, None]
        return np.clip(level_basis(inner, len(self.level)) @ self.level, low, high)

    @cached_property
    def table(self) -> np.ndarray:
        """Table (nodes, nodes, channels) of the model by spot, made on first use; channels: src/finger/detector.hpp."""
        return tabulated(self._channels)

    def _channels(self, spot: np.ndarray) -> np.ndarray:
        nothing = np.full(len(spot), np.nan)
        if self.smooth is None:
            deviation, inside = np.full(len(spot), self.deviation), np.ones(len(spot))
        else:
            deviation = self.smooth.deviation(spot)
            inside = self._inside(spot)
        cross = nothing if self.cross is None else cross_basis(spot) @ self.cross
        parts = [nothing if fitted is None else features(spot, np.ones(len(spot))) @ fitted for fitted in (self.force, self.depth)]
        return np.column_stack([self.normals(spot), deviation, inside, self.levels(spot), cross, *parts, *self._bend(spot)])

    def _bend(self, spot: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Light (N,), V, of typical contacts, and the change of the normals (N, 3) from half to one and a half of that light."""
        if self.shift is None:
            return np.ones(len(spot)), np.zeros((len(spot), 3))
        light = self.shift.light(spot)
        return light, self.normals(spot, 1.5 * light) - self.normals(spot, 0.5 * light)

    def _inside(self, spot: np.ndarray) -> np.ndarray:
        """(N,) 1 where a calibrated contact is within reach, else 0."""
        nearest = np.min([np.square(spot - known).sum(axis=1) for known in self.smooth.spot], axis=0)
        return (nearest <= self.reach**2).astype(float)

    @cached_property
    def load_terms(self) -> np.ndarray:
        """(2, 8) coefficients of force and depth; NaN where not calibrated."""
        return np.stack([np.full(FINGER.load_terms, np.nan) if fitted is None else fitted for fitted in (self.force, self.depth)])


def cross_basis(spot: np.ndarray) -> np.ndarray:
    """Basis of the cross term.

    Parameters
    ----------
    spot : ndarray, shape (N, 2)
        Centroids of the light on the detector, in half widths.

    Returns
    -------
    ndarray, shape (N, 6)
    """
    x, y = spot.T
    return np.column_stack([np.ones(len(spot)), x, y, x * y, x * x, y * y])


@dataclass(frozen=True)
class FingerFit:
    """Result of a calibration.

    Parameters
    ----------
    model : FingerModel
        Fitted model.
    positions : int
        Number of calibrated positions.
    errors, paper_errors : ndarray, shape (N,)
        Leave-one-out errors of the map, and errors of the equidistant map, in rad.
    residuals : dict
        Name to number for the calibration file.
    span : dict
        Name to [lowest, highest].
    notes : list of str
        On what was not determined.
    normal : ndarray, shape (N, 3)
        Normals of the positions.
    when : ndarray, shape (N,)
        Recording and time of each.
    """

    model: FingerModel
    positions: int
    errors: np.ndarray
    paper_errors: np.ndarray
    residuals: dict
    span: dict
    notes: list[str]
    normal: np.ndarray
    when: np.ndarray


SENSOR = 'psd_finger'
UNITS = {'spots': 'half widths of the detector', 'angles and errors, slopes': 'rad', 'light, level, room': 'V',
         'typical': 'logarithm of V', 'force': 'logarithm of N', 'depth': 'logarithm of m', 'force_relative, depth_relative': '1',
         'creep': 'share of a displacement that the cover shows late, and its time constant, s'}
#: Parts of a model by name, and the shapes of their numbers.
_PARTS = {'paper': (EquidistantMap, {'offset': (2,), 'beta': ()}), 'creep': (Creep, {'share': (), 'seconds': ()}),
          'shift': (LightShift, {'typical': (5,), 'slopes': (4, 2)}),
          'smooth': (SmoothMap, {'spot': (None, 2), 'slopes': (None, 2), 'weights': (None, 2), 'length': (), 'amplitude': (), 'extra': (),
                                 'noise': (None,)})}
_SHAPES = {'deviation': (), 'reach': (), 'cross_volts': (), 'level': (None,), 'level_limits': (3,), 'cross': (6,), 'force': (8,),
           'depth': (8,), 'room': (4,)}
_NEEDED = 'paper', 'deviation', 'reach', 'cross_volts'


def psd_file(fit: FingerFit, left_out: list[str], specimen: Specimen = Specimen()) -> CalibrationFile:
    """Make the calibration file of a fit.

    Parameters
    ----------
    fit : FingerFit
        Result of the calibration.
    left_out : list of str
        One line for each press that was left out.
    specimen : Specimen
        Serial number and parameters of the finger.

    Returns
    -------
    CalibrationFile
    """
    known = {name: getattr(fit.model, name) for name in (*_PARTS, *_SHAPES) if getattr(fit.model, name) is not None}
    fitted = {name: {own.name: np.asarray(getattr(value, own.name), float).tolist() for own in fields(value)} if name in _PARTS else
              np.asarray(value, float).tolist() for name, value in known.items() if name in _PARTS or np.isfinite(value).all()}
    return CalibrationFile(SENSOR, UNITS, fitted, fit.residuals, fit.span, [*fit.notes, *left_out], serial=specimen.serial,
                           parameters=specimen.parameters(SENSOR))


def read_psd(path: str | Path, values: Mapping | None = None) -> FingerModel:
    """Read the model of a finger from a calibration file.

    Parameters
    ----------
    path : str or Path
        File that `calibrate` wrote.
    values : Mapping, optional
        Parameters of the node; a difference from those of the calibration is a warning.

    Returns
    -------
    FingerModel

    Raises
    ------
    BadCalibration
        If the file cannot be used, or numbers are missing or of a wrong shape.
    """
    fitted = read_calibration(path, SENSOR, values).fitted
    parts = {name: kind(**fitted_arrays(fitted[name], shapes, path)) for name, (kind, shapes) in _PARTS.items() if name in fitted}
    numbers = fitted_arrays(fitted, {name: shape for name, shape in _SHAPES.items() if name in fitted}, path)
    missing, smooth, creep = set(_NEEDED) - set(fitted), parts.get('smooth'), parts.get('creep', Creep(0.0, 1.0))
    if missing or not (0 <= creep.share < 1 and creep.seconds > 0) or smooth and not (
            len(smooth.spot) == len(smooth.weights) == len(smooth.noise) and len(smooth.slopes) in (3, 5)):
        raise BadCalibration(f'{path}: fitted numbers are missing ({", ".join(missing) or "none"}) or do not fit together; {AGAIN}')
    return FingerModel(**parts, **numbers)
