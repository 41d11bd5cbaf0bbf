# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Two cameras as one source of pairs, and the picture that is stitched of them."""
import copy
import threading
import time
from contextlib import suppress

import cv2
import numpy as np
import pytest
import yaml
from stitchings import camera, stitching, view

from tactile_driver.camera.pairs import LEFT, RIGHT, PairedSource, Pairer
from tactile_driver.errors import BadArgument, BadFrame, BadRecording, DeviceLost
from tactile_driver.frame import CameraCalibration, Frame
from tactile_driver.sources.source import EndOfSource, NothingYet, Source
from tactile_driver.stitching.calibration import load_stitching, stitching_from_dict
from tactile_driver.stitching.methods import MiddleStitcher, make_stitcher

MS = 1_000_000
PERIOD = 33_333_333


def frame(stamp, number=0):
    """A frame that carries its number."""
    return Frame(np.full((1, 1), number % 256, np.uint8), int(stamp), 'mono8')


def fed(pairer, events):
    """Pairs, as (left number, right number), from events (arrival, side, stamp, number) in the order of arrival."""
    pairs = []
    for _, side, stamp, number in sorted(events):
        pairer.add(side, frame(stamp, number))
        while (pair := pairer.take()) is not None:
            pairs.append((int(pair.left.image[0, 0]), int(pair.right.image[0, 0])))
    return pairs


def cameras(period, delay, count=60, jitter=0.0, lost=0.0, seed=0):
    """Events of two cameras, the right one delay ns later, with jitter of the stamps, lost frames and uneven transport in order."""
    rng = np.random.default_rng(seed)
    events = []
    for side in (LEFT, RIGHT):
        kept = np.flatnonzero(rng.uniform(size=count) >= lost)
        stamps = kept * period + side * delay + rng.normal(0, jitter, len(kept))
        arrivals = np.sort(stamps + rng.uniform(0, 3 * period, len(kept)))
        events += zip(arrivals.tolist(), [side] * len(kept), stamps.tolist(), kept.tolist())
    return events


@pytest.mark.parametrize('lost', [0.0, 0.2, 0.5])
@pytest.mark.parametrize('period', [10 * MS, 16.7 * MS, 33 * MS])
@pytest.mark.parametrize('seed', range(4))
def test_only_frames_of_one_instant_are_paired(period, lost, seed):
    events = cameras(period, 4 * MS, jitter=0.2 * MS, lost=lost, seed=seed)
    pairer = Pairer(8 * MS)
    pairs = fed(pairer, events)
    assert all(left == right for left, right in pairs)
    both = {k for _, s, _, k in events if s == LEFT} & {k for _, s, _, k in events if s == RIGHT}
    assert len(pairs) >= 0.95 * len(both) - 1
    waiting = pairer.waiting(LEFT) + pairer.waiting(RIGHT)
    assert pairer.unpaired == len(events) - 2 * len(pairs) - waiting


def measured(offsets_ms):
    """The offset after pairs with these, ms."""
    pairer = Pairer(-1, PERIOD)
    for k, offset in enumerate(offsets_ms):
        pairer.add(LEFT, frame(10**9 + k * PERIOD))
        pairer.add(RIGHT, frame(10**9 + k * PERIOD + round(offset * MS)))
        pairer.take()
    return pairer.offset_ms


def test_the_offset_of_the_latest_pairs_is_reported_once_there_are_enough():
    assert measured(5.0 + np.random.default_rng(1).normal(0, 0.3, 300)) == pytest.approx(5.0, abs=0.1)
    assert np.isnan(measured([5.0] * 9))


def test_the_first_pair_waits_until_the_period_is_known():
    pairer = Pairer(8 * MS)
    pairer.add(LEFT, frame(10 * MS))
    for k in range(5):
        assert pairer.take() is None, 'the right frame may belong to a left one that was lost'
        pairer.add(RIGHT, frame((4 + 10 * k) * MS))
    pair = pairer.take()
    assert (pair.left.stamp_ns, pair.right.stamp_ns, pairer.unpaired) == (10 * MS, 14 * MS, 1)


def test_a_skew_over_the_limit_is_no_pair():
    pairer = Pairer(8 * MS)
    assert fed(pairer, cameras(100 * MS, 9 * MS)) == [] and pairer.unpaired >= 100
    assert len(fed(Pairer(8 * MS), cameras(100 * MS, 7 * MS))) == 60


def test_frames_out_of_order_are_dropped_and_a_jump_back_begins_anew():
    pairer = Pairer(8 * MS)
    for stamp in (100, 50, 100):
        pairer.add(LEFT, frame(stamp * MS))
    assert pairer.waiting(LEFT) == 1 and pairer.unpaired == 2
    later = [(k, side, (5000 + 20 * k) * MS, k) for k in range(5) for side in (LEFT, RIGHT)]
    again = [(10 + k, side, 20 * k * MS, k) for k in range(5) for side in (LEFT, RIGHT)]
    assert fed(Pairer(8 * MS), later + again) == [(k, k) for k in range(5)] * 2


def test_one_camera_alone_is_handed_over_and_does_not_pile_up():
    pairer = Pairer(8 * MS)
    for k in range(20):
        pairer.add(RIGHT, frame(20 * MS * k, k))
    assert pairer.waiting(RIGHT) == 8 and pairer.unpaired == 12
    single = pairer.take_single(RIGHT)
    assert single.left is None and single.stamp_ns == 240 * MS and single.sizes == {'right': (1, 1)}
    assert pairer.take_single(LEFT) is None
    pairer.discard()
    assert pairer.waiting(RIGHT) == 0 and pairer.unpaired == 12


@pytest.mark.parametrize('offset', [0.0, 0.2, 0.345, 0.49, 0.51, 0.8])
def test_at_any_offset_every_frame_pairs_with_the_nearest(offset):
    period = 33.3 * MS
    pairer = Pairer(-1)
    fed(pairer, cameras(period, offset * period, jitter=0.01 * period, seed=3))
    events = cameras(period, offset * period, count=200, jitter=0.01 * period, seed=4)
    stamps = [dict((number, stamp) for _, s, stamp, number in events if s == side) for side in (LEFT, RIGHT)]
    pairer = Pairer(-1)
    pairs = fed(pairer, [(max(arrival, stamp), side, stamp, number) for arrival, side, stamp, number in events])
    assert len(pairs) >= 194, 'jitter near half a period makes no frame unpaired'
    skews = np.array([stamps[RIGHT][right] - stamps[LEFT][left] for left, right in pairs])
    assert np.abs(skews).max() <= 0.56 * period and len(set(np.sign(skews))) == 1 or offset == 0.0


@pytest.mark.parametrize('ppm', [2000.0, -2000.0])
def test_a_drift_through_half_a_period_costs_one_frame(ppm):
    period, count = 33 * MS, 1000
    events = [(k * period * (1 + 1e-6 * ppm * side), side, k * period * (1 + 1e-6 * ppm * side), k)
              for side in (LEFT, RIGHT) for k in range(count)]
    pairer = Pairer(-1)
    pairs = fed(pairer, events)
    beats = abs(1e-6 * ppm) * count
    assert pairer.unpaired <= 1 + beats and len(pairs) >= count - 3 - beats


PERIOD_PAIRS = 20_000_000


class Camera(Source):
    """A live camera of 50 Hz, or a recording of so many frames; it can be pulled out, be silent or break."""

    on_demand = True

    def __init__(self, value, count=None, delay=0, gone=False):
        self.value, self.count, self.delay, self.live = value, count, delay, count is None
        self.gone, self.silent, self.broken = gone, threading.Event(), False
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
            self.number = round(time.monotonic_ns() / PERIOD_PAIRS)
        else:
            self.number += 1
            if self.number > self.count:
                raise EndOfSource('over')
        return Frame(np.full((2, 3), self.value, np.uint8), self.number * PERIOD_PAIRS + self.delay, 'mono8') if wanted else None

    def describe(self):
        return {'source': 'device', 'device': str(self.value), 'serial': f'S{self.value}', 'rate': 50.0}

    def calibrations(self):
        return (CameraCalibration(self.value, 2),)


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
    found, end = [], time.monotonic() + 60
    while len(found) < count and time.monotonic() < end:
        try:
            found.append(source.read(wanted))
        except NothingYet:
            pass
    return found


def until(source, condition):
    """The first pair for which condition holds."""
    end = time.monotonic() + 60
    while time.monotonic() < end:
        pair, = read(source, 1)
        if condition(pair):
            return pair
    raise AssertionError('it never came')


def test_a_recording_gives_every_pair_and_ends(paired):
    source = paired(Camera(1, 6), Camera(2, 6, delay=3_000_000))
    pairs = read(source, 6)
    assert [p.stamp_ns for p in pairs] == [k * PERIOD_PAIRS for k in range(1, 7)]
    assert all(p.right.stamp_ns - p.left.stamp_ns == 3_000_000 and p.left.image[0, 0] == 1 and p.right.image[0, 0] == 2 for p in pairs)
    with pytest.raises(EndOfSource, match='6 left, 6 right'):
        source.read()
    assert source.skipped == 0


def test_a_recording_that_breaks_is_named(paired):
    right = Camera(2, 60)  # until the period is known it reads some frames ahead
    source = paired(Camera(1, 60), right)
    read(source, 2)
    right.broken = True
    with pytest.raises(BadRecording, match='right: .*torn'):
        read(source, 60)


def test_two_live_cameras_are_paired(paired):
    source = paired(Camera(1), Camera(2))
    pairs = [until(source, lambda p: p.left is not None and p.right is not None and not source.warning) for _ in range(10)]
    assert all(abs(p.left.stamp_ns - p.right.stamp_ns) <= 8e6 for p in pairs) and source.live
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
    assert source.warning.startswith('no left camera, its half is black: camera 1 ')
    left.gone = False
    until(source, lambda p: p.left is not None and p.right is not None and not source.warning)


def test_a_silent_camera_counts_as_missing(paired):
    right = Camera(2)
    source = paired(Camera(1), right)
    read(source, 3)
    right.silent.set()
    assert until(source, lambda p: p.right is None).left is not None
    assert 'right camera, its half is black: it sends no frames' in source.warning
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
    said, end = 'the exposures of the two cameras are 7.0 ms apart, but max_skew is 4.0 ms', time.monotonic() + 60
    while said not in source.warning:
        assert time.monotonic() < end, source.warning
        with suppress(NothingYet):
            pair = source.read()
            assert pair.left is None or pair.right is None
    wide = paired(Camera(1), Camera(2, delay=7_000_000), -1)
    pair = until(wide, lambda p: p.left is not None and p.right is not None)
    assert pair.right.stamp_ns - pair.left.stamp_ns == 7_000_000


def test_a_place_is_seen_where_the_pinhole_model_has_it():
    side = camera(-0.01, 0.03)
    xy = np.random.default_rng(0).uniform(-0.012, 0.012, (50, 2))
    rotation = cv2.Rodrigues(np.array([0.0, 0.0, 0.03]))[0]
    points = np.column_stack([xy, np.zeros(50)])
    wanted = cv2.projectPoints(points, rotation, -rotation @ side.camera_centre, side.matrix, side.distortion)[0].reshape(-1, 2)
    np.testing.assert_allclose(side.project(xy), wanted, atol=1e-9)
    np.testing.assert_allclose(side.place(wanted), xy, atol=1e-8)


def test_the_seam_parts_the_picture_between_the_camera_centres():
    found = stitching()
    uv = np.array([[0.0, 5.0], [60.0, 30.0], [61.0, 30.0], [120.0, 60.0]])
    assert found.side_of(uv).tolist() == [0, 0, 1, 1]
    np.testing.assert_allclose(found.camera_centres[found.side_of(uv), 0], [-0.01, -0.01, 0.01, 0.01])
    np.testing.assert_allclose(found.place(uv[:2]), [[-0.02, -25e-3 / 3], [0, 0]])


def test_a_file_brings_back_the_numbers(tmp_path):
    wanted = stitching((1.0, 0.8))
    path = tmp_path / 'dual.yaml'
    path.write_text(yaml.safe_dump({'fitted': {'stitching': wanted.to_dict()}}))
    found = load_stitching(str(path))
    assert found.to_dict() == wanted.to_dict() and found.right.gain == 0.8
    np.testing.assert_array_equal(found.left.homography, wanted.left.homography)


def test_the_cameras_are_where_they_see_the_plane_from():
    found = stitching()
    for name, side in (('left', found.left), ('right', found.right)):
        rotation, translation = found.poses()[name]
        xy = np.random.default_rng(1).uniform(-0.01, 0.01, (20, 2))
        seen = cv2.projectPoints(np.column_stack([xy, np.zeros(20)]), rotation, translation, side.matrix, side.distortion)[0].reshape(-1, 2)
        np.testing.assert_allclose(seen, side.project(xy), atol=1e-9)
    rotation, translation = found.poses()['']
    assert not rotation.any() and np.allclose(-translation, found.camera_centres.mean(axis=0))


def test_a_camera_centre_that_is_not_known_stays_unknown():
    numbers = stitching().to_dict()
    del numbers['left']['camera_centre']
    found = stitching_from_dict(numbers, 'file')
    assert np.isnan(found.left.camera_centre).all() and np.isfinite(found.right.camera_centre).all()
    assert 'camera_centre' not in found.to_dict()['left'] and found.poses() == {}


@pytest.mark.parametrize(('path', 'value', 'words'), [
    (('scale',), None, 'file.scale must be one finite'), (('scale',), -5.0, 'scale -5'), (('seam',), 500.0, 'seam 500'),
    (('size',), [0, 5], 'file.size is 0'), (('origin',), [1.0], 'file.origin must be'), (('cut',), [1e4, 3.0], 'cut'),
    (('left', 'matrix'), [[1, 2], [3, 4]], 'file.left.matrix'), (('right', 'gain'), float('nan'), 'file.right.gain'),
    (('left', 'homography'), [[0.0] * 3] * 3, 'regular'), (('right', 'distortion'), 'abc', 'file.right.distortion')])
def test_nonsense_is_named(path, value, words):
    numbers = copy.deepcopy(stitching().to_dict())
    part = numbers
    for name in path[:-1]:
        part = part[name]
    part[path[-1]] = value
    with pytest.raises(BadArgument, match=words):
        stitching_from_dict(numbers, 'file')


@pytest.mark.parametrize('text', ['', 'fitted: 3', '{fitted: {water: 1}}', '\x00'])
def test_a_file_without_a_stitching_is_named(tmp_path, text):
    (tmp_path / 'a.yaml').write_text(text)
    for name in ('a.yaml', 'none.yaml'):
        with pytest.raises(BadArgument, match=f'stitching_path: .*{name} holds no stitching'):
            load_stitching(str(tmp_path / name))


def waves(x, y):
    return 100 + 60 * np.sin(x / 4e-3) + 30 * np.cos(y / 5e-3)


def wanted(found):
    u, v = np.meshgrid(np.arange(found.size[0]), np.arange(found.size[1]))
    return waves(*found.place(np.stack([u, v], axis=-1)).T).reshape(u.shape)


def test_the_plane_appears_at_its_scale_without_a_step_at_the_seam():
    found = stitching((1.0, 0.8))
    left, right = view(found.left, waves), view(found.right, lambda x, y: waves(x, y) / 0.8)
    picture = make_stitcher('plane', found).stitch(left, right)
    inner = slice(5, -5)
    error = picture.astype(float) - wanted(found)
    assert picture.shape == (61, 121) and picture.dtype == np.uint8
    assert np.abs(error[inner, inner]).max() < 2.5 and abs(error[inner, 59:63].mean(0)).max() < 1


@pytest.mark.parametrize('method', ['plane', 'middle'])
def test_the_half_of_a_missing_view_is_black(method):
    found = stitching()
    left, right = (view(side, waves) for side in (found.left, found.right))
    stitcher = make_stitcher(method, found)
    both, one, other = stitcher.stitch(left, right), stitcher.stitch(left, None), stitcher.stitch(None, right)
    first = 61 if method == 'plane' else 78
    assert (one[:, :first] == both[:, :first]).all() and not one[:, first:].any()
    assert (other[:, first:] == both[:, first:]).all() and not other[:, :first].any()


def test_the_middle_cut_puts_columns_side_by_side():
    left, right = np.full((4, 10), 1, np.uint8) * np.arange(10, dtype=np.uint8), np.full((4, 8), 100, np.uint8)
    picture = MiddleStitcher(((10, 4), (8, 4)), (7.4, 2.0)).stitch(left, right)
    assert picture.shape == (4, 13) and picture[0].tolist() == list(range(7)) + [100] * 6


def test_what_cannot_be_stitched_is_named():
    found = stitching()
    stitcher, good = make_stitcher('plane', found), np.zeros((80, 96), np.uint8)
    for left, right, words in ((good[:40], good, 'left image is 96 x 40 px, the stitching is for 96 x 80'), (None, None, 'no image'),
                               (good, np.zeros((80, 96, 3), np.uint8), 'grey one beside a coloured')):
        with pytest.raises(BadFrame, match=words):
            stitcher.stitch(left, right)
    with pytest.raises(BadArgument, match='height'):
        MiddleStitcher(((10, 4), (10, 5)), (5, 5))
    with pytest.raises(BadArgument, match="'blend' is unknown; choose one of plane, middle"):
        make_stitcher('blend', found)
