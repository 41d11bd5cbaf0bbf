# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What every source of camera frames does: device, file, bag and simulation behind one protocol."""
from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from ...frame import CameraCalibration, Frame, PairFrame

Clock = Callable[[], int]


class EndOfSource(Exception):
    """The recording is over: no failure, nothing more will come."""


class NothingYet(Exception):
    """Nothing came for a moment: no failure, ask again."""


class Source(Protocol):
    """A camera, live or recorded.

    live: it goes on by itself whether it is read or not, and only its newest frame is of interest; a recording waits and loses nothing.
    on_demand: it has no pace of its own, so it is read only while somebody wants its frames.
    skipped: frames that were due but not made; corrupt: frames that could not be used; remark: what is wrong with frames that come all the
    same, or do not, ''.
    """

    live: bool
    on_demand: bool
    skipped: int
    corrupt: int
    remark: str

    def open(self) -> None:
        """Get ready to read, from the start. Raises DeviceLost, BadRecording or BadArgument; may be called again after close."""

    def read(self, wanted: bool = True) -> Frame | PairFrame | None:
        """Wait for the next frame; None if it was not wanted (it is passed over, at less cost).

        Raises EndOfSource at the end of a recording, DeviceLost, NothingYet after a moment without one, or BadFrame for a frame to skip.
        """

    def close(self) -> None:
        """Let go of the device or file; harmless when not open."""

    def describe(self) -> dict:
        """What is read: source, device or path, serial, width, height (px), rate (Hz) and what else is known, as plain values."""

    def calibration(self) -> CameraCalibration | None:
        """The camera's calibration, where the source knows it; valid once open."""
