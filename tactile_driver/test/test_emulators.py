# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Emulated firmware on a pseudo-terminal, read by the drivers, with the faults of real links."""

import threading
import time
from contextlib import suppress

import numpy as np
import pytest

from tactile_driver.emulators import FAULTS, PsdEmulator, TaxelEmulator, psd_emulator, taxel_emulator
from tactile_driver.errors import BadArgument, DeviceLost
from tactile_driver.parameters.drivers import PSD_DRIVER_PARAMETERS, TAXEL_DRIVER_PARAMETERS
from tactile_driver.parameters.table import defaults
from tactile_driver.serial.psd import PsdSerialSource
from tactile_driver.serial.taxel import TaxelSerialSource
from tactile_driver.sources.source import NothingYet

VOLT = 5 / 4096

pytestmark = pytest.mark.full  # a device in a thread keeps its own time


class Bench:
    """A running emulator, and a source that is open on its port."""

    def __init__(self, emulator, source):
        self.emulator, self.source, self._ended = emulator, source, threading.Event()
        emulator.sent = []
        self._thread = threading.Thread(target=emulator.run, args=(self._ended.is_set,), daemon=True)
        self._thread.start()
        source.open()

    def read(self, enough):
        """The next so many that come. A lost port is opened again."""
        found, end = [], time.monotonic() + 60.0
        while len(found) < enough:
            assert time.monotonic() < end, len(found)
            try:
                found.append(self.source.read())
            except NothingYet:
                pass
            except DeviceLost:
                with suppress(DeviceLost):
                    self.source.open()
                time.sleep(0.02)
        return found

    def check(self, blocks):
        """Every sample delivered is one that was sent, and its neighbours in a block are its neighbours."""
        sent = [tuple(counts) for frame in self.emulator.sent for counts in frame.tolist()]
        positions = {}
        for position, counts in enumerate(sent):
            positions.setdefault(counts, []).append(position)
        for block in blocks:
            counts = [tuple(row) for row in np.round(block.volts / VOLT).astype(int).tolist()]
            assert any(sent[p:p + len(counts)] == counts for p in positions.get(counts[0], []))

    def close(self):
        self._ended.set()
        self._thread.join(5)
        self.source.close()


def finger(port, format='binary', rate=2000.0, scene='demo', modulation=False):
    """A PSD finger on a port, and its source."""
    settings = {**defaults(PSD_DRIVER_PARAMETERS), 'device': str(port), 'format': format, 'modulation': modulation}
    emulator = PsdEmulator(port, scene, rate, 4, format=format)
    emulator.modulation = modulation
    return emulator, PsdSerialSource(settings, time.time_ns)


def array(port, shape=(44, 44), bits=8, rate=200.0):
    """A taxel array on a port, and its source."""
    return (TaxelEmulator(port, 'disc', rate, 0, shape, bits),
            TaxelSerialSource(dict(defaults(TAXEL_DRIVER_PARAMETERS), device=str(port), rows=shape[0], columns=shape[1]), time.time_ns))


@pytest.fixture
def bench(tmp_path):
    """bench(kind, **settings): a finger or an array that runs."""
    made = []

    def make(kind=finger, **settings):
        made.append(Bench(*kind(tmp_path / 'port', **settings)))
        return made[-1]
    yield make
    for each in made:
        each.close()


def test_stamps_of_a_slow_simulation_are_of_its_own_time(tmp_path):
    period_ns, slowed = 5_000_000, TaxelEmulator(tmp_path / 'port', 'disc', 200.0)
    slowed.pace, slowed.runs_on = 0.5, False
    settings = dict(defaults(TAXEL_DRIVER_PARAMETERS), device=str(tmp_path / 'port'), simulated_time=True)
    rig = Bench(slowed, TaxelSerialSource(settings, lambda: len(slowed.sent) * period_ns))
    begin = time.monotonic()
    stamps = np.array([frame.stamp_ns for frame in rig.read(60)])
    rig.close()
    assert (np.diff(stamps) > 0).all() and stamps[-1] <= len(slowed.sent) * period_ns
    assert np.median(np.diff(stamps)) == pytest.approx(period_ns, rel=0.06), 'not slower, and not in steps of the clock'
    assert time.monotonic() - begin > 0.8 * 60 * 2e-9 * period_ns, 'at half of the pace'


@pytest.mark.parametrize('format', ['binary', 'csv'])
def test_samples_come_whole_and_under_the_time_they_were_taken(bench, format):
    rig = bench(format=format)
    blocks = rig.read(100)
    rig.check(blocks)
    assert format == 'csv' or blocks[-1].period_s == pytest.approx(5e-4, rel=1e-6)
    stamps = np.array([b.stamp_ns for b in blocks])
    assert (np.diff(stamps) > 0).all() and abs(time.time_ns() - stamps[-1]) < 20e9  # a busy machine is late


@pytest.mark.parametrize('fault', [f for f in FAULTS if f not in ('unplug', 'pause')])
def test_a_fault_costs_a_frame_or_two_and_gives_no_false_sample(bench, fault):
    rig = bench()
    blocks = rig.read(30)
    for _ in range(5):
        rig.emulator.fault(fault)
        blocks += rig.read(10)
    rig.check(blocks + rig.read(30))
    about = rig.source.describe()
    reported = {'drop': 'missing frames', 'swap': 'crc errors', 'garbage': 'garbage bytes', 'wrong_baud': 'missing frames',
                'reset': 'resets'}
    assert about[reported[fault]] > 0


@pytest.mark.parametrize('format', ['binary', 'csv'])
def test_with_modulation_the_driver_publishes_net_voltages_at_half_the_rate(bench, format):
    rig = bench(scene='light', format=format, modulation=True)  # nothing touches, under lamps that flicker
    blocks = rig.read(100)
    volts = np.concatenate([block.volts for block in blocks])
    assert volts.shape[1] == 4 and len(volts) >= 100 and abs(volts.mean(0)).max() < 2e-3
    assert format == 'csv' or blocks[-1].period_s == pytest.approx(1e-3, rel=1e-6)
    assert 'samples without a dark neighbour' in rig.source.describe()


@pytest.mark.parametrize('shape, bits', [((44, 44), 8), ((13, 6), 12), ((100, 7), 16)])
def test_a_frame_arrives_as_it_was_sent(bench, shape, bits):
    rig = bench(array, shape=shape, bits=bits, rate=50.0)
    frames = rig.read(20)
    sent = {values.tobytes() for values in rig.emulator.sent}  # two frames fill the port: a machine that comes late loses some
    assert all(frame.image.astype(np.uint16).tobytes() in sent for frame in frames)
    assert {frame.encoding for frame in frames} == {'mono8' if bits == 8 else 'mono16'}
    steps = np.diff([frame.stamp_ns for frame in frames])
    assert (steps > 0).all()


def test_wrong_words(tmp_path, capsys):
    port = tmp_path / 'port'
    for wrong, part in ((lambda: PsdEmulator(port).fault('melt'), 'drop, swap'), (lambda: PsdEmulator(port, batch=0), 'batch'),
                        (lambda: TaxelEmulator(port, shape=(300, 1)), '1 to 256')):
        with pytest.raises(BadArgument, match=part):
            wrong()
    for run, known in ((psd_emulator, 'calibration'), (taxel_emulator, 'two_fingers')):
        assert run(['--scene', 'nowhere', '--link', str(tmp_path / 'p')]) == 1
        assert known in capsys.readouterr().err
