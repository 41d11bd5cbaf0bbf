# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reads a truncated or damaged MCAP file record by record (mcap.dev/spec), because the library rosbags reads only intact files."""
from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

try:
    from compression import zstd
except ImportError:  # before Python 3.14
    from backports import zstd

from .left_out import LeftOut

MAGIC = b'\x89MCAP0\r\n'
# Opcodes, record and message headers: MCAP specification, mcap.dev/spec.
_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = 2, 3, 4, 5, 6
_KINDS = range(1, 16)
_HEAD = struct.Struct('<BQ')
_MESSAGE_HEAD = struct.Struct('<HIQQ')
_CHUNK_HEAD = struct.Struct('<QQQI')


class Channel(NamedTuple):
    """Topic, type name and message definition ('' without one) of a channel."""

    topic: str
    type_name: str
    definition: str


class SalvagedMcap:
    """A truncated or damaged MCAP file.

    topics: topic -> type name; definitions: type name -> text; counts: topic -> number of readable messages. Losses are added to left_out
    as messages are read.
    """

    def __init__(self, path: Path, left_out: LeftOut):
        self.path, self._left_out = path, left_out
        self._schemas: dict[int, tuple[str, str]] = {}  # filled by a first pass over the whole file: the chunk that defines them may be
        self._channels: dict[int, Channel] = {}         # damaged, and the end of the file repeats them
        self.topics: dict[str, str] = {}
        self.definitions: dict[str, str] = {}
        self.counts: Counter = Counter()
        for _ in self._scan(LeftOut()):
            pass
        for channel, _, _ in self._scan(LeftOut()):
            self.topics[channel.topic] = channel.type_name
            self.definitions[channel.type_name] = channel.definition
            self.counts[channel.topic] += 1

    def messages(self, topics: set[str]) -> Iterator[tuple[str, str, int, bytes]]:
        """(topic, type name, time of recording in ns, CDR data) in the order of the file, sorted by time within a chunk."""
        for channel, stamp_ns, data in self._scan(self._left_out):
            if channel.topic in topics:
                yield channel.topic, channel.type_name, stamp_ns, data

    def _scan(self, left_out: LeftOut) -> Iterator[tuple[Channel, int, bytes]]:
        with open(self.path, 'rb') as file:
            if file.read(len(MAGIC)) != MAGIC:
                left_out.add(self.path.name, 'no MCAP file')
                return
            for kind, content in self._records(file, left_out):
                if kind != _CHUNK:
                    yield from self._read(kind, content)
                    continue
                found = [m for part in _parts(self._unpacked(content, left_out)) for m in self._read(*part)]
                yield from sorted(found, key=lambda message: message[1])

    def _records(self, file: BinaryIO, left_out: LeftOut) -> Iterator[tuple[int, bytes]]:
        """(opcode, content) of the records; a truncated last chunk is included."""
        while True:
            at, head = file.tell(), file.read(_HEAD.size)
            if head and head[0] == _FOOTER:
                return
            if len(head) < _HEAD.size:
                left_out.add(self.path.name, f'the file is cut off at byte {at + len(head)}')
                return
            kind, size = _HEAD.unpack(head)
            if kind not in _KINDS:
                left_out.add(self.path.name, f'the file is damaged from byte {at} on')
                return
            content = file.read(min(size, self.path.stat().st_size))
            if len(content) < size:
                left_out.add(self.path.name, f'the file is cut off at byte {at + len(head) + len(content)}')
            if len(content) == size or kind == _CHUNK:
                yield kind, content

    def _unpacked(self, chunk: bytes, left_out: LeftOut) -> bytes:
        """The decompressed records of a chunk; empty if it is unreadable or its checksum is wrong."""
        try:
            _, _, size, checksum = _CHUNK_HEAD.unpack_from(chunk)
            compression, at = _text(chunk, _CHUNK_HEAD.size)
            packed = chunk[at + 8:]
            records = zstd.ZstdDecompressor().decompress(packed) if compression == 'zstd' else packed
        except (struct.error, UnicodeDecodeError, zstd.ZstdError) as error:
            left_out.add(self.path.name, f'a chunk cannot be read: {error}')
            return b''
        if compression not in ('', 'zstd'):
            left_out.add(self.path.name, f'compression {compression!r} of a damaged file is not supported')
            return b''
        if checksum and len(records) >= size and zlib.crc32(records) != checksum:
            lost = sum(kind == _MESSAGE for kind, _ in _parts(records))
            left_out.add(self.path.name, 'the checksum of their chunk is wrong', count=max(lost, 1))
            return b''
        return records

    def _read(self, kind: int, content: bytes) -> Iterator[tuple[Channel, int, bytes]]:
        """Yield the message of a message record; store schema and channel records."""
        try:
            if kind == _SCHEMA:
                name, at = _text(content, 2)
                encoding, at = _text(content, at)
                self._schemas[_number(content)] = name, _text(content, at)[0] if encoding == 'ros2msg' else ''
            elif kind == _CHANNEL:
                self._channels[_number(content)] = Channel(_text(content, 4)[0], *self._schemas.get(_number(content, 2), ('', '')))
            elif kind == _MESSAGE:
                number, _, stamp_ns, _ = _MESSAGE_HEAD.unpack_from(content)
                if number in self._channels:
                    yield self._channels[number], stamp_ns, content[_MESSAGE_HEAD.size:]
        except (struct.error, UnicodeDecodeError):
            return


def _parts(records: bytes) -> Iterator[tuple[int, bytes]]:
    """(opcode, content) of the complete records in the bytes of a chunk."""
    at = 0
    while at + _HEAD.size <= len(records):
        kind, size = _HEAD.unpack_from(records, at)
        at += _HEAD.size
        if at + size > len(records):
            return
        yield kind, records[at:at + size]
        at += size


def _number(content: bytes, at: int = 0) -> int:
    return struct.unpack_from('<H', content, at)[0]


def _text(content: bytes, at: int) -> tuple[str, int]:
    """The length-prefixed string at a byte offset, and the offset of its end."""
    size = struct.unpack_from('<I', content, at)[0]
    return content[at + 4:at + 4 + size].decode(), at + 4 + size
