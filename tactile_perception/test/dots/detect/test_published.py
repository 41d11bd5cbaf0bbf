# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from tactile_perception.dots.detect.methods import DotDetector
from tactile_perception.dots.detect.published import PaperDetector
from tactile_perception.errors import BadFrame


@pytest.mark.parametrize('sign, ground, contrast', [(-1, 180.0, -120.0), (1, 40.0, 150.0)])
def test_brightness_centres_lie_near_the_dots(draw_dots, lattice, sign, ground, contrast):
    uv, diameter = lattice
    image = np.clip(draw_dots(uv, diameter, ground=ground, contrast=contrast), 0, 255).astype(np.uint8)
    dots = PaperDetector(sign).detect(image)
    distance = np.hypot(*(uv[:, None] - dots.uv).transpose(2, 0, 1))
    assert len(dots) == len(uv)
    assert distance.min(1).max() < 0.3
    assert np.isnan(dots.sigma).all()


def test_the_centre_is_the_first_moment_of_inverted_brightness():
    image = np.full((64, 64), 200, np.uint8)
    image[20:24, 30:32] = 100
    image[20:24, 32:34] = 50
    dots = PaperDetector(-1).detect(image)
    weights = np.array([155.0, 155.0, 205.0, 205.0])
    assert dots.uv[0] == pytest.approx([(weights * np.arange(30, 34)).sum() / weights.sum(), 21.5])
    assert dots.area[0] == 16


def test_an_even_frame_has_no_dots():
    with pytest.raises(BadFrame):
        PaperDetector(-1).detect(np.full((64, 64), 90, np.uint8))


SHAPE = (120, 160)
CUSHION = Path(os.environ.get('TACTILE_RECORDINGS', '')) / 'simulated' / 'ac_test'


@pytest.fixture
def picture(draw_dots):
    """(12, 2) places of discs 16 px across, and a picture of them, green on dark."""
    uv = np.stack([20.2 + 40.1 * (np.arange(12) % 4), 20.4 + 40.3 * (np.arange(12) // 4)], 1)
    inside = draw_dots(uv, np.full(12, 16.0), SHAPE, 1.0, 0.0, 1.0)
    noise = np.random.default_rng(1).normal(0, 2, (*SHAPE, 3))
    return uv, np.clip(np.rint(15 + inside[:, :, None] * [30, 180, 30] + noise), 0, 255).astype(np.uint8)


@pytest.mark.parametrize('method, least, most', [('paper_areal', 0.95, 1.05), ('paper_cushion', 0.6, 0.85),
                                                ('paper_cushion_fast', 0.6, 0.85)])  # erosion takes a pixel off
def test_places_to_a_few_tenths_of_a_pixel(picture, method, least, most):
    uv, image = picture
    for polarity, shown in (('bright', image), ('dark', 255 - image)):
        dots = DotDetector(polarity, method).detect(shown)
        distance = np.hypot(*(dots.uv[:, None] - uv).transpose(2, 0, 1))
        assert len(dots) == 12 and distance.min(1).max() < 0.3
        ratio = dots.area / (np.pi * 64)
        assert least < ratio.min() and ratio.max() < most
        assert np.isnan(dots.sigma).all()


@pytest.mark.parametrize('method', ['paper_areal', 'paper_cushion', 'paper_cushion_fast'])
def test_a_frame_without_markers(method):
    image = np.zeros(SHAPE, np.uint8)
    image[32, 32] = 200
    with pytest.raises(BadFrame, match='marker'):
        DotDetector('bright', method).detect(image)


@pytest.mark.skipif(not CUSHION.is_dir(), reason='TACTILE_RECORDINGS holds no simulated/ac_test')
def test_a_gaussian_does_no_worse_than_non_local_means():
    truth, error = np.load(CUSHION / 'truth.npz')['uv'], {'paper_cushion': [], 'paper_cushion_fast': []}
    for k in (0, 10, 18, 24):
        for method, found in error.items():
            dots = DotDetector('bright', method).detect(cv2.imread(str(CUSHION / 'frames' / f'{k:03d}.webp')))
            assert len(dots) == 221
            found.append(np.hypot(*(dots.uv[:, None] - truth[k]).transpose(2, 0, 1)).min(1))
    paper, fast = (np.sqrt(np.square(found).mean()) for found in error.values())
    assert fast < 1.02 * paper < 0.1
