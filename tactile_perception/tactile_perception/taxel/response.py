# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Pressure from a taxel's change of value: a gain for each taxel, a common curve, and the hysteresis of the sensing layer; as a file."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from .._core import taxel as _kernel
from ..core.calibration_file import AGAIN, CalibrationFile, Specimen, read_calibration
from ..core.errors import BadArgument, BadCalibration
from .constants import TAXEL
from .pressure import TaxelArray

SENSOR = 'taxel_array'
UNITS = {'scale': 'Pa of the value, of its square, of its knee', 'gain': '1', 'zero, knee': 'values', 'residuals': '1', 'force': 'N',
         'loop': 'share 1, reach Pa, relative 1, relaxation s, late 1, late_s s'}


@dataclass(frozen=True)
class Loop:
    """Hysteresis of a sensing layer: a part of a load is shown late, and a part of the remainder is held by play with relaxation.

    The held load stays constant until the load differs from it by more than the reach, then follows at that distance (play operator,
    Visintin 1994), and creeps towards a constant load.

    Parameters
    ----------
    share : float
        Share of the held load in the part that is not late; 0 for no loop.
    reach : float
        Largest difference between load and held load in Pa.
    relative : float
        Largest difference over the load, added to reach.
    relaxation : float
        Time constant of the creep towards a constant load in s.
    late : tuple of float
        Parts of a load that are shown late (creep, a chain of Kelvin elements).
    late_s : tuple of float
        Time constant of each late part in s.

    Raises
    ------
    BadArgument
        If a number is out of range.
    """

    share: float = 0.0
    reach: float = 0.0
    relative: float = 0.0
    relaxation: float = 1.0
    late: tuple[float, ...] = ()
    late_s: tuple[float, ...] = ()

    def __post_init__(self):
        if not (0 <= self.share <= TAXEL.max_hidden and 0 <= self.reach < np.inf and 0 <= self.relative <= 1
                and 0 < self.relaxation < np.inf):
            raise BadArgument(f'taxel response: a loop needs a share from 0 to {TAXEL.max_hidden}, a reach of at least 0, a relative reach '
                              f'from 0 to 1 and a positive relaxation, got {self.share}, {self.reach}, {self.relative}, {self.relaxation}')
        if not (len(self.late) == len(self.late_s) and all(0 <= part for part in self.late) and self.at_once >= 1 - TAXEL.max_hidden and
                all(0 < time < np.inf for time in self.late_s)):
            raise BadArgument(f'taxel response: late parts of a loop need a positive time each, and a sum up to {TAXEL.max_hidden}, got '
                              f'{self.late}, {self.late_s}')

    @property
    def is_none(self) -> bool:
        """Whether no part is held or late."""
        return not self.share and not self.late

    @property
    def at_once(self) -> float:
        """Part of a load that is shown at once."""
        return 1 - sum(self.late)

    def width(self, load: float | np.ndarray) -> float | np.ndarray:
        """Largest difference, Pa, between the pressures shown under the same load while it rises to load, Pa, and falls from there."""
        held = 2 * self.share * np.minimum(self.reach + self.relative * load, 0.5 * load)
        return self.at_once * held + sum(self.late) * load

    @property
    def noise_gain(self) -> float:
        """Noise of the compensated loads over that of the shown ones."""
        return (1 + TAXEL.hidden_noise * self.share / (1 - self.share)) / self.at_once

    def shown(self, loads: np.ndarray, intervals: np.ndarray) -> np.ndarray:
        """Pressure (N,), Pa, that the layer shows under consecutive loads (N,), Pa, after intervals (N,), s."""
        found = (1 - self.share) * loads + self.share * self.held(loads, intervals)
        return self.at_once * found + sum(part * followed(loads, intervals, time) for part, time in zip(self.late, self.late_s))

    def held(self, loads: np.ndarray, intervals: np.ndarray) -> np.ndarray:
        """Held load (N,), Pa, under consecutive loads (N,), Pa, after intervals (N,), s."""
        found, held, last = np.empty(len(loads)), 0.0, 0.0
        for k, (load, crept) in enumerate(zip(loads.tolist(), (-np.expm1(-intervals / self.relaxation)).tolist())):
            held += (last - held) * crept
            reach = self.reach + self.relative * max(load, 0.0)
            found[k] = held = min(max(held, load - reach), load + reach)
            last = load
        return found


def followed(loads: np.ndarray, intervals: np.ndarray, time: float) -> np.ndarray:
    """Low-pass filter consecutive loads (N,), after intervals (N,), s, with a time constant, s."""
    found, late, last = np.empty(len(loads)), 0.0, 0.0
    for k, (load, gone) in enumerate(zip(loads.tolist(), (-np.expm1(-intervals / time)).tolist())):
        found[k] = late = late + (last - late) * gone
        last = load
    return found


@dataclass(frozen=True)
class Response:
    """Response curve of a taxel array.

    Parameters
    ----------
    scale : tuple of float
        Coefficients of the curve.
    knee : float
        Change of the value up to which the third term rises.
    gain : ndarray, shape (rows, columns), optional
        Gain of each taxel, mean about 1; 1 by default.
    known : bool
        Whether pressure is in Pa; else it is in the sensor's units.
    zero : ndarray, shape (rows, columns), optional
        Untouched values.
    loop : Loop
        Hysteresis between rising and falling loads.

    Raises
    ------
    BadArgument
        If pressure would not rise with the change of the value.

    Notes
    -----
    pressure = scale[0] c + scale[1] c |c| + scale[2] c knee / (|c| + knee), in Pa, for a change c of the value divided by the gain.
    """

    scale: tuple[float, float, float] = (1.0, 0.0, 0.0)
    knee: float = 1.0
    gain: np.ndarray | None = None
    known: bool = False
    zero: np.ndarray | None = None
    loop: Loop = Loop()

    def __post_init__(self):
        if not (len(self.scale) == 3 and np.isfinite(self.scale).all() and min(self.scale) >= 0 and any(self.scale) and self.knee > 0):
            raise BadArgument(f'taxel response: scale must be three finite numbers, none negative and not all 0, and knee positive, got '
                              f'{self.scale}, {self.knee}')

    def pressure(self, change: np.ndarray) -> np.ndarray:
        """Pressure (rows, columns), float32, in Pa if known, for changes (rows, columns) of the values."""
        return _kernel.response_pressure(np.asarray(change, np.float32), self)


def taxel_file(response: Response, residuals: dict, span: dict, left_out: list[str], specimen: Specimen = Specimen()) -> CalibrationFile:
    """Make the calibration file of a response; left_out: one line each."""
    fitted = {'scale': [float(value) for value in response.scale], 'knee': float(response.knee),
              'loop': {name: np.asarray(value, float).tolist() for name, value in asdict(response.loop).items()}}
    for name in ('gain', 'zero'):
        if getattr(response, name) is not None:
            fitted[name] = np.asarray(getattr(response, name), float)
    return CalibrationFile(SENSOR, UNITS, fitted, residuals, span, left_out, serial=specimen.serial, parameters=specimen.parameters(SENSOR))


def read_taxels(path: str | Path, array: TaxelArray, values: Mapping | None = None) -> Response:
    """Read the response from a calibration file.

    values: as in read_calibration. Raises BadCalibration for a bad file (read_calibration) and for an array of another size.
    """
    fitted = read_calibration(path, SENSOR, values).fitted
    try:
        maps = {name: np.array(fitted[name], np.float32) for name in ('gain', 'zero') if name in fitted}
        if any(values.shape != array.shape for values in maps.values()):
            raise BadCalibration(f'{path}: made for {" x ".join(map(str, next(iter(maps.values())).shape))} taxels, this sensor has '
                                 f'{array.rows} x {array.columns}; give the file of this sensor')
        if 'gain' in maps and not (maps['gain'] > 0).all():
            raise ValueError('gain must be positive')
        return Response(tuple(float(value) for value in fitted['scale']), float(fitted['knee']), known=True, **maps,
                        loop=Loop(**{name: tuple(map(float, value)) if isinstance(value, list) else float(value)
                                     for name, value in fitted['loop'].items()}))
    except (AttributeError, KeyError, TypeError, ValueError, BadArgument) as error:
        if isinstance(error, BadCalibration):
            raise
        raise BadCalibration(f'{path}: fitted numbers are missing or wrong ({error}); {AGAIN}') from None
