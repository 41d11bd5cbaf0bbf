# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Binary frames, as doc/serial_protocol.md describes them: written, and read out of a stream of bytes that may be broken anywhere."""
from __future__ import annotations

import struct
from binascii import crc_hqx
from dataclasses import dataclass

import numpy as np

from .counts import CountFrame, FrameCounts, SequenceCheck
from ..errors import BadArgument

SAMPLES, MATRIX = 1, 2
SYNC, END = b'\xa5\x5a', 0x7e
LARGEST = 256
_HEADER = struct.Struct('<2sBBIIIBB')
_CHECK = struct.Struct('<H')
_HEAD = _HEADER.size + _CHECK.size
_TAIL = _CHECK.size + 1
_START = 0xffff


@dataclass(frozen=True)
class Expected:
    """Which frames are wanted: kind, SAMPLES or MATRIX; rows, columns: 1 to 256, None for any."""

    kind: int
    rows: int | None = None
    columns: int | None = None

    def fits(self, kind: int, rows: int, columns: int) -> bool:
        """Whether a frame of that kind and shape is wanted."""
        return kind == self.kind and self.rows in (None, rows) and self.columns in (None, columns)


_KINDS = {SAMPLES: 'samples', MATRIX: 'a matrix'}


def frame_size(rows: int, columns: int, bits: int) -> int:
    """Length of a frame, bytes."""
    return _HEAD + rows * columns * (1 if bits == 8 else 2) + _TAIL


def write_frame(frame: CountFrame, kind: int) -> bytes:
    """The bytes of a frame. Raises BadArgument for a shape, a number of bits or counts that no frame can carry."""
    values = np.asarray(frame.values)
    if values.ndim != 2 or not 0 < min(values.shape) <= max(values.shape) <= LARGEST:
        raise BadArgument(f'frame: values have shape {values.shape}; rows and columns must be 1 to {LARGEST}')
    if not 8 <= frame.bits <= 16 or values.min() < 0 or values.max() >> frame.bits:
        raise BadArgument(f'frame: {frame.bits} bits for counts of {values.min()} to {values.max()}; bits must be 8 to 16, and enough')
    rows, columns = values.shape
    head = _HEADER.pack(SYNC, kind, frame.bits, frame.sequence % 2**32, frame.time_us % 2**32, frame.interval_ns, rows - 1, columns - 1)
    payload, check = values.astype('<u1' if frame.bits == 8 else '<u2').tobytes(), crc_hqx(head, _START)
    return b''.join((head, _CHECK.pack(check), payload, _CHECK.pack(crc_hqx(payload, check)), bytes([END])))


class BinaryReader:
    """Finds the frames in a stream of bytes; what is broken is passed over and counted, never delivered.

    The header has a check sum of its own, so that a length is believed before the bytes that it asks for have come; that of the counts goes
    on from it, so that no header is believed of another frame's counts. Behind a broken frame the search goes on within it, so that nothing
    whole is lost. counts: to go on with.
    """

    def __init__(self, expected: Expected, counts: FrameCounts | None = None):
        self.counts = counts or FrameCounts()
        self._expected, self._buffer = expected, bytearray()
        self._sequence = SequenceCheck(self.counts)

    def feed(self, data: bytes) -> list[CountFrame]:
        """The frames that are complete with these bytes, in order."""
        buffer = self._buffer
        buffer += data
        frames, place = [], 0
        while True:
            found = buffer.find(SYNC, place)
            if found < 0:
                found = len(buffer) - (buffer[-1:] == SYNC[:1])
                self.counts.garbage += max(found - place, 0)
                place = max(found, place)
                break
            self.counts.garbage += found - place
            place = found
            size, frame = self._frame_at(place)
            if size is None:
                break
            place += size
            if frame is not None:
                frames.append(frame)
        del buffer[:place]
        return frames

    def _frame_at(self, place: int) -> tuple[int | None, CountFrame | None]:
        """(bytes to go on by, frame) at a sync word: (None, None) where more bytes have to come, (2, None) where there is no frame."""
        buffer = self._buffer
        if len(buffer) - place < _HEAD:
            return None, None
        head = bytes(buffer[place:place + _HEADER.size])
        check = crc_hqx(head, _START)
        if _CHECK.unpack_from(buffer, place + _HEADER.size)[0] != check:
            self.counts.bad_crc += 1
            return len(SYNC), None
        _, kind, bits, sequence, time_us, interval_ns, rows, columns = _HEADER.unpack(head)
        shape = rows + 1, columns + 1
        if not (self._expected.fits(kind, *shape) and 8 <= bits <= 16):
            self.counts.refused += 1
            self.counts.stranger = f'{_KINDS.get(kind, f"kind {kind}")} of {shape[0]} x {shape[1]} values of {bits} bits'
            return len(SYNC), None
        size = frame_size(*shape, bits)
        if len(buffer) - place < size:
            return None, None
        payload = bytes(buffer[place + _HEAD:place + size - _TAIL])
        if buffer[place + size - 1] != END or _CHECK.unpack_from(buffer, place + size - _TAIL)[0] != crc_hqx(payload, check):
            self.counts.bad_crc += 1
            return len(SYNC), None
        values = np.frombuffer(payload, '<u1' if bits == 8 else '<u2').reshape(shape)
        if bits < 16 and values.max() >> bits:
            self.counts.refused += 1
            return len(SYNC), None
        self.counts.frames += 1
        self.counts.stranger = ''
        self._sequence.take(sequence)
        return size, CountFrame(values, time_us, interval_ns, sequence, bits)
