# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Sources on serial ports, with modulated light, and matrices in files."""
import itertools
import os
import time
import tty
from contextlib import suppress
from types import SimpleNamespace

import numpy as np
import pytest
from tactile_driver.errors import BadArgument, BadFrame, BadRecording, DeviceLost
from tactile_driver.samples import SampleBlock
from tactile_driver.serial import port as serial_port
from tactile_driver.parameters.drivers import PSD_DRIVER_PARAMETERS
from tactile_driver.parameters.table import defaults
from tactile_driver.serial.port import SerialSource, find_port
from tactile_driver.serial.psd import Demodulator, PsdSerialSource
from tactile_driver.serial.taxel import TaxelFileSource, read_table
from tactile_driver.sources import source as pacing
from tactile_driver.sources.source import EndOfSource, NothingYet
from waiting import until

PORTS = [SimpleNamespace(device='/dev/ttyUSB0', description='FT232R', serial_number='A901'),
         SimpleNamespace(device='/dev/ttyUSB1', description='FT232R', serial_number='A902')]


def test_a_port_is_found_by_its_serial_number(monkeypatch, tmp_path):
    monkeypatch.setattr(serial_port.list_ports, 'comports', lambda: PORTS)
    monkeypatch.setattr(serial_port, '_BY_ID', tmp_path)
    (tmp_path / 'usb-FTDI').write_text('')
    assert find_port('A902') == '/dev/ttyUSB1'
    assert find_port('usb-FTDI') == str(tmp_path / 'usb-FTDI')
    with pytest.raises(DeviceLost, match='several.*A901'):
        find_port('A90')


class Lines(SerialSource):
    deaf_bytes, settings = 20, 'wonder'

    def _new_reader(self):
        return self

    def feed(self, data):
        return [line.decode() for line in data.splitlines() if line.startswith(b'+')]

    def _poll(self):
        return self._received()[0]


@pytest.fixture
def port():
    master, slave = os.openpty()
    tty.setraw(slave)
    source = Lines({'device': os.ttyname(slave), 'baud': 9600}, lambda: 0)
    source.open()
    yield master, source
    source.close()
    with suppress(OSError):
        os.close(master), os.close(slave)


def read(source):
    """What has come, None without it."""
    with suppress(NothingYet):
        return source.read()


def test_frames_come_one_by_one_and_those_unwanted_are_passed_over(port):
    master, source = port
    os.write(master, b'+a\n+b\n+c\n')
    assert until(lambda: read(source)) == '+a' and [source.read(wanted=False), source.read()] == [None, '+c']
    with pytest.raises(NothingYet):
        source.read()
    assert source.describe()['baud'] == 9600 and source.describe()['path'] == source.describe()['device']
    assert (source.corrupt, source.warning) == (0, '')
    os.close(master)
    with pytest.raises(DeviceLost, match='is gone'):
        source.read()
    source.close()
    with pytest.raises(DeviceLost, match='not open'):
        source.read()


def test_bytes_without_a_frame_are_warned_of_until_one_comes_or_the_port_is_opened_anew(port):
    master, source = port
    for text, warned in ((b'x' * 19, False), (b'x', True), (b'+y\n', False)):
        os.write(master, text)
        assert until(lambda: read(source) or ('no frames: check parameters wonder' in source.warning) == warned)  # noqa: B023
        assert bool(source.warning) == warned
    os.write(master, b'x' * 40)
    assert until(lambda: read(source) or source.warning)
    source.open()
    assert source.warning == ''


SETTINGS = defaults(PSD_DRIVER_PARAMETERS)


def test_a_missing_port_is_reported_with_those_that_exist():
    for device in ('/dev/nothing', 'no-such-serial-number'):
        with pytest.raises(DeviceLost, match='there are'):
            PsdSerialSource({**SETTINGS, 'device': device}, lambda: 0).open()


def test_wrong_settings():
    with pytest.raises(BadArgument, match='serial port'):
        PsdSerialSource(SETTINGS, lambda: 0)


RATE = 10_000.0
PERIOD_NS = round(1e9 / RATE)
LIGHT = np.array([0.5, 0.8, 1.1, 0.4], np.float32)


def samples(count, ambient, lit=None):
    """(count, 5) V: the light of a contact on every second sample, over ambient light (count,)."""
    lit = np.arange(count) % 2 == 0 if lit is None else lit
    return np.column_stack([lit[:, None] * LIGHT + np.asarray(ambient)[:, None] / 4, lit]).astype(np.float32)


def net(rows, size, begin_ns=10**9):
    """All net blocks of rows in blocks of that size."""
    made = Demodulator(4.9)
    return made, [part for k in range(0, len(rows), size)
                  for part in made.net(SampleBlock(rows[k:k + size], begin_ns + k * PERIOD_NS, 1 / RATE))]


@pytest.mark.parametrize('size', [1, 2, 7, 50, 1000])
def test_ambient_light_flicker_and_steps_are_gone_and_stamps_are_those_of_the_lit_samples(size):
    t = np.arange(1000) / RATE
    ambient = 1.2 + 0.3 * np.sin(200 * np.pi * t) + 2 * np.clip((t - 0.05) / 0.02, 0, 1)
    made, blocks = net(samples(1000, ambient), size)
    volts = np.concatenate([block.volts for block in blocks])
    assert volts == pytest.approx(np.tile(LIGHT, (499, 1)), abs=2e-3)
    stamps = np.concatenate([block.stamp_ns + 2 * PERIOD_NS * np.arange(len(block.volts)) for block in blocks])
    assert stamps.tolist() == [10**9 + k * PERIOD_NS for k in range(2, 1000, 2)]
    assert {block.period_s for block in blocks} == {2 / RATE} and made.missing <= 1


def test_what_lacks_a_dark_neighbour_is_left_out_and_counted():
    lit = np.arange(40) % 2 == 0
    lit[21] = True  # three lit samples in a row
    made, blocks = net(samples(40, np.zeros(40), lit), 40)
    assert [len(block.volts) for block in blocks] == [9, 8] and made.missing >= 3
    assert blocks[1].stamp_ns == 10**9 + 24 * PERIOD_NS


def test_samples_around_a_gap_are_not_joined():
    rows, made = samples(40, np.zeros(40)), Demodulator(4.9)
    first = made.net(SampleBlock(rows[:20], 10**9, 1 / RATE))
    second = made.net(SampleBlock(rows[21:], 10**9 + 35 * PERIOD_NS, 1 / RATE))
    assert [b.stamp_ns for b in first + second] == [10**9 + 2 * PERIOD_NS, 10**9 + 36 * PERIOD_NS]


def test_a_saturated_output_stays_saturated():
    rows = samples(20, np.full(20, 16.0))
    rows[::2, 2] = 4.95
    _, blocks = net(rows, 20)
    assert (blocks[0].volts[:, 2] >= 4.9).all() and blocks[0].volts[:, 0] == pytest.approx(LIGHT[0], abs=1e-5)


def test_without_a_known_period_or_light_there_is_nothing():
    made = Demodulator(4.9)
    assert made.net(SampleBlock(samples(5, np.zeros(5)), 10**9, float('nan'))) == []
    assert made.net(SampleBlock(samples(8, np.zeros(8), np.zeros(8, bool)), 2 * 10**9, 1 / RATE)) == []


FRAMES = np.arange(3 * 2 * 4, dtype=np.uint8).reshape(3, 2, 4)


def source(path, array='', rate=0.0, loop=False, shape=(2, 4), clock=time.time_ns):
    opened = TaxelFileSource({'path': str(path), 'topic': array, 'rate': rate, 'loop': loop, 'rows': shape[0], 'columns': shape[1],
                              'transposed': False}, clock)
    opened.open()
    return opened


def all_of(opened):
    frames = []
    while True:
        try:
            frames.append(opened.read().image.tolist())
        except EndOfSource:
            return frames


def test_npz_npy_and_csv_hold_the_same(tmp_path):
    np.savez(tmp_path / 'a.npz', frames=FRAMES, t=np.arange(3) * 0.01)
    np.save(tmp_path / 'a.npy', FRAMES)
    np.savetxt(tmp_path / 'a.csv', FRAMES.reshape(3, -1), delimiter=',')
    np.savetxt(tmp_path / 'timed.csv', np.column_stack([np.arange(3) * 0.01, FRAMES.reshape(3, -1)]), delimiter=',')
    for name in ('a.npz', 'a.npy', 'a.csv', 'timed.csv'):
        assert all_of(source(tmp_path / name)) == FRAMES.tolist()


def test_recorded_times_are_kept(tmp_path, monkeypatch):
    now = [10**12]
    monkeypatch.setattr(pacing, 'time', SimpleNamespace(
        monotonic_ns=lambda: now[0], sleep=lambda seconds: now.__setitem__(0, now[0] + round(1e9 * seconds))))
    np.savez(tmp_path / 'a.npz', pad1=FRAMES, t_ms=10**12 + np.array([0, 50, 150]))
    opened = source(tmp_path / 'a.npz', rate=-1.0, clock=lambda: now[0])
    assert np.diff([opened.read().stamp_ns for _ in range(3)]) == pytest.approx([50e6, 100e6], abs=1e3)


def test_one_of_several_arrays_and_a_loop(tmp_path):
    np.savez(tmp_path / 'a.npz', pad1=FRAMES, pad5=FRAMES + 1)
    with pytest.raises(BadRecording, match='pad1, pad5'):
        source(tmp_path / 'a.npz')
    opened = source(tmp_path / 'a.npz', 'pad5', loop=True)
    assert [opened.read().image[0, 0] for _ in range(4)] == [1, 9, 17, 1]


@pytest.mark.parametrize('name, content', [('a.txt', b''), ('a.npz', b'no'), ('a.csv', b'1,2\n'), ('a.csv', b'x'), ('none.npy', None)])
def test_broken_files(tmp_path, name, content):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(BadRecording):
        source(tmp_path / name)


def test_frames_of_another_size_are_skipped(tmp_path):
    np.save(tmp_path / 'a.npy', FRAMES)
    with pytest.raises(BadFrame):
        source(tmp_path / 'a.npy', shape=(4, 4)).read()


TABLE = np.arange(5 * 3 * 4).reshape(5, 3, 4) + 0.5
TABLE_TIMES = np.array([0.0, 0.02, 0.04, 0.07, 0.08])


@pytest.mark.parametrize(('separator', 'head', 'time', 'lines'), itertools.product(
    [',', ';', '\t', ', '], [False, True], ['', 's', 'ms'], [1, 3]))
def test_tables_of_all_kinds(tmp_path, separator, head, time, lines):
    scale = 1000 if time == 'ms' and head else 1  # without a header a time is in s
    rows = TABLE.reshape(5 * lines, -1)
    if time:
        rows = np.column_stack([np.repeat(scale * TABLE_TIMES, lines), rows])
    text = [separator.join(f'{x:g}' for x in row) for row in rows]
    if separator == ';':
        text = [line.replace('.', ',') for line in text]
    if head:
        names = ([f'time ({time})'] if time else []) + [f'c{k}' for k in range(12 // lines)]
        text.insert(0, separator.join(names))
    (tmp_path / 'a.csv').write_text('\ufeff' * head + '\r\n'.join(text) + '\n\n', encoding='utf-8')
    frames, times = read_table(tmp_path / 'a.csv', (3, 4))
    np.testing.assert_allclose(frames, TABLE)
    if time:
        np.testing.assert_allclose(times, TABLE_TIMES)
    else:
        assert times is None


@pytest.mark.parametrize(('text', 'said'), [
    ('1,2,3\n4,5,6\n', '2 lines of 3 numbers; expected for 3 x 4 taxels: 12 a line'), ('', 'no line of numbers'),
    ('a,b\nc,d\n1,2\n', 'line 2 is not of numbers'),
    ('1,2,3,4\n1,2,3\n', 'line 2 has 3 numbers, those before it 4'),
    ('1,2,3,4\n' * 4, '4 lines of 4 numbers'), ('1,1,2,3,4\n' * 6, 'do not increase at frame 1'),
    ('1,2,x,4\n1,2,3,4\n1,2,y,4\n', 'line 3')])
def test_what_was_seen_and_what_is_expected_are_reported(tmp_path, text, said):
    (tmp_path / 'a.csv').write_text(text)
    with pytest.raises(BadRecording, match=said):
        read_table(tmp_path / 'a.csv', (3, 4))
