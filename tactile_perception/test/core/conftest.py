# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Messages of a simulated touchpad, untouched and with a ball pressed in."""
import cv2
import pytest


@pytest.fixture(scope='session')
def ball_messages():
    """camera_info, two untouched images and a pressed one, the parameters that belong to them, and the ball's truth."""
    from tactile_driver.frame import Frame, pinhole_calibration
    from tactile_driver.nodes.messages.conversions import calibration_to_message, header_of, image_to_message
    from tactile_driver.parameters.table import defaults
    from tactile_driver.simulation.sensors.scenes import open_scene
    from tactile_perception.touchpad.parameters import TOUCHPAD_PARAMETERS

    scene = open_scene('sphere_press', rate=10.0, seed=2)
    camera, skin, images = scene.camera, scene.membrane, []
    for time in (0.0, 0.1, 2.8):
        seen, stamp = scene.render(time), round((time + 1) * 1e9)
        images.append(image_to_message(Frame(seen.image, stamp, 'bgr8'), '', header_of(stamp, 'pad')))
    values = {**defaults(TOUCHPAD_PARAMETERS), 'membrane.shear_stiffness': float(skin.tension),
              'membrane.rest_pressure': float(skin.pressure), 'camera.rotation': cv2.Rodrigues(camera.rotation)[0].ravel().tolist(),
              'camera.translation': camera.translation.tolist()}
    calibration = pinhole_calibration(camera.matrix, camera.distortion, (camera.width, camera.height))
    return calibration_to_message(calibration, images[0].header), images, values, seen.truth
