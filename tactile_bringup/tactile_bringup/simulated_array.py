# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Scenes of the simulated taxel array as bags, and calibration/taxel_array_sim.yaml, made as a user would calibrate his array.

    python3 -m tactile_bringup.simulated_array FOLDER
"""
from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from tactile_driver.frame import Frame
from tactile_driver.nodes.conversions import header_of, image_to_message
from tactile_driver.nodes.ground_truth import TouchNumbers, contacts_message, region_message, slip_message, wrench_message
from tactile_driver.simulation.taxel_scene import open_taxel_scene
from tactile_perception.nodes.serialization import MessageCodec
from tactile_perception.offline.bags import BagWriter
from tactile_perception.offline.calibrate_taxels import calibrate_taxels

from .parameter_files import LICENCE
from .sensor_launch import share

SENSOR_TYPE = 'taxel_array'
_SECOND_NS = 10**9
_RATE = 20.0


def write_taxel_scene(path: Path, name: str, rate: float, seed: int = 0, namespace: str = SENSOR_TYPE) -> int:
    """Write a scene to a new bag as taxel_array_node publishes it, at rate frames/s, with ground truth; the number of frames written.

    Raises BadArgument for an unknown scene or a bag that exists.
    """
    scene, codec, numbers = open_taxel_scene(name, rate, seed), MessageCodec(), TouchNumbers()
    with BagWriter(path, codec.store) as writer:
        for number in range(scene.frames):
            stamp = _SECOND_NS + round(number / rate * _SECOND_NS)  # a stamp of zero means «no time» to much of ROS
            header, (values, truth) = header_of(stamp, namespace), scene.render(number / rate)
            messages = {'image_raw': image_to_message(Frame(values, stamp, 'mono8'), '', header),
                        'ground_truth/contacts': contacts_message(truth.contacts, numbers.assign(truth.contacts), header),
                        'ground_truth/contact_region': region_message(truth, 1 / rate, header),
                        'ground_truth/slip': slip_message(truth, header), 'ground_truth/wrench': wrench_message(truth, header)}
            for topic, message in messages.items():
                type_name, data = codec.encode(message)
                writer.write(f'/{namespace}/{topic}', type_name, stamp, data)
    return scene.frames


def calibrate_array(output: Path) -> str:
    """Write the calibration of the simulated specimen to output; how it went."""
    with TemporaryDirectory() as folder:
        bag = Path(folder) / SENSOR_TYPE
        write_taxel_scene(bag, 'plate', _RATE)
        told = calibrate_taxels([bag], Path(share('params', f'{SENSOR_TYPE}_sim.yaml')), output)
    output.write_text(LICENCE + output.read_text())
    return told


def main() -> int:
    """Write the file into the folder named on the command line."""
    print(calibrate_array(Path(sys.argv[1], f'{SENSOR_TYPE}_sim.yaml')))
    return 0


if __name__ == '__main__':
    sys.exit(main())
