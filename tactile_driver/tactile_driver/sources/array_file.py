# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings of taxels without ROS: .npz, .npy, text tables, and folders of them. Pressure arrays become frames of whole numbers."""
from __future__ import annotations

import re
from collections.abc import Mapping
from datetime import datetime
from itertools import product
from pathlib import Path
from typing import NamedTuple
from zipfile import BadZipFile

import numpy as np

from ..errors import BadRecording
from ..frame import sent_shape
from .constants import SOURCES
from .source import natural_key

TABLES = ('.csv', '.tsv', '.txt')
#: ends of the names of all files that are read
ARRAY_ENDINGS = ('.npz', '.npy', *TABLES)
AXES = 'xyz'  # of a taxel that measures three numbers
_TIMES = {'t': 1.0, 'stamps': 1.0, 't_ms': 1e-3}  # name of the times in an .npz: their unit, s
_SEPARATORS = ';', '\t', ','  # in this order: a line with semicolons may have commas in its numbers; else blanks
_TIME = re.compile(r'time|stamp|elapsed|^secs?\b|^t(_?[mun]?s)?($|\W)', re.IGNORECASE)  # name of a column of times
_COUNT = re.compile(r'(|#|n|no|id|unnamed.*|.*index|.*frame.*|sample.*|seq.*|count.*)', re.IGNORECASE)  # name of a column that counts
_UNIT = re.compile('(?<![a-z])([mun]s)(?![a-z])', re.IGNORECASE)
_UNITS = {'ms': 1e-3, 'us': 1e-6, 'ns': 1e-9}  # s
_EPOCHS = ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3))  # a time without a unit that is larger counts nano-, micro- or milliseconds since 1970
_CLOCK = re.compile(r'\d+:\d+:\d+(\.\d+)?')  # a time of day
_MARK = re.compile(r'\W*(frame|@@|end)', re.IGNORECASE)  # a line between frames, as Tekscan's exports have


class ArrayRecording(NamedTuple):
    """frames: (N, rows, columns) uint8 or uint16; times: (N,) s, None if there are none; about: what the values are; warning: what may be
    wrong with them, or ''."""

    frames: np.ndarray
    times: np.ndarray | None
    about: str
    warning: str = ''


class _Stored(NamedTuple):
    """frames: (N, ...) as stored; times: (N,) s or None; size: of a frame in words, as far as the file shows it."""

    frames: np.ndarray
    times: np.ndarray | None
    size: str = ''


def read_array_file(path: Path, values: Mapping) -> ArrayRecording:
    """The frames of a file, or of a folder of files.

    Parameters
    ----------
    path : Path
        An ``.npz`` with an array of frames and maybe times ``t``, ``stamps`` (s) or ``t_ms``; an ``.npy``; a table as text; or a folder of
        tables or ``.npy``, in the natural order of their names.
    values : Mapping
        Parameters of taxel_array_node: ``rows``, ``columns``, ``transposed``, ``topic`` (name of the array), ``layout``, ``axis``,
        ``inverted``.

    Raises
    ------
    BadRecording
        With what the file holds, what is expected, and which parameter to set.
    """
    try:
        stored = _folder(path, values) if path.is_dir() else _file(path, values)
        frames = _arranged(stored, values)
        if not (np.abs(frames) < SOURCES.max_number).any():
            raise BadRecording('it holds no frame with a number in it')
        if stored.times is not None and len(stored.times) != len(frames):
            raise BadRecording(f'it holds {len(frames)} frames but {len(stored.times)} times')
    except (OSError, ValueError, BadZipFile) as error:  # a BadRecording is a ValueError, too
        text = str(error)
        if 'pickle' in text:
            text = 'it holds Python objects; save plain numbers: numpy.save(path, array.astype(float))'
        raise BadRecording(f'path: {path} cannot be read: {text}') from error
    return _counts(frames, stored.times, bool(values['inverted']))


def read_vector_file(path: Path, count: int, columns: str = '', topic: str = '') -> tuple[np.ndarray, np.ndarray | None]:
    """The numbers of taxels that measure three each, from a file.

    Parameters
    ----------
    path : Path
        An ``.npz`` with an array of frames and maybe times ``t``, ``stamps`` (s) or ``t_ms``; an ``.npy``; or a table as text, a line a
        frame, with names above the columns or without.
    count : int
        Number of taxels.
    columns : str
        Regular expression of the names of the columns to read; empty, all but those of times and counts.
    topic : str
        Name of the array in an ``.npz``; empty if there is only one.

    Returns
    -------
    frames : ndarray, shape (N, 3 * count)
    times : ndarray, shape (N,), or None
        In s.

    Raises
    ------
    BadRecording
        With what the file holds, what is expected, and which parameter to set.
    """
    try:
        values = {'rows': count, 'columns': len(AXES), 'transposed': False, 'topic': topic}
        stored = _vector_table(path, count, columns) if path.suffix.lower() in TABLES else _file(path, values)
        frames = stored.frames.reshape(len(stored.frames), -1).astype(float)
        if frames.shape[1] != len(AXES) * count:
            raise BadRecording(f'a frame has {frames.shape[1]} numbers, {count} taxels have {len(AXES) * count}; set layout to the file of '
                               'this device, or columns to the names of the columns of its taxels')
        if stored.times is not None and len(stored.times) != len(frames):
            raise BadRecording(f'it holds {len(frames)} frames but {len(stored.times)} times')
    except (OSError, ValueError, BadZipFile, re.error) as error:  # a BadRecording is a ValueError, too
        raise BadRecording(f'path: {path} cannot be read: {error}') from error
    return frames, stored.times


def _vector_table(path: Path, count: int, columns: str) -> _Stored:
    """A line a frame, of the columns whose names match the expression."""
    names, table = _numbers(path)
    marks = [k for k, name in enumerate(names) if _TIME.search(name)]
    if columns:
        kept = [k for k, name in enumerate(names) if re.fullmatch(columns, name)]
        if not kept:
            most = SOURCES.max_listed_columns
            shown = ', '.join(names[:most]) + (', ...' if len(names) > most else '') if names else 'none'
            raise BadRecording(f'no column has a name that is {columns!r} as a whole; the names are: {shown}; correct columns')
    else:
        kept = [k for k in range(table.shape[1]) if not names or k not in marks and not _COUNT.fullmatch(names[k])]
        if not names and len(kept) == len(AXES) * count + 1:  # a time before the numbers
            marks, kept = [0], kept[1:]
    times = _seconds(table[:, marks[0]], names[marks[0]] if names else '') if marks else None
    return _Stored(table[:, kept], times, f'{len(kept)} numbers')


def _folder(path: Path, values: Mapping) -> _Stored:
    """All files of the most frequent ending in a folder, one frame or more each. Each line of a table may be a row of a frame."""
    files = [file for file in path.iterdir() if file.suffix.lower() in ARRAY_ENDINGS and file.suffix.lower() != '.npz']
    endings = [file.suffix.lower() for file in files]
    files = sorted((file for file in files if file.suffix.lower() == max(endings, key=endings.count)), key=natural_key)
    if not files:
        raise BadRecording(f'the folder holds no file that ends in {", ".join(e for e in ARRAY_ENDINGS if e != ".npz")}')
    parts = []
    for file in files:
        try:
            parts.append(_file(file, values))
        except ValueError as error:
            raise BadRecording(f'{file.name}: {error}') from error
        if parts[-1].frames.shape[1:] != parts[0].frames.shape[1:]:
            raise BadRecording(f'{file.name} holds frames of {parts[-1].size}, {files[0].name} of {parts[0].size}; '
                               'give a folder whose files are all frames of one array, or one file')
    return _Stored(np.concatenate([part.frames for part in parts]), None, parts[0].size)


def _file(path: Path, values: Mapping) -> _Stored:
    ending = path.suffix.lower()
    if ending in TABLES:
        return _table(path, values)
    if ending == '.npy':
        return _stored_array(np.load(path), None, sent_shape(values))
    if ending != '.npz':
        raise BadRecording(f'it is neither a folder nor a file that ends in one of {", ".join(ARRAY_ENDINGS)}')
    with np.load(path) as stored:
        found = [name for name in stored.files if stored[name].ndim >= 2]
        wanted = [name for name in found if name == values['topic']] if values['topic'] else \
            [name for name in found if stored[name].ndim >= 3] or found
        if len(wanted) != 1:
            raise BadRecording(f'it holds the arrays {", ".join(found) or "none of frames"}; name one as topic')
        times = next((stored[name].ravel() * unit for name, unit in _TIMES.items() if name in stored.files), None)
        return _stored_array(stored[wanted[0]], times, sent_shape(values))


def _stored_array(array: np.ndarray, times: np.ndarray | None, shape: tuple[int, int]) -> _Stored:
    """Frames of an array (frames, ...), (rows, columns, frames), or (rows, columns) of one."""
    if array.dtype.kind not in 'uifb' or array.ndim < 2:
        raise BadRecording(f'it holds an array of {array.dtype} of shape {array.shape}; numbers (frames, rows, columns) are needed')
    if array.shape == shape:
        array = array[None]
    elif array.ndim == 3 and array.shape[:2] == shape and array.shape[1:] != shape:
        array = np.moveaxis(array, -1, 0)
    return _Stored(array, times, ' x '.join(map(str, array.shape[1:])))


def _table(path: Path, values: Mapping) -> _Stored:
    """Frames of a text in UTF-8. A line is a frame, or one row of it; columns of time and of a count may stand beside the numbers, with
    names above them, or without names one time before them."""
    names, table = _numbers(path)
    marks = [k for k, name in enumerate(names) if _TIME.search(name)]
    beside = {*marks, *(k for k, name in enumerate(names) if _COUNT.fullmatch(name))} if len(names) == table.shape[1] else set()
    kept = [k for k in range(table.shape[1]) if k not in beside]
    rows, columns = sent_shape(values)
    wide, three = len(kept), len(AXES) * rows * columns
    forms = [(1, wide)] if _layout(values) else [(1, rows * columns), (1, three), (rows, columns)]  # lines a frame, numbers a line
    for (lines, count), ahead in product(forms, (0,) if beside else (0, 1)):
        if wide != count + ahead or len(table) % lines:
            continue
        marks = [0] if ahead else marks
        times = _seconds(table[::lines, marks[0]], names[marks[0]] if names else '') if marks else None
        return _Stored(table[:, kept[ahead:]].reshape(-1, lines * count), times, f'{lines * count} numbers')
    single = f', which would be rows: {len(table)} and columns: {wide} if all are one frame' if len(table) > 1 else ''
    raise BadRecording(
        f'it has {len(table)} lines of {wide} numbers{" after a header" if names else ""}{single}; expected for {rows} x {columns} taxels: '
        f'{rows * columns} a line (a frame; {three} with x, y and z), or {columns} a line and {rows} lines a frame, and one more where a '
        'time precedes them. Set rows and columns to those of the array, or layout to the numbers of the columns, from 0, that are its '
        'taxels')


def _seconds(times: np.ndarray, name: str) -> np.ndarray:
    """Times, s, of a column with a name; they must increase."""
    late = np.diff(times) <= 0
    if late.any():
        raise BadRecording(f'the times in its column {name or "before the values"} do not increase at frame {int(np.argmax(late)) + 1}')
    unit = _UNIT.search(name.replace('_', ' '))
    scale = _UNITS[unit[1].lower()] if unit else next((scale for least, scale in _EPOCHS if abs(times[0]) > least), 1.0)
    return times * scale


def _numbers(path: Path) -> tuple[list[str], np.ndarray]:
    """The names above the numbers, [] without any, and the numbers (lines, columns) of a text."""
    text = path.read_text(encoding='utf-8-sig')
    lines = [(k, line.strip()) for k, line in enumerate(text.splitlines(), 1) if line.strip() and not line.lstrip().startswith('#')]
    separator = next((mark for mark in _SEPARATORS if any(mark in line for _, line in lines[:1] + lines[-3:])), None)
    names, table = [], []
    for number, line in lines:
        fields = [field.strip() for field in (line.removesuffix(separator) if separator else line).split(separator)]
        try:
            table.append([_number(field, separator) for field in fields])
        except ValueError as error:
            if table and not _MARK.match(line):
                raise BadRecording(f'line {number} is not of numbers ({error}); lines of names may only precede the numbers, which are '
                                   'separated by commas, semicolons, tabs or blanks') from error
            names = names if table else [field.strip('"\' ') for field in fields]
            continue
        if len(table[-1]) != len(table[0]):
            if len(table) == 2 and len(table[0]) < len(table[1]) and names:  # a line of the header that holds a number
                names, table = names, table[1:]
                continue
            raise BadRecording(f'line {number} has {len(table[-1])} numbers, those before it {len(table[0])}')
    if not table:
        raise BadRecording('it has no line of numbers')
    return (names if len(names) == len(table[0]) else []), np.array(table)


def _number(field: str, separator: str | None) -> float:
    """A number; an empty field is NaN; a date and time counts seconds since 1970, a time of day since midnight."""
    if not field:
        return np.nan
    try:
        return float(field.replace(',', '.') if separator == ';' else field)
    except ValueError:
        if field[:4].isdigit() and '-' in field:
            return datetime.fromisoformat(field.strip('"').replace('Z', '+00:00')).timestamp()
        if _CLOCK.fullmatch(field):
            hours, minutes, seconds = map(float, field.split(':'))
            return 3600 * hours + 60 * minutes + seconds
        raise


def _layout(values: Mapping) -> list[int]:
    """Number of the value of each cell in a stored frame, -1 where there is no taxel; [] for row by row."""
    layout = list(values['layout'])
    return [] if layout == [-1] else layout


def _arranged(stored: _Stored, values: Mapping) -> np.ndarray:
    """Frames (N, rows, columns) as sent, of stored frames."""
    shape, layout, frames = sent_shape(values), _layout(values), stored.frames
    rows, columns = shape
    if not frames.size:
        raise BadRecording('it holds no frame with a number in it')
    flat = frames.reshape(len(frames), -1)
    size = flat.shape[1]
    if layout:
        if len(layout) != rows * columns or max(layout) >= size:
            raise BadRecording(f'parameter layout has {len(layout)} numbers up to {max(layout)}; {rows} x {columns} = {rows * columns} are '
                               f'needed, from 0 to {size - 1} (values of a frame in the file), -1 where there is no taxel')
        cells = np.array(layout)
        flat = np.where(cells < 0, flat.min(), flat[:, cells])
    elif size == len(AXES) * rows * columns:
        planes = frames.ndim > 2 and frames.shape[1] == len(AXES) and frames.shape[-1] != len(AXES)
        of_axes = flat.reshape(len(flat), len(AXES), -1).swapaxes(1, 2) if planes else flat.reshape(len(flat), -1, len(AXES))
        flat = of_axes[:, :, AXES.index(values['axis'])]
    elif size != rows * columns:
        raise BadRecording(f'its frames are {stored.size}, parameters rows and columns say {rows} x {columns}; set them to those of the '
                           f'array, or layout to which of the {size} values of a frame are its taxels')
    return flat.reshape(-1, rows, columns)


def _counts(frames: np.ndarray, times: np.ndarray | None, inverted: bool) -> ArrayRecording:
    """Frames of any numbers as whole numbers of 8 or 16 bits. Whole numbers in range stay as they are; others are counted from the lowest
    in steps of the smallest difference, or of the 65535th part of their range."""
    values = frames.astype(float)
    finite = np.abs(values) < SOURCES.max_number
    low, high = float(values[finite].min()), float(values[finite].max())
    values = np.where(finite, values, high if inverted else low)
    warning = '' if inverted else _falling(values)
    whole = bool((values == np.round(values)).all())
    about = f'{"whole numbers" if whole else "numbers"} from {low:.6g} to {high:.6g}'
    if whole and 0 <= low and high <= SOURCES.max_value and not inverted:
        kind = np.uint8 if frames.dtype == np.uint8 else np.uint16
        return ArrayRecording(values.astype(kind), times, f'{about}, at least {max(int(high).bit_length(), 8)} bits', warning)
    values, shown = (high - values, f'{high:.6g} - value') if inverted else (values - low, f'value - {low:.6g}')
    step = 1.0 if whole and high - low <= SOURCES.max_value else _step(values)
    return ArrayRecording(np.round(values / step).astype(np.uint16), times, f'{about}; the image holds ({shown}) / {step:.6g}', warning)


def _step(values: np.ndarray) -> float:
    """What one unit of the image means, in units of the values (N, rows, columns), which are at least 0."""
    coarse = max(float(values.max()) / SOURCES.max_value, np.finfo(float).tiny)
    apart = np.diff(np.unique(values.ravel()[::1 + values.size // SOURCES.step_sample]))
    apart = apart[apart > coarse]
    return float(apart.min()) if len(apart) else coarse


def _falling(values: np.ndarray) -> str:
    """Says so where the values (N, rows, columns) fall below the first ones more than they rise above them. A sensor that shows zeros
    subtracts its untouched values itself, and rises."""
    first = np.median(values[:SOURCES.untouched_frames], axis=0)
    if len(values) <= SOURCES.untouched_frames or np.count_nonzero(first == 0) > 0.5 * first.size:
        return ''
    change = (values - first).sum(axis=(1, 2))
    fall, rise = -float(change.min()), float(change.max())
    if fall <= rise:
        return ''
    return (f'the sum of a frame falls by {fall:.4g} below that of the first frames and rises by {rise:.4g} above it: if pressing lowers '
            'the values, set inverted to true; if something touches the array at the start, set reference.start to zero, or record again')
