# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A PSD finger: on a serial port, with light that may be switched from sample to sample; and simulated."""
from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..frame import CHANNELS, SampleBlock
from ..simulation.psd_scene import open_psd_scene
from ..sources.source import NS, Clock, EvenPace, SceneSource, stamp_of, wait_until
from .clock import SampleAssembler
from .constants import SERIAL
from .frames import SAMPLES, BinaryReader, LineReader
from .port import SerialSource


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


FORMATS = ('binary', 'csv')


class PsdSerialSource(SerialSource):
    """A PSD finger.

    values: as of SerialSource, and format: one of FORMATS; adc.full_scale: of the converter, V; adc.bits: of the converter, for CSV;
    batch_period: s; modulation: whether a fifth column indicates that the finger's light is on; saturation: V, see Demodulator.
    """

    def __init__(self, values: Mapping, clock: Clock):
        self._assembler, self._lost, self._resets = SampleAssembler(values['adc.full_scale']), 0, 0
        self._demodulator = Demodulator(values['saturation']) if values['modulation'] else None
        super().__init__(values, clock)

    def _new_reader(self) -> BinaryReader | LineReader:
        columns = CHANNELS + self._values['modulation']
        return BinaryReader(SAMPLES, None, columns, self._counts) if self._values['format'] == 'binary' \
            else LineReader(columns, self._values['adc.bits'], self._counts)

    def _begin(self) -> None:
        super()._begin()
        self._lost, self._resets = self.skipped, self._resets + self._assembler.clock.resets
        self._assembler = SampleAssembler(self._values['adc.full_scale'])
        self._poll_s = min(self._values['batch_period'], SERIAL.max_poll_s)
        self._pace = EvenPace(1 / self._poll_s)
        self._waiting, self._due_ns = [], 0

    @property
    def skipped(self) -> int:
        """Number of samples lost in transmission."""
        return self._lost + self._assembler.missing

    def _poll(self) -> list[SampleBlock]:
        """Read the port; make blocks once per batch_period."""
        due_ns = self._pace.next()
        wait_until(due_ns)
        frames, arrived_ns = self._received()
        self._waiting += frames
        if not self._waiting or due_ns < self._due_ns:
            return []
        # From when the poll was due: from when a late one came, the next would come too early, and its samples would wait for another.
        self._due_ns = due_ns + round((self._values['batch_period'] - 0.5 * self._poll_s) * NS)
        frames, self._waiting = self._waiting, []
        offset = stamp_of(arrived_ns, self._clock) - arrived_ns
        blocks = self._assembler.assemble(frames, arrived_ns)
        if self._demodulator is not None:
            blocks = [net for block in blocks for net in self._demodulator.net(block)]
        return [replace(block, stamp_ns=max(block.stamp_ns + offset, 0)) for block in blocks]

    def describe(self) -> dict:
        """The port and its error counts."""
        about = super().describe()
        unpaired = {'samples without a dark neighbour': self._demodulator.missing} if self._demodulator is not None else {}
        return about | unpaired | {'format': self._values['format'], 'missing samples': self.skipped,
                                   'resets': about['resets'] + self._resets + self._assembler.clock.resets}


class PsdSimulatedSource(SceneSource):
    """A scene of the simulated finger; a step is a sample. values: as of SceneSource, and batch_period: s of samples per block, returned
    when its last sample is due."""

    truths = ('contacts',)
    usual_rate = 1000.0
    max_catch_up = 5
    sensor = 'psd_finger'
    _open_scene = staticmethod(open_psd_scene)

    def __init__(self, values: Mapping, clock: Clock):
        super().__init__(values, clock)
        self.count = max(round(values['batch_period'] * self.rate), 1)

    def _make(self, number: int):
        counts, truth = self._scene.play(number, self.count)
        electronics = self._scene.electronics
        return counts.astype(np.float32) * np.float32(electronics.full_scale / 2**electronics.bits), truth

    def _handed_over(self, made, due_ns: int) -> SampleBlock:
        volts, truth = made
        first = due_ns - round((self.count - 1) / self.rate * NS)
        return SampleBlock(volts, self.stamp(min(first, time.monotonic_ns())), 1 / self.rate, truth)
