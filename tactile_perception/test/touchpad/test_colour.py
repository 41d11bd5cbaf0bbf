# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Colours around dots: ratios of a known ground, ink and glare left out, wrong images named."""
import cv2
import numpy as np
import pytest
from tactile_perception.errors import BadFrame
from tactile_perception.touchpad.water import POINTS, RING, WIDE, check_image, log_ratios, pitch_px, ring_share

GROUND = np.array([50, 75, 200])
RATIOS = np.log(GROUND[:2] / GROUND[2])


def plain(height=120, width=160):
    return np.broadcast_to(GROUND.astype(np.uint8), (height, width, 3)).copy()


def test_the_pitch_is_the_distance_to_the_nearest_other_dot():
    uv = np.stack(np.meshgrid(np.arange(5) * 18.0, np.arange(5) * 18.0), -1).reshape(-1, 2)
    assert pitch_px(uv) == pytest.approx(18)
    with pytest.raises(BadFrame, match='at least 9 dots'):
        pitch_px(uv[:8])


def dotted(noise=0.0):
    """Round dark dots, 18 px apart, blurred as a lens does; their places (N, 2)."""
    image, uv = plain(240, 320), np.stack(np.meshgrid(np.arange(20.0, 300, 18), np.arange(20.0, 220, 18)), -1).reshape(-1, 2)
    for place in uv:
        cv2.circle(image, place.astype(int).tolist(), 5, (6, 9, 26), -1)
    image = cv2.GaussianBlur(image, (0, 0), 1.0) + np.random.default_rng(0).normal(size=image.shape) * noise
    return np.clip(np.rint(image), 0, 255).astype(np.uint8), uv


@pytest.mark.parametrize('noise', [0.5, 2.0, 6.0])
def test_colour_that_bleeds_takes_a_wider_ring_and_noise_does_not(noise, stored_420, stored_jpeg):
    image, uv = dotted(noise)
    assert ring_share(image, uv) == RING
    assert ring_share(stored_420(image), uv) == ring_share(stored_jpeg(image), uv) == WIDE


def test_ratios_of_a_plain_ground_are_exact_beside_dark_dots():
    image = plain()
    image[57:64, 77:84] = 6
    rings = log_ratios(image, np.array([[80.0, 60.0]]), 8.0)
    assert rings.ratios[0] == pytest.approx(RATIOS, abs=1e-6)
    assert rings.count[0] == POINTS
    assert rings.brightness[0] == pytest.approx(np.log(GROUND[2]), abs=1e-6)


def test_ink_of_a_neighbour_is_left_out():
    image = plain()
    image[50:70, 86:96] = (7, 10, 30)
    rings = log_ratios(image, np.array([[80.0, 60.0]]), 8.0)
    assert rings.ratios[0] == pytest.approx(RATIOS, abs=0.01)
    assert 8 <= rings.count[0] < 16


def test_dots_at_the_border_use_what_is_inside():
    rings = log_ratios(plain(), np.array([[0.0, 60.0], [159.0, 119.0], [400.0, 60.0]]), 8.0)
    assert rings.ratios[0] == pytest.approx(RATIOS, abs=1e-6)
    assert 4 <= rings.count[0] <= 9
    assert np.isnan(rings.ratios[2]).all()


@pytest.mark.parametrize('image', [np.zeros((9, 9), np.uint8), np.zeros((9, 9, 3)), None])
def test_images_without_colour_are_named(image):
    with pytest.raises(BadFrame, match='colour image'):
        check_image(image)
