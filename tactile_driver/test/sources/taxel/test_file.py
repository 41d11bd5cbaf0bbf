# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import time

import numpy as np
import pytest
from tactile_driver.errors import BadArgument, BadFrame, BadRecording
from tactile_driver.sources.source import EndOfSource
from tactile_driver.serial.taxel import TaxelFileSource

FRAMES = np.arange(3 * 2 * 4, dtype=np.uint8).reshape(3, 2, 4)


def source(path, array='', rate=0.0, loop=False, shape=(2, 4)):
    opened = TaxelFileSource(str(path), array, rate, loop, shape, time.time_ns)
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


def test_recorded_times_are_kept(tmp_path):
    np.savez(tmp_path / 'a.npz', pad1=FRAMES, t_ms=10**12 + np.array([0, 50, 150]))
    opened = source(tmp_path / 'a.npz', rate=-1.0)
    stamps = [opened.read().stamp_ns for _ in range(3)]
    assert np.diff(stamps) == pytest.approx([50e6, 100e6], abs=10e6)


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
    with pytest.raises(BadArgument):
        source('')
