# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Serial ports: protocols, whole and damaged; sources on ports, with modulated light, and matrices in files."""
import itertools
import os
import time
import tty
from contextlib import suppress
from types import SimpleNamespace

import numpy as np
import pytest
from waiting import until

from tactile_driver.errors import BadArgument, BadRecording, DeviceLost
from tactile_driver.frame import SampleBlock
from tactile_driver.parameters.drivers import PSD_DRIVER_PARAMETERS, TAXEL_DRIVER_PARAMETERS
from tactile_driver.parameters.table import defaults
from tactile_driver.serial import port as serial_port
from tactile_driver.serial.clock import DeviceClock, SampleAssembler
from tactile_driver.serial.frames import END, MATRIX, SAMPLES, BinaryReader, CountFrame, LineReader, frame_size, write_frame, write_line
from tactile_driver.serial.port import SerialSource, find_port
from tactile_driver.serial.psd import Demodulator, PsdSerialSource
from tactile_driver.serial.taxel import TaxelFileSource
from tactile_driver.sources import source as pacing
from tactile_driver.sources.array_file import read_array_file
from tactile_driver.sources.source import EndOfSource, NothingYet

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


def test_samples_come_with_each_poll_also_after_a_late_one(monkeypatch):
    now, late_ns = [10**9], iter([3_500_000, 0, 0])

    def sleep(seconds):
        now[0] += round(1e9 * seconds) + next(late_ns)
    for module in (pacing, serial_port):
        monkeypatch.setattr(module, 'time', SimpleNamespace(monotonic_ns=lambda: now[0], sleep=sleep))
    master, slave = os.openpty()
    tty.setraw(slave)
    source = PsdSerialSource({**SETTINGS, 'device': os.ttyname(slave), 'batch_period': 0.005}, lambda: now[0])
    source.open()
    for k in range(4):
        os.write(master, write_frame(CountFrame(np.full((5, 4), 100), 5000 * k, 10**6, k, 16), SAMPLES))
        assert len(source.read().volts) == 5
    source.close()
    os.close(master), os.close(slave)


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
    opened = TaxelFileSource({**defaults(TAXEL_DRIVER_PARAMETERS), 'path': str(path), 'topic': array, 'rate': rate, 'loop': loop,
                              'rows': shape[0], 'columns': shape[1]}, clock)
    opened.open()
    return opened


def recording(path, shape=(3, 4), **more):
    return read_array_file(path, {**defaults(TAXEL_DRIVER_PARAMETERS), 'rows': shape[0], 'columns': shape[1], **more})


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


def test_an_array_of_no_frames_is_refused_by_what_it_lacks(tmp_path):
    np.save(tmp_path / 'a.npy', FRAMES[:0])
    with pytest.raises(BadRecording, match='no frame with a number'):
        source(tmp_path / 'a.npy')


def test_frames_of_another_size_are_refused(tmp_path):
    np.save(tmp_path / 'a.npy', FRAMES)
    with pytest.raises(BadRecording, match='frames are 2 x 4, parameters rows and columns say 4 x 4'):
        source(tmp_path / 'a.npy', shape=(4, 4))


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
    found = recording(tmp_path / 'a.csv')
    np.testing.assert_array_equal(found.frames, np.arange(5 * 3 * 4).reshape(5, 3, 4))
    assert 'numbers from 0.5 to 59.5; the image holds (value - 0.5) / 1' in found.about
    if time:
        np.testing.assert_allclose(found.times, TABLE_TIMES)
    else:
        assert found.times is None


@pytest.mark.parametrize(('text', 'said'), [
    ('1,2,3\n4,5,6\n', '2 lines of 3 numbers.*expected for 3 x 4 taxels: 12 a line'), ('', 'no line of numbers'),
    ('1,2,3,4\n1,2,3\n', 'line 2 has 3 numbers, those before it 4'),
    ('1,2,3,4\n' * 4, '4 lines of 4 numbers, which would be rows: 4 and columns: 4 if all are one frame'),
    ('1,1,2,3,4\n' * 6, 'do not increase at frame 1'),
    ('1,2,x,4\n1,2,3,4\n1,2,y,4\n', 'line 3 is not of numbers')])
def test_what_was_seen_and_what_is_expected_are_reported(tmp_path, text, said):
    (tmp_path / 'a.csv').write_text(text)
    with pytest.raises(BadRecording, match=said):
        recording(tmp_path / 'a.csv')


WHOLE = np.arange(4 * 3 * 4).reshape(4, 3, 4)


@pytest.mark.parametrize('lines', ['', ',\n'])
def test_a_folder_of_single_frames_in_natural_order(tmp_path, lines):
    for k, frame in enumerate(WHOLE):  # as pressure mats write them: leading zeros, a comma at the end of a line
        text = '\n'.join(','.join(f'{value:03d}' for value in row) + lines.strip() for row in frame)
        (tmp_path / f'reading_{k + 8}.csv').write_text(text)
    (tmp_path / 'about.md').write_text('a mat')
    assert recording(tmp_path).frames.tolist() == WHOLE.tolist()
    with pytest.raises(BadRecording, match='reading_8.csv: it has 3 lines of 4 numbers, which would be rows: 3 and columns: 4'):
        recording(tmp_path, (5, 5))
    (tmp_path / 'reading_2.csv').write_text('1,2,3\n')
    with pytest.raises(BadRecording, match='reading_2.csv: it has 1 lines of 3'):
        recording(tmp_path)


def test_an_empty_folder_says_what_it_lacks(tmp_path):
    with pytest.raises(BadRecording, match=r'no file that ends in .npy, .csv'):
        recording(tmp_path)


SIGNED = np.round(np.random.default_rng(1).normal(0.0, 3.0, (20, 3, 4)), 2)


@pytest.mark.parametrize(('values', 'step'), [(SIGNED, 0.01), (SIGNED.astype(np.float32), 0.01), (np.round(SIGNED) - 1000, 1.0),
                                              (SIGNED * 1e6, 1e4), (SIGNED**3 / 7, None), (WHOLE * 2.0**12, 4096.0)])
def test_signed_and_fractional_values_keep_their_resolution(tmp_path, values, step):
    np.save(tmp_path / 'a.npy', values)
    frames, _, about, _ = recording(tmp_path / 'a.npy')
    found = float(about.split(' / ')[1])
    assert found == pytest.approx(step, rel=1e-4) if step else np.ptp(values) / 65536 < found < 4 * np.ptp(values) / 65535
    step = step or found
    np.testing.assert_allclose(frames * step + values.min(), values, atol=0.51 * step + 0.1 * found)


@pytest.mark.parametrize('values', [WHOLE.astype(np.uint8), WHOLE.astype(np.int64), WHOLE.astype(float), WHOLE * 1000])
def test_whole_numbers_stay_as_they_are(tmp_path, values):
    np.save(tmp_path / 'a.npy', values)
    frames = recording(tmp_path / 'a.npy').frames
    assert frames.tolist() == values.tolist() and (frames.dtype == np.uint8) == (values.dtype == np.uint8)


def test_one_axis_of_three(tmp_path):
    three = np.stack([WHOLE + 100 * k for k in range(3)], axis=-1)
    forms = {'last': three, 'first': np.moveaxis(three, -1, 1), 'flat': three.reshape(4, -1), 'cells': three.reshape(4, 12, 3)}
    for (name, values), (k, axis) in itertools.product(forms.items(), enumerate('xyz')):
        np.save(tmp_path / f'{name}.npy', values)
        assert recording(tmp_path / f'{name}.npy', axis=axis).frames.tolist() == (WHOLE + 100 * k).tolist(), name
    np.savetxt(tmp_path / 'a.csv', three.reshape(4, -1), '%d', ',')
    assert recording(tmp_path / 'a.csv').frames.tolist() == (WHOLE + 200).tolist()


def test_a_layout_places_the_values(tmp_path):
    values = np.arange(3 * 48).reshape(3, 48)
    layout = [46, 45, 44, -1, 2, 1]
    np.save(tmp_path / 'a.npy', values)
    wanted = np.where(np.array(layout) < 0, 0, values[:, layout]).reshape(3, 2, 3)
    assert recording(tmp_path / 'a.npy', (2, 3), layout=layout).frames.tolist() == wanted.tolist()
    names = ['timestamp', 'elapsed', 'frame_index', *(f'ch{k}' for k in range(48))]
    table = np.column_stack([np.arange(3) + 1.7e9, np.arange(3), np.arange(3), values])
    np.savetxt(tmp_path / 'a.csv', table, '%.3f', ',', header='##Session\nrows,13\ncols,8\n##Data\n' + ','.join(names), comments='')
    found = recording(tmp_path / 'a.csv', (2, 3), layout=layout)
    assert found.frames.tolist() == wanted.tolist() and np.diff(found.times).tolist() == [1.0, 1.0]
    with pytest.raises(BadRecording, match='layout has 6 numbers up to 46; 2 x 2 = 4 are needed, from 0 to 47'):
        recording(tmp_path / 'a.npy', (2, 2), layout=layout)


@pytest.mark.parametrize(('head', 'start', 'scale'), [('t_ns', 1.7e18, 1e9), ('Time [us]', 0, 1e6), ('timestamp', 1.7e12, 1e3),
                                                      ('timestamp', 1.7e9, 1), ('elapsed_ms', 5, 1e3)])
def test_units_of_time(tmp_path, head, start, scale):
    lines = [f'{head},' + ','.join(f'c{k}' for k in range(12)),
             *(f'{start + 0.5 * k * scale:.0f},' + '1,' * 11 + str(k) for k in range(4, 8, 2))]
    (tmp_path / 'a.csv').write_text('\n'.join(lines))
    assert np.diff(recording(tmp_path / 'a.csv').times) == pytest.approx([1.0], rel=1e-3)


def test_dates_counts_and_lines_between_frames(tmp_path):
    rows = ['1 2 3 4', '5 6 7 8', '9 10 11 12']
    (tmp_path / 'a.txt').write_text('\n'.join(['ROWS 3', 'COLS 4', 'Frame 1', *rows, '', 'Frame 2', *rows, '@@']))
    assert recording(tmp_path / 'a.txt').frames.shape == (2, 3, 4)
    cells = ','.join('1' * 12)
    day, names = '2024-01-02 03:04', ','.join('abcdefghijkl')
    (tmp_path / 'b.csv').write_text(f'"",date time,{names}\n0,{day}:05.500,{cells}\n1,{day}:06.000,{cells}')
    found = recording(tmp_path / 'b.csv')
    assert found.frames.shape == (2, 3, 4) and np.diff(found.times) == pytest.approx([0.5])


def test_values_that_fall_under_pressure(tmp_path):
    values = np.full((30, 3, 4), 500.0)
    values[15:, 1, 1] -= 200
    np.save(tmp_path / 'a.npy', values)
    assert 'set inverted to true' in recording(tmp_path / 'a.npy').warning
    turned = recording(tmp_path / 'a.npy', inverted=True)
    assert turned.warning == '' and turned.frames[20].tolist() == (500 - values[20]).tolist()
    assert recording(tmp_path / 'a.npy').frames.tolist() == values.tolist()


def test_gaps_and_objects(tmp_path, recwarn):
    values = SIGNED.copy()
    values[3, 1, 1], values[4, 0], values[5, 1] = np.nan, np.inf, -1e308
    np.save(tmp_path / 'a.npy', values)
    assert recording(tmp_path / 'a.npy').frames[3, 1, 1] == 0
    np.save(tmp_path / 'b.npy', np.array([None, 1]))
    with pytest.raises(BadRecording, match='Python objects; save plain numbers'):
        recording(tmp_path / 'b.npy')
    np.save(tmp_path / 'c.npy', np.full((4, 3, 4), np.nan))
    with pytest.raises(BadRecording, match='no frame with a number'):
        recording(tmp_path / 'c.npy')
    assert not recwarn.list


RNG = np.random.default_rng(5)


def frame(k, rows=5, columns=4, bits=12, rng=RNG):
    return CountFrame(rng.integers(0, 2**bits, (rows, columns)).astype(np.uint16), 1000 * k, 200_000, k, bits)


def reader(columns=4):
    return BinaryReader(SAMPLES, columns=columns)


def feed(target, data, step):
    return [found for k in range(0, len(data), step) for found in target.feed(data[k:k + step])]


def same(found, sent):
    return (found.sequence, found.time_us, found.interval_ns, found.bits) == (sent.sequence, sent.time_us, sent.interval_ns, sent.bits) \
        and np.array_equal(found.values, sent.values)


@pytest.mark.parametrize('step', [1, 7, 63, 10_000])
def test_what_is_written_is_read_however_it_is_cut(step):
    sent = [frame(k, rows=1 + k % 9, bits=12 + k % 5) for k in range(60)]
    target = reader()
    found = feed(target, b''.join(write_frame(f, SAMPLES) for f in sent), step)
    assert len(found) == 60 and all(map(same, found, sent))
    assert (target.counts.frames, target.counts.bad_crc, target.counts.garbage, target.counts.missing) == (60, 0, 0, 0)


@pytest.mark.parametrize(('rows', 'columns', 'bits'), [(44, 44, 8), (256, 256, 16), (1, 1, 9), (256, 1, 12)])
def test_a_matrix_of_any_shape_is_carried(rows, columns, bits):
    sent = frame(3, rows, columns, bits)
    data = write_frame(sent, MATRIX)
    assert len(data) == frame_size(rows, columns, bits) == 23 + rows * columns * (1 if bits == 8 else 2)
    found, = BinaryReader(MATRIX, rows, columns).feed(data)
    assert same(found, sent)
    refusing = BinaryReader(MATRIX, rows + 1, columns)  # of 257 rows there can be none
    assert refusing.feed(data) == [] and refusing.counts.refused == 1
    assert refusing.counts.stranger == f'a matrix of {rows} x {columns} values of {bits} bits'
    assert len(refusing.feed(write_frame(frame(4, rows % 256 + 1, columns, bits), MATRIX))) == (rows < 256)
    assert refusing.counts.stranger == ('' if rows < 256 else f'a matrix of 1 x {columns} values of {bits} bits')


def test_the_bytes_are_those_of_the_page():
    data = write_frame(CountFrame(np.array([[1, 2, 3, 0xABC]]), 0x01020304, 200_000, 7, 12), SAMPLES)
    assert data[:20].hex() == 'a55a010c0700000004030201400d03000003' + data[18:20].hex()
    assert data[20:28].hex() == '010002000300bc0a' and data[-1] == END == 0x7E
    from binascii import crc_hqx
    assert crc_hqx(b'123456789', 0xFFFF) == 0x29B1
    assert data[18:20] == crc_hqx(data[:18], 0xFFFF).to_bytes(2, 'little')
    assert data[28:30] == crc_hqx(data[:18] + data[20:28], 0xFFFF).to_bytes(2, 'little')


@pytest.mark.parametrize(('values', 'bits'), [(np.zeros((0, 4)), 12), (np.zeros((257, 4)), 12), (np.zeros(4), 12),
                                              (np.full((1, 4), 4096), 12),
                                              (np.full((1, 4), -1), 12), (np.zeros((1, 4)), 17), (np.zeros((1, 4)), 7)])
def test_what_no_frame_can_carry_is_refused(values, bits):
    with pytest.raises(BadArgument, match='frame: '):
        write_frame(CountFrame(values.astype(int), 0, 0, 0, bits), SAMPLES)


def test_gaps_and_resets_are_counted():
    target = reader()
    for k in (2**32 - 2, 2**32 - 1, 0, 1, 5, 6, 3):
        target.feed(write_frame(frame(k), SAMPLES))
    assert (target.counts.frames, target.counts.missing, target.counts.resets) == (7, 3, 1)


def test_lines_with_time_and_check_sum():
    reader = LineReader(4, 12)
    data = b'9,9\n' + b''.join(write_line([k, 2, 3, 4095], 1000 * k) for k in range(50))
    found = [f for k in range(0, len(data), 5) for f in reader.feed(data[k:k + 5])]
    assert [f.time_us for f in found] == [1000 * k for k in range(50)]
    assert found[7].values.tolist() == [[7, 2, 3, 4095]] and found[7].sequence is None
    assert reader.counts.frames == 50 and reader.counts.garbage == 0


@pytest.mark.parametrize('line', [b'1,2,3,4', b'1; 2; 3; 4\r', b'1\t2\t3\t4', b'  1 2 3 4 '])
def test_what_hobby_boards_print(line):
    found, = LineReader(4, 12).feed(b'cut off\n# a comment\n\n' + line + b'\n')
    assert found.values.tolist() == [[1, 2, 3, 4]] and found.time_us is None


@pytest.mark.parametrize('line', [b'1,2,3', b'1,2,3,4,5,6', b'1,2,3,4096', b'1,2,x,4', b'1,,3,4', b'1,2,-3,4', b'1.5,2,3,4',
                                  b'\xff\xfe1,2,3,4', b'4294967296,1,2,3,4', b'1,2,3,4*0000', b'1,2,3,99999999999'])
def test_what_is_no_sample_is_counted(line):
    reader = LineReader(4, 12)
    assert reader.feed(b'\n' + line + b'\n') == []
    assert reader.counts.garbage + reader.counts.refused + reader.counts.bad_crc > 0


def test_once_checked_always_checked():
    reader = LineReader(4, 12)
    assert len(reader.feed(b'\n' + write_line([1, 2, 3, 4]) + b'1,2,3,4\n')) == 1
    assert reader.counts.bad_crc == 1


def played(skew, delays, start_us=0, step_us=5000, host_ns=7_000_000_000):
    """(true host times, mapped host times), ns, of frames every step_us of a device's clock that runs fast by skew."""
    clock = DeviceClock()
    true, mapped = [], []
    for k, delay in enumerate(delays):
        true.append(host_ns + k * step_us * 1000 / (1 + skew))
        mapped.append(clock.to_host([(start_us + k * step_us) % 2**32], round(true[-1] + delay))[0])
    return np.array(true), np.array(mapped), clock


@pytest.mark.parametrize('skew', [0.0, 80e-6, -80e-6])
def test_jitter_is_taken_off_and_drift_is_followed(skew):
    rng = np.random.default_rng(1)
    true, mapped, clock = played(skew, 3e5 + rng.exponential(2e6, 12000))
    late = mapped - true
    assert np.abs(late[6000:] - 3e5).max() < 1e5 + 5e9 * abs(skew)  # ns; it looks back 5 s
    assert np.abs(np.diff(mapped) - 5e6).max() < 0.06 * 5e6
    assert clock.resets == 0


def test_the_counter_may_wrap():
    true, mapped, clock = played(0.0, np.full(3000, 1e5), start_us=2**32 - 2_000_000)
    assert np.abs(mapped - true - 1e5).max() < 1e3 and clock.resets == 0


def test_a_reset_and_a_pause_begin_anew_or_go_on():
    clock = DeviceClock()
    for k in range(100):
        clock.to_host([10_000_000 + 5000 * k], 10**10 + 5_000_000 * k)
    assert clock.to_host([0], 10**10 + 2 * 10**9) == [10**10 + 2 * 10**9] and clock.resets == 1
    assert clock.to_host([60_000_000], 10**10 + 62 * 10**9) == [10**10 + 62 * 10**9] and clock.resets == 1


def test_time_never_goes_back():
    _, mapped, _ = played(0.0, np.r_[np.full(200, 2e7), np.full(2000, 1e5)])
    assert np.diff(mapped).min() > 0


def test_frames_that_come_in_one_go_keep_their_distances():
    clock = DeviceClock()
    assert np.diff(clock.to_host([0, 1000, 2000, 3000], 5_000_000, 800_000)).tolist() == [1_000_000] * 3
    assert clock.to_host([4000], 9_000_000)[0] == 5_200_000  # the earlier arrival determines the offset


def test_a_reset_amid_the_frames_of_one_go():
    clock = DeviceClock()
    clock.to_host([50_000_000], 10**9)
    before, after = clock.to_host([50_001_000, 0], 10**9 + 1_000_000)
    assert (before, after, clock.resets) == (10**9 + 1_000_000, 10**9 + 1_000_000, 1)


def counted(k, rows=5, period_us=200, interval=True, timed=True):
    values = np.tile(np.arange(k * rows, (k + 1) * rows, dtype=np.uint16)[:, None], (1, 4))
    return CountFrame(values, (k * rows * period_us) % 2**32 if timed else None, period_us * 1000 if interval else None, k, 12)


def test_frames_without_a_gap_are_one_block():
    blocks = SampleAssembler(5.0).assemble([counted(k) for k in range(10)], 10**9)
    assert len(blocks) == 1
    assert blocks[0].volts.shape == (50, 4) and blocks[0].volts.dtype == np.float32
    assert blocks[0].volts[:, 2] == pytest.approx(np.arange(50) * 5 / 4096)
    assert blocks[0].period_s == pytest.approx(200e-6)


def test_a_missing_frame_parts_two_blocks():
    assembler = SampleAssembler(5.0)
    first = assembler.assemble([counted(0), counted(1)], 2_000_000)
    blocks = assembler.assemble([counted(2), counted(4), counted(5)], 6_000_000)
    assert [len(b.volts) for b in first + blocks] == [10, 5, 10]
    assert blocks[1].stamp_ns - blocks[0].stamp_ns == pytest.approx(2_000_000, abs=1e5)
    assert assembler.missing == 5


def test_lines_with_time_but_without_an_interval():
    assembler = SampleAssembler(5.0)
    assembler.assemble([counted(0, 1, 1000, interval=False)], 0)
    block, = assembler.assemble([counted(k, 1, 1000, interval=False) for k in range(1, 6)], 5_000_000)
    assert len(block.volts) == 5 and block.period_s == pytest.approx(1e-3, rel=0.06)
    blocks = assembler.assemble([counted(k, 1, 1000, interval=False) for k in (6, 7, 10, 11)], 11_000_000)
    assert [len(b.volts) for b in blocks] == [2, 2] and assembler.missing == 2


def test_lines_without_time_lie_between_arrivals():
    assembler = SampleAssembler(5.0)
    first, = assembler.assemble([counted(0, 1, timed=False, interval=False)], 1_000_000)
    assert np.isnan(first.period_s) and first.stamp_ns == 1_000_000
    block, = assembler.assemble([counted(k, 1, timed=False, interval=False) for k in range(4)], 5_000_000)
    assert block.period_s == pytest.approx(1e-3) and block.stamp_ns == 2_000_000
