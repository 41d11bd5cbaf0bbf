# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A pressure array's recording as text: a frame a line or a row of taxels a line, with or without header and times."""
from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ..errors import BadRecording

_SEPARATORS = ';', '\t', ','  # in this order: a line with semicolons may have commas in its numbers
_TIME = re.compile(r'\W*(t|time|times|stamp|timestamp)(\W*_?\W*(s|sec|seconds|ms|us))?\W*', re.IGNORECASE)
_UNITS = {'ms': 1e-3, 'us': 1e-6}  # s


def read_table(path: Path, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray | None]:
    """Frames (N, rows, columns) of a text file in UTF-8, and their times (N,), s, or None; shape: (rows, columns).

    A line is a frame, row by row, or one row of taxels; a time may precede it, in s, or in ms or us if the header says so. Numbers are
    separated by commas, semicolons or tabs. Raises BadRecording with what was seen and what is expected.
    """
    header, table = _numbers(path)
    (rows, columns), wide = shape, table.shape[1]
    for lines, across in ((1, rows * columns), (rows, columns)):
        if wide in (across, across + 1) and len(table) % lines == 0:
            times = table[::lines, 0] * _unit(header) if wide > across else None
            if times is not None and not (np.diff(times) > 0).all():
                number = int(np.argmin(np.diff(times) > 0)) + 1
                raise BadRecording(f'path: {path}: the times in the first column do not increase at frame {number}')
            return table[:, wide - across:].reshape(-1, *shape), times
    raise BadRecording(f'path: {path} has {len(table)} lines of {wide} numbers{" after a header" if header else ""}; expected for {rows} x '
                       f'{columns} taxels: {rows * columns} a line (a frame), or {columns} a line and {rows} lines a frame, and one more '
                       'where a time precedes them. Set rows and columns to those of the array')


def _numbers(path: Path) -> tuple[list[str], np.ndarray]:
    """The header's names, [] without one, and the numbers (lines, columns) of a file."""
    text = path.read_text(encoding='utf-8-sig')
    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip() and not line.lstrip().startswith('#')]
    separator = next((mark for mark in _SEPARATORS if any(mark in line for _, line in lines[:3])), None)
    header, table = [], []
    for number, line in lines:
        fields = [field.strip() for field in line.strip(' \r').rstrip(separator).split(separator)]
        try:
            table.append([float(field.replace(',', '.')) if separator == ';' else float(field) for field in fields])
        except ValueError as error:
            if table or header:
                raise BadRecording(f'path: {path}: line {number} is not of numbers ({error}); after one line of names, numbers are '
                                   'expected, separated by commas, semicolons or tabs') from error
            header = fields
            continue
        if len(table[-1]) != len(table[0]):
            raise BadRecording(f'path: {path}: line {number} has {len(table[-1])} numbers, those before it {len(table[0])}')
    if not table:
        raise BadRecording(f'path: {path} has no line of numbers')
    return header, np.array(table)


def _unit(header: list[str]) -> float:
    """Seconds in a unit of the times."""
    named = _TIME.fullmatch(header[0]) if header else None
    return _UNITS.get((named.group(3) or '').lower(), 1.0) if named else 1.0
