# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The touchpad's calibration file: the same model comes back; what does not fit is named."""
import numpy as np
import pytest
import yaml
from tactile_perception.calibration.files.format import write_calibration
from tactile_perception.touchpad.calibration import TouchpadCalibration, read_touchpad, touchpad_file
from tactile_perception.common.camera import CameraModel
from tactile_perception.errors import BadCalibration
from tactile_perception.touchpad.water import WaterModel, LightPath

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


def test_the_same_model_comes_back(path, model):
    found = read_touchpad(path, CAMERA, SIZE)
    for name in ('constants', 'absorptions', 'noise', 'ring', 'scale_sigma'):
        assert np.array_equal(getattr(found, name), getattr(model, name)), name
    assert found.path == model.path and found.cap == model.cap


@pytest.mark.parametrize('key, value, complaint', [
    ('absorptions', [0.0, 28.0], 'absorptions is .* must be positive'), ('ring', 0, 'ring is 0.0, must be positive'),
    ('ring', 1.0, 'ring of 2 px'), ('height', -1.0, 'height'), ('constants', [1.0], r'shape \(1,\)'),
    ('noise', [[1.0, 2.0], [2.0, 1.0]], 'no covariance'), ('window_z', float('nan'), 'not a finite number'), ('lamp_z', None, 'lamp_z')])
def test_impossible_and_missing_numbers_are_named(path, key, value, complaint):
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
