# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Two files as two cameras: frames of one number are pairs, whatever one of the files lacks."""
import time

import cv2
import numpy as np
import pytest

from tactile_driver.errors import BadFrame, BadRecording
from tactile_driver.sources.source import EndOfSource
from tactile_driver.camera.file import TwoFilesSource


@pytest.fixture
def folders(tmp_path):
    """left: 5 images of brightness k; right: 6 of brightness 100 + k."""
    for name, first, count in (('left', 0, 5), ('right', 100, 6)):
        (tmp_path / name).mkdir()
        for k in range(count):
            cv2.imwrite(str(tmp_path / name / f'{k}.png'), np.full((8, 8), first + k, np.uint8))
    return tmp_path


def opened(folder, rate=0.0, loop=False, clock=time.time_ns):
    source = TwoFilesSource(str(folder / 'left'), str(folder / 'right'), rate, loop, clock)
    source.open()
    return source


def numbers(pair):
    return int(pair.left.image[0, 0]), int(pair.right.image[0, 0]) - 100


def test_the_nth_frames_are_pairs_until_the_shorter_file_ends(folders):
    source = opened(folders)
    pairs = [source.read() for _ in range(5)]
    assert [numbers(p) for p in pairs] == [(k, k) for k in range(5)]
    assert all(p.left.stamp_ns == p.right.stamp_ns for p in pairs) and source.on_demand and not source.live
    with pytest.raises(EndOfSource):
        source.read()
    source.close()


def test_a_loop_begins_both_again(folders):
    source = opened(folders, loop=True)
    assert [numbers(source.read()) for _ in range(8)] == [(k % 5, k % 5) for k in range(8)]


@pytest.mark.parametrize('broken', ['left', 'right'])
def test_a_frame_whose_mate_is_broken_is_dropped(folders, broken):
    (folders / broken / '2.png').write_bytes(b'x')
    source = opened(folders)
    found = [numbers(source.read()) for _ in range(2)]
    with pytest.raises(BadFrame, match='2.png'):
        source.read()
    found += [numbers(source.read()) for _ in range(2)]
    assert found == [(0, 0), (1, 1), (3, 3), (4, 4)] and source.describe()['unpaired'] == source.skipped == 1


def test_a_missing_file_is_named(folders):
    with pytest.raises(BadRecording, match='nowhere'):
        TwoFilesSource(str(folders / 'left'), '/nowhere', 0, False, time.time_ns).open()


def test_unwanted_pairs_are_passed_over(folders):
    source = opened(folders)
    assert source.read(False) is None and numbers(source.read()) == (1, 1)
    assert source.calibrations() == (None, None) and source.corrupt == 0
