# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers of dots, on a grid and in a pattern without one."""
import copy
import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

from tactile_perception.common.dots import Dots
from tactile_perception.core.errors import BadArgument, BadFrame
from tactile_perception.dots.links import Linker, link_positions
from tactile_perception.dots.number import GridNumbering, find_lattice, number_grid
from tactile_perception.dots.pattern import Pattern, PatternNumbers

SCENES = {
    'plain': {},
    'bulged': {'bulge': 0.2},
    'compressed': {'compression': 0.6},
    'sheared': {'shear': 0.2, 'turn': 20.0},
    'sheared back': {'shear': -0.2, 'turn': -20.0},
    'dragged': {'drag': 2.0},
    'missing, merged and false': {'missing': 0.02, 'merged': 0.01, 'false': 0.01},
    'all at once': {'bulge': 0.1, 'compression': 0.7, 'shear': 0.1, 'turn': 20.0, 'missing': 0.02, 'merged': 0.01, 'false': 0.01},
}


def make_grid(rng, rows=23, columns=23, pitch=18.0, size=(640, 480), turn=0.0, shear=0.0, bulge=0.0, compression=1.0, drag=0.0,
              shift=(0.0, 0.0), missing=0.0, merged=0.0, false=0.0, noise=0.05):
    """(uv (N, 2) px, number (N,)) in random order; number is -2 for false and merged dots. shift, drag: pitches; turn: degrees."""
    number = np.arange(rows * columns)
    p = np.stack([number % columns - (columns - 1) / 2, number // columns - (rows - 1) / 2], axis=1)
    p = p * (1 + bulge * (1 - (p**2).sum(axis=1, keepdims=True) / (rows / 2) ** 2) / 2)
    centre, direction = rng.uniform(-5, 5, 2), np.exp(1j * rng.uniform(0, 2 * np.pi))
    direction = np.array([direction.real, direction.imag])
    away, width = p - centre, rng.uniform(3, 6)
    p = p - (1 - compression) * np.outer(away @ direction * np.exp(-(away**2).sum(axis=1) / (2 * width**2)), direction)
    width = max(2.2, 1.7 * drag) * rng.uniform(1, 1.5)
    p = p + drag * np.outer(np.exp(-(away**2).sum(axis=1) / (2 * width**2)), direction)
    c, s = np.cos(np.deg2rad(turn)), np.sin(np.deg2rad(turn))
    p = p @ np.array([[1, shear], [0, 1]]).T @ np.array([[c, -s], [s, c]]).T
    uv = (p + shift) * pitch + np.array(size) / 2 + rng.normal(0, noise, p.shape)
    keep = rng.uniform(size=len(uv)) >= missing
    pairs = np.flatnonzero((rng.uniform(size=len(uv)) < merged) & (number % columns < columns - 1))
    uv[pairs], keep[pairs + 1] = (uv[pairs] + uv[pairs + 1]) / 2, False
    number[pairs] = -2
    keep &= np.all((uv > 2) & (uv < np.array(size) - 3), axis=1)
    stray = rng.uniform(0, 1, (rng.poisson(false * rows * columns), 2)) * size
    order = rng.permutation(keep.sum() + len(stray))
    return np.vstack([uv[keep], stray])[order], np.r_[number[keep], np.full(len(stray), -2)][order]


def score(numbers, number):
    """(wrong, missed, all) of the true dots."""
    true = number >= 0
    return np.sum(true & (numbers.id >= 0) & (numbers.id != number)), np.sum(true & (numbers.id < 0)), np.sum(true)


def after(uv, rows, columns):
    """A numbering that has seen a whole grid at uv (N, 2) px."""
    numbering = GridNumbering(rows, columns)
    assert numbering.number(uv).certain
    return numbering


@pytest.mark.parametrize('scene', SCENES)
def test_from_nothing_no_number_is_wrong(scene):
    rng = np.random.default_rng(1)
    totals, refused = np.zeros(3), 0
    for _ in range(25):
        uv, number = make_grid(rng, **SCENES[scene])
        numbers = number_grid(uv, 23, 23)
        refused += not numbers.certain
        totals += score(numbers, number) if numbers.certain else 0
    assert totals[0] == 0
    assert totals[1] <= 0.005 * totals[2] and refused <= 1  # merged dots make links contradict each other in one of a hundred


@pytest.mark.parametrize('pitches', [0.0, 0.5, 1.0, 2.0, 3.0])
def test_a_fast_move_between_two_frames_changes_no_number(pitches):
    rng = np.random.default_rng(int(10 * pitches))
    for scene in ('plain', 'missing, merged and false', 'dragged'):
        for shift in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            numbering = after(make_grid(rng)[0], 23, 23)
            uv, number = make_grid(rng, **SCENES[scene], shift=np.array(shift) * pitches)
            wrong, missed, count = score(numbering.number(uv), number)
            assert wrong == 0
            assert missed <= 0.02 * count or pitches == 3  # a row has left by then, and the move is too far to know which


@pytest.mark.parametrize(('rows', 'columns'), [(23, 25), (20, 23), (13, 9)])
def test_another_pattern_than_configured_is_said(rows, columns):
    uv, _ = make_grid(np.random.default_rng(4))
    numbers = number_grid(uv, rows, columns)
    assert not numbers.certain
    assert np.all(numbers.id == -1)
    assert '23' in numbers.reason and str(rows if rows != 23 else columns) in numbers.reason


def test_dots_at_random_places_get_no_number():
    rng = np.random.default_rng(5)
    for _ in range(20):
        numbers = number_grid(rng.uniform(0, 480, (529, 2)), 23, 23)
        assert not numbers.certain and np.all(numbers.id == -1)


@pytest.mark.parametrize(('gone', 'numbered'), [(0.15, 0.98), (0.3, 0.9)])
@pytest.mark.parametrize('scene', ['plain', 'compressed', 'sheared'])
def test_scattered_gaps_leave_most_dots_their_numbers(scene, gone, numbered):
    rng = np.random.default_rng(8)
    totals = np.zeros(3)
    for _ in range(5):
        uv, number = make_grid(rng, **{**SCENES[scene], 'missing': gone})
        totals += score(number_grid(uv, 23, 23), number)
    assert totals[0] == 0
    assert totals[1] <= (1 - numbered) * totals[2]


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
    numbering = GridNumbering(rows, columns)
    for uv, seen in zip(truth['uv' + side], truth['visible' + side]):
        numbers, id = number_grid(uv[seen].astype(float), rows, columns), number[seen] @ [columns, 1]
        assert numbers.certain and (numbers.id >= 0).mean() >= 0.85
        for ids in (numbers.id, numbering.number(uv[seen].astype(float)).id):
            assert np.array_equal(ids[ids >= 0], id[ids >= 0])


@pytest.fixture
def dome():
    """Places of an 8 x 10 grid, its pitch growing towards the middle as on a dome, their row, column and index."""
    row, column = np.divmod(np.arange(80), 10)
    p = np.stack([column - 4.5, row - 3.5], axis=1)
    return 30.0 * p * (1.1 - 0.006 * (p**2).sum(axis=1, keepdims=True)) + [160, 130], row, column, np.arange(80)


def test_two_false_dots_make_no_row(dome):
    uv, *_, id = dome
    numbers = number_grid(np.vstack([uv, [[100.0, -25.0], [130.0, -26.0]]]), 8, 10)
    np.testing.assert_array_equal(numbers.id, np.r_[id, -1, -1])


def test_half_a_grid_is_certain_only_by_its_own_unevenness(dome):
    uv, _, column, id = dome
    left = column < 5
    assert '5 of 10 columns' in number_grid(uv[left], 8, 10).reason
    np.testing.assert_array_equal(after(uv, 8, 10).number(uv[left] + 2.0).id, id[left])


def test_on_an_even_grid_a_hidden_row_cannot_be_reported_from_a_move():
    row, column = np.divmod(np.arange(80), 10)
    uv, seen = 30.0 * np.stack([column + 1.0, row + 0.5], axis=1), row < 7
    assert '7 of 8 rows' in after(uv, 8, 10).number(uv[seen]).reason


@pytest.mark.parametrize('speed', [0.02, 0.1, 0.25])
@pytest.mark.parametrize('seed', range(3))
def test_a_grid_that_slides_under_a_rim_gets_right_numbers_or_none(seed, speed):
    """Five to seven of seven rows are seen, and all 35 dots at times; a dome's pitch falls off towards its border by a few percent."""
    rng = np.random.default_rng(seed)
    row, column = np.divmod(np.arange(35), 5)
    printed = np.stack([column - 2.0, row - 3.0], axis=1) + rng.normal(0, 0.01, (35, 2))
    numbering, numbered = GridNumbering(7, 5), 0
    for shift in np.r_[np.arange(0, 2, speed), np.arange(2, -2, -speed), np.arange(-2, 2, speed)]:
        p = printed + [0.2 * shift, shift]
        uv = 40.0 * p * (1 - 0.004 * (p**2).sum(axis=1, keepdims=True)) + [320, 240] + rng.normal(0, 0.05, p.shape)
        seen = (np.abs(uv[:, 1] - 240) < 132) & (rng.uniform(size=35) > 0.03)
        found = numbering.number(uv[seen])
        assert np.isin(found.id, [-1, *range(35)]).all() and (found.id[found.id >= 0] == np.flatnonzero(seen)[found.id >= 0]).all()
        numbered += found.certain
    assert numbered > 0.5 * len(np.r_[np.arange(0, 2, speed), np.arange(2, -2, -speed), np.arange(-2, 2, speed)])


def test_rows_that_were_not_configured_come_into_view_and_change_no_number():
    """Five of seven rows are seen at a time, as many as configured: which five is known from frame to frame."""
    row, column = np.divmod(np.arange(35), 5)
    printed = np.stack([column, row], axis=1) * [1.0, 1.0] + np.random.default_rng(0).normal(0, 0.01, (35, 2))
    numbering = GridNumbering(5, 5)
    for shift in np.arange(0, 2.01, 0.1):
        uv = 40.0 * (printed - [0, shift]) + 60.0
        seen = (uv[:, 1] > 40) & (uv[:, 1] < 239)
        id = numbering.number(uv[seen]).id
        assert np.array_equal(id, np.where(np.flatnonzero(seen) < 25, np.flatnonzero(seen), -1))


@pytest.mark.parametrize('seed', range(4))
def test_a_grid_of_which_an_image_showed_ten_rows_is_never_a_row_off(seed):
    """An object drags a gel of 14 rows by 0.7 of a pitch and lets go at once; a third of the dots are not found."""
    rng, numbered = np.random.default_rng(seed), 0
    row, column = np.divmod(np.arange(14 * 12), 12)
    printed, numbering = np.stack([column, row], axis=1) + rng.normal(0, 0.03, (len(row), 2)), GridNumbering(10, 12, is_whole=False)
    for shift in np.r_[0, 0, np.arange(0, 0.75, 0.05), 0.15, 0, 0]:
        uv = 67.0 * (printed + [0.3 * shift, shift] * (1 + np.exp(-((printed - [6, 7])**2).sum(axis=1, keepdims=True) / 8))) + [40, -80]
        seen = (uv[:, 1] > 15) & (uv[:, 1] < 705) & ((rng.uniform(size=len(row)) > 0.3) | (shift == 0))
        found, number = numbering.number(uv[seen]), np.arange(len(row))[seen] - 24
        assert (found.id[found.id >= 0] == number[found.id >= 0]).all()
        numbered += found.certain
    assert found.certain and numbered > 6


def test_a_clipped_row_more_than_configured_is_left_out(dome):
    uv, row, column, id = dome
    seen = (row > 0) | (column < 6)
    np.testing.assert_array_equal(number_grid(uv[seen], 7, 10).id, np.where(row > 0, id - 10, -1)[seen])


def test_a_copy_remembers_frames_of_its_own(dome):
    uv, _, column, id = dome
    numbering, left = GridNumbering(8, 10), column < 5
    fresh = copy.deepcopy(numbering)
    numbering.number(uv, 1000, 1000)
    assert numbering.number(uv[left] + 2.0, 1000, 1000).certain and not fresh.number(uv[left] + 2.0, 1000, 1000).certain


def test_a_grid_turned_by_45_degrees_is_not_certain():
    uv, _ = make_grid(np.random.default_rng(7), turn=45.0, pitch=14.0)
    assert 'degrees' in number_grid(uv, 23, 23).reason


def printed(rows, columns, pitch=20.0, degrees=0.0):
    """Places (N, 2) of a grid's dots and their indices (N, 2), row after row."""
    rc = np.stack(np.divmod(np.arange(rows * columns), columns), axis=1)
    z = pitch * (rc[:, 1] + 1j * rc[:, 0]) * np.exp(1j * np.deg2rad(degrees))
    return np.stack([z.real, z.imag], axis=1) + 200, rc


@given(seed=st.integers(0, 2**32 - 1), rows=st.integers(6, 12), columns=st.integers(6, 12), degrees=st.floats(-40, 40),
       noise=st.floats(0, 1.5), lost=st.floats(0, 0.15))
@example(seed=11, rows=4, columns=11, degrees=0.0, noise=0.0, lost=0.078125)  # three lost dots leave no closed cell between two columns
@settings(max_examples=80, deadline=None)
def test_indices_of_a_turned_grid_with_gaps(seed, rows, columns, degrees, noise, lost):
    rng = np.random.default_rng(seed)
    uv, rc = printed(rows, columns, degrees=degrees)
    kept = rng.permutation(len(uv))[:len(uv) - int(lost * len(uv))]
    found = find_lattice(uv[kept] + rng.normal(0, noise, (len(kept), 2)))
    assert found is not None
    assert len(np.unique((found.rc - rc[kept])[found.member], axis=0)) == 1
    assert found.member.mean() > 0.75 - 2 * lost
    assert np.degrees(found.angle) == pytest.approx(degrees, abs=1.5 + noise)
    assert found.pitch == pytest.approx(20.0, abs=0.5 + 2.5 * noise)


def scattered(rng, count=200, apart=18.0):
    """(count, 2) px, at random but not nearer to each other than that."""
    uv = np.zeros((0, 2))
    while len(uv) < count:
        position = rng.uniform(0, 480, 2)
        if not len(uv) or np.hypot(*(uv - position).T).min() > apart:
            uv = np.vstack([uv, position])
    return uv


def pressed(uv, rng):
    """The positions when something swells the middle of the image by up to two spacings, and all shifts."""
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


@given(seed=SEEDS, positions=st.integers(0, 40), dots=st.integers(0, 40), gate=st.floats(0.1, 60))
@settings(max_examples=100, deadline=None)
def test_positions_and_dots_that_are_each_others_nearest_are_linked(seed, positions, dots, gate):
    rng = np.random.default_rng(seed)
    p, d = rng.uniform(0, 100, (positions, 2)), rng.uniform(0, 100, (dots, 2))
    away = np.linalg.norm(p[:, None] - d, axis=2)
    mutual = [(i, j) for i, j in np.ndindex(away.shape) if away[i, j] < gate and away[i, j] == away[i].min() == away[:, j].min()]
    assert [tuple(link) for link in link_positions(p, d, gate).tolist()] == mutual


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
