# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""When samples were taken: the device's clock mapped to host time, and blocks of evenly spaced samples."""
from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np

from ..frame import SampleBlock
from ..sources.source import NS
from .constants import SERIAL
from .frames import CountFrame

NS_PER_US = 1000


class DeviceClock:
    """Maps device time, us modulo 2**32, to host time, ns.

    Buffers, USB polling and the scheduler delay frames; nothing makes them early. So the least delayed frame of the last seconds gives the
    offset. Stamps approach it slowly and never go back. If device and host intervals differ by more than a second, the device has
    restarted: the map is discarded and resets is incremented.
    """

    def __init__(self):
        self.resets = 0
        self._forget()

    def _forget(self) -> None:
        self._last: tuple[int, int, int] | None = None  # device us, the same continued over wraps, ns, and its arrival, ns
        self._min_offsets: deque[int] = deque(maxlen=SERIAL.blocks)  # least offset, ns, of each second
        self._block_end = 0
        self._shown: tuple[int, float] | None = None  # device ns, offset ns of the last answer

    def to_host(self, times_us: Sequence[int], arrived_ns: int, span_ns: int = 0) -> list[int]:
        """Host times, ns, of the device times of frames received by arrived_ns (monotonic clock, ns).

        span_ns: time from the last of these device times to the last sample in its frame, ns.
        """
        mapped, waiting = [], []
        for time_us in times_us:
            device_ns = time_us * NS_PER_US
            if self._last is not None:
                last_us, last_ns, host_ns = self._last
                half = SERIAL.clock_wrap // 2
                device_ns = last_ns + ((time_us - last_us + half) % SERIAL.clock_wrap - half) * NS_PER_US
                if abs(device_ns - last_ns - (arrived_ns - host_ns)) > SERIAL.max_step_ns:
                    mapped += self._mapped(waiting, arrived_ns)
                    waiting, device_ns = [], time_us * NS_PER_US
                    self._forget()
                    self.resets += 1
            waiting.append(device_ns)
            self._last = time_us, device_ns, arrived_ns
        return mapped + self._mapped(waiting, arrived_ns - span_ns)

    def _mapped(self, device_ns: list[int], arrived_ns: int) -> list[int]:
        """Host times, ns, of frames that arrived together, all with one offset, which changes so slowly that stamps stay in order."""
        if not device_ns:
            return []
        newest = device_ns[-1]
        offset = arrived_ns - newest
        if not self._min_offsets or newest >= self._block_end:
            self._min_offsets.append(offset)
            self._block_end = newest + SERIAL.block_ns
        self._min_offsets[-1] = min(self._min_offsets[-1], offset)
        offset = float(min(self._min_offsets))
        if self._shown is not None:
            most = SERIAL.slew * abs(newest - self._shown[0])
            offset = self._shown[1] + min(max(offset - self._shown[1], -most), most)
        self._shown = newest, offset
        return [ns + round(offset) for ns in device_ns]


class SampleAssembler:
    """Joins frames as long as no sample is missing between them; volts_full_scale: voltage of the count 2**bits, V.

    missing: number of samples lost between blocks, by the device's clock.
    """

    def __init__(self, volts_full_scale: float):
        self.clock = DeviceClock()
        self.missing = 0
        self._scale = volts_full_scale
        self._steps: deque[float] = deque(maxlen=SERIAL.period_intervals)
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
        runs: list[list[tuple[CountFrame, int, int, float]]] = [[]]  # of frames without a gap: first and last sample, period, ns
        for frame, stamp, span in zip(frames, stamps, spans):
            follows = self._last_ns is not None and self.clock.resets == self._resets
            step = stamp - self._last_ns if follows else math.nan
            if follows and not frame.interval_ns:
                self._steps.append(step)
            period = frame.interval_ns or (float(np.median(self._steps)) if self._steps else math.nan)
            if follows and period > 0:
                self.missing += max(round(step / period) - 1, 0)
            if runs[-1] and abs(step - period) > SERIAL.grid_tolerance * period:
                runs.append([])
            runs[-1].append((frame, stamp, stamp + span, period))
            self._last_ns, self._resets = stamp + span, self.clock.resets
        return [self._block(run) for run in runs]

    def _block(self, run: list[tuple[CountFrame, int, int, float]]) -> SampleBlock:
        counts = np.concatenate([frame.values for frame, *_ in run])
        (first, begin_ns, _, period), (*_, end_ns, _) = run[0], run[-1]
        period = (end_ns - begin_ns) / (len(counts) - 1) if len(counts) > 1 else period
        return SampleBlock(self._volts(counts, first.bits), begin_ns, period / NS)

    def _untimed(self, frames: list[CountFrame], arrived_ns: int) -> SampleBlock:
        """Block of frames without device time: samples spaced evenly from the last arrival to this one."""
        counts = np.concatenate([frame.values for frame in frames])
        since, self._last_ns = self._last_ns, arrived_ns
        period = (arrived_ns - since) / len(counts) if since is not None else 0.0
        return SampleBlock(self._volts(counts, frames[0].bits), round(arrived_ns - (len(counts) - 1) * period),
                           period / NS if period > 0 else float('nan'))

    def _volts(self, counts: np.ndarray, bits: int) -> np.ndarray:
        return counts.astype(np.float32) * np.float32(self._scale / 2**bits)
