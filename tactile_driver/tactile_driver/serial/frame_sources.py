# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What taxels of any kind have in common as sources: frames on a serial port and in files, with their stamps."""
from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator

import numpy as np

from ..sources.source import NS, PlayedSource, stamp_of
from .clock import DeviceClock
from .port import SerialSource


class FrameSerialSource(SerialSource):
    """Frames of a device that counts microseconds. A subclass defines ``_new_reader`` and ``_made``."""

    deaf_bytes = 65536  # some frames of the largest arrays

    @abstractmethod
    def _made(self, values: np.ndarray, stamp_ns: int, label: str):
        """A frame of what was received. Raises BadFrame."""

    def _begin(self) -> None:
        super()._begin()
        self._device_clock = DeviceClock()

    @property
    def skipped(self) -> int:
        """Number of frames lost in transmission."""
        return self._counts.missing

    def _poll(self) -> list:
        frames, arrived_ns = self._received()
        # A simulated time may be slower than the monotonic clock, and stands between its messages: the device's time is mapped to it
        # directly. It is 0 until its first message.
        is_simulated = self._values.get('simulated_time', False)
        arrived_ns = self._clock() if is_simulated else arrived_ns
        if not frames or not arrived_ns:
            return []
        stamps = self._device_clock.to_host([frame.time_us for frame in frames], arrived_ns)
        return [self._made(frame.values, stamp if is_simulated else stamp_of(stamp, self._clock), f'frame {frame.sequence}')
                for frame, stamp in zip(frames, stamps)]

    def describe(self) -> dict:
        """The port and its error counts."""
        about = super().describe()
        return about | {'resets': about['resets'] + self._device_clock.resets}


class FrameFileSource(PlayedSource):
    """A file that is read whole. A subclass defines ``_load`` and ``_made``."""

    @abstractmethod
    def _load(self) -> tuple[np.ndarray, np.ndarray | None, float]:
        """Frames, their times in s or None, and the rate in Hz of a file without times. Raises BadRecording."""

    @abstractmethod
    def _made(self, values: np.ndarray, stamp_ns: int, label: str):
        """A frame of what was read. Raises BadFrame."""

    def _items(self) -> Iterator[tuple]:
        """(number, time in s, values) of each frame."""
        frames, times, rate = self._load()
        return zip(range(len(frames)), np.arange(len(frames)) / rate if times is None else times, frames)

    def _recorded(self, item: tuple) -> tuple[int, tuple]:
        return round(float(item[1]) * NS), item

    def _frame(self, content: tuple, stamp_ns: int):
        return self._made(content[2], stamp_ns, f'frame {content[0]} of {self._path}')
