# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Two sources as one: pairs, one of two lost and back, both lost, a recording's end; and one source that holds both views."""
import threading
import time

import numpy as np
import pytest

from tactile_driver.errors import BadRecording, DeviceLost
from tactile_driver.frame import CameraCalibration, Frame
from tactile_driver.sources.source import EndOfSource, NothingYet
from tactile_driver.camera.pairs import PairedSource, SplitSource

PERIOD = 20_000_000


class Camera:
    """A live camera of 50 Hz, or a recording of so many frames; it can be pulled out, be silent or break."""

    on_demand = True
    skipped, corrupt, remark = 0, 0, ''

    def __init__(self, value, count=None, delay=0, gone=False):
        self.value, self.count, self.delay, self.live = value, count, delay, count is None
        self.gone, self.silent, self.broken, self.closed = gone, threading.Event(), False, False
        self.number, self.asked = 0, []

    def open(self):
        if self.gone:
            raise DeviceLost(f'camera {self.value} is not there')

    def read(self, wanted=True):
        self.asked.append(wanted)
        if self.broken:
            raise BadRecording('torn')
        if self.gone:
            raise DeviceLost(f'camera {self.value} pulled out')
        while self.silent.is_set():
            time.sleep(0.01)
        if self.live:
            time.sleep(0.02)
            self.number = round(time.monotonic_ns() / PERIOD)
        else:
            self.number += 1
            if self.number > self.count:
                raise EndOfSource('over')
        return Frame(np.full((2, 3), self.value, np.uint8), self.number * PERIOD + self.delay, 'mono8') if wanted else None

    def close(self):
        self.closed = True

    def describe(self):
        return {'source': 'device', 'device': str(self.value), 'serial': f'S{self.value}', 'rate': 50.0}

    def calibration(self):
        return CameraCalibration(self.value, 2)


@pytest.fixture
def paired():
    """Opens a source of two and closes it at the end."""
    made = []

    def make(left, right, max_skew=0.008):
        made.append(PairedSource(left, right, max_skew))
        made[-1].open()
        return made[-1]
    yield make
    for source in made:
        source.close()


def read(source, count, wanted=True):
    """So many pairs."""
    found, end = [], time.monotonic() + 10
    while len(found) < count and time.monotonic() < end:
        try:
            found.append(source.read(wanted))
        except NothingYet:
            pass
    return found


def until(source, condition):
    """The first pair for which condition holds."""
    end = time.monotonic() + 10
    while time.monotonic() < end:
        pair, = read(source, 1)
        if condition(pair):
            return pair
    raise AssertionError('it never came')


def test_a_recording_gives_every_pair_and_ends(paired):
    source = paired(Camera(1, 6), Camera(2, 6, delay=3_000_000))
    pairs = read(source, 6)
    assert [p.stamp_ns for p in pairs] == [k * PERIOD for k in range(1, 7)]
    assert all(p.right.stamp_ns - p.left.stamp_ns == 3_000_000 and p.left.image[0, 0] == 1 and p.right.image[0, 0] == 2 for p in pairs)
    with pytest.raises(EndOfSource, match='6 left, 6 right'):
        source.read()
    assert source.skipped == 0


def test_a_single_pair_is_a_recording_too(paired):
    source = paired(Camera(1, 1), Camera(2, 1))
    assert len(read(source, 1)) == 1
    with pytest.raises(EndOfSource):
        source.read()


def test_the_longer_recordings_frames_have_no_mates(paired):
    source = paired(Camera(1, 4), Camera(2, 7))
    assert len(read(source, 4)) == 4
    with pytest.raises(EndOfSource):
        source.read()
    assert source.skipped == source.describe()['unpaired'] >= 0


def test_a_recording_that_breaks_is_named(paired):
    right = Camera(2, 60)  # until the period is known it reads some frames ahead
    source = paired(Camera(1, 60), right)
    read(source, 2)
    right.broken = True
    with pytest.raises(BadRecording, match='right: .*torn'):
        read(source, 60)


def test_two_live_cameras_are_paired(paired):
    source = paired(Camera(1), Camera(2))
    pairs = read(source, 10)
    assert all(p.left is not None and p.right is not None and abs(p.left.stamp_ns - p.right.stamp_ns) <= 8e6 for p in pairs)
    assert source.remark == '' and source.live
    assert [c.width for c in source.calibrations()] == [1, 2]
    about = source.describe()
    assert (about['path'], about['serial'], about['rate'], about['left']['serial']) == ('1 + 2', 'S1 + S2', 50.0, 'S1')


def test_what_a_recording_says_of_the_sensor_is_said_once(paired):
    left, right = Camera(1), Camera(2)
    left.describe = right.describe = lambda: {'source': 'bag', 'path': 'a', 'recorded': {'source': 'sim'}}
    about = paired(left, right).describe()
    assert about['recorded'] == {'source': 'sim'} and 'recorded' not in about['left'] and 'recorded' not in about['right']


def test_the_others_half_goes_on_while_one_camera_is_lost_and_it_comes_back(paired):
    left = Camera(1)
    source = paired(left, Camera(2))
    read(source, 3)
    left.gone = True
    alone = until(source, lambda p: p.left is None)
    assert alone.stamp_ns == alone.right.stamp_ns and len(read(source, 5)) == 5
    assert source.remark.startswith('no left camera, its half is black: camera 1 ')
    left.gone = False
    until(source, lambda p: p.left is not None and p.right is not None)
    assert source.remark == ''


def test_a_camera_missing_from_the_start_is_looked_for(paired):
    right = Camera(2, gone=True)
    source = paired(Camera(1), right)
    assert until(source, lambda p: True).right is None and 'camera 2 is not there' in source.remark
    right.gone = False
    until(source, lambda p: p.right is not None)


def test_a_silent_camera_counts_as_missing(paired):
    right = Camera(2)
    source = paired(Camera(1), right)
    read(source, 3)
    right.silent.set()
    assert until(source, lambda p: p.right is None).left is not None
    assert 'right camera, its half is black: it sends no frames' in source.remark
    right.silent.clear()
    until(source, lambda p: p.right is not None)


def test_both_lost_is_lost(paired):
    left, right = Camera(1), Camera(2)
    source = paired(left, right)
    read(source, 2)
    left.gone = right.gone = True
    with pytest.raises(DeviceLost, match='left: camera 1 .*; right: camera 2 '):
        read(source, 100)
    with pytest.raises(DeviceLost, match='not there'):
        source.open()
    left.gone = right.gone = False
    source.open()
    assert len(read(source, 3)) == 3


def test_what_nobody_wants_is_passed_over(paired):
    left, right = Camera(1), Camera(2)
    source = paired(left, right)
    left.asked.clear()
    assert read(source, 4, wanted=False) == [None] * 4
    assert not any(left.asked[1:] + right.asked[1:])


def test_cameras_beyond_max_skew_give_no_pair_and_say_so(paired):
    source = paired(Camera(1), Camera(2, delay=7_000_000), 0.004)
    end = time.monotonic() + 10
    while not source.remark and time.monotonic() < end:
        with pytest.raises(NothingYet):
            source.read()
    assert source.remark.startswith('the exposures of the two cameras are 7.0 ms apart, but max_skew is 4.0 ms')
    pairs = read(paired(Camera(1), Camera(2, delay=7_000_000), -1), 3)
    assert {pair.right.stamp_ns - pair.left.stamp_ns for pair in pairs} == {7_000_000}


def test_what_is_wrong_with_one_camera_s_pictures_is_told(paired):
    left, right = Camera(1), Camera(2)
    source = paired(left, right)
    until(source, lambda pair: pair.left and pair.right)
    right.remark = 'the pictures are black'
    assert source.remark == 'right camera: the pictures are black'


def test_one_image_holds_both_views():
    class Wide(Camera):
        def read(self, wanted=True):
            image = np.repeat(np.array([[1, 1, 1, 9, 2, 2, 2]], np.uint8), 2, axis=0)
            return Frame(image, 5, 'mono8', 'truth') if wanted else None
    source = SplitSource(Wide(1))
    source.open()
    pair = source.read()
    assert set(pair.left.image.ravel()) == {1} and set(pair.right.image.ravel()) == {2} and pair.truth == 'truth'
    assert pair.sizes == {'left': (3, 2), 'right': (3, 2)} and pair.left.stamp_ns == pair.right.stamp_ns == 5
    assert source.read(False) is None and source.calibrations() == (None, None) and source.describe()['layout'] == 'side_by_side'
    assert (source.live, source.on_demand, source.skipped, source.corrupt, source.remark) == (True, True, 0, 0, '')
    source._source.remark = 'frozen'
    assert source.remark == 'frozen'
