# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Small bags of a taxel array that something round is pressed on, drawn, for the tests of this folder: quick to process."""
import numpy as np
import yaml

from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import header_of, image_to_message
from tactile_driver.recordings.serialization import encode
from tactile_driver.recordings.writer import BagWriter

PERIOD_NS = 20_000_000


def write_taxels(path, frames=30, shape=(16, 16), change=None, first=(), **more):
    """Frames under /pad, 50 a second from 1 s on, and path.yaml beside; change(k, image message): CDR bytes of the k-th; first:
    (topic, message) before all frames; more: parameters."""
    with BagWriter(path) as writer:
        for topic, message in first:
            type_name, data = encode(message)
            writer.write(topic, type_name, 10**9 - 1, data)
        for k in range(frames):
            stamp = 10**9 + k * PERIOD_NS
            message = image_to_message(Frame(picture(k, shape), stamp, 'mono8'), '', header_of(stamp, 'pad'))
            type_name, data = encode(message)
            writer.write('/pad/image_raw', type_name, stamp, data if change is None else change(k, message))
    values = {'sensor_type': 'taxel_array', 'rows': shape[0], 'columns': shape[1], **more}
    path.with_name(path.name + '.yaml').write_text(yaml.safe_dump({'/**': {'ros__parameters': values}}))
    return path


def picture(k, shape):
    """The k-th frame: untouched for ten, then pressed ever more, moving on."""
    y, x = np.mgrid[0:shape[0], 0:shape[1]]
    load = min(max(k - 9, 0) * 20, 180)
    noise = np.random.default_rng(k).normal(0, 0.7, shape)
    bump = np.clip(1.5 - np.hypot(x - 7 - 0.1 * k, y - 8) / 3, 0, 1)
    return np.clip(3 + noise + load * bump, 0, 255).astype(np.uint8)
