# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What a frame carries, whichever way it came, and what a reader of frames has met."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class CountFrame:
    """Converter counts of one frame.

    values: (rows, columns), unsigned; a row is one sample of all channels, or one row of a matrix; time_us: the device's clock at
    the first row, us, modulo 2**32, None where the frame does not tell; interval_ns: between two rows, 0 where all belong to one time,
    None where the frame does not tell; sequence: number of the frame, modulo 2**32, None where it has none; bits: of the converter.
    """

    values: np.ndarray
    time_us: int | None
    interval_ns: int | None
    sequence: int | None
    bits: int


@dataclass
class FrameCounts:
    """frames: good ones; bad_crc: with a sync word in place and a wrong check sum; refused: correct, but of another kind or shape than is
    wanted, or with counts that the converter cannot give; garbage: bytes between frames; missing: frames that the sequence numbers miss;
    resets: how often the sequence began anew; stranger: what the newest frame carries, where it is of another kind or shape, else ''."""

    frames: int = 0
    bad_crc: int = 0
    refused: int = 0
    garbage: int = 0
    missing: int = 0
    resets: int = 0
    stranger: str = ''


class SequenceCheck:
    """Counts what sequence numbers tell, into counts. longest_gap: frames; a longer step is a device that began anew."""

    def __init__(self, counts: FrameCounts, longest_gap: int = 2**16):
        self._counts, self._longest_gap = counts, longest_gap
        self._last: int | None = None

    def take(self, sequence: int) -> None:
        """The number of the next good frame."""
        if self._last is not None:
            step = (sequence - self._last) % 2**32
            if 0 < step <= self._longest_gap:
                self._counts.missing += step - 1
            else:
                self._counts.resets += 1
        self._last = sequence
