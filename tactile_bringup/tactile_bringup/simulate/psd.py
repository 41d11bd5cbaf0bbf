# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Writes scenes of the simulated PSD finger to bags."""
from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np
from tactile_driver.nodes.messages.conversions import header_of
from tactile_driver.nodes.messages.ground_truth import TouchNumbers, contacts_message
from tactile_driver.nodes.messages.conversions import instants, voltages_message
from tactile_driver.recordings.writer import write_messages
from tactile_driver.samples import SampleBlock
from tactile_driver.simulation.psd.finger import COVER_RADIUS
from tactile_driver.simulation.psd.scene import open_psd_scene
from tactile_driver.nodes.messages.transforms import static_transform
from tactile_perception.nodes.messages.description import description_messages


SENSOR_TYPE = 'psd_finger'
_SECOND_NS = 10**9
_BATCH_S = 0.01  # chosen: duration of the samples in one message


def write_psd_scene(path: Path, name: str, rate: float, seed: int = 0, namespace: str = SENSOR_TYPE) -> int:
    """Write a scene to a new bag as psd_node publishes it, at rate samples/s, with ground truth; the number of samples written.

    Raises BadArgument for an unknown scene or an existing bag.
    """
    scene = open_psd_scene(name, rate, seed)
    about = {'source': 'sim', 'device': f'simulated {SENSOR_TYPE}', 'scene': name, 'seed': seed, 'rate': rate}
    described = description_messages(_SECOND_NS, SENSOR_TYPE, namespace, about,
                                     [static_transform(namespace, f'{namespace}_tip', (0.0, 0.0, COVER_RADIUS))])
    write_messages(path, namespace, chain(described, _messages(scene, rate, namespace)))
    return scene.samples


def _messages(scene, rate: float, frame_id: str) -> Iterator[tuple[int, str, object]]:
    """Yield (stamp in ns, topic, message): blocks of voltages, each with ground truth at its first sample and at each contact change."""
    numbers, count = TouchNumbers(), max(round(_BATCH_S * rate), 1)
    scale = scene.electronics.full_scale / 2**scene.electronics.bits
    for first in range(0, scene.samples, count):
        counts, truth = scene.play(first, min(count, scene.samples - first))
        block = SampleBlock((counts * scale).astype(np.float32), _stamp(first, rate), 1 / rate)
        yield block.stamp_ns, 'voltages', voltages_message(block, frame_id)
        for k in instants(truth.touching):
            touches, stamp = truth.touches(k), _stamp(first + k, rate)
            yield stamp, 'ground_truth/contacts', contacts_message(touches, numbers.assign(touches), header_of(stamp, frame_id))


def _stamp(number: int, rate: float) -> int:
    """Stamp, ns, of a sample; the first is 1 s, because much of ROS takes a stamp of zero for an unknown time."""
    return _SECOND_NS + round(number / rate * _SECOND_NS)
