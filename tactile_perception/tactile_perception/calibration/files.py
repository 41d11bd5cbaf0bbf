# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration files: YAML with date, sensor, units, what was fitted, residuals, the calibrated range and what was left out."""
from __future__ import annotations

import datetime
import math
import os
from dataclasses import dataclass, field
from pathlib import Path

import yaml

from ..errors import BadCalibration

FORMAT = 'tactile calibration 1'
SECTIONS = {'sensor': str, 'date': str, 'units': dict, 'fitted': dict, 'residuals': dict, 'calibrated_range': dict, 'left_out': list}
AGAIN = 'run `ros2 run tactile_perception calibrate` again'
_DIGITS = 7  # significant, of each number written
_LOADER = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)  # in C it takes a tenth of the time


class _Dumper(yaml.SafeDumper):
    """Writes a list of numbers on as few lines as it takes."""

    def numbers_in_lines(self, values: list):
        """The list, in brackets where it holds numbers."""
        flow = bool(values) and all(isinstance(value, (int, float)) for value in values)
        return self.represent_sequence('tag:yaml.org,2002:seq', values, flow_style=flow)


_Dumper.add_representer(list, _Dumper.numbers_in_lines)


@dataclass
class CalibrationFile:
    """What a calibration file holds.

    sensor: type as in the sensor's launch file (touchpad ...); units: name of a number -> unit; fitted: numbers, lists of
    numbers or dictionaries of them; residuals: name -> number (NaN: not known); calibrated_range: name -> [lowest, highest];
    left_out: a line each; date: UTC.
    """

    sensor: str
    units: dict
    fitted: dict
    residuals: dict
    calibrated_range: dict
    left_out: list = field(default_factory=list)
    date: str = field(default_factory=lambda: datetime.datetime.now(datetime.timezone.utc).strftime('%Y-%m-%dT%H:%M:%SZ'))


def write_calibration(path: str | Path, content: CalibrationFile) -> None:
    """Write content to path, whole or not at all (a temporary file beside it, then renamed).

    Raises BadCalibration where a fitted number is not finite, OSError where the file cannot be written.
    """
    path = Path(path)
    check_numbers(content.fitted, 'fitted', path)
    page = {'format': FORMAT} | {name: _rounded(getattr(content, name)) for name in SECTIONS} | {'complete': True}
    partial = path.with_name(path.name + '.partial')
    partial.write_text(yaml.dump(page, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=120), encoding='utf-8')
    os.replace(partial, path)


def _rounded(value):
    """value with the digits that are written; tuples as lists."""
    if isinstance(value, dict):
        return {key: _rounded(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_rounded(part) for part in value]
    return float(f'{value:.{_DIGITS}g}') if isinstance(value, float) else value


def read_calibration(path: str | Path, sensor: str) -> CalibrationFile:
    """Content of the calibration file at path, for that sensor type.

    Raises BadCalibration, saying what is wrong and what to do, where the file is missing, truncated, no calibration, for another sensor
    type, or holds a fitted number that is not finite.
    """
    path = Path(path)
    page = _parse(path)
    if page.get('format') != FORMAT:
        raise BadCalibration(f'{path}: format is {page.get("format")!r}, not {FORMAT!r}: no calibration file of this software; {AGAIN}')
    missing = [name for name, kind in SECTIONS.items() if not isinstance(page.get(name), kind)]
    if missing or page.get('complete') is not True:
        raise BadCalibration(f'{path}: truncated or edited: no usable {", ".join(missing or ["end mark"])}; {AGAIN}')
    if page['sensor'] != sensor:
        raise BadCalibration(f'{path}: for sensor type {page["sensor"]!r}, this is {sensor!r}; give this sensor\'s own file')
    check_numbers(page['fitted'], 'fitted', path)
    return CalibrationFile(**{name: page[name] for name in SECTIONS})


def _parse(path: Path) -> dict:
    """The YAML mapping in the file, read without making any Python object."""
    try:
        page = yaml.load(path.read_text(encoding='utf-8'), _LOADER)
    except FileNotFoundError:
        raise BadCalibration(f'{path}: no such file; give a file that `calibrate` wrote, or leave the parameter empty') from None
    except (OSError, UnicodeDecodeError) as error:
        raise BadCalibration(f'{path}: cannot be read ({error}); {AGAIN}') from None
    except yaml.YAMLError as error:
        raise BadCalibration(f'{path}: no valid YAML, perhaps truncated ({str(error).splitlines()[0]}); {AGAIN}') from None
    if not isinstance(page, dict):
        raise BadCalibration(f'{path}: empty or no mapping; {AGAIN}')
    return page


def check_numbers(value, name: str, path: str | Path) -> None:
    """Raise BadCalibration naming the first number under value that is not finite, or is no number."""
    if isinstance(value, dict):
        for key, part in value.items():
            check_numbers(part, f'{name}.{key}', path)
    elif isinstance(value, (list, tuple)):
        for index, part in enumerate(value):
            check_numbers(part, f'{name}[{index}]', path)
    elif isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise BadCalibration(f'{path}: {name} is {value!r}, not a finite number; {AGAIN}')
