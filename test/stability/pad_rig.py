# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated touchpad, untouched and pressed by a disc, and its processing stages."""
import functools

import cv2
from tactile_driver.parameters.table import defaults
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_perception.parameters.touchpad import DOT_PARAMETERS, REGION_PARAMETERS
from tactile_perception.pipeline.contact_stage import ContactEstimator
from tactile_perception.touchpad.places import TouchpadDots
from tactile_perception.touchpad.sensor import Touchpad

RATE = 10.0
PRESSED_AT = 2.7  # s: the disc rests, 3 mm deep


class Pad:
    """The scene and its frames. rest: untouched images; pressed: one with the disc; truth: of that one."""

    def __init__(self, name='disc_twist', width=640, height=480, pressed_at=PRESSED_AT):
        self.scene = open_scene(name, rate=RATE, seed=1, width=width, height=height)
        self.rest = [self.scene.render(k / RATE).image for k in range(6)]
        seen = self.scene.render(pressed_at)
        self.pressed, self.truth = seen.image, seen.truth
        camera = self.scene.camera
        self.info = {'width': width, 'height': height, 'K': camera.matrix, 'dist_k1_k2_p1_p2_k3': camera.distortion}

    def values(self, **changes):
        """Parameters of both nodes for this sensor; names with a dot as keyword by two underscores."""
        skin, camera = self.scene.membrane, self.scene.camera
        return {**defaults(REGION_PARAMETERS), **defaults(DOT_PARAMETERS),
                'membrane.shear_stiffness': float(skin.tension), 'membrane.rest_pressure': float(skin.pressure),
                'camera.rotation': cv2.Rodrigues(camera.rotation)[0].ravel().tolist(), 'camera.translation': camera.translation.tolist(),
                **{name.replace('__', '.'): value for name, value in changes.items()}}

    def chain(self, **changes):
        """Fresh stages."""
        return Chain(self, self.values(**changes))


class Chain:
    """Both stages as one; each call is a tenth of a second later, unless a stamp is given."""

    def __init__(self, pad, values):
        sensor = Touchpad.from_parameters(values)
        camera = sensor.camera(pad.scene.camera.matrix, pad.scene.camera.distortion)
        self.dots, self.contact, self.stamp = TouchpadDots(sensor, camera, values), ContactEstimator(sensor, camera, values), 1.0

    def __call__(self, image, stamp=None):
        self.stamp += 1 / RATE
        stamp = self.stamp if stamp is None else stamp
        tracks = self.dots.process(image, stamp)
        return tracks, self.contact.process(tracks, stamp)

    def begun(self, pad):
        """This chain with three untouched frames done."""
        for image in pad.rest[:3]:
            self(image)
        return self


@functools.cache
def shared_pad():
    """The pad that most tests share; nobody may change its images."""
    return Pad()
