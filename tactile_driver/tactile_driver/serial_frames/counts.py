# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The content of a frame, independent of the protocol, and the statistics of a frame reader."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class CountFrame:
    """Converter counts of one frame.

    values: (rows, columns), unsigned; a row is one sample of all channels, or one row of a matrix; time_us: device clock at the first row,
    us, modulo 2**32, None if the frame has no time; interval_ns: time between two rows, ns, 0 if all rows have the same time, None if
    unknown; sequence: number of the frame, modulo 2**32, None without one; bits: resolution of the converter.
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


class SequenceCheck:
    """Counts lost frames and restarts by sequence numbers, into counts. longest_gap: frames; a longer gap counts as a restart."""

    def __init__(self, counts: FrameCounts, longest_gap: int = 2**16):
        self._counts, self._longest_gap = counts, longest_gap
        self._last: int | None = None

    def take(self, sequence: int) -> None:
        """Process the sequence number of the next valid frame."""
        if self._last is not None:
            step = (sequence - self._last) % 2**32
            if 0 < step <= self._longest_gap:
                self._counts.missing += step - 1
            else:
                self._counts.resets += 1
        self._last = sequence
