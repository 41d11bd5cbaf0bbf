# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_bringup.visualization.tiles import sheet, tile


@pytest.mark.parametrize('shape', [(480, 640, 3), (44, 44, 3), (720, 200, 3)])
def test_any_picture_fits_into_a_tile(shape):
    made = tile('thumb', np.full(shape, 200, np.uint8))
    assert made.shape == (392, 960, 3)
    inside = (made[32:] == 200).all(axis=2)
    assert inside.sum() == pytest.approx(min(480 / shape[1], 360 / shape[0]) ** 2 * shape[0] * shape[1], rel=0.01)
    assert inside[:, 230:250].any(axis=1).all() or inside[170:190].any(axis=0).all(), 'in the middle'


def test_a_scene_stands_at_the_right_of_the_picture():
    made = tile('thumb', np.full((360, 480, 3), 200, np.uint8), np.full((360, 480, 3), 77, np.uint8))
    assert (made[32:, :480] == 200).all() and (made[32:, 480:] == 77).all()


def test_without_a_picture_a_word_says_so():
    assert (tile('thumb', None)[32:] > 100).any() and not (tile('', np.full((9, 9, 3), 32, np.uint8))[32:] > 100).any()


@pytest.mark.parametrize(('count', 'shape'), [(1, (4, 6)), (2, (4, 12)), (5, (8, 18)), (9, (12, 18))])
def test_tiles_make_a_sheet(count, shape):
    made = sheet([np.full((4, 6, 3), k + 1, np.uint8) for k in range(count)])
    assert made.shape[:2] == shape and {k + 1 for k in range(count)} <= set(np.unique(made))
