# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The protocols of doc/serial_protocol.md: binary frames and CSV lines, written, and read from a stream that may be corrupted anywhere."""
from __future__ import annotations

import re
import struct
from binascii import crc_hqx
from dataclasses import dataclass

import numpy as np

from ..errors import BadArgument
from .constants import SERIAL


@dataclass(frozen=True)
class CountFrame:
    """Converter counts of one frame.

    values: (rows, columns), unsigned; a row is one sample of all channels, or one row of a matrix; of vectors: (taxels, 3), signed numbers
    or floats; time_us: device clock at the first row,
    us, modulo 2**32, None if the frame has no time; interval_ns: time between two rows, ns, 0 if all rows have the same time, None if
    unknown; sequence: number of the frame, modulo 2**32, None without one; bits: resolution of the converter; of
    vectors: 16 for whole numbers, 32 for floats.
    """

    values: np.ndarray
    time_us: int | None
    interval_ns: int | None
    sequence: int | None
    bits: int


@dataclass
class FrameCounts:
    """Statistics of a frame reader.

    frames: valid frames; bad_crc: frames with a wrong checksum; refused: intact frames of another kind or shape than expected, or with
    counts out of the converter's range; garbage: bytes between frames; missing: frames lost by their sequence numbers; resets: restarts of
    the sequence; stranger: content of the newest frame if it is of an unexpected kind or shape, else ''.
    """

    frames: int = 0
    bad_crc: int = 0
    refused: int = 0
    garbage: int = 0
    missing: int = 0
    resets: int = 0
    stranger: str = ''


# The values below are those of the protocol, doc/serial_protocol.md.
SAMPLES, MATRIX, VECTORS = 1, 2, 3
SYNC, END = b'\xa5\x5a', 0x7e
LARGEST = 256
_HEADER = struct.Struct('<2sBBIIIBB')
_CHECK = struct.Struct('<H')
_HEAD = _HEADER.size + _CHECK.size
_KINDS = {SAMPLES: 'samples', MATRIX: 'a matrix', VECTORS: 'vectors'}


def _number(kind: int, bits: int) -> str:
    """NumPy type of a number of a frame, '' for one that the protocol does not have."""
    if kind == VECTORS:
        return {16: '<i2', 32: '<f4'}.get(bits, '')
    return '' if not 8 <= bits <= 16 else '<u1' if bits == 8 else '<u2'


def frame_size(rows: int, columns: int, bits: int) -> int:
    """Length of a frame of rows x columns counts, bytes."""
    return _HEAD + rows * columns * (1 if bits == 8 else 2 if bits <= 16 else 4) + _CHECK.size + 1


def write_frame(frame: CountFrame, kind: int) -> bytes:
    """The bytes of a frame. Raises BadArgument for a shape, a number of bits or counts that the protocol cannot carry."""
    values = np.asarray(frame.values)
    if values.ndim != 2 or not 0 < min(values.shape) <= max(values.shape) <= LARGEST:
        raise BadArgument(f'frame: values have shape {values.shape}; rows and columns must be 1 to {LARGEST}')
    number = _number(kind, frame.bits)
    if not number or kind != VECTORS and (values.min() < 0 or values.max() >> frame.bits):
        raise BadArgument(f'frame: {frame.bits} bits for counts of {values.min()} to {values.max()}; bits must be 8 to 16, and enough; of '
                          'vectors 16 or 32')
    rows, columns = values.shape
    head = _HEADER.pack(SYNC, kind, frame.bits, frame.sequence % 2**32, frame.time_us % 2**32, frame.interval_ns, rows - 1, columns - 1)
    payload, check = values.astype(number).tobytes(), crc_hqx(head, SERIAL.crc_start)
    return b''.join((head, _CHECK.pack(check), payload, _CHECK.pack(crc_hqx(payload, check)), bytes([END])))


class BinaryReader:
    """Finds the frames in a byte stream; corrupted data is skipped and counted, never delivered.

    The header has its own checksum, so its length is trustworthy before the payload arrives. The payload checksum continues the header's,
    so a header is never combined with the payload of another frame. After a corrupted frame the search resumes inside it, so no intact
    frame is lost.

    kind: SAMPLES, MATRIX or VECTORS; rows, columns: 1 to 256, None for any; frames of others are refused. counts: counters to continue,
    None for new ones.
    """

    def __init__(self, kind: int, rows: int | None = None, columns: int | None = None, counts: FrameCounts | None = None):
        self.counts = counts or FrameCounts()
        self._kind, self._shape, self._buffer = kind, (rows, columns), bytearray()
        self._last: int | None = None  # sequence number

    def feed(self, data: bytes) -> list[CountFrame]:
        """The frames completed by these bytes, in order."""
        buffer = self._buffer
        buffer += data
        frames, offset = [], 0
        while True:
            found = buffer.find(SYNC, offset)
            if found < 0:
                found = len(buffer) - (buffer[-1:] == SYNC[:1])
                self.counts.garbage += max(found - offset, 0)
                offset = max(found, offset)
                break
            self.counts.garbage += found - offset
            offset = found
            size, frame = self._frame_at(offset)
            if size is None:
                break
            offset += size
            if frame is not None:
                frames.append(frame)
        del buffer[:offset]
        return frames

    def _frame_at(self, offset: int) -> tuple[int | None, CountFrame | None]:
        """(bytes to skip, frame) at a sync word: (None, None) if more bytes are needed, (2, None) if there is no valid frame."""
        buffer = self._buffer
        if len(buffer) - offset < _HEAD:
            return None, None
        head = bytes(buffer[offset:offset + _HEADER.size])
        check = crc_hqx(head, SERIAL.crc_start)
        if _CHECK.unpack_from(buffer, offset + _HEADER.size)[0] != check:
            self.counts.bad_crc += 1
            return len(SYNC), None
        _, kind, bits, sequence, time_us, interval_ns, rows, columns = _HEADER.unpack(head)
        shape = rows + 1, columns + 1
        fits = kind == self._kind and all(wanted in (None, found) for wanted, found in zip(self._shape, shape))
        if not fits or not _number(kind, bits):
            self.counts.refused += 1
            self.counts.stranger = f'{_KINDS.get(kind, f"kind {kind}")} of {shape[0]} x {shape[1]} values of {bits} bits'
            return len(SYNC), None
        size = frame_size(*shape, bits)
        if len(buffer) - offset < size:
            return None, None
        end = offset + size - _CHECK.size - 1
        payload = bytes(buffer[offset + _HEAD:end])
        if buffer[offset + size - 1] != END or _CHECK.unpack_from(buffer, end)[0] != crc_hqx(payload, check):
            self.counts.bad_crc += 1
            return len(SYNC), None
        values = np.frombuffer(payload, _number(kind, bits)).reshape(shape)
        if bits < 16 and values.max() >> bits:
            self.counts.refused += 1
            return len(SYNC), None
        self.counts.frames += 1
        self.counts.stranger = ''
        if self._last is not None:
            step = (sequence - self._last) % 2**32
            self.counts.missing += step - 1 if 0 < step <= SERIAL.max_missing_frames else 0
            self.counts.resets += not 0 < step <= SERIAL.max_missing_frames
        self._last = sequence
        return size, CountFrame(values, time_us, interval_ns, sequence, bits)


_SPLIT = re.compile(rb'[,;\s]+')


def write_line(values: list[int], time_us: int | None = None) -> bytes:
    """One line: the device time, us (optional), the counts and the checksum."""
    fields = [*([] if time_us is None else [time_us % 2**32]), *values]
    text = ','.join(map(str, fields)).encode()
    return text + b'*%04X\n' % crc_hqx(text, SERIAL.crc_start)


class LineReader:
    """Reads lines of 1 to 64 channels, with or without a leading device time. bits: of the converter, 8 to 16.

    The first line may be incomplete and is dropped. Once a line with a checksum has been received, lines without one are dropped. Each
    line becomes a CountFrame of one row without a sequence number. counts: counters to continue, None for new ones. Raises BadArgument for
    channels or bits out of range.
    """

    def __init__(self, channels: int, bits: int, counts: FrameCounts | None = None):
        if not 8 <= bits <= 16 or not 0 < channels <= 64:
            raise BadArgument(f'lines of {channels} channels of {bits} bits; there can be 1 to 64, of 8 to 16 bits')
        self.counts = counts or FrameCounts()
        self._channels, self._bits = channels, bits
        self._rest, self._begun, self._checked = b'', False, False

    def feed(self, data: bytes) -> list[CountFrame]:
        """The samples of the lines completed by these bytes, in order."""
        *lines, self._rest = (self._rest + data).split(b'\n')
        if len(self._rest) > SERIAL.max_line_bytes:
            self.counts.garbage += len(self._rest)
            self._rest, self._begun = b'', False
        frames = []
        for line in lines:
            begun, self._begun = self._begun, True
            frame = self._frame(line) if begun else None
            if frame is not None:
                frames.append(frame)
        return frames

    def _frame(self, line: bytes) -> CountFrame | None:
        text, star, check = line.strip().partition(b'*')
        if not text or text.startswith(b'#'):
            return None
        if (star or self._checked) and check.strip().upper() != b'%04X' % crc_hqx(text, SERIAL.crc_start):
            self.counts.bad_crc += 1
            return None
        fields = _SPLIT.split(text.strip(b',; \t'))
        if len(fields) - self._channels not in (0, 1) or not all(field.isdigit() and len(field) <= 10 for field in fields):
            self.counts.garbage += len(line) + 1
            return None
        numbers = [int(field) for field in fields]
        timed = len(numbers) > self._channels
        if max(numbers[timed:]) >> self._bits or (timed and numbers[0] >> 32):
            self.counts.refused += 1
            return None
        self._checked = self._checked or bool(star)
        self.counts.frames += 1
        return CountFrame(np.array([numbers[timed:]], np.uint16), numbers[0] if timed else None, None, None, self._bits)
