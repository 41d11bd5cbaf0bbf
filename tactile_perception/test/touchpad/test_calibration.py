# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration by sphere presses: its gain over the untouched pad alone, refused data, the radius of the sphere, and the file."""
import json
import os
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

from tactile_perception.common.camera import CameraModel
from tactile_perception.common.dots import DotTracks
from tactile_perception.core.calibration_file import write_calibration
from tactile_perception.core.errors import BadCalibration
from tactile_perception.touchpad.calibration import (
    Press,
    TouchpadCalibration,
    dots_on_sphere,
    find_sphere_radius,
    fit_touchpad,
    read_touchpad,
    touchpad_file,
)
from tactile_perception.touchpad.constants import TOUCHPAD
from tactile_perception.touchpad.identification import fit_rest
from tactile_perception.touchpad.water import LightPath, WaterModel

RADIUS = 0.008
POSITIONS = [(0.0, 0.0), (0.005, 0.001), (-0.004, 0.004)]
DEPTHS = (0.0015, 0.0035)


@pytest.fixture(scope='module')
def pad(water_pad):
    return water_pad(window=-0.005, lamp_radius=0.022)


@pytest.fixture(scope='module')
def recorded(pad):
    """One untouched frame, then two depths at each of three positions."""
    presses = [Press(pad.image(), pad.tracks())]
    for x, y in POSITIONS:
        for depth in DEPTHS:
            tip = pad.tip(x, y, depth)
            presses.append(Press(pad.image(tip), pad.tracks(), tip, depth))
    return presses


@pytest.mark.full
def test_presses_determine_the_absorption_better_than_the_untouched_pad(pad, recorded):
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


def test_bad_presses_are_left_out_and_reported(pad, recorded):
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
    (lambda p: p[:3] + p[1:3], 'lie within 0.00 mm of one position')])
def test_data_that_do_not_determine_the_model_are_refused(pad, recorded, pick, complaint):
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
def test_a_calibration_from_recorded_presses_is_accurate_on_other_scenes():
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


@pytest.mark.parametrize('radius', [3e-3, 5e-3, 8e-3, 12e-3, 24e-3])
def test_the_radius_of_minimum_misfit_is_found(radius):
    found = find_sphere_radius(lambda r: 1e-5 + 1e-4 * abs(np.log(r / radius)))
    assert found == pytest.approx(radius, rel=2 * TOUCHPAD.radius_tolerance)


def test_radii_that_cannot_be_fitted_are_skipped():
    def misfit(radius):
        if radius < 5e-3:
            raise BadCalibration('no dot lies on the sphere')
        return (radius - 9e-3)**2 + 1e-9
    assert find_sphere_radius(misfit) == pytest.approx(9e-3, rel=0.02)


@pytest.mark.parametrize('misfit', [lambda r: r, lambda r: 1e-3 / r, lambda r: 1e-4 + 0 * r])
def test_a_missing_minimum_within_the_bounds_is_an_error(misfit):
    with pytest.raises(BadCalibration, match='--sphere-radius'):
        find_sphere_radius(misfit)


@pytest.mark.full
def test_selected_dots_lie_on_the_sphere(water_pad):
    pad = water_pad()
    model = fit_rest(pad.image(), pad.rest_uv, pad.camera)
    tip = pad.tip(0.002, 0.001, 0.003)
    group = dots_on_sphere(Press(pad.image(tip), pad.tracks(), tip, 0.003), 0.008, model, pad.camera)
    assert 6 <= len(group.count) <= 20
    away = np.linalg.norm(group.colours.positions - tip - [0, 0, 0.008], axis=1)
    assert away == pytest.approx(np.full(len(away), 0.008), abs=6e-5)


@pytest.mark.full
def test_no_dot_lies_on_a_sphere_outside_the_pad(water_pad):
    pad = water_pad()
    model = fit_rest(pad.image(), pad.rest_uv, pad.camera)
    press = Press(pad.image(), pad.tracks(), pad.tip(0, 0, -0.004), 0.001)
    assert len(dots_on_sphere(press, 0.008, model, pad.camera).count) == 0


SIZE = (640, 480)
CAMERA = CameraModel(np.array([[700.0, 0, 320], [0, 700, 240], [0, 0, 1]]), translation=np.array([0, 0, 0.04]))


@pytest.fixture
def model():
    return WaterModel(LightPath(-0.0093, -0.0357, 0.0148, 0.27, (0.0, 0.0, -0.04)), np.array([-0.046, -0.042]), np.array([36.985, 27.976]),
                      np.array([[5.6e-6, 1.3e-6], [1.3e-6, 3.7e-6]]), 8.19, scale_sigma=0.005)


@pytest.fixture
def path(tmp_path, model):
    calibration = TouchpadCalibration(model, 0.008, 36, 565, 3e-5, -3e-7, np.nan, (0.001, 0.004),
                                      np.array([[-0.005, -0.005], [0.005, 0.005]]), ['x'])
    write_calibration(tmp_path / 'pad.yaml', touchpad_file(calibration, SIZE))
    return tmp_path / 'pad.yaml'


def test_a_written_model_is_read_back_unchanged(path, model):
    found = read_touchpad(path, CAMERA, SIZE)
    for name in ('constants', 'absorptions', 'noise', 'ring', 'scale_sigma'):
        assert np.array_equal(getattr(found, name), getattr(model, name)), name
    assert found.path == model.path and found.cap == model.cap


@pytest.mark.parametrize('key, value, complaint', [
    ('absorptions', [0.0, 28.0], 'absorptions is .* must be positive'), ('ring', 0, 'ring is 0.0, must be positive'),
    ('ring', 1.0, 'ring of 2 px'), ('height', -1.0, 'height'), ('constants', [1.0], r'shape \(1,\)'),
    ('noise', [[1.0, 2.0], [2.0, 1.0]], 'not a covariance'), ('window_z', float('nan'), 'not a finite number'), ('lamp_z', None, 'lamp_z')])
def test_impossible_and_missing_numbers_are_refused_by_name(path, key, value, complaint):
    page = yaml.safe_load(path.read_text())
    page['fitted'][key] = value
    if value is None:
        del page['fitted'][key]
    path.write_text(yaml.safe_dump(page, sort_keys=False))
    with pytest.raises(BadCalibration, match=complaint):
        read_touchpad(path, CAMERA, SIZE)


def test_another_image_size_or_camera_pose_is_refused(path):
    with pytest.raises(BadCalibration, match=r'\[640, 480\].*\[320, 240\]'):
        read_touchpad(path, CAMERA, (320, 240))
    moved = CameraModel(CAMERA.matrix, translation=np.array([0, 0, 0.041]))
    with pytest.raises(BadCalibration, match='1.00 mm'):
        read_touchpad(path, moved, SIZE)
