# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The protocol of all sources: device, file, bag and simulation."""
from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from ...frame import CameraCalibration, Frame, PairFrame

Clock = Callable[[], int]


class EndOfSource(Exception):
    """The recording is over; not a failure."""


class NothingYet(Exception):
    """Nothing arrived for a moment; not a failure, read again."""


class Source(Protocol):
    """A camera, live or recorded.

    live: it runs whether it is read or not, and only its newest frames matter; a recording waits and loses nothing. on_demand: it has no
    rate of its own and is read only while frames are wanted. skipped: number of frames that were due but not produced; corrupt: number of
    unusable frames; remark: a warning about the data, ''. A source whose frames carry ground truth names in `truths` what of ground_truth/*
    they have, once it is open.
    """

    live: bool
    on_demand: bool
    skipped: int
    corrupt: int
    remark: str

    def open(self) -> None:
        """Open at the start. Raises DeviceLost, BadRecording or BadArgument; may be called again after close."""

    def read(self, wanted: bool = True) -> Frame | PairFrame | None:
        """Wait for the next frame; None if it is not wanted (skipping costs less than decoding).

        Raises EndOfSource at the end of a recording, DeviceLost, NothingYet after a moment without one, or BadFrame for an unusable one.
        """

    def close(self) -> None:
        """Release the device or file; does nothing if it is not open."""

    def describe(self) -> dict:
        """Plain values for the description: source, device or path, serial, width, height (px), rate (Hz) and others, if known."""

    def calibration(self) -> CameraCalibration | None:
        """The camera's calibration, None if unknown; valid once open."""
