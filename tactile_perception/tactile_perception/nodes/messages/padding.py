# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Padding of serialised messages (CDR version 1, OMG DDSI-RTPS 9.4.2.10): the bytes that align numbers, whose content is undefined."""
from __future__ import annotations

import struct
from collections.abc import Mapping

from rosbags.interfaces import Nodetype

_HEAD = 4  # bytes before the first field, from which alignment counts
_SIZES = {'bool': 1, 'octet': 1, 'byte': 1, 'char': 1, 'int8': 1, 'uint8': 1, 'int16': 2, 'uint16': 2, 'int32': 4, 'uint32': 4, 'int64': 8,
          'uint64': 8, 'float32': 4, 'float64': 8}  # bytes
_COUNT = 4  # bytes of a string's and a sequence's length
_ZEROS = [bytes(k) for k in range(8)]
_NUMBERS, _STRING, _SEQUENCE = range(3)

# Steps through a message: (_NUMBERS, size of one, bytes of all), (_STRING, 1, 0) and (_SEQUENCE, 0, steps through an element).
_Steps = list[tuple]


class Padding:
    """Clears the padding of messages; fields: by type name, as in a rosbags type store."""

    def __init__(self, fields: Mapping[str, tuple]):
        self._fields, self._known = fields, {}

    def cleared(self, data: bytes, type_name: str) -> bytes:
        """The message data of that type with zeros as padding."""
        steps = self._known.get(type_name)
        if steps is None:
            steps = self._known[type_name] = self._of_type(type_name)
        out = bytearray(data)
        _walk(out, _HEAD, steps, struct.Struct('<I' if data[1] & 1 else '>I'))
        return bytes(out)

    def _of_type(self, type_name: str) -> _Steps:
        steps: _Steps = []
        for _, kind in self._fields[type_name][1]:
            _extend(steps, self._of_field(kind))
        return steps

    def _of_field(self, kind: tuple) -> _Steps:
        node, detail = kind
        if node == Nodetype.NAME:
            return self._of_type(detail)
        if node == Nodetype.BASE:
            return [(_STRING, 1, 0)] if detail[0] == 'string' else [(_NUMBERS, _SIZES[detail[0]], _SIZES[detail[0]])]
        element, count = self._of_field(detail[0]), detail[1]
        if node == Nodetype.SEQUENCE:
            return [(_SEQUENCE, 0, element)]
        steps: _Steps = []
        for _ in range(count):
            _extend(steps, element)
        return steps


def _extend(steps: _Steps, more: _Steps) -> None:
    """Add more steps; numbers of one size that follow each other are one step."""
    for step in more:
        if steps and step[0] == steps[-1][0] == _NUMBERS and step[1] == steps[-1][1]:
            steps[-1] = (_NUMBERS, step[1], steps[-1][2] + step[2])
        else:
            steps.append(step)


def _walk(data: bytearray, at: int, steps: _Steps, count: struct.Struct) -> int:
    """Clear the padding of the steps that begin at a byte; the byte after them."""
    for kind, size, more in steps:
        if kind == _NUMBERS:
            at = _aligned(data, at, size) + more
            continue
        at = _aligned(data, at, _COUNT)
        length, at = count.unpack_from(data, at)[0], at + _COUNT
        if kind == _STRING:
            at += length
        elif len(more) == 1 and more[0][0] == _NUMBERS:
            at = _aligned(data, at, more[0][1]) + length * more[0][2] if length else at
        else:
            for _ in range(length):
                at = _walk(data, at, more, count)
    return at


def _aligned(data: bytearray, at: int, size: int) -> int:
    """The first byte from at where a number of that size may begin; those before are cleared."""
    gap = (_HEAD - at) % size
    if gap:
        data[at:at + gap] = _ZEROS[gap]
    return at + gap
