# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Valid messages by sensor type: raw messages of a simulated scene with a press."""
from __future__ import annotations

import functools
from array import array

import cv2
import numpy as np
from sensor_msgs.msg import CompressedImage, Image
from tactile_driver.frame import Frame, pinhole_calibration
from tactile_driver.nodes.messages.conversions import calibration_to_message, header_of, image_to_message
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.nodes.messages.conversions import voltages_message
from tactile_driver.samples import SampleBlock
from tactile_driver.simulation.psd.scene import open_psd_scene
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_driver.simulation.taxel.scene import open_taxel_scene

BEGIN_NS = 1_700_000_000 * 10**9
#: Camera sensors: scene, frames a second, and the seconds that are rendered: untouched, then pressed.
_SCENES = {'touchpad': ('disc_twist', 10.0, (0.0, 0.1, 0.2, 2.5, 2.6, 2.7)),
           'areal_single': ('areal_single_press', 10.0, (0.0, 0.1, 0.2, 2.7, 2.8, 2.9)),
           'air_cushion': ('air_cushion_press', 10.0, (0.0, 0.1, 0.2, 3.0, 3.1, 3.2))}
_FINGER_RATE, _BLOCK, _BLOCKS = 1000.0, 10, 120
_TAXEL_RATE, _TAXEL_FRAMES = 100.0, 60


@functools.cache
def messages(sensor: str) -> list[tuple[str, object]]:
    """(topic, message) in the order in which they are sent; nobody may change them."""
    return list({'psd_finger': _finger, 'taxel_array': _taxels}.get(sensor, lambda: _camera(sensor))())


def compressed(image: Image, kind: str) -> CompressedImage:
    """The same image under the same header; kind: .png or .jpg."""
    data = cv2.imencode(kind, image_to_array(image))[1]
    return CompressedImage(header=image.header, format=kind[1:], data=array('B', data.tobytes()))


def _camera(sensor: str):
    name, rate, times = _SCENES[sensor]
    scene = open_scene(name, rate=rate, seed=1)
    camera = scene.camera
    info = pinhole_calibration(camera.matrix, camera.distortion, (camera.width, camera.height))
    for number, time in enumerate(times):
        stamp = BEGIN_NS + round(number / rate * 1e9)
        header, message = header_of(stamp, sensor), calibration_to_message(info)
        message.header = header
        yield 'camera_info', message
        yield 'image_raw', image_to_message(Frame(scene.render(time).image, stamp, 'bgr8'), '', header)


def _finger():
    scene = open_psd_scene('grid', _FINGER_RATE, 0)
    counts, _ = scene.play(0, _BLOCK * _BLOCKS)
    volts = (counts * (scene.electronics.full_scale / 2**scene.electronics.bits)).astype(np.float32)
    for first in range(0, len(volts), _BLOCK):
        stamp = BEGIN_NS + round(first / _FINGER_RATE * 1e9)
        yield 'voltages', voltages_message(SampleBlock(volts[first:first + _BLOCK], stamp, 1 / _FINGER_RATE), 'psd_finger')


def _taxels():
    scene = open_taxel_scene('demo', _TAXEL_RATE, 0)
    for number in range(_TAXEL_FRAMES):
        stamp = BEGIN_NS + round(number / _TAXEL_RATE * 1e9)
        values, _ = scene.render((number if number < 20 else number + 100) / _TAXEL_RATE)
        yield 'image_raw', image_to_message(Frame(values, stamp, 'mono8'), '', header_of(stamp, 'taxel_array'))
