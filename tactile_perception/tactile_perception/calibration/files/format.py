# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration files: YAML with version, date, sensor, parameters of the sensor, units, fitted values, cross-validation residuals,
calibrated range, outliers, and what was left out.
"""
from __future__ import annotations

import datetime
import hashlib
import json
import logging
import math
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import yaml

from ...errors import BadCalibration
from ...markers.view.sensor import MARKER_SENSORS

FORMAT, VERSION = 'tactile calibration', 2
SECTIONS = {'sensor': str, 'serial': str, 'date': str, 'software': str, 'parameters': dict, 'units': dict, 'fitted': dict,
            'residuals': dict, 'calibrated_range': dict, 'outliers': list, 'left_out': list}
_SINCE_2 = {'serial': '', 'software': '', 'parameters': {}, 'outliers': []}  # sections that files of version 1 lack
AGAIN = 'run `ros2 run tactile_perception calibrate` again'
_DIGITS = 7  # significant digits of each number written, chosen
_LOADER = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)  # measured: libyaml takes a tenth of the time, also to write


_log = logging.getLogger(__name__)
_warned: set[tuple[str, str]] = set()

# Parameters that a calibration depends on: it is valid only while these are unchanged. Those of a touchpad's material are not among them.
_POSE = ('camera.rotation', 'camera.translation')
_SHEET = ('rows', 'columns', 'pitch', 'sheet_size')
_DOME = ('rows', 'columns', 'dome.rim_radius', 'dome.height', *_POSE)
BELONGS_TO = {'touchpad': ('rows', 'columns', 'surface', 'cap.curvature_radius', 'cap.height', *_POSE),
              **{name: _SHEET if sensor.is_sheet else _DOME for name, sensor in MARKER_SENSORS.items()},
              'psd_finger': ('radius',), 'taxel_array': ('rows', 'columns', 'pitch', 'bits')}


def _software() -> str:
    try:
        return version('tactile_perception')
    except PackageNotFoundError:
        return ''


class _Dumper(getattr(yaml, 'CSafeDumper', yaml.SafeDumper)):
    """Writes lists of numbers in flow style, several on a line."""

    def numbers_in_lines(self, values: list):
        """Represent a list, in flow style when it holds numbers."""
        flow = bool(values) and all(isinstance(value, (int, float)) for value in values)
        return self.represent_sequence('tag:yaml.org,2002:seq', values, flow_style=flow)


_Dumper.add_representer(list, _Dumper.numbers_in_lines)


@dataclass
class CalibrationFile:
    """Content of a calibration file.

    sensor: type as in the sensor's launch file (touchpad ...); date: UTC; serial: of the device, '' when unknown; software: version that
    wrote the file; parameters: values by name of those that the calibration depends on, {} when unknown; units: by name; fitted: numbers,
    lists of numbers or dictionaries of them; residuals: numbers by name, NaN when unknown; calibrated_range: [lowest, highest] by name;
    outliers, left_out: one line each.
    """

    sensor: str
    units: dict
    fitted: dict
    residuals: dict
    calibrated_range: dict
    left_out: list = field(default_factory=list)
    date: str = field(default_factory=lambda: datetime.datetime.now(datetime.timezone.utc).strftime('%Y-%m-%dT%H:%M:%SZ'))
    serial: str = ''
    parameters: dict = field(default_factory=dict)
    outliers: list = field(default_factory=list)
    software: str = field(default_factory=_software)


@dataclass(frozen=True)
class Specimen:
    """The sensor that is calibrated; serial: of the device, '' when unknown; values: its parameters."""

    serial: str = ''
    values: Mapping = field(default_factory=dict)

    def parameters(self, sensor: str) -> dict:
        """Values by name of the parameters that a calibration of this sensor type depends on."""
        return {name: self.values[name] for name in BELONGS_TO.get(sensor, ()) if name in self.values}


def parameter_hash(parameters: Mapping) -> str:
    """Hash of parameters (name -> value): 16 hexadecimal digits of SHA-256."""
    return hashlib.sha256(json.dumps(_rounded(dict(parameters)), sort_keys=True).encode()).hexdigest()[:16]


def write_calibration(path: str | Path, content: CalibrationFile) -> None:
    """Write content to path atomically: to a temporary file beside it, which is then renamed.

    Raises BadCalibration for a fitted number that is not finite, OSError when the file cannot be written.
    """
    path = Path(path)
    check_numbers(content.fitted, 'fitted', path)
    page = {'format': f'{FORMAT} {VERSION}'} | {name: _rounded(getattr(content, name)) for name in SECTIONS} | {'complete': True}
    page['parameters'] = {'hash': parameter_hash(content.parameters), 'values': _rounded(content.parameters)}
    partial = path.with_name(path.name + '.partial')
    partial.write_text(yaml.dump(page, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=120), encoding='utf-8')
    os.replace(partial, path)


def _rounded(value):
    """value with _DIGITS significant digits; tuples become lists."""
    if isinstance(value, dict):
        return {key: _rounded(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_rounded(part) for part in value]
    return float(f'{value:.{_DIGITS}g}') if isinstance(value, float) else value


def read_calibration(path: str | Path, sensor: str, values: Mapping | None = None) -> CalibrationFile:
    """Read the calibration file of a sensor type at path; values: the current parameters.

    With values, a difference from the parameters in the file is logged as a warning. Raises BadCalibration, saying what is wrong and
    what to do, for a file that is missing, truncated, no calibration, of a later version or of another sensor type, or that holds a
    fitted number that is not finite.
    """
    path = Path(path)
    page = _parse(path)
    _take_version(page, path)
    missing = [name for name, kind in SECTIONS.items() if not isinstance(page.get(name), kind)]
    if missing or page.get('complete') is not True:
        raise BadCalibration(f'{path}: truncated or edited: no usable {", ".join(missing or ["end mark"])}; {AGAIN}')
    if page['sensor'] != sensor:
        raise BadCalibration(f'{path}: for sensor type {page["sensor"]!r}, this is {sensor!r}; give this sensor\'s own file')
    check_numbers(page['fitted'], 'fitted', path)
    page['parameters'] = _parameters(page['parameters'], path)
    found = CalibrationFile(**{name: page[name] for name in SECTIONS})
    if values is not None:
        _compare(found, values, path)
    return found


def _take_version(page: dict, path: Path) -> None:
    """Convert a page of an earlier version to the current one. Raises BadCalibration for a later version and for another format."""
    told = re.fullmatch(FORMAT + r' (\d+)', str(page.get('format')))
    if told is None:
        raise BadCalibration(f'{path}: format is {page.get("format")!r}, not {FORMAT!r}: no calibration file of this software; {AGAIN}')
    if int(told[1]) > VERSION:
        raise BadCalibration(f'{path}: version {told[1]} of the format, this software reads up to {VERSION}: update it, or {AGAIN}')
    if int(told[1]) == 1:
        page.update({name: page.get(name, type(value)(value)) for name, value in _SINCE_2.items()})


def _parameters(section: dict, path: Path) -> dict:
    """Parameters in a file. Raises BadCalibration when they do not match their hash."""
    if not section:
        return {}
    values = section.get('values')
    if not isinstance(values, dict) or section.get('hash') != parameter_hash(values):
        raise BadCalibration(f'{path}: parameters: hash and values do not fit together, they were edited; {AGAIN}')
    return values


def _compare(found: CalibrationFile, values: Mapping, path: Path) -> None:
    """Log, once per change, which parameters differ from those in the file."""
    now = {name: values.get(name) for name in found.parameters}
    if parameter_hash(now) == parameter_hash(found.parameters) or (str(path), parameter_hash(now)) in _warned:
        return
    _warned.add((str(path), parameter_hash(now)))
    changed = [f'{name} is {now[name]}, was {value}' for name, value in found.parameters.items()
               if parameter_hash({name: now[name]}) != parameter_hash({name: value})]
    _log.warning('%s: made with other parameters: %s; correct them, or %s', path, '; '.join(changed), AGAIN)


def _parse(path: Path) -> dict:
    """The YAML mapping in the file, by the safe loader. Raises BadCalibration."""
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
    """Raise BadCalibration that names the first element of value that is not a finite number."""
    if isinstance(value, dict):
        for key, part in value.items():
            check_numbers(part, f'{name}.{key}', path)
    elif isinstance(value, (list, tuple)):
        for index, part in enumerate(value):
            check_numbers(part, f'{name}[{index}]', path)
    elif isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise BadCalibration(f'{path}: {name} is {value!r}, not a finite number; {AGAIN}')
