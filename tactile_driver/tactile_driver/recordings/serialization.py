# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Messages as the CDR bytes that bags hold, without a node."""
from __future__ import annotations

import json
import struct
from functools import cache
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from rclpy.serialization import deserialize_message, serialize_message
from rosidl_runtime_py.utilities import get_message

from ..errors import BadFrame
from .constants import RECORDINGS
from .written_message import WrittenMessage

#: Bytes of a value by its number in a type description (type_description_interfaces/msg/FieldType); 0: a string.
_SIZES = {2: 1, 3: 1, 4: 2, 5: 2, 6: 4, 7: 4, 8: 8, 9: 8, 10: 4, 11: 8, 13: 1, 15: 1, 16: 1, 17: 0, 21: 0}


def decode(data: bytes, type_name: str):
    """The message in CDR data. Raises BadFrame for data that cannot be decoded as that type."""
    try:
        return deserialize_message(data, get_message(type_name))
    except Exception as error:  # rclpy raises RuntimeError and others, by middleware
        raise BadFrame(f'{len(data)} bytes cannot be decoded as {type_name}: {error}') from error


def header_stamp_ns(data: bytes) -> int:
    """Stamp, ns, of a serialised (CDR) message that begins with a header; the message is not decoded."""
    seconds, nanoseconds = struct.unpack_from('<iI' if data[1] & 1 else '>iI', data, 4)
    return seconds * 10**9 + nanoseconds


def encode(message) -> tuple[str, bytes]:
    """Type name and CDR bytes; equal messages give equal bytes: padding, which the middleware leaves as it was in memory, is
    zero, and the unused end of its buffer is cut off."""
    if isinstance(message, WrittenMessage):
        return type_name_of(message.kind), message.cdr
    type_name = type_name_of(type(message))
    data = bytearray(serialize_message(message))
    return type_name, bytes(data[:_clear(data, RECORDINGS.header_bytes, _fields(type_name))])


def type_name_of(message_type: type) -> str:
    """'sensor_msgs/msg/Image' of a message class."""
    package, kind = message_type.__module__.split('.')[:2]
    return f'{package}/{kind}/{message_type.__name__}'


def type_hash(type_name: str) -> str:
    """The type description hash (RIHS01) of an installed message type, '' if it is unknown."""
    try:
        return {one['type_name']: one['hash_string'] for one in _description(type_name)['type_hashes']}[type_name]
    except (LookupError, OSError, ValueError):  # PackageNotFoundError is a LookupError
        return ''


def unusable(type_name: str, recorded_hash: str) -> str:
    """Reason why messages of a type in a recording cannot be decoded, '' if they can; recorded_hash: its hash there, '' if unknown."""
    own = type_hash(type_name)
    if not own:
        return f'type {type_name} is not installed'
    if recorded_hash not in ('', own):
        return f'type {type_name} is defined otherwise in the recording: it was made by another version'
    return ''


def _description(type_name: str) -> dict:
    package, kind, name = type_name.split('/')
    return json.loads(Path(get_package_share_directory(package), kind, f'{name}.json').read_text())


#: Number of values (negative: in each entry of a sequence), bytes of one (0: string, -1: nested message), fields of a nested message.
Field = tuple[int, int, object]


@cache
def _fields(type_name: str) -> list[Field]:
    """The fields of an installed message type; neighbours that are one primitive are one array, for speed."""
    about = _description(type_name)['type_description_msg']
    nested = {one['type_name']: one['fields'] for one in (about['type_description'], *about['referenced_type_descriptions'])}
    return _laid_out(type_name, nested)


def _laid_out(type_name: str, nested: dict[str, list]) -> list[Field]:
    found: list[Field] = []
    for kind in (field['type'] for field in nested[type_name]):
        form, number = divmod(kind['type_id'], RECORDINGS.types_per_kind)
        entry = _laid_out(kind['nested_type_name'], nested) if number == RECORDINGS.nested_type else [(1, _SIZES[number], None)]
        count = kind['capacity'] if form == 1 else -1
        if form and len(entry) == 1 and entry[0][0] > 0 and entry[0][1] >= 0:  # such as Point: three doubles
            entry = [(count * entry[0][0], entry[0][1], None)]
        elif form:
            entry = [(count, -1, entry)]
        for length, size, inner in entry:
            if found and size > 0 and size == found[-1][1] and min(length, found[-1][0]) > 0:
                found[-1] = found[-1][0] + length, size, None
            else:
                found.append((length, size, inner))
    return found


def _clear(data: bytearray, at: int, fields: list[Field]) -> int:
    """Set the padding of fields from the offset `at` on to zero; return the offset of their end."""
    for length, size, inner in fields:
        count = length
        if length < 0:
            at = _aligned(data, at, 4)
            count = -length * struct.unpack_from('<I', data, at)[0]
            at += 4
        if size > 0:
            at = _aligned(data, at, size) + count * size if count else at
            continue
        for _ in range(count):
            if inner is not None:
                at = _clear(data, at, inner)
            else:
                at = _aligned(data, at, 4)
                at += 4 + struct.unpack_from('<I', data, at)[0]
    return at


def _aligned(data: bytearray, at: int, size: int) -> int:
    end = at + (RECORDINGS.header_bytes - at) % size
    data[at:end] = bytes(end - at)
    return end
