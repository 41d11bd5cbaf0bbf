# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration files: YAML with version, date, sensor, parameters of the sensor, units, fitted values, cross-validation residuals,
calibrated range, outliers, and what was left out; fitted arrays are in an .npz file of the same name beside it.
"""
from __future__ import annotations

import datetime
import hashlib
import io
import json
import logging
import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import yaml

from .errors import BadCalibration
from .sensor_type import SENSOR_TYPES

FORMAT = 'tactile calibration 2'  # name and version
SECTIONS = {'sensor': str, 'serial': str, 'date': str, 'software': str, 'parameters': dict, 'units': dict, 'fitted': dict,
            'residuals': dict, 'calibrated_range': dict, 'outliers': list, 'left_out': list}
ARRAYS = 'arrays'  # section of a file with fitted arrays: name of the .npz file beside it, and its SHA-256
AGAIN = 'run `ros2 run tactile_perception calibrate` again'
_LOADER = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)  # measured: libyaml takes a tenth of the time, also to write


_log = logging.getLogger(__name__)
_warned: set[tuple[str, str]] = set()

def _software() -> str:
    from importlib.metadata import PackageNotFoundError, version  # takes 0.1 s to import, and only a written file needs it
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
    arrays, lists or dictionaries of them, with NaN in arrays only; residuals: numbers by name, NaN when unknown; calibrated_range:
    [lowest, highest] by name; outliers, left_out: one line each.
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
        depends_on = SENSOR_TYPES[sensor].calibration_parameters if sensor in SENSOR_TYPES else ()
        return {name: self.values[name] for name in depends_on if name in self.values}


def parameter_hash(parameters: Mapping) -> str:
    """Hash of parameters (name -> value): 16 hexadecimal digits of SHA-256."""
    return hashlib.sha256(json.dumps(_rounded(dict(parameters)), sort_keys=True).encode()).hexdigest()[:16]


def write_calibration(path: str | Path, content: CalibrationFile) -> None:
    """Write content to path, and its arrays to the .npz file of the same name, each atomically: to a temporary file that is then renamed.
    The same content gives the same bytes. A folder that is missing is made.

    Raises BadCalibration for the name of an .npz file and for a fitted number that is not finite, OSError when a file cannot be written.
    """
    path = Path(path)
    if path.suffix == '.npz':
        raise BadCalibration(f'{path}: the .npz file holds the arrays of a calibration; give the name of the YAML file, as NAME.yaml')
    path.parent.mkdir(parents=True, exist_ok=True)
    arrays: dict[str, np.ndarray] = {}

    def described(value, name: str):
        """A number as it is, an array by its shape and type; the array goes to arrays."""
        _check_number(value, name, path)
        if not isinstance(value, np.ndarray):
            return value
        arrays[name] = value
        return f'array {" x ".join(map(str, value.shape))} {value.dtype}'
    page = {'format': FORMAT} | {name: getattr(content, name) for name in SECTIONS} | {'complete': True}
    page['fitted'] = _replaced(content.fitted, '', described)
    page = _rounded(page)
    page['parameters'] = {'hash': parameter_hash(content.parameters), 'values': _rounded(content.parameters)}
    if arrays:
        file = io.BytesIO()
        np.savez_compressed(file, **arrays)
        page[ARRAYS] = {'file': path.with_suffix('.npz').name, 'sha256': hashlib.sha256(file.getvalue()).hexdigest()}
        _replace(path.with_suffix('.npz'), file.getvalue())
    _replace(path, yaml.dump(page, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=120).encode())


def _replace(path: Path, content: bytes) -> None:
    partial = path.with_name(path.name + '.partial')
    partial.write_bytes(content)
    os.replace(partial, path)


def _replaced(value, name: str, leaf: Callable[[object, str], object]):
    """value with leaf(part, name of the part) instead of each part of its dictionaries and lists; tuples become lists."""
    if isinstance(value, Mapping):
        return {key: _replaced(part, f'{name}.{key}'.lstrip('.'), leaf) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_replaced(part, f'{name}.{index}', leaf) for index, part in enumerate(value)]
    return leaf(value, name)


def _arrays(section: object, path: Path) -> dict[str, np.ndarray]:
    """Arrays by name from the .npz file that the section names. Raises BadCalibration for a file that is missing, damaged or another."""
    if section is None:
        return {}
    if not isinstance(section, dict) or Path(str(section.get('file'))).name != section.get('file'):
        raise BadCalibration(f'{path}: {ARRAYS}: names no file beside this one; {AGAIN}')
    try:
        content = (path.parent / section['file']).read_bytes()
    except OSError as error:
        raise BadCalibration(f'{path}: {section["file"]}, which belongs beside it, cannot be read ({error.strerror}); copy both files, or '
                             f'{AGAIN}') from None
    if hashlib.sha256(content).hexdigest() != section.get('sha256'):
        raise BadCalibration(f'{path}: {section["file"]} is damaged or of another calibration; copy both files of one, or {AGAIN}')
    with np.load(io.BytesIO(content), allow_pickle=False) as found:
        return dict(found)


def _rounded(value):
    """value with seven significant digits; tuples become lists."""
    return _replaced(value, '', lambda part, _name: float(f'{part:.7g}') if isinstance(part, float) else part)


def read_calibration(path: str | Path, sensor: str, values: Mapping | None = None) -> CalibrationFile:
    """Read the calibration file of a sensor type at path; values: the current parameters.

    With values, a difference from the parameters in the file is logged as a warning. Raises BadCalibration, saying what is wrong and
    what to do, for a file that is missing, truncated, no calibration, of another version or of another sensor type, whose .npz file is
    missing or damaged, or that holds a fitted number that is not finite.
    """
    path = Path(path)
    page = _parse(path)
    if page.get('format') != FORMAT:
        raise BadCalibration(f'{path}: format is {page.get("format")!r}, this software reads {FORMAT!r}; {AGAIN}')
    missing = [name for name, kind in SECTIONS.items() if not isinstance(page.get(name), kind)]
    if missing or page.get('complete') is not True:
        raise BadCalibration(f'{path}: truncated or edited: no usable {", ".join(missing or ["end mark"])}; {AGAIN}')
    if page['sensor'] != sensor:
        raise BadCalibration(f'{path}: for sensor type {page["sensor"]!r}, this is {sensor!r}; give this sensor\'s own file')
    arrays = _arrays(page.get(ARRAYS), path)
    page['fitted'] = _replaced(page['fitted'], '', lambda value, name: arrays.get(name, value) if isinstance(value, str) else value)
    _replaced(page['fitted'], '', lambda value, name: _check_number(value, name, path))
    page['parameters'] = _parameters(page['parameters'], path)
    found = CalibrationFile(**{name: page[name] for name in SECTIONS})
    if values is not None:
        _compare(found, values, path)
    return found


def fitted_arrays(fitted: Mapping, shapes: Mapping[str, tuple], path: str | Path) -> dict[str, np.ndarray | float]:
    """Fitted numbers by name, of these shapes, in which None is any length; floats of shape (). Raises BadCalibration for one that is
    missing, no number, or of another shape."""
    found = {}
    for name, shape in shapes.items():
        try:
            array = np.asarray(fitted[name], float)
        except (KeyError, TypeError, ValueError):
            raise BadCalibration(f'{path}: fitted.{name} is missing or no number; {AGAIN}') from None
        if array.ndim != len(shape) or any(length not in (None, own) for length, own in zip(shape, array.shape)):
            raise BadCalibration(f'{path}: fitted.{name} has shape {array.shape}, not {shape}; {AGAIN}')
        found[name] = array if shape else float(array)
    return found


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
    then = {name: value for name, value in found.parameters.items() if name in values}  # earlier versions had others
    now = {name: values[name] for name in then}
    if parameter_hash(now) == parameter_hash(then) or (str(path), parameter_hash(now)) in _warned:
        return
    _warned.add((str(path), parameter_hash(now)))
    changed = [f'{name} is {now[name]}, was {value}' for name, value in then.items()
               if parameter_hash({name: now[name]}) != parameter_hash({name: value})]
    _log.warning('%s: made with other parameters: %s; correct them, or %s', path, '; '.join(changed), AGAIN)


def _parse(path: Path) -> dict:
    """The YAML mapping in the file, by the safe loader. Raises BadCalibration."""
    try:
        page = yaml.load(path.read_text(encoding='utf-8'), _LOADER)
    except FileNotFoundError:
        raise BadCalibration(f'{path}: no such file; give a file that `calibrate` wrote, or leave the parameter empty') from None
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise BadCalibration(f'{path}: no valid YAML, perhaps truncated ({str(error).splitlines()[0]}); {AGAIN}') from None
    if not isinstance(page, dict):
        raise BadCalibration(f'{path}: empty or no mapping; {AGAIN}')
    return page


def _check_number(value, name: str, path: Path) -> None:
    """Raise BadCalibration, which says where in the file, for what is no finite number and no array without an infinite one."""
    if isinstance(value, np.ndarray):
        if value.dtype.kind not in 'fiu' or np.isinf(value).any():
            raise BadCalibration(f'{path}: fitted.{name} has numbers that are not finite; {AGAIN}')
    elif isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise BadCalibration(f'{path}: fitted.{name} is {value!r}, not a finite number; {AGAIN}')
