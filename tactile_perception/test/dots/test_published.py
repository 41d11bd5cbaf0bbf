# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0

import numpy as np
import pytest
from tactile_perception.dots.detect import DotDetector
from tactile_perception.dots.published import PaperDetector, PaperNumbering
from tactile_perception.errors import BadArgument, BadFrame


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
    """(12, 2) places of discs 16 px across, and a picture of them, green on dark."""
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
