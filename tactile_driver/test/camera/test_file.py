# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Files and simulated cameras as sources."""
import time
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from fake_source import video_of

from tactile_driver.camera import simulated
from tactile_driver.camera.file import FileSource, TwoFilesSource
from tactile_driver.camera.simulated import DualSimulatedSource, SimulatedSource
from tactile_driver.errors import BadFrame, BadRecording
from tactile_driver.sources import source as pacing
from tactile_driver.sources.source import EndOfSource


@pytest.fixture
def video(tmp_path):
    """Ten frames of 64 x 48 at 50 Hz, frame k of brightness 10 + 20 k."""
    return video_of(tmp_path / 'pad.avi', range(10, 210, 20))


@pytest.fixture
def folder(tmp_path):
    """frame_1, frame_2 and frame_10, grey, of brightness 1, 2 and 10, and a text file."""
    for k in (10, 1, 2):
        cv2.imwrite(str(tmp_path / f'frame_{k}.png'), np.full((48, 64), k, np.uint8))
    (tmp_path / 'notes.txt').write_text('no image')
    return tmp_path


def played(source):
    """All frames until the end."""
    frames = []
    with pytest.raises(EndOfSource):
        while True:
            frames.append(source.read())
    return frames


def opened(path, rate=0.0, loop=False, clock=time.time_ns):
    source = FileSource({'path': str(path), 'rate': rate, 'loop': loop}, clock)
    source.open()
    return source


def test_every_frame_of_a_video_in_order(video):
    frames = played(opened(video))
    assert [round(f.image.mean() / 20 - 0.5) for f in frames] == list(range(10))
    assert {f.encoding for f in frames} == {'bgr8'}


def test_as_fast_as_consumed_the_stamps_are_recorded_time(video):
    source = opened(video, clock=lambda: 7_000_000_000)
    assert source.read(wanted=False) is None
    assert [f.stamp_ns for f in played(source)] == [7_000_000_000 + k * 20_000_000 for k in range(1, 10)]


@pytest.mark.parametrize(('rate', 'seconds'), [(-1.0, 0.18), (100.0, 0.09)])
def test_own_and_set_rate(video, rate, seconds):
    begin = time.monotonic()
    frames = played(opened(video, rate))
    assert time.monotonic() - begin > 0.95 * seconds  # a busy machine is slower
    assert (np.diff([frame.stamp_ns for frame in frames]) > 0).all() and len(frames) == 10


def test_a_loop_starts_again_and_time_goes_on(video):
    source = opened(video, loop=True)
    frames = [source.read() for _ in range(23)]
    assert round(frames[20].image.mean() / 20 - 0.5) == 0
    assert np.all(np.diff([f.stamp_ns for f in frames]) == 20_000_000)


def test_a_folder_is_played_in_natural_order(folder):
    frames = played(opened(folder))
    assert [int(f.image[0, 0]) for f in frames] == [1, 2, 10]
    assert frames[0].encoding == 'mono8'


def test_a_broken_image_is_bad_and_the_next_one_good(folder):
    (folder / 'frame_2.png').write_bytes(b'\x89PNG broken')
    source = opened(folder)
    source.read()
    with pytest.raises(BadFrame, match='frame_2.png'):
        source.read()
    assert source.read().image[0, 0] == 10


def test_a_video_cut_off_in_the_middle_counts_what_is_missing(video):
    data = video.read_bytes()
    starts = [i for i in range(len(data) - 4) if data[i:i + 4] == b'00dc']
    video.write_bytes(data[:starts[6]])
    source = opened(video)
    frames = played(source)
    assert len(frames) in (5, 6)
    assert source.corrupt == 10 - len(frames)


@pytest.mark.parametrize('name', ['missing.avi', 'rubbish.avi', 'empty'])
def test_what_is_no_recording_is_named(tmp_path, name):
    (tmp_path / 'rubbish.avi').write_bytes(b'rubbish' * 100)
    (tmp_path / 'empty').mkdir()
    with pytest.raises(BadRecording, match=name):
        opened(tmp_path / name)


def test_a_video_of_which_nothing_can_be_decoded_is_refused_with_what_to_do(video):
    data = bytearray(video.read_bytes())
    begin = data.index(b'movi') + 4
    data[begin:] = bytes(len(data) - begin)
    video.write_bytes(bytes(data))
    with pytest.raises(BadRecording, match='ffmpeg'):
        opened(video)


@pytest.fixture
def folders(tmp_path):
    """left: 5 images of brightness k; right: 6 of brightness 100 + k."""
    for name, first, count in (('left', 0, 5), ('right', 100, 6)):
        (tmp_path / name).mkdir()
        for k in range(count):
            cv2.imwrite(str(tmp_path / name / f'{k}.png'), np.full((8, 8), first + k, np.uint8))
    return tmp_path


def opened_file(folder, rate=0.0, loop=False, clock=time.time_ns):
    source = TwoFilesSource({'path': str(folder / 'left'), 'right_path': str(folder / 'right'), 'rate': rate, 'loop': loop}, clock)
    source.open()
    return source


def numbers(pair):
    return int(pair.left.image[0, 0]), int(pair.right.image[0, 0]) - 100


def test_the_nth_frames_are_pairs_until_the_shorter_file_ends(folders):
    source = opened_file(folders)
    pairs = [source.read() for _ in range(5)]
    assert [numbers(p) for p in pairs] == [(k, k) for k in range(5)]
    assert all(p.left.stamp_ns == p.right.stamp_ns for p in pairs) and source.on_demand and not source.live
    with pytest.raises(EndOfSource):
        source.read()
    source.close()


def test_a_loop_begins_both_again(folders):
    source = opened_file(folders, loop=True)
    assert [numbers(source.read()) for _ in range(8)] == [(k % 5, k % 5) for k in range(8)]


@pytest.mark.parametrize('broken', ['left', 'right'])
def test_a_frame_whose_mate_is_broken_is_dropped(folders, broken):
    (folders / broken / '2.png').write_bytes(b'x')
    source = opened_file(folders)
    found = [numbers(source.read()) for _ in range(2)]
    with pytest.raises(BadFrame, match='2.png'):
        source.read()
    found += [numbers(source.read()) for _ in range(2)]
    assert found == [(0, 0), (1, 1), (3, 3), (4, 4)] and source.describe()['unpaired'] == source.skipped == 1


def test_unwanted_pairs_are_passed_over(folders):
    source = opened_file(folders)
    assert source.read(False) is None and numbers(source.read()) == (1, 1)
    assert source.calibrations() == (None, None) and source.corrupt == 0


MS = 1_000_000


class FakeScene:
    """A scene on a clock by which a frame is rendered in 10 ms and a step computed ahead in 1 ms."""

    def __init__(self):
        self.now, self.ahead = 10**12, 0

    def sleep(self, seconds):
        self.now += round(seconds * 1e9)

    def render(self, t):
        self.now += 10 * MS
        return simulated_frame(t)

    def observe_ahead(self, number):
        self.now += MS
        self.ahead += self.ahead < number
        return self.ahead < number


def simulated_frame(t):
    return type('Rendered', (), {'image': np.full((48, 64, 3), 1, np.uint8), 'truth': t})


@pytest.fixture
def scene(monkeypatch):
    fake = FakeScene()
    monkeypatch.setattr(simulated.scenes, 'open_scene', lambda *_: fake)
    for module in (simulated, pacing):  # there alone: threads of other tests sleep too
        monkeypatch.setattr(module, 'time', SimpleNamespace(monotonic_ns=lambda: fake.now, sleep=fake.sleep))
    return fake


def on_clock(scene, rate):
    return opened_as(SimulatedSource, clock=lambda: scene.now, rate=rate)


def opened_as(kind, clock=time.time_ns, **values):
    source = kind({'scene': 'demo', 'seed': 0, 'width': 0, 'height': 0, **values}, clock)
    source.open()
    return source


def test_the_time_before_a_frame_is_used_for_three_seconds_of_the_scene(scene):
    source = on_clock(scene, 10.0)
    for steps in (0, 32, 33):  # the first frame is due at once
        source.read()
        assert scene.ahead == steps


def test_nothing_is_computed_ahead_where_no_time_is_left(scene):
    source = on_clock(scene, 100.0)
    source.read()
    source.read()
    assert scene.ahead == 0


def test_a_frame_is_handed_over_when_it_shows_not_when_it_is_rendered(scene):
    source = on_clock(scene, 25.0)
    source.read()
    stamps = [(source.read().stamp_ns, scene.now) for _ in range(5)]
    assert all(stamp == now for stamp, now in stamps) and {b - a for (a, _), (b, _) in zip(stamps, stamps[1:])} == {40 * MS}


def test_the_touchpad_itself():
    source = opened_as(SimulatedSource, scene='rest', rate=100.0, width=320, height=240)
    frame = source.read()
    assert frame.image.shape == (240, 320, 3) and frame.image.dtype == np.uint8 and frame.encoding == 'bgr8'
    assert not frame.truth.dot_state.any()
    about, (calibration,) = source.describe(), source.calibrations()
    assert (about['width'], about['height'], about['rate']) == (320, 240, 100.0)
    assert (calibration.width, calibration.height, calibration.model) == (320, 240, 'plumb_bob')
    assert calibration.k[0] > 100


@pytest.mark.parametrize('delay', [0.0035, -0.006])
def test_two_cameras_are_a_pair_at_their_own_times(monkeypatch, delay):
    pictures = np.full((4, 6, 3), 1, np.uint8), np.full((4, 6, 3), 2, np.uint8)
    fake = type('Two', (), {'right_delay': lambda self, number: delay, 'render': lambda self, t: (*pictures, f'truth {t}')})()
    monkeypatch.setattr(simulated.scenes, 'open_dual_scene', lambda name, rate, seed: fake)
    source = opened_as(DualSimulatedSource, rate=50.0)
    pair = source.read()
    assert pair.right.stamp_ns <= time.time_ns() and pair.right.stamp_ns - pair.left.stamp_ns == round(delay * 1e9)
    assert pair.truth == 'truth 0.0' and pair.stamp_ns == pair.left.stamp_ns
    assert (pair.left.image == 1).all() and (pair.right.image == 2).all()


def test_the_two_simulated_cameras_are_calibrated():
    source = opened_as(DualSimulatedSource, scene='areal_dual_rest', rate=10.0, seed=3)
    left, right = source.calibrations()
    pair = source.read()
    assert (left.width, left.height) == pair.left.image.shape[1::-1] and left.k != right.k and left.model == 'plumb_bob'


@pytest.mark.parametrize('scene, sensor', [('areal_single_rest', 'areal_single'), ('air_cushion_rest', 'air_cushion')])
def test_a_scene_s_name_tells_the_sensor(scene, sensor):
    source = opened_as(SimulatedSource, scene=scene, rate=100.0, seed=1)
    assert source.read().image.shape == (480, 640, 3)
    assert source.describe()['device'] == f'simulated {sensor}'
