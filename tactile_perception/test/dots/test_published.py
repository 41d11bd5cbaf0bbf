# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0

import numpy as np
import pytest

from tactile_perception.common.dots import Dots
from tactile_perception.core.errors import BadArgument, BadFrame
from tactile_perception.dots.detect import DotDetector
from tactile_perception.published.sort import SortNumbers
from tactile_perception.published.touchpad_contact_region import PaperDetector, PaperNumbering


@pytest.mark.parametrize('sign, ground, contrast', [(-1, 180.0, -120.0), (1, 40.0, 150.0)])
def test_brightness_centres_lie_near_the_dots(draw_dots, lattice, sign, ground, contrast):
    uv, diameter = lattice
    image = np.clip(draw_dots(uv, diameter, ground=ground, contrast=contrast), 0, 255).astype(np.uint8)
    dots = PaperDetector(sign).detect(image)
    distance = np.hypot(*(uv[:, None] - dots.uv).transpose(2, 0, 1))
    assert len(dots) == len(uv)
    assert distance.min(1).max() < 0.3
    assert np.isnan(dots.sigma).all()


SHAPE = (120, 160)


@pytest.fixture
def picture(draw_dots):
    """(12, 2) positions of discs 16 px across, and a picture of them, green on dark."""
    uv = np.stack([20.2 + 40.1 * (np.arange(12) % 4), 20.4 + 40.3 * (np.arange(12) // 4)], 1)
    inside = draw_dots(uv, np.full(12, 16.0), SHAPE, 1.0, 0.0, 1.0)
    noise = np.random.default_rng(1).normal(0, 2, (*SHAPE, 3))
    return uv, np.clip(np.rint(15 + inside[:, :, None] * [30, 180, 30] + noise), 0, 255).astype(np.uint8)


@pytest.mark.parametrize('method, least, most', [('paper_areal', 0.95, 1.05), ('paper_cushion', 0.6, 0.85)])  # erosion takes a pixel off
def test_places_to_a_few_tenths_of_a_pixel(picture, method, least, most):
    uv, image = picture
    for polarity, shown in (('bright', image), ('dark', 255 - image)):
        dots = DotDetector(polarity, method).detect(shown)
        distance = np.hypot(*(dots.uv[:, None] - uv).transpose(2, 0, 1))
        assert len(dots) == 12 and distance.min(1).max() < 0.3
        ratio = dots.area / (np.pi * 64)
        assert least < ratio.min() and ratio.max() < most
        assert np.isnan(dots.sigma).all()


@pytest.mark.parametrize('method', ['paper_areal', 'paper_cushion'])
def test_a_frame_without_markers(method):
    image = np.zeros(SHAPE, np.uint8)
    image[32, 32] = 200
    with pytest.raises(BadFrame, match='marker'):
        DotDetector('bright', method).detect(image)


def whole(rows=7, columns=9, pitch=20.0, size=(240, 200)):
    row, column = np.divmod(np.arange(rows * columns), columns)
    return np.stack([column - (columns - 1) / 2, row - (rows - 1) / 2], axis=1) * pitch + (np.array(size) - 1) / 2, size


def test_a_whole_grid_at_rest():
    uv, size = whole()
    order = np.random.default_rng(0).permutation(len(uv))
    numbers = PaperNumbering(7, 9).number(uv[order], *size)
    assert numbers.certain
    np.testing.assert_array_equal(numbers.id, order)


@pytest.mark.parametrize('rows, columns, stretch', [(11, 14, (1.15, 1.0)), (6, 8, (1.0, 1.4)), (7, 9, (1.6, 1.0)), (2, 4, (1.0, 1.0))])
def test_even_numbers_of_rows_and_columns_and_unequal_pitches(rows, columns, stretch):
    uv, (width, height) = whole(rows, columns, size=(600, 400))
    centre = (np.array([width, height]) - 1) / 2
    order = np.random.default_rng(1).permutation(len(uv))
    uv = centre + (uv[order] - centre) * stretch + [2.0, -1.5]
    np.testing.assert_array_equal(PaperNumbering(rows, columns).number(uv, width, height).id, order)


def test_a_gap_in_the_middle_row_stops_it():
    uv, size = whole()
    numbers = PaperNumbering(7, 9).number(np.delete(uv, [3 * 9 + 2, 3 * 9 + 4], axis=0), *size)
    assert np.all(numbers.id == -1) and 'meet in 0 dots' in numbers.reason


def test_a_shift_by_a_pitch_misnumbers_all():
    uv, size = whole()
    id = PaperNumbering(7, 9).number(uv + [20.0, 0.0], *size).id
    assert np.all(id != np.arange(63))  # it starts from fixed points: why number_grid does not


def test_too_few_dots():
    assert PaperNumbering(7, 9).number(np.zeros((3, 2)), 240, 200).reason == 'only 3 dots found'


def test_it_needs_the_size_of_the_image():
    with pytest.raises(BadArgument, match='width and height'):
        PaperNumbering(7, 9).number(whole()[0])


ACROSS, FRAME = 20.0, 1 / 30
REST = np.stack(np.meshgrid(np.arange(6) * 30.0, np.arange(5) * 30.0), -1).reshape(-1, 2)
WAY = np.arange(60)[:, None] * [3.0, -5.0]  # px, of each frame: in four of them more than a marker is across


def markers(uv):
    return Dots(uv, np.full(len(uv), np.pi / 4 * ACROSS**2), np.full(len(uv), np.nan))


@pytest.mark.parametrize('pattern', [REST, None])
def test_numbers_stay_with_markers_that_move_in_any_order(pattern):
    numbers, rng = SortNumbers(pattern), np.random.default_rng(0)
    assert np.array_equal(numbers.update(markers(REST), 0.0), np.arange(len(REST)))
    for k, moved in enumerate(WAY, 1):
        order = rng.permutation(len(REST))
        assert np.array_equal(numbers.update(markers(REST[order] + moved + rng.normal(0, 0.3, REST.shape)), k * FRAME), order)


@pytest.mark.parametrize('hidden, found', [(1, True), (2, False)])
def test_a_marker_that_is_hidden_for_a_frame_is_found_where_it_was_going_and_has_no_number_after_two(hidden, found):
    numbers = SortNumbers(REST)
    for k, moved in enumerate(WAY):
        seen = np.arange(len(REST)) != 8 if 20 <= k < 20 + hidden else np.full(len(REST), True)
        id = numbers.update(markers((REST + moved)[seen]), k * FRAME)
        assert np.array_equal(np.delete(id, 8) if seen.all() else id, np.delete(np.arange(len(REST)), 8))
    assert id[8] == (8 if found else -1)


def test_a_step_beyond_what_overlaps_and_a_new_marker_have_no_number():
    numbers = SortNumbers(REST)
    assert numbers.update(markers(np.vstack([REST, [[400.0, 400.0]]])), 0.0)[-1] == -1
    assert (numbers.update(markers(REST + 15.0), FRAME) == -1).all()
