# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Fixtures of the touchpad's tests: recordings with the true positions of their dots."""
import json
import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from cap_with_dots import pad, recording  # noqa: F401

from tactile_driver.parameters.table import defaults
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_perception.common.camera import CameraModel
from tactile_perception.touchpad.parameters import TOUCHPAD_PARAMETERS
from tactile_perception.touchpad.sensor import Touchpad


class TouchpadRecording:
    """The ground truth of a recording, and simulated measurements with known errors."""

    def __init__(self, folder):
        description = json.loads((folder / 'sensor.json').read_text())
        camera = description['cameras'][0]
        self.camera = CameraModel(np.array(camera['K'], float), np.array(camera['dist_k1_k2_p1_p2_k3'], float),
                                  np.array(camera['R_cam_from_sensor']), np.array(camera['t_cam_from_sensor']))
        self.truth = dict(np.load(folder / 'truth.npz'))
        self.rest = self.truth['dot_rest_xyz'].astype(float)
        self.info = description['info']
        self.centring = self.truth['uv'][0] - self.camera.project(self.rest)

    def measure(self, frame, rng, pixel=0.008, spread=18e-6, gain=0.0):
        """Unit rays (K, 3), ranges (K,) m with noise and an error that grows with the displacement, and the true ranges (K,)."""
        origin, position = self.camera.centre, self.truth['dot_xyz'][frame].astype(float)
        rays = self.camera.rays(self.truth['uv'][frame] - self.centring + rng.normal(size=(len(position), 2)) * pixel)
        true = ((position - origin) * rays).sum(1)
        moved = true - np.linalg.norm(self.rest - origin, axis=1)
        return rays, true + gain * moved + rng.normal(size=len(true)) * spread, true


@pytest.fixture
def touchpad():
    """Opens a touchpad recording by name; skips where there are none."""
    def open_recording(name):
        root = os.environ.get('TACTILE_RECORDINGS')
        if not root:
            pytest.skip('set TACTILE_RECORDINGS to the folder of recordings to run this')
        return TouchpadRecording(Path(root) / 'simulated' / name)
    return open_recording


RATE, PRESSED_AT = 10.0, 2.8


class Ball:
    """rest: untouched images; untouched: their truth; pressed, truth: of a ball; sensor, camera, values: as perception receives them."""

    def __init__(self):
        scene = open_scene('sphere_press', rate=RATE, seed=2)
        self.rest, self.untouched = [scene.render(k / RATE).image for k in range(4)], scene.render(0.0).truth
        seen = scene.render(PRESSED_AT)
        self.pressed, self.truth = seen.image, seen.truth
        skin, camera = scene.membrane, scene.camera
        self.values = {
            **defaults(TOUCHPAD_PARAMETERS), 'membrane.shear_stiffness': float(skin.tension),
            'membrane.rest_pressure': float(skin.pressure), 'camera.rotation': cv2.Rodrigues(camera.rotation)[0].ravel().tolist(),
            'camera.translation': camera.translation.tolist()}
        self.sensor = Touchpad.from_parameters(self.values)
        self.camera = self.sensor.camera(camera.matrix, camera.distortion)


@pytest.fixture(scope='session')
def ball():
    return Ball()
