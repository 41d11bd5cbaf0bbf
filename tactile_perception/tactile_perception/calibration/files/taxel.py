# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of a taxel array as a file."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from ...errors import BadArgument, BadCalibration
from .format import AGAIN, CalibrationFile, Specimen, read_calibration, write_calibration
from ...taxel.array import TaxelArray
from ...taxel.hysteresis import Loop
from ...taxel.response import Response

SENSOR = 'taxel_array'
UNITS = {'scale': 'Pa of the value, of its square, of its knee', 'gain': '1', 'zero, knee': 'values', 'residuals': '1', 'force': 'N',
         'loop': 'share 1, reach Pa, relative 1, relaxation s, late 1, late_s s'}


def write_taxels(path: str | Path, response: Response, residuals: dict, span: dict, left_out: list[str],
                 specimen: Specimen = Specimen(), outliers: Sequence[str] = ()) -> None:
    """Write a response; left_out, outliers: one line each. Raises BadCalibration or OSError as write_calibration does."""
    fitted = {'scale': [float(value) for value in response.scale], 'knee': float(response.knee),
              'loop': {name: np.asarray(value, float).tolist() for name, value in asdict(response.loop).items()}}
    for name in ('gain', 'zero'):
        if getattr(response, name) is not None:
            fitted[name] = np.asarray(getattr(response, name), float)
    write_calibration(path, CalibrationFile(SENSOR, UNITS, fitted, residuals, span, left_out, serial=specimen.serial,
                                            parameters=specimen.parameters(SENSOR), outliers=list(outliers)))


def read_taxels(path: str | Path, array: TaxelArray, values: Mapping | None = None) -> Response:
    """Read the response; values: as of read_calibration. Raises BadCalibration for a bad file (read_calibration) and for an array of
    another size.
    """
    fitted = read_calibration(path, SENSOR, values).fitted
    try:
        maps = {name: np.array(fitted[name], np.float32) for name in ('gain', 'zero') if name in fitted}
        if any(values.shape != array.shape for values in maps.values()):
            raise BadCalibration(f'{path}: for {" x ".join(map(str, next(iter(maps.values())).shape))} taxels, this sensor has '
                                 f'{array.rows} x {array.columns}; give this sensor\'s own file')
        if 'gain' in maps and not (maps['gain'] > 0).all():
            raise ValueError('gain must be positive')
        return Response(tuple(float(value) for value in fitted['scale']), float(fitted['knee']), known=True, **maps,
                        loop=Loop(**{name: tuple(map(float, value)) if isinstance(value, list) else float(value)
                                     for name, value in fitted['loop'].items()}))
    except (AttributeError, KeyError, TypeError, ValueError, BadArgument) as error:
        if isinstance(error, BadCalibration):
            raise
        raise BadCalibration(f'{path}: fitted numbers are missing or wrong ({error}); {AGAIN}') from None
