# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Any message as arrays by name, with what its definition says of them."""
from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from ament_index_python.packages import get_package_share_directory
from rosidl_runtime_py.utilities import get_message
from sensor_msgs_py.point_cloud2 import read_points

from tactile_driver.nodes.messages.images import grey_to_array, image_to_array
from tactile_driver.recordings.serialization import type_name_of

_NUMBERS = {'double': 'f8', 'float': 'f4', 'boolean': '?', 'octet': 'u1', 'char': 'u1',
            **{f'{sign}int{bits}': f'{sign or "i"}{bits // 8}' for sign in ('', 'u') for bits in (8, 16, 32, 64)}}
_SEQUENCE = re.compile(r'sequence<([\w/]+)(?:, \d+)?>$')
_ARRAY = re.compile(r'([\w/]+)\[(\d+)\]$')
_DEFINED = re.compile(r'^\s*[\w/]+(?:\[[<=\d]*\])?\s+(\w+)\s*[^#=]*#\s*(.+)$', re.MULTILINE)


class Field(NamedTuple):
    """values: of one message; is_variable: whether their number differs from message to message; note: unit and meaning."""

    values: np.ndarray
    is_variable: bool = False
    note: str = ''


def fields_of(message: object) -> dict[str, Field]:
    """The numbers in a message by name, as ``position.x``; headers and texts are left out.

    Raises BadFrame for an image that cannot be decoded.
    """
    kind = type_name_of(type(message))
    if kind in ('sensor_msgs/msg/Image', 'sensor_msgs/msg/CompressedImage'):
        pixels = grey_to_array(message) if getattr(message, 'encoding', '') == 'mono16' else image_to_array(message)
        return {'image': Field(pixels, note='pixels as recorded: rows, columns, channels in the order blue, green, red')}
    if kind == 'sensor_msgs/msg/PointCloud2':
        points = read_points(message).ravel()
        return {name: Field(np.array(points[name]), is_variable=True) for name in points.dtype.names}
    return {name: Field(part.values[0] if part.counts is None else part.values, part.counts is not None, part.note)
            for name, part in _gather([message], kind, '', '').items()}


class _Part(NamedTuple):
    """A column of several messages. values: an entry for each of them; or all their entries one after the other, and counts (N,)."""

    values: np.ndarray
    counts: np.ndarray | None
    note: str


def _gather(messages: list, kind: str, prefix: str, inherited: str) -> dict[str, _Part]:
    """The numbers in messages of one type. Entry k of a sequence of messages is at index k of each of its columns. Where these have
    sequences themselves, they follow each other, and PATH.index gives the message to which an entry belongs."""
    found: dict[str, _Part] = {}
    for field, entry, number, shape, is_variable, own in _plan(kind):
        path, note = prefix + field, own or inherited
        values = [getattr(message, field) for message in messages]
        counts = np.array([len(each) for each in values], int) if is_variable else None
        if number:
            values = [np.frombuffer(each, np.uint8) if isinstance(each, bytes) else each for each in values]
            found[path] = _Part(_joined(values, number) if is_variable else np.array(values, number).reshape(-1, *shape), counts, note)
        elif is_variable:
            found |= _of_entries([each for part in values for each in part], counts, entry, path, note)
        else:
            found |= _gather(values, entry, path + '.', note)
    return found


def _joined(values: list, number: str) -> np.ndarray:
    return np.asarray(values[0], number) if len(values) == 1 else np.concatenate([np.asarray(each, number) for each in values]) \
        if values else np.zeros(0, number)


def _of_entries(entries: list, counts: np.ndarray, kind: str, path: str, note: str) -> dict[str, _Part]:
    """The columns of the entries of a sequence, of which each message has so many."""
    found: dict[str, _Part] = {}
    owner = np.repeat(np.arange(len(counts)), counts)
    for name, part in _gather(entries, kind, path + '.', note).items():
        if part.counts is None:
            found[name] = _Part(part.values, counts, part.note)
            continue
        own = np.bincount(owner, part.counts, len(counts)).astype(int)
        index = np.arange(len(entries)) - np.repeat(np.cumsum(counts) - counts, counts)
        found[name] = _Part(part.values, own, part.note)
        found[f'{name}.index'] = _Part(np.repeat(index, part.counts), own, f'entry of {path}')
    return found


@cache
def _plan(kind: str) -> list[tuple[str, str, str, tuple[int, ...], bool, str]]:
    """Of each field of a message type that holds numbers: name, type of an entry, the dtype of a number or '', shape of an array of
    fixed size, whether it is a sequence, note."""
    notes, plan = _notes(kind), []
    for name, whole in get_message(kind).get_fields_and_field_types().items():
        parts = _SEQUENCE.match(whole) or _ARRAY.match(whole)
        entry = parts[1] if parts else whole
        if entry != 'std_msgs/Header' and 'string' not in entry:
            is_variable = bool(_SEQUENCE.match(whole)) or bool(parts) and entry not in _NUMBERS
            shape = (int(parts[2]),) if parts and not is_variable else ()
            plan.append((name, entry if entry in _NUMBERS else entry.replace('/', '/msg/'), _NUMBERS.get(entry, ''), shape, is_variable,
                         notes.get(name, '')))
    return plan


@cache
def _notes(type_name: str) -> dict[str, str]:
    """Comments of the fields in a message's definition, with their units."""
    package, folder, name = type_name.split('/')
    file = Path(get_package_share_directory(package), folder, f'{name}.msg')
    return dict(_DEFINED.findall(file.read_text())) if file.is_file() else {}
