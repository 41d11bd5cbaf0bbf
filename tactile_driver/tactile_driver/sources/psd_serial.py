# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The samples of a PSD finger on a serial port."""
from __future__ import annotations

import time
from dataclasses import dataclass, replace

from ..errors import BadArgument
from ..samples import CHANNELS, SampleBlock
from ..serial_frames.assemble import SampleAssembler
from ..serial_frames.binary import SAMPLES, BinaryReader, Expected
from ..serial_frames.counts import FrameCounts
from ..serial_frames.lines import LineReader
from .pacing import EvenPace, stamp_of, wait_until
from .protocol import Clock, NothingYet
from .serial_port import SerialPort

_LONGEST_POLL_S = 0.01  # Linux keeps 4 KB of what nobody has read: 10 ms at 400 KB/s
_DEAF_BYTES = 4096  # without a frame among so many, format or baud rate are wrong

FORMATS = ('binary', 'csv')


@dataclass(frozen=True)
class SerialSettings:
    """format: of FORMATS; baud: bits a second; full_scale: V, of the converter; bits: of the converter, for CSV, which does not tell;
    batch_period: s."""

    format: str
    baud: int
    full_scale: float
    bits: int
    batch_period: float


class PsdSerialSource:
    """device: see serial_port.find_port; clock: ns for the stamps."""

    live, on_demand = True, False

    def __init__(self, device: str, settings: SerialSettings, clock: Clock):
        if settings.format not in FORMATS:
            raise BadArgument(f'format: {settings.format!r} is unknown; choose one of {", ".join(FORMATS)}')
        self._port, self._settings, self._clock = SerialPort(device, settings.baud), settings, clock
        self._counts, self._missing, self._resets = FrameCounts(), 0, 0
        self._assembler = SampleAssembler(settings.full_scale)
        self._begin()

    def _begin(self) -> None:
        self._reader = BinaryReader(Expected(SAMPLES, columns=CHANNELS), self._counts) if self._settings.format == 'binary' \
            else LineReader(CHANNELS, self._settings.bits, self._counts)
        self._missing, self._resets = self._missing + self._assembler.missing, self._resets + self._assembler.clock.resets
        self._assembler = SampleAssembler(self._settings.full_scale)
        self._pace = EvenPace(1 / min(self._settings.batch_period, _LONGEST_POLL_S), skip=True)
        self._blocks: list[SampleBlock] = []
        self._waiting, self._due_s, self._deaf = [], 0.0, 0

    @property
    def skipped(self) -> int:
        """Samples that the device has sent and that did not come, or not whole."""
        return self._missing + self._assembler.missing

    @property
    def corrupt(self) -> int:
        """Frames or lines with a wrong check sum or impossible content."""
        return self._counts.bad_crc + self._counts.refused

    def open(self) -> None:
        """Open the port. Raises DeviceLost."""
        self._port.open()
        self._begin()

    def read(self, wanted: bool = True) -> SampleBlock | None:
        """The next samples. Raises NothingYet or DeviceLost."""
        if not self._blocks:
            self._poll()
        if not self._blocks:
            raise NothingYet
        block = self._blocks.pop(0)
        return block if wanted else None

    def _poll(self) -> None:
        """Take what has come; blocks are made once a batch_period."""
        wait_until(self._pace.next())
        data = self._port.read()
        arrived_ns = time.monotonic_ns()
        frames = self._reader.feed(data)
        self._deaf = 0 if frames else self._deaf + len(data)
        self._waiting += frames
        if not self._waiting or arrived_ns * 1e-9 < self._due_s:
            return
        self._due_s = arrived_ns * 1e-9 + self._settings.batch_period - 0.5 * min(self._settings.batch_period, _LONGEST_POLL_S)
        frames, self._waiting = self._waiting, []
        offset = stamp_of(arrived_ns, self._clock) - arrived_ns
        self._blocks = [replace(block, stamp_ns=max(block.stamp_ns + offset, 0))
                        for block in self._assembler.assemble(frames, arrived_ns)]

    def close(self) -> None:
        """Close the port."""
        self._port.close()

    def describe(self) -> dict:
        """The port and what it has met."""
        counts = self._counts
        return {'source': 'device', 'path': self._port.path, 'device': self._port.path, 'baud': self._settings.baud,
                'format': self._settings.format, 'rate': 0.0, 'crc errors': counts.bad_crc, 'refused frames': counts.refused,
                'garbage bytes': counts.garbage, 'missing frames': counts.missing, 'missing samples': self.skipped,
                'resets': counts.resets + self._resets + self._assembler.clock.resets}

    @property
    def remark(self) -> str:
        """What is wrong though bytes come, ''."""
        if self._deaf < _DEAF_BYTES:
            return ''
        return f'bytes come from {self._port.path}, but no frames: check parameters baud and format'

    def calibration(self) -> None:
        """None: there is no camera."""
