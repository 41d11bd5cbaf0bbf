# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots that are no grid: a registered pattern, links between two sets of places, and tracks."""
import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tactile_perception.common.dots import Dots
from tactile_perception.dots.links import Linker, link_places
from tactile_perception.dots.pattern import Pattern, PatternNumbers
from tactile_perception.errors import BadArgument, BadFrame

SIMULATED = Path(os.environ.get('TACTILE_RECORDINGS', '')) / 'simulated'


def scattered(rng, count=200, apart=18.0):
    """(count, 2) px, at random but not nearer to each other than that."""
    uv = np.zeros((0, 2))
    while len(uv) < count:
        place = rng.uniform(0, 480, 2)
        if not len(uv) or np.hypot(*(uv - place).T).min() > apart:
            uv = np.vstack([uv, place])
    return uv


def pressed(uv, rng):
    """The places when something swells the middle of the image by up to two spacings, and all shifts."""
    centre, height, width = rng.uniform(100, 380, 2), rng.uniform(20, 50), rng.uniform(60, 100)
    off = uv - centre
    return uv + height / width * off * np.exp(-(off**2).sum(1) / (2 * width**2))[:, None] + rng.normal(0, 8, 2)


def mixed(moved, rng, hidden, false):
    """Dots in no order, some hidden, some false, and the number of each."""
    seen = rng.permutation(len(moved))[int(hidden * len(moved)):]
    return np.vstack([moved[seen], rng.uniform(0, 480, (false, 2))]), np.r_[seen, np.full(false, -1)]


def test_a_random_pattern_pressed_with_dots_hidden_and_false():
    wrong = missed = 0
    for seed in range(10):
        rng = np.random.default_rng(seed)
        uv = scattered(rng)
        dots, number = mixed(pressed(uv, rng), rng, 0.05, 6)
        id = Pattern(uv).match(dots)
        assert len(np.unique(id[id >= 0])) == np.count_nonzero(id >= 0)
        wrong += np.sum((id >= 0) & (number >= 0) & (id != number))
        missed += np.sum((id < 0) & (number >= 0))
    assert wrong == 0
    assert missed <= 0.02 * 10 * 190


@pytest.mark.parametrize('shift', [0.5, 1.0, 2.0])
def test_a_hexagonal_array_that_moves_by_whole_spacings(shift):
    x, y = np.meshgrid(np.arange(-6, 7), np.arange(-6, 7))
    inside = np.abs(x + y) <= 6
    uv = 12.0 * np.stack([x + y / 2, y * np.sqrt(0.75)], 2)[inside] + 120
    assert len(uv) == 127
    order = np.random.default_rng(1).permutation(127)
    assert np.array_equal(Pattern(uv).match(uv[order] + [12 * shift, 0]), order)


def test_another_pattern_gets_no_number():
    rng = np.random.default_rng(4)
    pattern = Pattern(scattered(rng))
    for _ in range(5):
        assert np.all(pattern.match(scattered(rng)) == -1)
    assert np.all(pattern.match(pattern.uv[:100]) == -1)
    assert len(pattern.match(np.zeros((0, 2)))) == 0
    dots = pattern.uv.copy()
    dots[3] = np.nan
    assert np.array_equal(np.flatnonzero(pattern.match(dots) != np.arange(200)), [3])


def test_bad_patterns_are_named():
    for uv in (np.zeros((7, 2)), np.zeros((9, 3)), np.full((9, 2), np.nan)):
        with pytest.raises(BadArgument, match='at least 8'):
            Pattern(uv)
    with pytest.raises(BadArgument, match='line'):
        Pattern(np.outer(np.arange(12.0), [1, 1]))


@pytest.mark.skipif(not (SIMULATED / 'ac_test').is_dir(), reason='TACTILE_RECORDINGS holds no simulated/ac_test')
@pytest.mark.parametrize('name', ['ac_test', 'ac_calib_small', 'as_test', 'as_calib_small'])
def test_recorded_presses(name):
    """These patterns are grids, of which the search makes no use: what number is right is known."""
    truth, rng = np.load(SIMULATED / name / 'truth.npz')['uv'], np.random.default_rng(0)
    pattern, missed = Pattern(truth[0]), 0
    for uv in truth:
        order = rng.permutation(len(uv))
        id = pattern.match(uv[order])
        assert not np.any((id >= 0) & (id != order))
        missed += np.count_nonzero(id < 0)
    assert missed <= 0.003 * truth.shape[0] * truth.shape[1]


@pytest.fixture
def uv():
    row, column = np.divmod(np.arange(60), 10)
    return np.stack([column * 20.0, row * 20.0], 1) + np.random.default_rng(0).uniform(-6, 6, (60, 2))


def dots(uv):
    return Dots(uv, np.full(len(uv), 50.0), np.full(len(uv), 0.1))


def test_the_first_frame_numbers_all_that_follow(uv):
    numbers, order = PatternNumbers(), np.random.default_rng(1).permutation(60)
    assert np.array_equal(numbers.update(dots(uv), 0.0), np.arange(60))
    assert np.all(numbers.update(dots(uv[:20]), 1.0) == -1)
    assert np.array_equal(numbers.update(dots(uv[order] + [9, 3]), 900.0), order)


def test_a_first_frame_of_few_dots_is_a_bad_one(uv):
    numbers = PatternNumbers()
    with pytest.raises(BadFrame, match='at least 8'):
        numbers.update(dots(uv[:5]), 0.0)
    assert np.array_equal(numbers.update(dots(uv), 1.0), np.arange(60))


SEEDS = st.integers(0, 2**32 - 1)


def update(linker, uv, stamp_s):
    return linker.update(Dots(uv, np.ones(len(uv)), np.ones(len(uv))), stamp_s)


@given(seed=SEEDS, places=st.integers(0, 40), dots=st.integers(0, 40), gate=st.floats(0.1, 60))
@settings(max_examples=100, deadline=None)
def test_places_and_dots_that_are_each_others_nearest_are_linked(seed, places, dots, gate):
    rng = np.random.default_rng(seed)
    p, d = rng.uniform(0, 100, (places, 2)), rng.uniform(0, 100, (dots, 2))
    away = np.linalg.norm(p[:, None] - d, axis=2)
    mutual = [(i, j) for i, j in np.ndindex(away.shape) if away[i, j] < gate and away[i, j] == away[i].min() == away[:, j].min()]
    assert [tuple(link) for link in link_places(p, d, gate).tolist()] == mutual


def test_numbers_stay_through_a_drag_of_two_spacings():
    uv, linker, rng = scattered(np.random.default_rng(0), 120, 20.0), Linker(), np.random.default_rng(1)
    update(linker, uv, -0.02)
    for step in range(40):
        order = rng.permutation(len(uv))
        shift = 45.0 * np.sin(np.pi * step / 39) * np.exp(-((uv - 225) ** 2).sum(axis=1, keepdims=True) / (2 * 90**2))
        number = update(linker, (uv + shift * [1, 0] + rng.normal(0, 0.1, uv.shape))[order], step / 60)
        np.testing.assert_array_equal(number, order)


def test_lost_dots_come_back_under_their_number_and_none_is_used_twice():
    uv, linker = scattered(np.random.default_rng(0), 30, 20.0), Linker()
    update(linker, uv, 0.0)
    assert update(linker, uv[1:], 0.1).tolist() == list(range(1, 30))
    assert update(linker, uv, 0.2)[0] == 0
    for step in range(25):
        update(linker, uv[1:], 0.3 + 0.1 * step)
    assert update(linker, uv, 2.8)[0] == -1 and update(linker, uv, 2.9)[0] >= 30


def test_a_false_dot_of_a_frame_or_two_is_never_handed_out():
    uv, linker = scattered(np.random.default_rng(0), 30, 20.0), Linker()
    update(linker, uv, 0.0)
    for stamp_s in (0.02, 0.04, 0.1):
        assert update(linker, np.vstack([uv, [[600.0, 600.0]]]), stamp_s)[-1] == (-1 if stamp_s < 0.1 else 30)
    assert update(linker, np.vstack([uv, [[np.nan, 600.0]]]), 0.12).tolist() == [*range(30), -1]


def test_no_dots():
    linker = Linker()
    assert len(update(linker, np.zeros((0, 2)), 0.0)) == 0
    assert update(linker, scattered(np.random.default_rng(0), 5, 20.0), 1.0).tolist() == [0, 1, 2, 3, 4]
    assert len(update(linker, np.zeros((0, 2)), 1.1)) == 0
