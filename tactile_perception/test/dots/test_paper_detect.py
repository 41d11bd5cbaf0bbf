# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception.dots.paper_detect import PaperDetector
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
