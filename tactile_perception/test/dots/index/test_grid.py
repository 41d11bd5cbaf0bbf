# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import os
from pathlib import Path

import numpy as np
import pytest
from tactile_perception.dots.index.grid import Numbered, number_grid
from tactile_perception.errors import BadArgument

from grids import SCENES, make_grid

SIZE = (640, 480)


def score(numbers, number):
    """(wrong, missed, all) of the true dots."""
    true = number >= 0
    return np.sum(true & (numbers.id >= 0) & (numbers.id != number)), np.sum(true & (numbers.id < 0)), np.sum(true)


@pytest.mark.parametrize('scene', SCENES)
def test_from_nothing_no_number_is_wrong(scene):
    rng = np.random.default_rng(1)
    totals = np.zeros(3)
    for _ in range(25):
        uv, number = make_grid(rng, **SCENES[scene])
        totals += score(number_grid(uv, 23, 23, None, SIZE), number)
    assert totals[0] == 0
    assert totals[1] <= 0.005 * totals[2]


@pytest.mark.parametrize('pitches', [0.0, 0.5, 1.0, 2.0, 3.0])
def test_a_fast_move_between_two_frames_changes_no_number(pitches):
    rng = np.random.default_rng(int(10 * pitches))
    for scene in ('plain', 'missing, merged and false', 'dragged'):
        for way in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            uv, number = make_grid(rng)
            previous = Numbered(uv, number)
            uv, number = make_grid(rng, **SCENES[scene], shift=np.array(way) * pitches)
            wrong, missed, count = score(number_grid(uv, 23, 23, previous, SIZE), number)
            assert wrong == 0
            assert missed <= 0.02 * count


def test_the_order_of_the_dots_and_those_that_are_not_finite_do_not_matter():
    uv, number = make_grid(np.random.default_rng(2))
    uv[7] = np.nan
    numbers = number_grid(uv, 23, 23)
    assert numbers.certain
    assert numbers.id[7] == -1
    np.testing.assert_array_equal(np.delete(numbers.id, 7), np.delete(number, 7))


@pytest.mark.parametrize(('rows', 'columns'), [(7, 10), (9, 13), (5, 4)])
def test_other_grids(rows, columns):
    uv, number = make_grid(np.random.default_rng(3), rows=rows, columns=columns, pitch=40.0)
    np.testing.assert_array_equal(number_grid(uv, rows, columns).id, number)


@pytest.mark.parametrize(('rows', 'columns'), [(23, 25), (20, 23), (13, 9)])
def test_another_pattern_than_configured_is_said(rows, columns):
    uv, _ = make_grid(np.random.default_rng(4))
    numbers = number_grid(uv, rows, columns, None, SIZE)
    assert not numbers.certain
    assert np.all(numbers.id == -1)
    assert '23' in numbers.reason and str(rows if rows != 23 else columns) in numbers.reason


def test_dots_at_random_places_get_no_number():
    rng = np.random.default_rng(5)
    for _ in range(20):
        numbers = number_grid(rng.uniform(0, 480, (529, 2)), 23, 23, None, SIZE)
        assert not numbers.certain and np.all(numbers.id == -1)


@pytest.mark.parametrize('count', [0, 1, 3, 4])
def test_too_few_dots(count):
    numbers = number_grid(np.arange(2.0 * count).reshape(count, 2), 23, 23)
    assert not numbers.certain
    assert len(numbers.id) == count


def test_half_of_the_dots_gone_misnumbers_none():
    rng = np.random.default_rng(6)
    for _ in range(20):
        uv, number = make_grid(rng)
        for gone in (uv[:, 0] > 320, uv[:, 1] < 240, rng.uniform(size=len(uv)) < 0.5):
            assert score(number_grid(uv[~gone], 23, 23, None, SIZE), number[~gone])[0] == 0


@pytest.mark.parametrize(('gone', 'numbered'), [(0.15, 0.98), (0.3, 0.9)])
@pytest.mark.parametrize('scene', ['plain', 'compressed', 'sheared'])
def test_scattered_gaps_leave_most_dots_their_numbers(scene, gone, numbered):
    rng = np.random.default_rng(8)
    totals = np.zeros(3)
    for _ in range(5):
        uv, number = make_grid(rng, **{**SCENES[scene], 'missing': gone})
        totals += score(number_grid(uv, 23, 23, None, SIZE), number)
    assert totals[0] == 0
    assert totals[1] <= (1 - numbered) * totals[2]


def test_why_half_of_the_dots_get_no_number_is_told():
    rng = np.random.default_rng(6)
    uv, _ = make_grid(rng)
    numbers = number_grid(uv[rng.uniform(size=len(uv)) < 0.5], 23, 23, None, SIZE)
    assert (numbers.id < 0).all()
    assert 'dots found (529 configured)' in numbers.reason


def test_a_grid_turned_by_45_degrees_is_not_certain():
    uv, _ = make_grid(np.random.default_rng(7), turn=45.0, pitch=14.0)
    assert 'degrees' in number_grid(uv, 23, 23).reason


def test_wrong_arguments_are_named():
    with pytest.raises(BadArgument, match=r'\(N, 2\)'):
        number_grid(np.zeros((4, 3)), 23, 23)
    with pytest.raises(BadArgument, match='1 x 23'):
        number_grid(np.zeros((4, 2)), 1, 23)


SIMULATED = Path(os.environ.get('TACTILE_RECORDINGS', '')) / 'simulated'


@pytest.mark.skipif(not (SIMULATED / 'as_test').is_dir(), reason='TACTILE_RECORDINGS holds no simulated/as_test')
@pytest.mark.parametrize('name, side, rows, columns, first', [
    ('as_test', '', 9, 13, 0), ('as_calib_small', '', 9, 13, 0), ('ac_test', '', 17, 17, 18), ('ac_calib_small', '', 17, 17, 18),
    ('ad_test', '_left', 11, 8, 0), ('ad_test', '_right', 11, 8, 6), ('ad_calib_small', '_right', 11, 8, 6)])
def test_all_markers_seen_in_the_deepest_presses_are_numbered_from_one_image(name, side, rows, columns, first):
    """Of a dome's grid the corners are missing; each view of two cameras sees eight of fourteen columns."""
    truth = np.load(SIMULATED / name / 'truth.npz')
    number = truth['dot_rc'] - divmod(first, 17 if name.startswith('ac') else 14)
    previous = None
    for uv, seen in zip(truth['uv' + side], truth['visible' + side]):
        numbers, id = number_grid(uv[seen].astype(float), rows, columns), number[seen] @ [columns, 1]
        assert numbers.certain and np.array_equal(numbers.id, id)
        assert np.array_equal(number_grid(uv[seen].astype(float), rows, columns, previous).id, id)
        previous = Numbered(uv[seen], id)
