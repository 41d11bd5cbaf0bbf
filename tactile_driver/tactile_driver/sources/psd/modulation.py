# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Subtracts the dark samples of a PSD finger whose light is switched from sample to sample."""
from __future__ import annotations

import numpy as np

from ...samples import CHANNELS, SampleBlock


class Demodulator:
    """Net voltages of the samples with light: each less the mean of its two dark neighbours, which cancels light that is constant or
    changes evenly. saturation: V, from which an output keeps its voltage, so that it is still seen to be saturated.

    missing: number of samples with light that lacked a dark neighbour.
    """

    def __init__(self, saturation: float):
        self._saturation = saturation
        self._kept, self._next_ns = np.zeros((0, CHANNELS + 1), np.float32), 0.0
        self.missing = 0

    def net(self, block: SampleBlock) -> list[SampleBlock]:
        """Blocks of net samples (M, 4) of a block with volts (N, 5), whose last column is above 0 where the light is on. The last sample
        waits for its dark neighbour in the next block."""
        period_ns = 1e9 * block.period_s
        if not abs(block.stamp_ns - self._next_ns) < 0.5 * period_ns:  # samples are missing, or the period is not known yet
            self._kept = self._kept[:0]
        rows = np.concatenate([self._kept, block.volts])
        begin_ns = block.stamp_ns - len(self._kept) * (period_ns if len(self._kept) else 0.0)
        lit, known = rows[:, CHANNELS] > 0, len(self._kept)
        self._kept, self._next_ns = rows[-2:], block.stamp_ns + len(block.volts) * period_ns
        used = np.flatnonzero(lit[1:-1] & ~lit[:-2] & ~lit[2:]) + 1
        self.missing += max(int(lit[max(known - 1, 0):-1].sum()) - len(used), 0)
        if not len(used) or not period_ns > 0:
            return []
        bright, dark = rows[used, :CHANNELS], 0.5 * (rows[used - 1, :CHANNELS] + rows[used + 1, :CHANNELS])
        net = np.where(bright >= self._saturation, bright, bright - dark)
        runs = np.split(np.arange(len(used)), np.flatnonzero(np.diff(used) != 2) + 1)
        return [SampleBlock(net[run], round(begin_ns + used[run[0]] * period_ns), 2 * block.period_s) for run in runs]
