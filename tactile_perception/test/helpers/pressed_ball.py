# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated touchpad: untouched images, one of a ball pressed in, and the stages' parameters for it."""
import cv2
import pytest
from tactile_driver.parameters.table import defaults
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_perception.parameters.touchpad import DOT_PARAMETERS, REGION_PARAMETERS
from tactile_perception.touchpad.sensor import Touchpad

RATE, PRESSED_AT = 10.0, 2.8


class Ball:
    """rest: untouched images; untouched: their truth; pressed, truth: the ball's; sensor, camera, values: what perception is reported."""

    def __init__(self):
        scene = open_scene('sphere_press', rate=RATE, seed=2)
        self.rest, self.untouched = [scene.render(k / RATE).image for k in range(4)], scene.render(0.0).truth
        seen = scene.render(PRESSED_AT)
        self.pressed, self.truth = seen.image, seen.truth
        skin, camera = scene.membrane, scene.camera
        self.values = {
            **defaults(REGION_PARAMETERS), **defaults(DOT_PARAMETERS), 'membrane.shear_stiffness': float(skin.tension),
            'membrane.rest_pressure': float(skin.pressure), 'camera.rotation': cv2.Rodrigues(camera.rotation)[0].ravel().tolist(),
            'camera.translation': camera.translation.tolist()}
        self.sensor = Touchpad.from_parameters(self.values)
        self.camera = self.sensor.camera(camera.matrix, camera.distortion)


@pytest.fixture(scope='session')
def ball():
    return Ball()
