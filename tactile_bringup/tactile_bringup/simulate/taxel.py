# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Writes scenes of the simulated taxel array to bags."""
from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from pathlib import Path

from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import header_of, image_to_message
from tactile_driver.nodes.messages.ground_truth import TouchNumbers, truth_messages
from tactile_driver.recordings.writer import write_messages
from tactile_driver.simulation.taxel.scene import TaxelScene, open_taxel_scene
from tactile_driver.nodes.messages.transforms import static_transform
from tactile_perception.nodes.messages.description import description_messages


SENSOR_TYPE = 'taxel_array'
_SECOND_NS = 10**9


def write_taxel_scene(path: Path, name: str, rate: float, seed: int = 0, namespace: str = SENSOR_TYPE,
                      scene: TaxelScene | None = None) -> int:
    """Write a scene to a new bag as taxel_array_node publishes it, at rate frames/s, with ground truth; the number of frames written.

    scene: of another device, instead of the one of that name. Raises BadArgument for an unknown scene or an existing bag.
    """
    scene = scene or open_taxel_scene(name, rate, seed)
    pad = scene.specimen
    about = {'source': 'sim', 'device': f'simulated {SENSOR_TYPE}', 'scene': name, 'seed': seed, 'rate': rate, 'width': pad.columns,
             'height': pad.rows, 'encoding': 'mono8'}
    described = description_messages(_SECOND_NS, SENSOR_TYPE, namespace, about,
                                     [static_transform(namespace, f'{namespace}_taxels', (0.0, 0.0, -pad.thickness))])
    write_messages(path, namespace, chain(described, _messages(scene, rate, namespace)))
    return scene.frames


def _messages(scene, rate: float, frame_id: str) -> Iterator[tuple[int, str, object]]:
    """Yield (stamp in ns, topic, message) of all frames."""
    numbers = TouchNumbers()
    for number in range(scene.frames):
        stamp = _SECOND_NS + round(number / rate * _SECOND_NS)  # much of ROS takes a stamp of zero for an unknown time
        header, (values, truth) = header_of(stamp, frame_id), scene.render(number / rate)
        yield stamp, 'image_raw', image_to_message(Frame(values, stamp, 'mono8'), '', header)
        for name, message in truth_messages(truth, numbers.assign(truth.contacts), 1 / rate, header).items():
            yield stamp, f'ground_truth/{name}', message
