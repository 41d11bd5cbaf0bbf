# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Two videos or image folders as two cameras. They hold no stamps, so the n-th frames of both form a pair."""
from __future__ import annotations

from dataclasses import replace

from ..base.protocol import Clock, EndOfSource
from ..camera.file import FileSource
from ...errors import BadFrame
from ...frame import PairFrame
from .pairs import DualSource


class TwoFilesSource(DualSource):
    """Pairs of two files. left, right: paths; rate, loop, clock: as in FileSource, rate -1 is that of the left file. Ends with the shorter
    file."""

    def __init__(self, left: str, right: str, rate: float, loop: bool, clock: Clock):
        self._left = FileSource(left, rate, False, clock)
        self._right = FileSource(right, 0, False, clock)
        self.on_demand, self._loop, self._unpaired, self._read = self._left.on_demand, loop, 0, False

    def open(self) -> None:
        """Open both at the start. Raises BadRecording as FileSource.open does."""
        self._left.open()
        self._right.open()
        self._read = False

    def read(self, wanted: bool = True) -> PairFrame | None:
        """The next pair, when it is due; None if not wanted. Raises EndOfSource, or BadFrame if one of the two cannot be decoded."""
        try:
            pair = self._next(wanted)
        except EndOfSource:
            if not self._loop or not self._read:
                raise
            self._left.rewind()
            self._right.rewind()
            pair = self._next(wanted)
        self._read = True
        return pair

    def _next(self, wanted: bool) -> PairFrame | None:
        """The next two frames of equal number; a frame whose counterpart is corrupt is skipped."""
        right = self._right.read(wanted)  # first, because only the left read waits until the frame is due
        try:
            left = self._left.read(wanted)
        except BadFrame:
            self._unpaired += 1
            raise
        while self._left.number != self._right.number:
            self._unpaired += 1
            if self._left.number < self._right.number:
                left = self._left.read(wanted)
            else:
                right = self._right.read(wanted)
        return PairFrame(left, replace(right, stamp_ns=left.stamp_ns)) if wanted else None

    def close(self) -> None:
        """Close both."""
        self._left.close()
        self._right.close()

    @property
    def skipped(self) -> int:
        """Number of unpaired frames."""
        return self._unpaired

    @property
    def corrupt(self) -> int:
        """Number of frames of both files that could not be decoded."""
        return self._left.corrupt + self._right.corrupt

    def describe(self) -> dict:
        """Both paths, the rate, Hz, and the number of unpaired frames."""
        left, right = self._left.describe(), self._right.describe()
        return {**left, 'path': f'{left["path"]} + {right["path"]}', 'unpaired': self._unpaired}
