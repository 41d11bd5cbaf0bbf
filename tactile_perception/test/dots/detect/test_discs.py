# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from tactile_perception.dots.detect.methods import DotDetector
from tactile_perception.errors import BadFrame

RECORDINGS = Path(os.environ.get('TACTILE_RECORDINGS', ''))
UV = np.stack(np.divmod(np.arange(24), 4), 1) * 46.0 + 40.3


def speckled(draw_dots, diameter=22.0, share=0.45):
    discs = draw_dots(UV, np.full(24, diameter), (220, 320), 0.8, 0.0, 1.0)
    bare = cv2.GaussianBlur(np.random.default_rng(0).normal(size=discs.shape), (0, 0), 1.5)
    return np.clip(30 + 120 * discs * (bare < np.quantile(bare, 1 - share)), 0, 255).astype(np.uint8)


@pytest.mark.parametrize('channel', [None, 0, 1, 2])
def test_speckled_discs_in_the_channel_that_shows_them(draw_dots, channel):
    image = speckled(draw_dots)
    if channel is not None:
        grey, image = image, np.full((*image.shape, 3), 60, np.uint8)
        image[..., channel] = grey
    dots = DotDetector('bright', 'discs').detect(image)
    away = np.hypot(*(dots.uv[:, None] - UV).transpose(2, 0, 1))
    assert sorted(away.argmin(axis=1)) == list(range(24)) and np.sqrt((away.min(axis=1)**2).mean() / 2) < 1.0
    assert 2 * np.sqrt(np.median(dots.area) / np.pi) == pytest.approx(22, rel=0.1)


def test_the_scale_is_measured_anew_when_discs_get_lost(draw_dots):
    detector = DotDetector('bright', 'discs')
    assert len(detector.detect(speckled(draw_dots, 28.0))) == 24
    assert len(detector.detect(speckled(draw_dots, 7.0, 0.0))) == 24


def test_a_frame_without_discs_is_refused():
    slope = np.tile(np.linspace(80, 120, 160).astype(np.uint8), (120, 1))
    with pytest.raises(BadFrame, match='polarity'):
        DotDetector('bright', 'discs').detect(slope)


@pytest.mark.skipif(not (RECORDINGS / 'pin_array_127').is_dir(), reason='TACTILE_RECORDINGS holds no pin_array_127')
def test_pins_are_found_and_the_streaks_beside_them_are_not():
    for path in sorted((RECORDINGS / 'pin_array_127').glob('frame_*.png'))[:10]:
        assert 127 <= len(DotDetector('bright', 'discs').detect(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE))) <= 135
