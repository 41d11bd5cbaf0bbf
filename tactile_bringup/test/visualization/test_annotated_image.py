# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_bringup.visualization import pictures as picture, pictures as colours
from tactile_bringup.visualization.pictures import Annotation, annotate, states_of

GREY = np.full((480, 640), 100, np.uint8)


def changed(image, ground=100):
    """(H, W) whether a pixel differs from the even ground."""
    return (image != ground).any(axis=2)


def dots_at(*places, moved=(0.0, 0.0), state=0):
    uv = np.array(places, float)
    n = len(uv)
    return Annotation(0, 0, np.arange(n), uv, np.tile(moved, (n, 1)).astype(float), np.full(n, state), radius=3.0)


def centroid(mask):
    v, u = np.nonzero(mask)
    return u.mean(), v.mean()


def test_nothing_known_leaves_the_image_as_it_is():
    image = np.random.default_rng(0).integers(0, 255, (480, 640, 3), np.uint8)
    assert (annotate(image, Annotation()) == image).all()


@pytest.mark.parametrize('state', [0, 1, 2])
def test_a_ring_in_the_colour_of_its_state_lies_round_its_dot(state):
    result = annotate(GREY, dots_at((200.25, 100.75), state=state))
    u, v = centroid(changed(result))
    assert abs(u - 200.25) < 0.2 and abs(v - 100.75) < 0.2
    assert (result == colours.bgr(colours.STATE_COLOURS[state])).all(axis=2).any()
    assert not changed(result)[101, 200]


def test_an_arrow_goes_from_rest_to_where_the_dot_is():
    result = annotate(GREY, dots_at((200, 100), moved=(40, 0)))
    v, u = np.nonzero((result[..., 2] > 180) & (result[..., 0] < 130))  # yellow, softened at its edges
    assert abs(u.min() - 160) <= 1 and abs(u.max() - 200) <= 1
    assert 4 <= v.max() - v.min() <= 8
    # The head is at the end.
    assert (np.ptp(v[u > 194]) if (u > 194).any() else 0) > np.ptp(v[u < 190])


@pytest.mark.parametrize('moved', [(0.5, 0.5), (np.nan, np.nan)])
def test_noise_and_the_unknown_make_no_arrow(moved):
    still = annotate(GREY, dots_at((200, 100), moved=(0, 0)))
    assert (annotate(GREY, dots_at((200, 100), moved=moved)) == still).all()


def test_small_images_are_enlarged_with_pixel_centres_kept():
    result = annotate(np.full((240, 320), 100, np.uint8), dots_at((100, 60)))
    assert result.shape == (480, 640, 3)
    u, v = centroid(changed(result))
    assert abs(u - 200.5) < 0.2 and abs(v - 120.5) < 0.2


def test_a_region_is_veiled_and_its_hole_is_not():
    square = np.array([(100, 100), (200, 100), (200, 200), (100, 200)], float)
    hole = np.array([(140, 140), (140, 160), (160, 160), (160, 140)], float)
    result = annotate(GREY, Annotation(outlines=[square], holes=[hole]))
    assert changed(result)[120, 120] and not changed(result)[150, 150] and not changed(result)[90, 90]
    assert (result[100, 150] == colours.bgr(colours.REGION)).all()
    assert (result[150, 140] == colours.bgr(colours.HOLE)).all()
    expected = 0.78 * 100 + 0.22 * np.array(colours.bgr(colours.REGION))
    assert np.abs(result[120, 120] - expected).max() <= 1.5


def test_a_region_beyond_the_border_does_not_fail():
    square = np.array([(-50, -50), (900, -50), (900, 900), (-50, 900)], float)
    assert changed(annotate(GREY, Annotation(outlines=[square])))[240, 320]
    far = square + 5000
    assert not changed(annotate(GREY, Annotation(outlines=[far]))).any()


def test_a_legend_stands_below_the_text_in_its_colours_and_fits():
    names = [(name * 3, colour) for name, colour in zip(colours.STATE_NAMES, colours.STATE_COLOURS)]
    result = annotate(GREY, Annotation(text=['a line'], legend=names))
    assert result.shape == (480 + 26 + 26, 640, 3)
    places = [np.nonzero((result[506:] == colours.bgr(colour)).all(axis=2).any(axis=0))[0].mean() for _, colour in names]
    assert places == sorted(places) and (result[506:, 632:] == 24).all()


def test_a_contact_is_marked_and_an_unknown_place_is_not():
    result = annotate(GREY, Annotation(contacts=np.array([(300.0, 200.0), (np.nan, np.nan)])))
    assert centroid(changed(result)) == (300.0, 200.0)


def test_numbers_are_written_beside_few_dots_of_a_grid():
    u, v = np.meshgrid(np.arange(23) * 20.0 + 100, np.arange(23) * 20.0 + 20)
    uv = np.stack([u.ravel(), v.ravel()], axis=1)
    still = np.zeros_like(uv)
    what = Annotation(23, 23, np.arange(529), uv, still, np.zeros(529, int), radius=3.0)
    plain = Annotation(0, 0, np.arange(529), uv, still, np.zeros(529, int), radius=3.0)
    written = changed(annotate(GREY, what), 0) & (annotate(GREY, what) != annotate(GREY, plain)).any(axis=2)
    assert 0 < written.sum() < 0.03 * written.size


def test_states_are_found_by_the_dots_numbers():
    found = states_of(np.array([5, 1, 9, 3]), np.array([9, 1, 5]), np.array([2, 0, 1]))
    assert found.tolist() == [1, 0, 2, -1]
    assert states_of(np.array([5, 1]), np.zeros(0, int), np.zeros(0, int)).tolist() == [-1, -1]


@pytest.mark.parametrize('shape', [(1, 300_000), (300_000, 1), (3, 100_000)])
def test_an_image_of_one_row_or_column_makes_no_huge_picture(shape):
    found = picture.annotate(np.zeros(shape, np.uint8), Annotation(text=['1 touch', '0.50 N']))
    assert found.nbytes < 100e6
