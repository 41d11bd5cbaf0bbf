# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""When samples were taken: the device's clock mapped to host time, and blocks of evenly spaced samples."""
from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..samples import SampleBlock
from .frames import CountFrame

NS_PER_US = 1000
_WRAP = 2**32
_BLOCK_NS, _BLOCKS = 10**9, 5  # length of a block, and how many are kept: a crystal off by 50 ppm moves by 0.25 ms meanwhile. Chosen
_LARGEST_STEP_NS = 10**9  # difference of device and host intervals that counts as a restart of the device; chosen
_SLEW = 0.05  # correction per elapsed time: stamps converge without going back; chosen


class DeviceClock:
    """Maps device time, us modulo 2**32, to host time, ns.

    Buffers, USB polling and the scheduler delay frames; nothing makes them early. So the least delayed frame of the last seconds tells the
    offset. Stamps approach it slowly and never go back. If device and host intervals differ by more than a second, the device has
    restarted: the map is discarded and resets is incremented.
    """

    def __init__(self):
        self.resets = 0
        self._forget()

    def _forget(self) -> None:
        self._device_ns = self._host_ns = self._raw = None
        self._blocks: deque[int] = deque(maxlen=_BLOCKS)  # least offset, ns, of each second
        self._block_end = 0
        self._shown: tuple[int, float] | None = None  # device ns, offset ns of the last answer

    def to_host(self, times_us: Sequence[int], arrived_ns: int, span_ns: int = 0) -> list[int]:
        """Host times, ns, of the device times of frames received by arrived_ns (monotonic clock, ns).

        span_ns: time from the last of these device times to the last sample in its frame, ns.
        """
        mapped, waiting = [], []
        for time_us in times_us:
            if self._begins_anew(time_us, arrived_ns):
                if waiting:
                    self._note(waiting[-1], arrived_ns - waiting[-1])
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
        offset = float(min(self._blocks))
        if self._shown is not None:
            most = _SLEW * abs(device_ns[-1] - self._shown[0])
            offset = self._shown[1] + min(max(offset - self._shown[1], -most), most)
        self._shown = device_ns[-1], offset
        return [ns + round(offset) for ns in device_ns]

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
            self._blocks.append(offset)
            self._block_end = device_ns + _BLOCK_NS
        self._blocks[-1] = min(self._blocks[-1], offset)


NS = 1_000_000_000
_STEPS = 64  # latest intervals whose median is the period, for frames without one; chosen
_TOLERANCE = 0.5  # periods by which a sample may deviate from the regular grid before it counts as a gap; chosen


class _Piece(NamedTuple):
    frame: CountFrame
    begin_ns: int
    end_ns: int
    period_ns: float


class SampleAssembler:
    """Joins frames as long as no sample is missing between them; volts_full_scale: voltage of the count 2**bits, V.

    missing: number of samples lost between blocks, by the device's clock.
    """

    def __init__(self, volts_full_scale: float):
        self.clock = DeviceClock()
        self.missing = 0
        self._scale = volts_full_scale
        self._steps: deque[float] = deque(maxlen=_STEPS)
        self._last_ns: int | None = None  # host time of the last sample delivered
        self._resets = 0

    def assemble(self, frames: list[CountFrame], arrived_ns: int) -> list[SampleBlock]:
        """Blocks of the frames received by arrived_ns (monotonic clock, ns), stamped on that clock."""
        if not frames:
            return []
        if frames[0].time_us is None:
            return [self._untimed(frames, arrived_ns)]
        spans = [(len(frame.values) - 1) * (frame.interval_ns or 0) for frame in frames]
        stamps = self.clock.to_host([frame.time_us for frame in frames], arrived_ns, spans[-1])
        blocks, run = [], []
        for frame, stamp, span in zip(frames, stamps, spans):
            period = frame.interval_ns or self._step_to(stamp)
            if run and abs(stamp - run[-1].end_ns - period) > _TOLERANCE * period:
                blocks.append(self._block(run))
                run = []
            self._count_gap(stamp, period)
            self._last_ns = stamp + span
            run.append(_Piece(frame, stamp, stamp + span, period))
        return [*blocks, self._block(run)]

    def _step_to(self, stamp: int) -> float:
        """Median interval, ns, between samples of frames without an interval; NaN before the second sample."""
        if self._last_ns is not None and self.clock.resets == self._resets:
            self._steps.append(stamp - self._last_ns)
        return float(np.median(self._steps)) if self._steps else float('nan')

    def _count_gap(self, stamp: int, period: float) -> None:
        if self._last_ns is not None and self.clock.resets == self._resets and period > 0:
            self.missing += max(round((stamp - self._last_ns) / period) - 1, 0)
        self._resets = self.clock.resets

    def _block(self, run: list[_Piece]) -> SampleBlock:
        counts = np.concatenate([piece.frame.values for piece in run])
        period = (run[-1].end_ns - run[0].begin_ns) / (len(counts) - 1) if len(counts) > 1 else run[0].period_ns
        return SampleBlock(self._volts(counts, run[0].frame.bits), run[0].begin_ns, period / NS)

    def _untimed(self, frames: list[CountFrame], arrived_ns: int) -> SampleBlock:
        """Block of frames without device time: samples spaced evenly from the last arrival to this one."""
        counts = np.concatenate([frame.values for frame in frames])
        since, self._last_ns = self._last_ns, arrived_ns
        period = (arrived_ns - since) / len(counts) if since is not None else 0.0
        return SampleBlock(self._volts(counts, frames[0].bits), round(arrived_ns - (len(counts) - 1) * period),
                           period / NS if period > 0 else float('nan'))

    def _volts(self, counts: np.ndarray, bits: int) -> np.ndarray:
        return counts.astype(np.float32) * np.float32(self._scale / 2**bits)
