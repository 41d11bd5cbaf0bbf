# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What all sources are: device, file, bag and simulation."""
from __future__ import annotations

from collections.abc import Callable

from ...frame import CameraCalibration, Frame, PairFrame

Clock = Callable[[], int]


class EndOfSource(Exception):
    """The recording is over; not a failure."""


class NothingYet(Exception):
    """Nothing arrived for a moment; not a failure, read again."""


class Source:
    """A sensor, live or recorded.

    live: it runs whether it is read or not, and only its newest frames matter; a recording waits and loses nothing. on_demand: it has no
    rate of its own and is read only while frames are wanted. skipped: number of frames that were due but not produced; corrupt: number of
    unusable frames; remark: a warning about the data, ''; truths: what of ground_truth/* its frames have, known once it is open.
    """

    live = on_demand = False
    skipped = corrupt = 0
    remark = ''
    truths: tuple[str, ...] = ()

    def open(self) -> None:
        """Open at the start. Raises DeviceLost, BadRecording or BadArgument; may be called again after close."""
        raise NotImplementedError

    def read(self, wanted: bool = True) -> Frame | PairFrame | None:
        """Wait for the next frame; None if it is not wanted (skipping costs less than decoding).

        Raises EndOfSource at the end of a recording, DeviceLost, NothingYet after a moment without one, or BadFrame for an unusable one.
        """
        raise NotImplementedError

    def close(self) -> None:
        """Release the device or file; does nothing if it is not open."""

    def describe(self) -> dict:
        """Plain values for the description: source, device or path, serial, width, height (px), rate (Hz) and others, if known."""
        raise NotImplementedError

    def calibration(self) -> CameraCalibration | None:
        """The camera's calibration, None if unknown; valid once open."""
        return None

    def set_exposure(self, exposure: float) -> None:
        """Set the exposure time, s, of a camera that supports it; 0: automatic."""
