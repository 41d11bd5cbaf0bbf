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


def relative(rc):
    return rc - rc.min(axis=0)


def test_a_whole_grid_needs_nothing_else(dome):
    uv, rc = dome
    anchor = anchor_lattice(rc + [3, 5], uv, SHAPE, PITCH)
    assert anchor.certain
    np.testing.assert_array_equal(anchor.offset, [-3, -5])


def test_two_false_dots_make_no_row(dome):
    uv, rc = dome
    rc, uv = np.vstack([rc + [1, 0], [[0, 3]]]), np.vstack([uv, [[100, 2]]])
    anchor = anchor_lattice(rc, uv, SHAPE, PITCH)
    np.testing.assert_array_equal(anchor.offset, [-1, 0])


def test_a_row_that_left_the_image_is_known_by_the_border(dome):
    uv, rc = dome
    seen = rc[:, 0] > 0
    anchor = anchor_lattice(relative(rc[seen]), uv[seen] - [0, 1.1 * PITCH], SHAPE, PITCH, None, SIZE)
    assert anchor.certain
    np.testing.assert_array_equal(anchor.offset, [1, 0])


def test_half_a_grid_is_certain_only_by_its_own_unevenness(dome):
    uv, rc = dome
    left = rc[:, 1] < 5
    alone = anchor_lattice(relative(rc[left]), uv[left], SHAPE, PITCH, None, (1000, 1000))
    assert not alone.certain and '5 of 10 columns' in alone.reason
    known = anchor_lattice(relative(rc[left]), uv[left] + 2.0, SHAPE, PITCH, (uv, rc), (1000, 1000))
    np.testing.assert_array_equal(known.offset, [0, 0])


def test_on_an_even_grid_a_row_hidden_is_not_told_from_a_move():
    row, column = np.divmod(np.arange(80), 10)
    uv, rc = PITCH * np.stack([column + 1.0, row + 0.5], axis=1), np.stack([row, column], axis=1)
    seen = row < 7  # the last one is hidden inside the image, the first one could have left it
    anchor = anchor_lattice(rc[seen], uv[seen], SHAPE, PITCH, (uv, rc), (330, 400))
    assert not anchor.certain
    assert 'disagree' in anchor.reason


def test_a_clipped_row_more_than_configured_is_left_out(dome):
    uv, rc = dome
    seen = (rc[:, 0] > 0) | (rc[:, 1] < 6)
    anchor = anchor_lattice(rc[seen], uv[seen], (7, 10), PITCH)
    np.testing.assert_array_equal(anchor.offset, [-1, 0])


def test_another_pattern(dome):
    uv, rc = dome
    assert 'another pattern' in anchor_lattice(rc, uv, (7, 10), PITCH).reason
