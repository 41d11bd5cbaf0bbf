# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The samples of a PSD finger on a serial port."""
from __future__ import annotations

from dataclasses import dataclass, replace

from ..base.pacing import EvenPace, stamp_of, wait_until
from ..base.protocol import Clock
from ..base.serial_source import FrameReader, SerialSource
from ...errors import BadArgument
from ...samples import CHANNELS
from ...serial_frames.assemble import SampleAssembler
from ...serial_frames.binary import SAMPLES, BinaryReader, Expected
from ...serial_frames.lines import LineReader
from .modulation import Demodulator

_LONGEST_POLL_S = 0.01  # Linux buffers 4 KB of unread input: 10 ms at 400 KB/s
_DEAF_BYTES = 4096  # so many bytes without a frame mean a wrong format or baud rate; chosen

FORMATS = ('binary', 'csv')


@dataclass(frozen=True)
class SerialSettings:
    """format: one of FORMATS; baud: bit/s; full_scale: of the converter, V; bits: of the converter, for CSV; batch_period: s; modulation:
    whether a fifth column tells if the finger's light is on; saturation: V, see Demodulator."""

    format: str
    baud: int
    full_scale: float
    bits: int
    batch_period: float
    modulation: bool = False
    saturation: float = 4.9


class PsdSerialSource(SerialSource):
    """A PSD finger. device: see serial_port.find_port; clock: ns for the stamps."""

    def __init__(self, device: str, settings: SerialSettings, clock: Clock):
        if settings.format not in FORMATS:
            raise BadArgument(f'format: {settings.format!r} is unknown; choose one of {", ".join(FORMATS)}')
        self._settings, self._missing, self._resets = settings, 0, 0
        self._columns = CHANNELS + settings.modulation
        self._assembler = SampleAssembler(settings.full_scale)
        self._demodulator = Demodulator(settings.saturation) if settings.modulation else None
        super().__init__(device, settings.baud, clock, _DEAF_BYTES)

    def _new_reader(self) -> FrameReader:
        return BinaryReader(Expected(SAMPLES, columns=self._columns), self._counts) if self._settings.format == 'binary' \
            else LineReader(self._columns, self._settings.bits, self._counts)

    def _begin(self) -> None:
        super()._begin()
        self._missing, self._resets = self._missing + self._assembler.missing, self._resets + self._assembler.clock.resets
        self._assembler = SampleAssembler(self._settings.full_scale)
        self._pace = EvenPace(1 / min(self._settings.batch_period, _LONGEST_POLL_S), skip=True)
        self._waiting, self._due_s = [], 0.0

    @property
    def skipped(self) -> int:
        """Number of samples lost in transmission."""
        return self._missing + self._assembler.missing

    def _poll(self) -> None:
        """Read the port; make blocks once per batch_period."""
        wait_until(self._pace.next())
        frames, arrived_ns = self._received()
        self._waiting += frames
        if not self._waiting or arrived_ns * 1e-9 < self._due_s:
            return
        self._due_s = arrived_ns * 1e-9 + self._settings.batch_period - 0.5 * min(self._settings.batch_period, _LONGEST_POLL_S)
        frames, self._waiting = self._waiting, []
        offset = stamp_of(arrived_ns, self._clock) - arrived_ns
        blocks = self._assembler.assemble(frames, arrived_ns)
        if self._demodulator is not None:
            blocks = [net for block in blocks for net in self._demodulator.net(block)]
        self._ready = [replace(block, stamp_ns=max(block.stamp_ns + offset, 0)) for block in blocks]

    def describe(self) -> dict:
        """The port and its error counts."""
        about = super().describe()
        unpaired = {'samples without a dark neighbour': self._demodulator.missing} if self._demodulator is not None else {}
        return about | unpaired | {'format': self._settings.format, 'missing samples': self.skipped,
                        'resets': about['resets'] + self._resets + self._assembler.clock.resets}

    def _deafness(self) -> str:
        return f'bytes come from {self._port.path}, but no frames: check parameters baud and format'
