# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Markers of the right view at the left exposure, against markers whose motion is known."""
from types import SimpleNamespace

import numpy as np
import pytest
from tactile_perception.common.dots import DotTracks
from tactile_perception.press.shutters import RightShutter

SEAM, PERIOD, SIGMA = 50.0, 1 / 30, 0.02
REST = np.array([[10.0, 5.0], [40.0, 20.0], [60.0, 5.0], [95.0, 30.0]])  # two on each side of the seam
SPEED = np.array([[90.0, 0.0], [30.0, -60.0], [-60.0, 30.0], [120.0, 45.0]])  # px/s


def seen(left_s, skew_s, speed=SPEED, accelerated=0.0, noise=None):
    """Tracks of all four markers, each where it is when its camera exposes; area in proportion to 1 + time."""
    time_s = np.where(REST[:, 0] > SEAM, left_s + skew_s, left_s)
    moved = speed * time_s[:, None] + 0.5 * accelerated * time_s[:, None]**2
    moved = moved + (0.0 if noise is None else noise.normal(0, SIGMA, moved.shape))
    return DotTracks(2, 2, np.arange(4), REST + moved, 12.0 * (1 + time_s), np.full(4, SIGMA), moved)


@pytest.mark.parametrize('share', [-0.5, -0.3, -0.1, 0.1, 0.345, 0.5])
def test_even_motion_is_followed_at_any_offset(share):
    shutter, skew = RightShutter(SEAM, 4), share * PERIOD
    for k in range(4):
        tracks = shutter.process(seen(k * PERIOD, skew), k * PERIOD, skew)
    true = REST + SPEED * 3 * PERIOD
    assert np.abs(tracks.uv - true).max() < 0.01 and np.abs(tracks.duv - (true - REST)).max() < 0.01
    assert tracks.area == pytest.approx(np.full(4, 12.0 * (1 + 3 * PERIOD)), rel=1e-3)
    assert np.abs(seen(3 * PERIOD, skew).uv - true).max() > 0.3, 'without the correction'
    assert tracks.sigma[2] == pytest.approx(SIGMA * np.hypot(1 - share, share), rel=0.01) and tracks.sigma[0] == SIGMA


def test_an_accelerated_marker_is_followed_to_half_an_interval_squared():
    shutter, skew, pull = RightShutter(SEAM, 4), PERIOD / 3, 900.0  # px/s^2
    for k in range(4):
        tracks = shutter.process(seen(k * PERIOD, skew, accelerated=pull), k * PERIOD, skew)
    true = REST + SPEED * 3 * PERIOD + 0.5 * pull * (3 * PERIOD)**2
    assert np.abs(tracks.uv - true).max() < 0.5 * pull * skew * (PERIOD - skew) * 1.1  # error of a linear interpolation


def test_a_synchronised_pair_is_left_as_it_is():
    shutter = RightShutter(SEAM, 4)
    for k in range(3):
        given = seen(k * PERIOD, 0.0)
        assert shutter.process(given, k * PERIOD, 0.0) is given


def test_the_left_view_is_never_changed():
    shutter = RightShutter(SEAM, 4)
    for k in range(3):
        given = seen(k * PERIOD, 0.01)
        found = shutter.process(given, k * PERIOD, 0.01)
        assert (found.uv[:2] == given.uv[:2]).all() and (found.area[:2] == given.area[:2]).all()


@pytest.mark.parametrize('share', [-0.5, 0.5])
def test_markers_at_rest_get_little_more_noise(share):
    shutter, skew, noise = RightShutter(SEAM, 4), share * PERIOD, np.random.default_rng(1)
    off = []
    for k in range(500):
        tracks = shutter.process(seen(k * PERIOD, skew, speed=0 * SPEED, noise=noise), k * PERIOD, skew)
        off.append(tracks.uv[2:] - REST[2:])
    assert np.std(off) < 1.3 * SIGMA, 'going on by half a motion makes it 1.58 times'


def test_a_marker_without_an_earlier_place_stays_where_it_is_seen():
    shutter, skew = RightShutter(SEAM, 4), 0.01
    first = seen(0.0, skew)
    assert (shutter.process(first, 0.0, skew).uv == first.uv).all()
    shutter.process(seen(PERIOD, skew).take(np.array([0, 1, 2])), PERIOD, skew)
    found = shutter.process(seen(2 * PERIOD, skew), 2 * PERIOD, skew)
    assert np.abs(found.uv - (REST + SPEED * 2 * PERIOD)).max() < 0.02, 'a marker that was missed once goes on from its last place'


def balance(ratio=np.nan, sigma=np.inf, imbalance=0.0):
    """A seam that tells this."""
    return SimpleNamespace(ratio=lambda uv, duv, move: (ratio, sigma), imbalance=lambda uv, duv: imbalance)


def begun(told, skew, steady=True):
    """Tracks after two frames at rest and one (steady: three) in motion, and what was seen last."""
    shutter = RightShutter(SEAM, 4, told)
    for k in range(2):
        shutter.process(seen(k * PERIOD, skew, speed=0 * SPEED), k * PERIOD, skew)
    for k in range(2, 5 if steady else 3):
        given = seen(k * PERIOD, skew)
        tracks = shutter.process(given, k * PERIOD, skew)
    return tracks, given


def test_a_motion_that_begins_is_told_by_the_seam_and_a_steady_one_by_its_intervals():
    skew = 0.4 * PERIOD
    tracks, given = begun(balance(-1.0, 0.05), skew, steady=False)
    assert np.abs(tracks.uv[2:] - REST[2:]).max() < 0.05 * np.abs(given.uv[2:] - REST[2:]).max(), 'the press began after the left exposure'
    tracks, _ = begun(balance(-1.0, 0.5), skew)
    assert np.abs(tracks.uv - (REST + SPEED * 4 * PERIOD)).max() < 0.2, 'a vague seam does not disturb a steady motion'
    for found in (begun(told, skew)[0] for told in (balance(), None)):
        assert np.abs(found.uv - (REST + SPEED * 4 * PERIOD)).max() < 0.01


def test_a_sheet_that_both_views_show_untouched_is_left_as_it_is():
    shutter, noise = RightShutter(SEAM, 4, balance(0.0, 0.3)), np.random.default_rng(2)
    for k in range(3):
        shutter.process(seen(k * PERIOD, 0.4 * PERIOD), k * PERIOD, 0.4 * PERIOD)
    released = seen(3 * PERIOD, 0.4 * PERIOD, speed=0 * SPEED, noise=noise)
    assert shutter.process(released, 3 * PERIOD, 0.4 * PERIOD) is released


@pytest.mark.parametrize('skew', [-0.4, 0.4])
@pytest.mark.parametrize('imbalance, kept', [(0.2, [0, 1]), (0.01, [0, 1, 2, 3])])
def test_a_touch_that_the_right_view_alone_shows_is_of_another_time(skew, imbalance, kept):
    shutter = RightShutter(SEAM, 4, balance(imbalance=imbalance))
    for k in range(2):
        shutter.process(seen(k * PERIOD, 0.0, speed=0 * SPEED), k * PERIOD, skew * PERIOD)
    given = seen(2 * PERIOD, 0.0)
    given.uv[:2], given.duv[:2] = REST[:2], 0.0
    assert shutter.process(given, 2 * PERIOD, skew * PERIOD).id.tolist() == kept


def test_nothing_goes_back_beyond_its_last_place():
    for ratio in (-5.0, 5.0):
        tracks, given = begun(balance(ratio, 1e-3), 0.4 * PERIOD, steady=False)
        low, high = np.minimum(REST, given.uv), np.maximum(REST, given.uv)
        assert (tracks.uv >= low - 0.01).all() and (tracks.uv <= high + 0.01).all()


@pytest.mark.parametrize('skew, imbalance, kept', [(-0.4, 0.2, [0, 1]), (-0.4, 0.01, [0, 1, 2, 3]), (0.4, 0.2, [0, 1, 2, 3])])
def test_a_right_view_from_before_the_touch_is_left_out(skew, imbalance, kept):
    shutter = RightShutter(SEAM, 4, balance(imbalance=imbalance))
    for k in range(3):
        given = seen(0.0 if k < 2 else PERIOD, 0.0)
        given.uv[2:] = REST[2:]
        given.duv[2:] = 0.0
        tracks = shutter.process(given, k * PERIOD, skew * PERIOD)
    assert tracks.id.tolist() == kept


@pytest.mark.parametrize('imbalance, kept', [(0.2, [0, 1, 2]), (0.01, [0, 1, 2, 3])])
def test_a_right_view_with_the_first_traces_of_a_touch_is_left_out_until_it_goes_on(imbalance, kept):
    shutter = RightShutter(70.0, 4, balance(imbalance=imbalance))  # one marker on the right
    for k in range(2):
        shutter.process(seen(0.0, 0.0), k * PERIOD, -0.2 * PERIOD)
    assert shutter.process(seen(PERIOD, 0.0), 2 * PERIOD, -0.2 * PERIOD).id.tolist() == kept
    assert shutter.process(seen(2 * PERIOD, 0.0), 3 * PERIOD, -0.2 * PERIOD).id.tolist() == [0, 1, 2, 3]


@pytest.mark.parametrize('share', [-0.45, -0.2])
def test_a_press_that_turns_back_after_an_early_right_exposure_is_followed_by_the_left_view(share):
    """Displacements in proportion to a depth that rests and then falls; the seam tells nothing."""
    shutter, skew, turn = RightShutter(SEAM, 4), share * PERIOD, 4.9 * PERIOD
    field = np.array([[3.0, 1.0], [-2.0, 4.0], [5.0, -1.0], [1.0, 2.0]])

    def depth(time_s):
        return 1.0 - 30.0 * np.maximum(time_s - turn, 0.0)
    for k in range(6):
        time_s = np.where(REST[:, :1] > SEAM, k * PERIOD + skew, k * PERIOD)
        shift = field * depth(time_s)
        tracks = shutter.process(DotTracks(2, 2, np.arange(4), REST + shift, np.full(4, 12.0), np.full(4, SIGMA), shift), k * PERIOD, skew)
        error = np.abs(tracks.duv - field * depth(k * PERIOD)).max()
        assert error < 0.005, f'frame {k}'
    assert np.abs(field[2:] * (depth(time_s[2:]) - depth(k * PERIOD))).max() > 0.4, 'as last seen'
