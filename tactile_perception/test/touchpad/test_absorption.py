# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Ranges from colour: on pads whose walls are known, and on recordings with truth."""
from dataclasses import replace

import numpy as np
import pytest
from tactile_perception.errors import BadArgument, BadFrame
from tactile_perception.touchpad.identification import fit_rest


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


def test_a_dent_is_measured_from_rest_alone(pad, model):
    tip = pad.tip(0.001, -0.002, 0.003)
    ranges, _ = model.depths(pad.image(tip), pad.tracks(), pad.camera)
    moved = pad.ranges() - pad.ranges(tip)
    flat = np.hypot(*(pad.camera.centre + pad.ranges(tip)[:, None] * pad.camera.rays(pad.rest_uv) - tip)[:, :2].T) < 0.0025
    assert moved[flat].max() > 2.5e-3
    assert rms((ranges - pad.ranges(tip))[flat]) < 0.1 * 3e-3
    assert rms((ranges - pad.ranges(tip))[moved == 0]) < 6e-5


def test_glare_widens_sigma_or_hides_the_dot(pad, model):
    image = pad.image().astype(float)
    place = pad.rest_uv[140]
    v, u = np.mgrid[0:image.shape[0], 0:image.shape[1]]
    image += 90 * np.exp(-((u - place[0])**2 + (v - place[1])**2) / 2 / 12**2)[..., None]
    ranges, sigma = model.depths(np.clip(image, 0, 255).astype(np.uint8), pad.tracks(), pad.camera)
    assert np.isnan(ranges[140]) or sigma[140] > 3 * np.nanmedian(sigma)


def test_a_pattern_without_a_grid_is_measured_too(pad, model):
    tracks = replace(pad.tracks(), rows=0, columns=0)
    ranges, _ = model.depths(pad.image(), tracks, pad.camera)
    assert rms(ranges - pad.ranges()) < 3e-5


def test_bad_input_is_named(pad, model):
    with pytest.raises(BadFrame, match='colour image'):
        model.depths(pad.image()[..., 0], pad.tracks(), pad.camera)
    ranges, sigma = model.depths(np.zeros_like(pad.image()), pad.tracks(), pad.camera)
    assert np.isnan(ranges).all()
    with pytest.raises(BadArgument, match='positive absorptions'):
        replace(model, absorptions=np.array([0.0, 1.0]))
    with pytest.raises(BadArgument, match='finite'):
        replace(model, constants=np.array([np.nan, 1.0]))
