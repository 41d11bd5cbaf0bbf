# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Random messages of any type that the type system lets through, made by walking the type's fields: valid-looking and hostile ones."""
from __future__ import annotations

import copy
import math
import random
from array import array

from rosidl_parser.definition import AbstractSequence, AbstractString, Array, BasicType, NamespacedType
from rosidl_runtime_py.import_message import import_message_from_namespaced_type

_INTEGERS = {'int8': 8, 'uint8': 8, 'int16': 16, 'uint16': 16, 'int32': 32, 'uint32': 32, 'int64': 64, 'uint64': 64, 'octet': 8}
_CODES = {'int8': 'b', 'uint8': 'B', 'int16': 'h', 'uint16': 'H', 'int32': 'i', 'uint32': 'I', 'int64': 'q', 'uint64': 'Q',
          'float': 'f', 'double': 'd'}
_LARGEST = {'float': 3.4028234663852886e38, 'double': 1.7976931348623157e308}
_SMALLEST = {'float': 1.401298464324817e-45, 'double': 5e-324}
#: What the names of encodings, models, frames and files may be taken for.
_TEXTS = ('', ' ', 'bgr8', 'BGR8', 'rgb8', 'rgba8', 'mono8', 'mono16', '8UC1', '8UC3', '16UC1', '32FC1', '64FC4', 'bayer_rggb8',
          'yuv422', 'yuv422_yuy2', 'nv12', 'jpeg', 'plumb_bob', 'fisheye', 'rational_polynomial', '/', '//a', '../..', 'a' * 300, '\n\r\t',
          '\x01\x7f', '\ufffd', '\U0001f590', 'frame\u202eid', '%s%n', '{}', '{0.__class__}', '!!python/object:os.system', '- [', 'NaN',
          '-1')
_LENGTHS = (0, 1, 2, 3, 4, 5, 7, 8, 9, 12, 36, 529, 1000)


def random_message(rng: random.Random, kind: type):
    """A message of a type with all fields at random."""
    message = kind()
    for name, type_ in _fields(kind):
        setattr(message, name, _value(rng, type_, getattr(message, name)))
    return message


def spoiled(rng: random.Random, good):
    """A copy of a good message, of which one to three fields, wherever they are inside, hold something else."""
    message = copy.deepcopy(good)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        _spoil(rng, message)
    return message


def hostile(rng: random.Random, good):
    """Mostly a good message that is spoiled, sometimes one that is all random."""
    return spoiled(rng, good) if rng.random() < 0.8 else random_message(rng, type(good))


def _fields(kind: type) -> list[tuple[str, object]]:
    return list(zip(kind.get_fields_and_field_types(), kind.SLOT_TYPES))


def _spoil(rng: random.Random, message) -> None:
    if not _fields(type(message)):
        return
    name, type_ = rng.choice(_fields(type(message)))
    value = getattr(message, name)
    if isinstance(type_, NamespacedType):
        _spoil(rng, value)
    elif isinstance(type_, (AbstractSequence, Array)) and len(value) and rng.random() < 0.6:
        _spoil_entries(rng, value, type_.value_type)
    else:
        setattr(message, name, _value(rng, type_, value))


def _spoil_entries(rng: random.Random, values, type_) -> None:
    """Some entries of an array, its length as it is."""
    for _ in range(rng.choice((1, 1, 2, 5, 50))):
        place = rng.randrange(len(values))
        if isinstance(type_, NamespacedType):
            _spoil(rng, values[place])
        else:
            values[place] = _value(rng, type_, values[place])


def _value(rng: random.Random, type_, old):
    """A value of a field that holds old."""
    if isinstance(type_, NamespacedType):
        return random_message(rng, import_message_from_namespaced_type(type_))
    if isinstance(type_, Array):
        values = [_value(rng, type_.value_type, None) for _ in range(type_.size)]
        if not isinstance(old, (list, array)):  # NumPy's
            old = old.copy()
            old[:] = values
            return old
        return values
    if isinstance(type_, AbstractSequence):
        return _sequence(rng, type_, old)
    if isinstance(type_, AbstractString):
        return rng.choice(_TEXTS) if rng.random() < 0.8 else ''.join(chr(rng.randrange(1, 0xd800)) for _ in range(rng.randrange(20)))
    return _number(rng, type_.typename, old)


def _sequence(rng: random.Random, type_, old):
    """One of another length, cut, doubled or made anew."""
    how = rng.random()
    if old is not None and len(old) and how < 0.4:
        length = rng.choice((0, 1, len(old) - 1, len(old) // 2))
        return old[:length]
    if old is not None and len(old) and how < 0.5 and len(old) < 10_000:
        return old + old
    count = rng.choice(_LENGTHS) if isinstance(type_.value_type, BasicType) else rng.randrange(4)
    values = [_value(rng, type_.value_type, None) for _ in range(min(count, getattr(type_, 'maximum_size', count)))]
    code = _CODES.get(getattr(type_.value_type, 'typename', ''))
    return array(code, values) if code else values


def _number(rng: random.Random, kind: str, old):
    """At the ends of its range, near what it was, or anything."""
    if kind == 'boolean':
        return rng.random() < 0.5
    if kind in _LARGEST:
        return _float(rng, kind, old)
    bits = _INTEGERS[kind]
    low, high = (0, 2**bits - 1) if kind[0] in 'uo' else (-2**(bits - 1), 2**(bits - 1) - 1)
    near = old + rng.choice((-2, -1, 1, 2, 1000)) if isinstance(old, int) else 0
    value = rng.choice((low, high, 0, 1, -1, high // 2, near, 2 * near, rng.randint(low, high), rng.randint(0, 255)))
    value = min(max(value, low), high)
    return bytes([value]) if kind == 'octet' else value


def _float(rng: random.Random, kind: str, old) -> float:
    largest = _LARGEST[kind]
    near = float(old) if isinstance(old, float) and math.isfinite(old) else 1.0
    value = rng.choice((math.nan, math.inf, -math.inf, 0.0, -0.0, 1.0, -1.0, largest, -largest, _SMALLEST[kind], 1e-30, 1e30, 1e9, -1e9,
                        -near, near * (1 + 1e-3), near * 1e3, near * 1e-3, rng.uniform(-1, 1), rng.gauss(0, 1) * 10**rng.randrange(-9, 10)))
    return value if not math.isfinite(value) else min(max(value, -largest), largest)
