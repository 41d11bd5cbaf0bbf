# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Maps the clock of a device to host time: the least delayed frames determine offset and drift."""
from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np

NS_PER_US = 1000
_WRAP = 2**32
_BLOCK_NS, _BLOCKS = 10**9, 30  # length of a block, and blocks in the fit: half a minute; chosen
_FEWEST = 5  # blocks needed to fit the drift of the device's clock; chosen
_FASTEST = 5e-4  # limit of the drift: crystals of hobby boards drift less; RC oscillators (about 1 %) exceed it and cause resets
_LARGEST_STEP_NS = 10**9  # difference of device and host intervals that counts as a restart of the device; chosen
_SLEW = 0.05  # correction per elapsed time: stamps converge without going back; chosen


class DeviceClock:
    """Maps device time, us modulo 2**32, to host time, ns.

    Buffers, USB polling and the scheduler delay frames; nothing makes them early. So the least delayed frame of each second counts, and
    the map is a straight line below the offsets of the last half minute. Stamps approach this line slowly and never go back. If device
    and host intervals differ by more than a second, the device has restarted: the map is discarded and resets is incremented.
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
        """Host times, ns, of the device times of frames received by arrived_ns (monotonic clock, ns).

        span_ns: time from the last of these device times to the last sample in its frame, ns.
        """
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
        """Host times, ns, of unwrapped device times, all with one offset; it changes by at most _SLEW, so stamps stay in order."""
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
        """Device time, ns, continued over wraps of the 32-bit counter."""
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
        """Fit the line below the least offset of each block; the slope uses completed blocks only."""
        known = np.array(self._blocks, float)
        self._origin = self._blocks[0][0]
        since = known[:, 0] - self._origin
        slope = np.polyfit(since[:-1], known[:-1, 1] - known[0, 1], 1)[0] if len(known) > _FEWEST else 0.0
        self._rate = float(np.clip(slope, -_FASTEST, _FASTEST))
        self._offset = float((known[:, 1] - self._rate * since).min())
