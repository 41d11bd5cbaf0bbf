# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Bags of a small sheet that two cameras see, drawn, for the tests of this folder."""

import numpy as np
from sheet_pair import DISTORTION, MATRIX, SENSOR, SIZE, picture, printed

from tactile_driver.frame import Frame, pinhole_calibration
from tactile_driver.nodes.messages.conversions import calibration_to_message, header_of, image_to_message
from tactile_driver.recordings.serialization import encode
from tactile_driver.recordings.writer import BagWriter
from tactile_msgs.msg import Contact, Contacts

PERIOD, LATE = 100_000_000, 4_000_000
PARAMETERS = {'sensor_type': 'areal_dual', 'rows': SENSOR.rows, 'columns': SENSOR.columns, 'pitch': list(SENSOR.pitch),
              'sheet_size': list(SENSOR.size), 'polarity': 'bright', 'detection': 'blobs'}


def pair():
    """Left and right picture of the untouched sheet."""
    return picture('left', printed()), picture('right', printed(), brightness=190.0, seed=1)


def write_pairs(path, pairs, touched=(), truth=True, known=True):
    """A bag under /pad of pairs, ten a second from 1 s on, an image of None left out; touched: numbers of those at which something
    touches; truth: whether that is recorded; known: whether the cameras are calibrated."""
    calibration = pinhole_calibration(MATRIX if known else np.zeros((3, 3)), DISTORTION, SIZE)
    with BagWriter(path) as writer:
        def write(topic, stamp, message):
            type_name, data = encode(message)
            writer.write(f'/pad/{topic}', type_name, stamp, data)
        for k, images in enumerate(pairs):
            for name, image, late in zip(('left', 'right'), images, (0, LATE)):
                stamp = 10**9 + k * PERIOD + late
                if image is not None:
                    write(f'{name}/camera_info', stamp, calibration_to_message(calibration, header_of(stamp, 'pad')))
                    write(f'{name}/image_raw', stamp, image_to_message(Frame(image, stamp, 'bgr8'), '', header_of(stamp, 'pad')))
            if truth:
                header = header_of(10**9 + k * PERIOD, 'pad')
                write('ground_truth/contacts', 10**9 + k * PERIOD, Contacts(header=header, contacts=[Contact()] if k in touched else []))
    return path
