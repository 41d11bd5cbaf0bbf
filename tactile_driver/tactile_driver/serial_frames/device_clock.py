# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The clock of a device on the host's time: the earliest arrivals tell where it stands and how fast it runs."""
from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np

NS_PER_US = 1000
_WRAP = 2**32
_BLOCK_NS, _BLOCKS = 10**9, 30
_FEWEST = 5  # blocks needed to fit the rate of the device's clock; chosen
_FASTEST = 5e-4  # crystals of hobby boards differ by less; RC oscillators are calibrated to some 1 %, which _LARGEST_STEP tells
_LARGEST_STEP_NS = 10**9
_SLEW = 0.05  # of the time that passes: stamps come right without going back


class DeviceClock:
    """Maps a device's us (modulo 2**32) to host ns.

    Frames arrive late by what buffers, the USB's polling and the machine add, never early: of each second the frame with the least
    delay counts, and a straight line under the last half minute of them is the map, to which stamps keep so that they never go back.
    The device began anew, and the map with it, where its clock and the host's went on by amounts that differ by more than a second.
    """

    def __init__(self):
        self.resets = 0
        self._forget()

    def _forget(self) -> None:
        self._device_ns = self._host_ns = self._raw = None
        self._blocks: deque[tuple[int, int]] = deque(maxlen=_BLOCKS)  # (device ns, least offset ns), by second
        self._block_end = 0
        self._rate, self._offset, self._origin = 0.0, 0.0, 0
        self._shown: tuple[int, float] | None = None  # device ns, offset ns of the last answer

    def to_host(self, times_us: Sequence[int], arrived_ns: int, span_ns: int = 0) -> list[int]:
        """Host times, ns, of the device's times of frames that were all there at arrived_ns (a clock of small numbers: the monotonic one);
        span_ns: from the last of these times to the last sample in its frame."""
        mapped, waiting = [], []
        for time_us in times_us:
            if self._begins_anew(time_us, arrived_ns):
                mapped += self._shown_times(waiting)
                waiting = []
                self._forget()
                self.resets += 1
            waiting.append(self._unwrapped(time_us))
            self._raw, self._device_ns, self._host_ns = time_us, waiting[-1], arrived_ns
        self._note(waiting[-1], arrived_ns - span_ns - waiting[-1])
        return mapped + self._shown_times(waiting)

    def _shown_times(self, device_ns: list[int]) -> list[int]:
        """Host times of the device's, all with the offset of the last, which follows the line at a pace that keeps stamps in order."""
        if not device_ns:
            return []
        offset = self._line(device_ns[-1])
        if self._shown is not None:
            most = _SLEW * abs(device_ns[-1] - self._shown[0])
            offset = self._shown[1] + min(max(offset - self._shown[1], -most), most)
        self._shown = device_ns[-1], offset
        return [ns + round(offset) for ns in device_ns]

    def _line(self, device_ns: int) -> float:
        return self._offset + self._rate * (device_ns - self._origin)

    def _begins_anew(self, time_us: int, arrived_ns: int) -> bool:
        if self._raw is None:
            return False
        return abs((self._unwrapped(time_us) - self._device_ns) - (arrived_ns - self._host_ns)) > _LARGEST_STEP_NS

    def _unwrapped(self, time_us: int) -> int:
        """Device time that goes on where the counter begins again, ns."""
        if self._raw is None:
            return time_us * NS_PER_US
        return self._device_ns + ((time_us - self._raw + _WRAP // 2) % _WRAP - _WRAP // 2) * NS_PER_US

    def _note(self, device_ns: int, offset: int) -> None:
        if not self._blocks or device_ns >= self._block_end:
            self._blocks.append((device_ns, offset))
            self._block_end = device_ns + _BLOCK_NS
            self._fit()
        elif offset < self._blocks[-1][1]:
            self._blocks[-1] = (device_ns, offset)
            if offset < self._line(device_ns):
                self._fit()

    def _fit(self) -> None:
        """The line under the blocks' least offsets; of seconds that are over it takes the slope."""
        known = np.array(self._blocks, float)
        self._origin = self._blocks[0][0]
        since = known[:, 0] - self._origin
        slope = np.polyfit(since[:-1], known[:-1, 1] - known[0, 1], 1)[0] if len(known) > _FEWEST else 0.0
        self._rate = float(np.clip(slope, -_FASTEST, _FASTEST))
        self._offset = float((known[:, 1] - self._rate * since).min())
