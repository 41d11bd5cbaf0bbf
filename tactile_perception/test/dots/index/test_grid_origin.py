# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.dots.index.grid_origin import anchor_lattice

SHAPE, PITCH, SIZE = (8, 10), 30.0, (320, 260)


@pytest.fixture
def dome():
    """Places of an 8 x 10 grid, its pitch growing towards the middle as on a dome, and row and column."""
    row, column = np.divmod(np.arange(80), 10)
    p = np.stack([column - 4.5, row - 3.5], axis=1)
    return PITCH * p * (1.1 - 0.006 * (p**2).sum(axis=1, keepdims=True)) + [160, 130], np.stack([row, column], axis=1)


def anchor(rc, uv, shape=SHAPE, previous=None, image_size=None):
    """The offset (2,) of relative rows and columns that the indices have, None if there are none, and the reason."""
    before = None if previous is None else (previous[0], previous[1] @ [shape[1], 1])
    found = anchor_lattice(uv, rc, np.ones(len(rc), bool), shape, PITCH, before, image_size)
    has = found.id >= 0
    offsets = np.unique(np.stack(np.divmod(found.id[has], shape[1]), axis=1) - rc[has], axis=0)
    assert len(offsets) == (not found.reason)
    return (None if found.reason else offsets[0].tolist()), found.reason


def relative(rc):
    return rc - rc.min(axis=0)


def test_a_whole_grid_needs_nothing_else(dome):
    uv, rc = dome
    assert anchor(rc + [3, 5], uv) == ([-3, -5], '')


def test_two_false_dots_make_no_row(dome):
    uv, rc = dome
    rc, uv = np.vstack([rc + [1, 0], [[0, 3]]]), np.vstack([uv, [[100, 2]]])
    assert anchor(rc, uv) == ([-1, 0], '')


def test_dots_that_are_no_members_count_nothing(dome):
    uv, rc = dome
    member = np.arange(80) % 7 > 0
    found = anchor_lattice(uv, np.where(member[:, None], rc, 99), member, SHAPE, PITCH)
    np.testing.assert_array_equal(found.id, np.where(member, np.arange(80), -1))


def test_a_row_that_left_the_image_is_known_by_the_border(dome):
    uv, rc = dome
    seen = rc[:, 0] > 0
    assert anchor(relative(rc[seen]), uv[seen] - [0, 1.1 * PITCH], image_size=SIZE) == ([1, 0], '')


def test_half_a_grid_is_certain_only_by_its_own_unevenness(dome):
    uv, rc = dome
    left = rc[:, 1] < 5
    assert '5 of 10 columns' in anchor(relative(rc[left]), uv[left], image_size=(1000, 1000))[1]
    assert anchor(relative(rc[left]), uv[left] + 2.0, previous=(uv, rc), image_size=(1000, 1000)) == ([0, 0], '')


def test_on_an_even_grid_a_row_hidden_is_not_told_from_a_move():
    row, column = np.divmod(np.arange(80), 10)
    uv, rc = PITCH * np.stack([column + 1.0, row + 0.5], axis=1), np.stack([row, column], axis=1)
    seen = row < 7  # the last one is hidden inside the image, the first one could have left it
    assert 'disagree' in anchor(rc[seen], uv[seen], previous=(uv, rc), image_size=(330, 400))[1]


def test_a_clipped_row_more_than_configured_is_left_out(dome):
    uv, rc = dome
    seen = (rc[:, 0] > 0) | (rc[:, 1] < 6)
    assert anchor(rc[seen], uv[seen], (7, 10)) == ([-1, 0], '')


def test_another_pattern(dome):
    uv, rc = dome
    assert 'another pattern' in anchor(rc, uv, (7, 10))[1]
