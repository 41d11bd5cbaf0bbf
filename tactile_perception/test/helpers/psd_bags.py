# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Bags of the simulated PSD finger, with ground truth, and its parameter file."""
import numpy as np
import yaml
from tactile_driver.nodes.messages.conversions import header_of, voltages_message
from tactile_driver.nodes.messages.ground_truth import TouchNumbers, contacts_message
from tactile_driver.recordings.serialization import encode
from tactile_driver.recordings.writer import BagWriter
from tactile_driver.samples import SampleBlock
from tactile_driver.simulation.psd.scene import open_psd_scene


PERIOD_NS = 1_000_000


def write_psd(path, name, batch=20, begin=0, end=None, seed=0, truth_every=1):
    """Samples begin to end of a scene at 1 kHz, and path.yaml beside it; returns their truth."""
    scene, numbers = open_psd_scene(name, 1000.0, seed), TouchNumbers()
    counts, truth = scene.play(0, scene.samples)
    volts = (counts * (5 / 4096)).astype(np.float32)
    with BagWriter(path) as writer:
        for first in range(begin, end or len(volts), batch):
            stamp = 10**9 + first * PERIOD_NS
            write(writer, 'voltages', stamp, voltages_message(SampleBlock(volts[first:first + batch], stamp, 1e-3), 'finger'))
            last = min(first + batch, len(volts))
            changes = np.flatnonzero(np.diff(truth.touching[first:last])) + 1 + first
            for k in sorted({*range(first, last, truth_every), *changes.tolist()}):
                touches, at = truth.touches(k), 10**9 + k * PERIOD_NS
                known = contacts_message(touches, numbers.assign(touches), header_of(at, 'finger'))
                write(writer, 'ground_truth/contacts', at, known)
    path.with_name(path.name + '.yaml').write_text(yaml.safe_dump({'/**': {'ros__parameters': {'sensor_type': 'psd_finger'}}}))
    return truth


def write(writer, topic, stamp, message):
    type_name, data = encode(message)
    writer.write(f'/finger/{topic}', type_name, stamp, data)
