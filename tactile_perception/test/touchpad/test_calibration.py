# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration by sphere presses: what it gains over rest alone, and data that it refuses."""
import json
import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from tactile_perception.touchpad.calibration import Press, fit_touchpad
from tactile_perception.common.camera import CameraModel
from tactile_perception.common.dots import DotTracks
from tactile_perception.errors import BadCalibration
from tactile_perception.touchpad.identification import fit_rest

RADIUS = 0.008
PLACES = [(0.0, 0.0), (0.005, 0.001), (-0.004, 0.004)]
DEPTHS = (0.0015, 0.0035)


@pytest.fixture(scope='module')
def pad(water_pad):
    return water_pad(window=-0.005, lamp_radius=0.022)


@pytest.fixture(scope='module')
def recorded(pad):
    """One untouched frame, then two depths at each of three places."""
    presses = [Press(pad.image(), pad.tracks())]
    for x, y in PLACES:
        for depth in DEPTHS:
            tip = pad.tip(x, y, depth)
            presses.append(Press(pad.image(tip), pad.tracks(), tip, depth))
    return presses


@pytest.mark.full
def test_presses_find_the_water_that_rest_alone_leaves_open(pad, recorded):
    result = fit_touchpad(recorded, pad.camera, RADIUS)
    true = pad.absorption[:2] - pad.absorption[2]
    assert result.model.absorptions == pytest.approx(true, rel=0.025)
    assert result.residual_rms < 4e-5 and abs(result.residual_bias) < 1e-5
    assert result.held_out_rms < 6e-5
    assert result.presses == 6 and result.dots > 30
    assert result.depth_range == DEPTHS
    assert result.model.scale_sigma < 0.02
    tip = pad.tip(-0.001, -0.003, 0.003)
    ranges, _ = result.model.depths(pad.image(tip), pad.tracks(), pad.camera)
    flat = np.hypot(*(pad.camera.centre + pad.ranges(tip)[:, None] * pad.camera.rays(pad.rest_uv) - tip)[:, :2].T) < 0.0025
    assert np.sqrt(np.mean((ranges - pad.ranges(tip))[flat]**2)) < 6e-5


def test_bad_presses_are_left_out_and_said(pad, recorded):
    presses = list(recorded)
    presses += [Press(pad.image(), pad.tracks(), pad.tip(0, 0, 0.0001), 0.0001, name='touch'),
                Press(np.zeros_like(presses[0].image), pad.tracks(), pad.tip(0, 0, 0.002), 0.002, name='dark')]
    result = fit_touchpad(presses, pad.camera, RADIUS)
    lines = '\n'.join(result.left_out)
    assert 'touch: 0.10 mm deep' in lines and 'dark: no dot lies on the sphere' in lines
    assert result.presses == 6


@pytest.mark.parametrize('pick, complaint', [
    (lambda p: p[:1], '0 usable presses'),
    (lambda p: p[1:], 'no untouched frame'),
    (lambda p: p[:3], '2 usable presses'),
    (lambda p: p[:1] + p[1::2], 'depths span 0.00 mm'),
    (lambda p: p[:3] + p[1:3], 'lie within 0.00 mm of one place')])
def test_data_that_cannot_tell_are_refused(pad, recorded, pick, complaint):
    with pytest.raises(BadCalibration, match=complaint):
        fit_touchpad(pick(recorded), pad.camera, RADIUS)


@pytest.mark.parametrize('radius', [0.0, np.nan, -1.0])
def test_a_sphere_without_radius_is_refused(pad, recorded, radius):
    with pytest.raises(BadCalibration, match='sphere radius'):
        fit_touchpad(recorded, pad.camera, radius)


def recording(scene):
    """Camera, truth and images of a recorded scene."""
    root = os.environ.get('TACTILE_RECORDINGS')
    if not root:
        pytest.skip('set TACTILE_RECORDINGS to the folder of recordings to run this')
    folder = Path(root) / 'simulated' / scene
    lens = json.loads((folder / 'sensor.json').read_text())['cameras'][0]
    camera = CameraModel(*(np.array(lens[key], float) for key in ('K', 'dist_k1_k2_p1_p2_k3', 'R_cam_from_sensor', 't_cam_from_sensor')))
    return camera, dict(np.load(folder / 'truth.npz')), [cv2.imread(str(path)) for path in sorted((folder / 'frames').glob('*.webp'))]


def tracks_of(truth, frame, rest_uv):
    uv, count = truth['uv'][frame].astype(float), len(rest_uv)
    return DotTracks(23, 23, np.arange(count), uv, np.full(count, 100.0), np.full(count, 0.02), uv - rest_uv)


@pytest.mark.full
def test_recordings_calibrated_by_their_presses_and_judged_on_other_scenes():
    camera, truth, images = recording('tp_calib')
    rest_uv = camera.project(truth['dot_rest_xyz'].astype(float))
    presses = [Press(images[k], tracks_of(truth, k, rest_uv), truth['obj_p'][k].astype(float), float(truth['depth'][k]))
               for k in range(len(images)) if k < 3 or truth['segment'][k] % 2]
    result = fit_touchpad(presses, camera, 0.008)
    assert result.held_out_rms < 5e-5
    rest_alone = fit_rest(images[0], rest_uv, camera)
    for scene in ('tp_rect_drag', 'tp_ring_press', 'tp_disc_twist'):
        _, truth, images = recording(scene)
        errors = {name: [] for name in ('rest', 'calibrated')}
        for frame in range(2, len(images), 4):
            true = np.linalg.norm(truth['dot_xyz'][frame] - camera.centre, axis=1)
            for name, model in (('rest', rest_alone), ('calibrated', result.model)):
                errors[name].append(model.depths(images[frame], tracks_of(truth, frame, rest_uv), camera)[0] - true)
        rms = {name: float(np.sqrt(np.nanmean(np.square(parts)))) for name, parts in errors.items()}
        assert rms['calibrated'] < 3.3e-5, scene
        assert rms['calibrated'] < rms['rest'] < 8e-5, scene
