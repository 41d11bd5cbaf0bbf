# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Ranges from the colour of the water, and colour ratios around dots."""
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tactile_perception._core.touchpad import Glare, SeenColours, WaterColour, water_lengths
from tactile_perception.core.errors import BadArgument, BadFrame
from tactile_perception.touchpad.constants import TOUCHPAD
from tactile_perception.touchpad.identification import fit_rest
from tactile_perception.touchpad.water import RING_POINTS, LightPath, check_image, log_ratios, pitch_px, ring_share


def rms(values):
    return float(np.sqrt(np.nanmean(np.square(values))))


@pytest.fixture(scope='module')
def pad(water_pad):
    return water_pad()


@pytest.fixture(scope='module')
def model(pad):
    return fit_rest(pad.image(), pad.rest_uv, pad.camera)


def test_untouched_ranges_are_those_of_the_cap_within_their_sigma(pad, model):
    ranges, sigma = model.depths(pad.image(), pad.tracks(), pad.camera)
    error = ranges - pad.ranges()
    assert rms(error) < 3e-5
    assert abs(np.nanmean(error)) < 1.5e-5
    assert 0.6 < np.nanstd(error / sigma) < 1.4


def test_a_dent_is_measured_after_a_fit_to_the_untouched_pad_alone(pad, model):
    tip = pad.tip(0.001, -0.002, 0.003)
    ranges, _ = model.depths(pad.image(tip), pad.tracks(), pad.camera)
    moved = pad.ranges() - pad.ranges(tip)
    flat = np.hypot(*(pad.camera.centre + pad.ranges(tip)[:, None] * pad.camera.rays(pad.rest_uv) - tip)[:, :2].T) < 0.0025
    assert moved[flat].max() > 2.5e-3
    assert rms((ranges - pad.ranges(tip))[flat]) < 0.1 * 3e-3
    assert rms((ranges - pad.ranges(tip))[moved == 0]) < 6e-5


def test_glare_increases_sigma_or_hides_the_dot(pad, model):
    image = pad.image().astype(float)
    position = pad.rest_uv[140]
    v, u = np.mgrid[0:image.shape[0], 0:image.shape[1]]
    image += 90 * np.exp(-((u - position[0])**2 + (v - position[1])**2) / 2 / 12**2)[..., None]
    ranges, sigma = model.depths(np.clip(image, 0, 255).astype(np.uint8), pad.tracks(), pad.camera)
    assert np.isnan(ranges[140]) or sigma[140] > 3 * np.nanmedian(sigma)


def test_a_pattern_without_a_grid_is_also_measured(pad, model):
    tracks = replace(pad.tracks(), rows=0, columns=0)
    ranges, _ = model.depths(pad.image(), tracks, pad.camera)
    assert rms(ranges - pad.ranges()) < 3e-5


def test_bad_input_is_refused(pad, model):
    with pytest.raises(BadFrame, match='colour image'):
        model.depths(pad.image()[..., 0], pad.tracks(), pad.camera)
    ranges, sigma = model.depths(np.zeros_like(pad.image()), pad.tracks(), pad.camera)
    assert np.isnan(ranges).all()
    with pytest.raises(BadArgument, match='positive absorptions'):
        replace(model, absorptions=np.array([0.0, 1.0]))
    with pytest.raises(BadArgument, match='finite'):
        replace(model, constants=np.array([np.nan, 1.0]))


CENTRE = (0.0, 0.0, -0.04)
UP = np.array([[0.0, 0.0, 1.0]])


def test_eight_lamps_approximate_a_continuous_ring_light():
    path = LightPath(-0.01, -0.037, 0.016, 0.25, CENTRE)
    positions = np.array([[0.012, 0.004, 0.006], [-0.006, 0.009, 0.010], [0.0, 0.0, 0.013]])
    normals = positions - [0, 0, -0.007]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    angle = np.linspace(0, 2 * np.pi, 721)[:-1]
    ray = positions[:, None] - np.column_stack([0.016 * np.cos(angle), 0.016 * np.sin(angle), np.full(720, -0.037)])
    distance = np.linalg.norm(ray, axis=2)
    weight = (np.einsum('nkc,nc->nk', ray, normals) / distance + 0.25) / distance**2
    slant = (weight * distance / ray[..., 2]).sum(1) / weight.sum(1)
    back = np.linalg.norm(positions - np.array(CENTRE), axis=1) / (positions[:, 2] + 0.04)
    assert path.lengths(positions, normals)[0] == pytest.approx((positions[:, 2] + 0.01) * (slant + back), rel=2e-4)


def test_the_slope_is_the_derivative_of_the_length_along_the_ray():
    path = LightPath(-0.01, -0.037, 0.016, 0.25, CENTRE)
    position = np.array([[0.010, -0.006, 0.008]])
    ray = position - np.array(CENTRE)
    ray /= np.linalg.norm(ray)
    step = 1e-5
    numeric = (path.lengths(position + step * ray, UP)[0] - path.lengths(position - step * ray, UP)[0]) / (2 * step)
    assert path.lengths(position, UP)[1] == pytest.approx(numeric, rel=0.01)


CONSTANTS, ABSORPTIONS = np.array([-0.5, -0.4]), np.array([35.0, 27.0])
NOISE = np.array([[9e-6, 4e-6], [4e-6, 7e-6]])


def lengths_of(ratios, excess, sigma=0.02, probability=0.3, size=0.1, colour=(0.5, 0.6), count=16, patchiness=0.0):
    """Length and standard deviation, m, of one dot."""
    seen = SeenColours(ratios=np.array([ratios], float), count=np.array([count]), patchiness=np.array([patchiness]),
                       excess=np.array([excess]), excess_sigma=np.array([sigma]), colour=np.array([colour], float))
    water = WaterColour(constants=CONSTANTS, absorptions=ABSORPTIONS, noise=NOISE.ravel(), disagree=2.5, patchy=2.5)
    found = water_lengths(seen, water, Glare(probability=probability, size=size))
    return found.lengths[0], found.sigma[0]


def mirrored(length, share, colour=(0.5, 0.6)):
    """Log ratios (2,) of a dot at the end of a path of this length, m, a share of whose light is glare."""
    return CONSTANTS - ABSORPTIONS * length + np.log((1 + np.array(colour) * share) / (1 + share))


@given(share=st.floats(0.1, 0.5), length=st.floats(0.01, 0.05))
@settings(max_examples=50, deadline=None)
def test_strong_glare_is_subtracted(share, length):
    ratios = mirrored(length, share)
    with_it, sigma = lengths_of(ratios, np.log1p(share), sigma=0.005, size=0.3)
    without, _ = lengths_of(ratios, np.nan)
    assert abs(with_it - length) < 3 * sigma < 1e-3
    assert abs(with_it - length) < 0.2 * abs(without - length)


def test_disagreeing_ratios_and_patches_increase_the_standard_deviation():
    agree = CONSTANTS - ABSORPTIONS * 0.03
    usual = lengths_of(agree, np.nan)[1]
    assert lengths_of(agree + [0.03, -0.03], np.nan)[1] > 3 * usual
    assert lengths_of(agree, np.nan, patchiness=1e-2)[1] > 3 * usual


def test_the_standard_deviation_is_larger_where_glare_and_shape_are_confounded():
    ratios = mirrored(0.033, 0.04)
    usual, doubtful = lengths_of(ratios, np.nan)[1], lengths_of(ratios, np.log1p(0.04))
    assert doubtful[1] > 2.5 * usual and abs(doubtful[0] - 0.033) < 2 * doubtful[1]


@pytest.mark.parametrize('colour', [np.nan, -1.0, 1e4, np.inf])
def test_glare_of_an_unknown_colour_is_not_subtracted(colour):
    ratios = mirrored(0.033, 0.2)
    assert lengths_of(ratios, np.log1p(0.2), colour=(0.5, colour)) == lengths_of(ratios, np.nan)


GROUND = np.array([50, 75, 200])
RATIOS = np.log(GROUND[:2] / GROUND[2])


def plain(height=120, width=160):
    return np.broadcast_to(GROUND.astype(np.uint8), (height, width, 3)).copy()


def test_the_pitch_is_the_distance_to_the_nearest_neighbour():
    uv = np.stack(np.meshgrid(np.arange(5) * 18.0, np.arange(5) * 18.0), -1).reshape(-1, 2)
    assert pitch_px(uv) == pytest.approx(18)
    with pytest.raises(BadFrame, match='at least 9 dots'):
        pitch_px(uv[:8])


def dotted(noise=0.0):
    """Round dark dots, 18 px apart, blurred as a lens does; their positions (N, 2)."""
    image, uv = plain(240, 320), np.stack(np.meshgrid(np.arange(20.0, 300, 18), np.arange(20.0, 220, 18)), -1).reshape(-1, 2)
    for position in uv:
        cv2.circle(image, position.astype(int).tolist(), 5, (6, 9, 26), -1)
    image = cv2.GaussianBlur(image, (0, 0), 1.0) + np.random.default_rng(0).normal(size=image.shape) * noise
    return np.clip(np.rint(image), 0, 255).astype(np.uint8), uv


@pytest.mark.parametrize('noise', [0.5, 2.0, 6.0])
def test_bleeding_colour_widens_the_ring_and_noise_does_not(noise, stored_420, stored_jpeg):
    image, uv = dotted(noise)
    assert ring_share(image, uv) == TOUCHPAD.ring
    assert ring_share(stored_420(image), uv) == ring_share(stored_jpeg(image), uv) == TOUCHPAD.wide_ring


def test_ratios_of_a_uniform_background_are_exact_beside_dark_dots():
    image = plain()
    image[57:64, 77:84] = 6
    rings = log_ratios(image, np.array([[80.0, 60.0]]), 8.0)
    assert rings.ratios[0] == pytest.approx(RATIOS, abs=1e-6)
    assert rings.count[0] == RING_POINTS
    assert rings.brightness[0] == pytest.approx(np.log(GROUND[2]), abs=1e-6)


def test_ink_of_a_neighbouring_dot_is_left_out():
    image = plain()
    image[50:70, 86:96] = (7, 10, 30)
    rings = log_ratios(image, np.array([[80.0, 60.0]]), 8.0)
    assert rings.ratios[0] == pytest.approx(RATIOS, abs=0.01)
    assert 8 <= rings.count[0] < 16


def test_dots_at_the_border_use_the_ring_points_inside_the_image():
    rings = log_ratios(plain(), np.array([[0.0, 60.0], [159.0, 119.0], [400.0, 60.0]]), 8.0)
    assert rings.ratios[0] == pytest.approx(RATIOS, abs=1e-6)
    assert 4 <= rings.count[0] <= 9
    assert np.isnan(rings.ratios[2]).all()


@pytest.mark.parametrize('image', [np.zeros((9, 9), np.uint8), np.zeros((9, 9, 3)), None])
def test_images_without_colour_are_refused(image):
    with pytest.raises(BadFrame, match='colour image'):
        check_image(image)
