# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from tactile_perception.dots.detect import DotDetector
from tactile_perception.errors import BadFrame

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
