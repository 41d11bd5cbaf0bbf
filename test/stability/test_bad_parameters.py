# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""NaN, zero and nonsense in parameter and calibration files: one line names the file, the number and the remedy; no frame is processed."""
import math

import pytest
import yaml
from tactile_perception.touchpad.calibration import read_touchpad
from tactile_perception.errors import BadArgument, BadCalibration
from tactile_perception.parameters.file import read_parameters
from tactile_perception.parameters.touchpad import DOT_PARAMETERS, REGION_PARAMETERS
from tactile_perception.touchpad.sensor import Touchpad

NAN = math.nan
NUMBERS = [p for p in (*DOT_PARAMETERS, *REGION_PARAMETERS) if p.type in (int, float, list[float])]


def written(path, **values):
    path.write_text(yaml.safe_dump({'/**': {'ros__parameters': values}}))
    return path


@pytest.mark.parametrize('parameter', {p.name: p for p in NUMBERS}.values(), ids=lambda p: p.name)
def test_a_number_that_is_none_is_refused(tmp_path, parameter):
    table = DOT_PARAMETERS if parameter in DOT_PARAMETERS else REGION_PARAMETERS
    for bad in (NAN, math.inf, -math.inf, 'x', None):
        value = [bad] * 3 if parameter.type == list[float] else bad
        with pytest.raises(BadArgument, match=parameter.name):
            read_parameters(written(tmp_path / 'p.yaml', **{parameter.name: value}), 'dot_tracker_node', table)


@pytest.mark.parametrize('name', [
    'cap.curvature_radius', 'cap.height', 'membrane.shear_stiffness', 'membrane.rest_pressure', 'reference.frames',
    'reference.time_constant'])
def test_zero_is_refused_where_it_makes_no_sense(tmp_path, name):
    with pytest.raises(BadArgument, match=name):
        read_parameters(written(tmp_path / 'p.yaml', **{name: 0}), 'dot_tracker_node', DOT_PARAMETERS)


@pytest.mark.parametrize('changes', [{'cap__height': 0.05}, {'rows': 2}, {'camera__translation': [0.0]}, {'camera__rotation': []}])
def test_numbers_that_do_not_fit_together_are_refused(pad, changes):
    with pytest.raises(BadArgument):
        Touchpad.from_parameters(pad.values(**changes))


@pytest.fixture(scope='module')
def calibrated(pad):
    sensor = Touchpad.from_parameters(pad.values())
    camera = sensor.camera(pad.scene.camera.matrix, pad.scene.camera.distortion)
    fitted = {'window_z': -0.01, 'lamp_z': -0.04, 'lamp_radius': 0.012, 'ambient': 0.3, 'ring': 8.0, 'ring_offset': 0.0,
              'scale_sigma': 0.01, 'offset_sigma': 1e-4, 'curvature_radius': 0.02, 'height': 0.013, 'constants': [0.1, 0.1],
              'absorptions': [40.0, 30.0],
              'noise': [[1e-4, 0.0], [0.0, 1e-4]], 'camera_centre': camera.centre.tolist(), 'image_size': [640, 480]}
    page = {'format': 'tactile calibration 2', 'sensor': 'touchpad', 'serial': '', 'date': '2026-01-01T00:00:00Z', 'software': '',
            'parameters': {}, 'units': {}, 'fitted': fitted, 'outliers': [],
            'residuals': {}, 'calibrated_range': {}, 'left_out': [], 'complete': True}
    return page, camera


def test_the_calibration_itself_is_good(calibrated, tmp_path):
    page, camera = calibrated
    (tmp_path / 'c.yaml').write_text(yaml.safe_dump(page))
    assert read_touchpad(tmp_path / 'c.yaml', camera).absorptions[0] == 40


@pytest.mark.parametrize('name, value', [
    ('ring', 0.0), ('ring', NAN), ('absorptions', [0.0, 0.0]), ('absorptions', [NAN, 1.0]), ('noise', [[0.0, 0.0]] * 2),
    ('scale_sigma', 0.0), ('curvature_radius', 0.0), ('window_z', NAN), ('window_z', 'x'), ('camera_centre', [0.0, 0.0, 0.0]),
    ('constants', [1.0]), ('ambient', None)])
def test_a_spoilt_calibration_is_refused(calibrated, tmp_path, name, value):
    page, camera = calibrated
    (tmp_path / 'c.yaml').write_text(yaml.safe_dump({**page, 'fitted': {**page['fitted'], name: value}}))
    with pytest.raises(BadCalibration, match='c.yaml'):
        read_touchpad(tmp_path / 'c.yaml', camera)


@pytest.mark.parametrize('text', ['', 'fitted: 3', '{', '\x00', 'format: tactile calibration 2\n'])
def test_what_is_no_calibration_is_refused(calibrated, tmp_path, text):
    (tmp_path / 'c.yaml').write_text(text)
    with pytest.raises(BadCalibration, match='c.yaml'):
        read_touchpad(tmp_path / 'c.yaml', calibrated[1])
