# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Writes and reads CSV lines, one sample per line (doc/serial_protocol.md), as hobby boards print them."""
from __future__ import annotations

import re
from binascii import crc_hqx

import numpy as np

from .counts import CountFrame, FrameCounts
from ..errors import BadArgument

_START = 0xffff  # initial value of the CRC, doc/serial_protocol.md
_LONGEST = 256  # bytes; longer data without an end of line is discarded; chosen
_SPLIT = re.compile(rb'[,;\s]+')


def write_line(values: list[int], time_us: int | None = None, check: bool = True) -> bytes:
    """One line: the device time, us (optional), the counts and the checksum (if check)."""
    fields = [*([] if time_us is None else [time_us % 2**32]), *values]
    text = ','.join(map(str, fields)).encode()
    return text + (b'*%04X\n' % crc_hqx(text, _START) if check else b'\n')


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
        if len(self._rest) > _LONGEST:
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
        if (star or self._checked) and check.strip().upper() != b'%04X' % crc_hqx(text, _START):
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
