# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Joins received frames into blocks of evenly spaced samples with host times."""
from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np

from .counts import CountFrame
from .device_clock import DeviceClock
from ..samples import SampleBlock

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
