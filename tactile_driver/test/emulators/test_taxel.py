# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The emulator and the source that reads it: bytes through a pseudo-terminal, as from hardware."""
import threading
import time

import numpy as np
import pytest
from tactile_driver.emulators.taxel import TaxelEmulator, main
from tactile_driver.errors import BadArgument, DeviceLost
from tactile_driver.sources.source import NothingYet
from tactile_driver.serial.taxel import TaxelSerialSource

pytestmark = pytest.mark.full  # a device in a thread keeps its own time


class Bench:
    """A running emulator, and a source that is open on it."""

    def __init__(self, folder, shape=(44, 44), bits=8, rate=200.0):
        self.emulator = TaxelEmulator(folder / 'port', 'disc', rate, 0, shape, bits, keep=True)
        self._ended = False
        self._thread = threading.Thread(target=self.emulator.run, args=(lambda: self._ended,), daemon=True)
        self._thread.start()
        self.source = TaxelSerialSource(str(folder / 'port'), 921600, shape, time.time_ns)
        self.source.open()

    def read(self, seconds, enough=None):
        """Frames of the next seconds; enough: as many end it before."""
        frames, end = [], time.monotonic() + seconds
        while time.monotonic() < end and len(frames) != enough:
            try:
                frames.append(self.source.read())
            except NothingYet:
                pass
            except DeviceLost:
                try:
                    self.source.open()
                except DeviceLost:
                    time.sleep(0.02)
        return frames

    def close(self):
        self._ended = True
        self._thread.join()
        self.source.close()


@pytest.fixture
def bench(tmp_path):
    rigs = []

    def make(**settings):
        rigs.append(Bench(tmp_path, **settings))
        return rigs[-1]
    yield make
    for rig in rigs:
        rig.close()


@pytest.mark.parametrize('shape, bits', [((44, 44), 8), ((13, 6), 12), ((100, 7), 16)])
def test_every_frame_arrives_as_it_was_sent(bench, shape, bits):
    rig = bench(shape=shape, bits=bits, rate=50.0)  # two frames fill the port: a busy machine may come 40 ms late
    frames = rig.read(30.0, 40)
    sent = [values.tolist() for _, values in rig.emulator.sent]
    assert len(frames) == 40 and rig.source.skipped == rig.source.corrupt == 0
    first = sent.index(frames[0].image.tolist())
    assert [frame.image.tolist() for frame in frames] == sent[first:first + len(frames)] or len(set(map(str, sent))) < 3
    assert {frame.encoding for frame in frames} == {'mono8' if bits == 8 else 'mono16'}
    steps = np.diff([frame.stamp_ns for frame in frames])
    assert (steps > 0).all() and np.median(steps) == pytest.approx(20e6, rel=0.02)


@pytest.mark.parametrize('fault', ['drop', 'swap', 'garbage', 'unplug', 'reset'])
def test_faults_are_counted_or_survived_and_nothing_wrong_arrives(bench, fault):
    rig = bench()
    rig.read(0.2)
    rig.emulator.fault(fault)
    frames = rig.read(30.0, 60)
    sent = {values.tobytes() for _, values in rig.emulator.sent}
    assert len(frames) == 60 and all(frame.image.astype(np.uint16).tobytes() in sent for frame in frames)


def test_frames_of_another_size_are_told(bench):
    rig = bench(rate=500.0)
    rig.source._shape = (10, 10)
    rig.source.open()
    assert not rig.read(0.6)
    assert 'a matrix of 44 x 44' in rig.source.remark and 'set the parameters' in rig.source.remark


def test_wrong_words(tmp_path, capsys):
    with pytest.raises(BadArgument, match='1 to 256'):
        TaxelEmulator(tmp_path / 'port', shape=(300, 1))
    assert main(['--scene', 'nowhere', '--link', str(tmp_path / 'p')]) == 1
    assert 'two_fingers' in capsys.readouterr().err
