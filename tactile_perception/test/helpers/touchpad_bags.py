# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Bags of simulated touchpads, made once a session, and the parameter file that describes the specimen."""
import json

import cv2
import numpy as np
import pytest

from tactile_driver.frame import Frame, pinhole_calibration
from tactile_driver.nodes.messages.conversions import calibration_to_message, header_of, image_to_message
from tactile_driver.nodes.messages.ground_truth import TouchNumbers, contacts_message, region_message
from tactile_driver.recordings.serialization import encode
from tactile_driver.recordings.writer import BagWriter
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_perception.core.parameter_files import write_parameters


def write_scene(path, name, times, rate):
    """A bag of the scene's frames at the given times (s), and the parameter file beside it (path + .yaml)."""
    scene, numbers = open_scene(name, rate=rate, seed=1), TouchNumbers()
    camera = scene.camera
    calibration = pinhole_calibration(camera.matrix, camera.distortion, (camera.width, camera.height))
    with BagWriter(path) as writer:
        for time in times:
            seen, stamp = scene.render(time), round((time + 1) * 1e9)
            header = header_of(stamp, 'touchpad')
            for topic, message in {
                'camera_info': calibration_to_message(calibration, header),
                'image_raw': image_to_message(Frame(seen.image, stamp, 'bgr8'), '', header),
                'ground_truth/contacts': contacts_message(seen.truth.contacts, numbers.assign(seen.truth.contacts), header),
                'ground_truth/contact_region': region_message(seen.truth, 1 / rate, header),
            }.items():
                type_name, data = encode(message)
                writer.write(f'/touchpad/{topic}', type_name, stamp, data)
    values = {
        'camera.rotation': cv2.Rodrigues(camera.rotation)[0].ravel().tolist(),
        'camera.translation': camera.translation.ravel().tolist(),
        'membrane.shear_stiffness': float(scene.membrane.tension),
        'membrane.rest_pressure': float(scene.membrane.pressure),
    }
    write_parameters(path.with_name(path.name + '.yaml'), values)


@pytest.fixture(scope='session')
def pressed_bag(tmp_path_factory):
    """A disc pressed: two untouched frames, then the press, ten frames a second."""
    path = tmp_path_factory.mktemp('bags') / 'disc'
    write_scene(path, 'disc_twist', [0.1 * k for k in range(12, 26)], 10.0)
    return path


@pytest.fixture(scope='session')
def sphere_bag(tmp_path_factory):
    """A ball of 8 mm radius pressed at nine known positions: three untouched frames, then one of each of the 23 presses."""
    path = tmp_path_factory.mktemp('bags') / 'sphere'
    write_scene(path, 'sphere_calibration', [0.0, 0.1, 0.2, *(1.9 + 1.1 * k for k in range(23))], 10.0)
    return path


@pytest.fixture
def recording_folder(tmp_path):
    """A recording of three tiny frames: free, touched (a ring around a hole), slipping."""
    folder = tmp_path / 'recording'
    (folder / 'frames').mkdir(parents=True)
    for k in range(3):
        cv2.imwrite(str(folder / f'frames/{k:03}.png'), np.full((48, 64, 3), 10 * (k + 1), np.uint8))
    camera = {'width': 64, 'height': 48, 'K': [[70.0, 0, 32], [0, 70, 24], [0, 0, 1]], 'dist_k1_k2_p1_p2_k3': [0.0] * 5,
              'R_cam_from_sensor': np.eye(3).tolist(), 't_cam_from_sensor': [0.0, 0.0, 0.04]}
    row_col = [[k // 4, k % 4] for k in range(12)]
    info = {'curvature_radius': 0.02, 'cap_height': 0.013, 'rest_gauge_pressure': 2000.0, 'shear_modulus_times_thickness': 90.0}
    sensor = {'sensor': 'touchpad', 'cameras': [camera], 'info': info, 'dots': {'row_col': row_col}, 'frame_interval_s': 0.1}
    (folder / 'sensor.json').write_text(json.dumps(sensor))
    np.savez(folder / 'truth.npz', **_truth(np.array(row_col)))
    return folder


def _truth(row_col):
    """Three frames of twelve dots, of which the first row touches in two and slips in one."""
    touches = np.zeros((3, 12), bool)
    touches[1:, :4] = True
    state = np.where(touches, np.array([0, 1, 2])[:, None], 0)
    slip = np.zeros((3, 12, 3))
    slip[2, :4, 0] = 1e-4
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) * 1e-3
    each, two = (lambda *values: np.array([values] * 3, float)), np.full((3, 2), np.nan)
    return {
        'timestamps': np.array([0.0, 0.1, 0.2]), 'dot_rc': row_col, 'dot_contact': touches, 'dot_state': state, 'dot_slip': slip,
        'dot_xyz': np.random.default_rng(0).normal(0, 1e-3, (3, 12, 3)), 'uv': np.random.default_rng(1).normal(30, 5, (3, 12, 2)),
        'contact_area': np.array([0, 1e-5, 1e-5]), 'contact_centroid': each(1e-3, 2e-3, 12e-3), 'depth': np.array([0, 1e-3, 1e-3]),
        'obj_p': each(3e-3, 0, 11e-3), 'obj_R': np.array([np.eye(3)] * 3), 'obj_disp': np.zeros((3, 3)), 'obj_rotvec': np.zeros((3, 3)),
        'force': each(0.1, 0, -2), 'moment_sensor': np.zeros((3, 3)), 'pressure': np.full(3, 2000.0), 'part_area': np.zeros((3, 2)),
        'part_centroid': np.full((3, 2, 3), np.nan), 'part_depth': two, 'part_force': np.full((3, 2, 3), np.nan),
        'loop_start': np.array([0, 4, 8, 12]), 'loop_frame': np.array([1, 1, 2]), 'loop_is_hole': np.array([False, True, False]),
        'loop_xyz': np.vstack([square, square / 3, square])}


@pytest.fixture
def dual_folder(recording_folder):
    """The same recording as of a sheet with two cameras; the right one's images are brighter by 100 and 4 ms later."""
    folder = recording_folder
    (folder / 'frames').rename(folder / 'frames_left')
    (folder / 'frames_right').mkdir()
    for k in range(3):
        cv2.imwrite(str(folder / f'frames_right/{k:03}.png'), np.full((48, 64, 3), 100 + 10 * (k + 1), np.uint8))
    sensor = json.loads((folder / 'sensor.json').read_text())
    camera = sensor['cameras'][0]
    dots = {'row_col': sensor['dots']['row_col'], 'rest_xyz_nominal': [[9.4e-3 * c, 8.2e-3 * r, 0] for r, c in sensor['dots']['row_col']]}
    sensor.update(sensor='areal_dual', cameras=[{**camera, 'name': 'left'}, {**camera, 'name': 'right', 'K': np.eye(3).tolist()}],
                  info={'size': [0.133, 0.091]}, dots=dots, static=True)
    (folder / 'sensor.json').write_text(json.dumps(sensor))
    truth = _truth(np.array(dots['row_col']))
    truth['uv_left'], truth['uv_right'] = truth.pop('uv'), np.zeros((3, 12, 2))
    np.savez(folder / 'truth.npz', **truth, timestamps_right=truth['timestamps'] + 0.004)
    return folder


def change_truth(folder, change):
    """Let change(name -> array) change the truth of a recording."""
    with np.load(folder / 'truth.npz') as stored:
        truth = {name: stored[name] for name in stored.files}
    change(truth)
    np.savez(folder / 'truth.npz', **truth)
