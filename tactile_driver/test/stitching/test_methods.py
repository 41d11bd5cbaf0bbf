# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Both methods on views of a known sheet: what stands where in the picture, and what happens where one view is missing or wrong."""

import numpy as np
import pytest

from tactile_driver.errors import BadArgument, BadFrame
from tactile_driver.stitching.methods import MiddleStitcher, make_stitcher


from stitchings import stitching, view


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


def test_colour_stays_colour():
    found = stitching()
    views = [np.dstack([view(side, waves), view(side, waves) // 2, view(side, waves) // 3]) for side in (found.left, found.right)]
    picture = make_stitcher('plane', found).stitch(*views)
    grey = make_stitcher('plane', found).stitch(*(v[:, :, 0].copy() for v in views))
    assert picture.shape == (61, 121, 3) and (picture[:, :, 0] == grey).all()


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
