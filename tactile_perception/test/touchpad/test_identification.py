# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Identification of the water from the untouched pad, on three pads of different water, window and lamps."""
import numpy as np
import pytest

from tactile_perception.core.errors import BadArgument, BadFrame
from tactile_perception.touchpad.constants import TOUCHPAD
from tactile_perception.touchpad.identification import as_ring_colours, fit_rest, rest_colours, update_constants

pytestmark = pytest.mark.full  # each takes seconds of a core

PADS = [{}, {'window': -0.004, 'lamp_radius': 0.020, 'absorption': (30, 24, 2)}, {'window': -0.018, 'lamp_radius': 0.010}]


@pytest.mark.parametrize('design', PADS)
def test_the_untouched_pad_determines_the_absorption(water_pad, design):
    pad = water_pad(**design)
    model = fit_rest(pad.image(), pad.rest_uv, pad.camera)
    true = pad.absorption[:2] - pad.absorption[2]
    assert model.absorptions == pytest.approx(true, rel=0.08)
    assert model.scale_sigma < 0.15
    assert model.path.window_z == pytest.approx(pad.window, abs=0.006)


def test_constants_follow_a_drift_of_the_white_balance(water_pad):
    pad = water_pad()
    model = fit_rest(pad.image(), pad.rest_uv, pad.camera)
    pad.gain = pad.gain * np.array([1.1, 1.0, 0.95])
    followed = update_constants(model, pad.image(), pad.rest_uv, pad.camera)
    assert followed.constants - model.constants == pytest.approx(np.log([1.1 / 0.95, 1 / 0.95]), abs=2e-3)
    ranges, _ = followed.depths(pad.image(), pad.tracks(), pad.camera)
    assert np.sqrt(np.nanmean((ranges - pad.ranges())**2)) < 4e-5


def test_a_calibrated_model_adopts_the_noise_of_the_current_images(water_pad):
    pad = water_pad(noise=1.0)
    model = fit_rest(pad.image(), pad.rest_uv, pad.camera)
    pad.noise = 5.0
    followed = update_constants(model, pad.image(), pad.rest_uv, pad.camera)
    ranges, sigma = followed.depths(pad.image(), pad.tracks(), pad.camera)
    off = np.nanstd(ranges - pad.ranges())
    assert np.nanmedian(sigma) == pytest.approx(off, rel=0.25)


def test_water_without_colour_is_refused(water_pad):
    pad = water_pad(absorption=(5.0, 5.0, 30.0), gain=(200, 200, 700))
    with pytest.raises(BadArgument, match='causes no colour'):
        fit_rest(pad.image(), pad.rest_uv, pad.camera)


def test_black_frames_are_refused(water_pad):
    pad = water_pad()
    with pytest.raises(BadFrame, match='check light'):
        fit_rest(np.zeros_like(pad.image()), pad.rest_uv, pad.camera)


def test_where_colour_bleeds_the_rings_are_used_instead_of_the_background(water_pad, stored_420):
    pad = water_pad()
    image = stored_420(pad.image())
    model = fit_rest(image, pad.rest_uv, pad.camera)
    assert model.ring_share == TOUCHPAD.wide_ring
    assert np.sqrt(np.nanmean((model.depths(image, pad.tracks(), pad.camera)[0] - pad.ranges())**2)) < 1e-4
    ground = rest_colours(image, pad.camera, model.cap, model.ring, np.eye(2) * 1e-4)
    shifted = as_ring_colours(ground, model, pad.camera.centre)
    assert shifted.ratios - ground.ratios == pytest.approx(np.broadcast_to(shifted.ratios[0] - ground.ratios[0], ground.ratios.shape))
    assert as_ring_colours(ground, fit_rest(pad.image(), pad.rest_uv, pad.camera), pad.camera.centre) is ground


def test_a_calibrated_model_widens_its_ring_where_colour_bleeds(water_pad, stored_420):
    pad = water_pad()
    model = fit_rest(pad.image(), pad.rest_uv, pad.camera)
    assert model.ring_share == TOUCHPAD.ring
    followed = update_constants(model, stored_420(pad.image()), pad.rest_uv, pad.camera)
    assert followed.ring_share == pytest.approx(TOUCHPAD.wide_ring)
    assert followed.ring == pytest.approx(model.ring * TOUCHPAD.wide_ring / TOUCHPAD.ring)
    again = update_constants(followed, pad.image(), pad.rest_uv, pad.camera)
    assert again.ring == followed.ring
