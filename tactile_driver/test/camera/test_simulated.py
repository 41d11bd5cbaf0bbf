# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Simulated cameras as sources."""

import time
from types import SimpleNamespace

import numpy as np
import pytest
from tactile_driver.camera import simulated
from tactile_driver.camera.simulated import DualSimulatedSource, SimulatedSource
from tactile_driver.sources import source as pacing


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


def opened(scene, rate):
    return opened_as(SimulatedSource, clock=lambda: scene.now, rate=rate)


def opened_as(kind, clock=time.time_ns, **values):
    source = kind({'scene': 'demo', 'seed': 0, 'width': 0, 'height': 0, **values}, clock)
    source.open()
    return source


def test_the_time_before_a_frame_is_used_for_three_seconds_of_the_scene(scene):
    source = opened(scene, 10.0)
    for steps in (0, 32, 33):  # the first frame is due at once
        source.read()
        assert scene.ahead == steps


def test_nothing_is_computed_ahead_where_no_time_is_left(scene):
    source = opened(scene, 100.0)
    source.read()
    source.read()
    assert scene.ahead == 0


def test_a_frame_is_handed_over_when_it_shows_not_when_it_is_rendered(scene):
    source = opened(scene, 25.0)
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
