# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Valid messages by sensor type: raw messages of a simulated sensor, untouched and then pressed."""
from __future__ import annotations

import copy
import functools
from array import array

import cv2
import numpy as np
import rig
from sensor_msgs.msg import CompressedImage, Image
from tactile_driver.nodes.messages.conversions import header_of
from tactile_driver.nodes.messages.images import image_to_array

BEGIN_NS = 1_700_000_000 * 10**9
_PERIOD_NS = {'psd_finger': 10**7, 'taxel_array': 10**7}  # of messages; else 0.1 s
_BLOCK = 10


@functools.cache
def messages(sensor: str) -> list[tuple[str, object]]:
    """(topic, message) in the order in which they are sent; nobody may change them."""
    of, found = rig.seen(sensor), []
    chain = of.chain()
    if sensor == 'psd_finger':
        raws, topic = np.concatenate([*of.rest, of.pressed]).reshape(-1, _BLOCK, 4), 'voltages'
    else:
        raws, topic = [*of.rest, *[of.pressed] * 20] if sensor == 'taxel_array' else [*of.rest[:3], *[of.pressed] * 3], 'image_raw'
    for number, raw in enumerate(raws):
        stamp = BEGIN_NS + number * _PERIOD_NS.get(sensor, rig.STEP_NS)
        if of.info is not None:
            info = copy.deepcopy(of.info)
            info.header = header_of(stamp, sensor)
            found.append(('camera_info', info))
        found.append((topic, chain.message(raw, stamp)))
    return found


def compressed(image: Image, kind: str) -> CompressedImage:
    """The same image under the same header; kind: .png or .jpg."""
    data = cv2.imencode(kind, image_to_array(image))[1]
    return CompressedImage(header=image.header, format=kind[1:], data=array('B', data.tobytes()))
