# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Scenes of the simulated PSD finger as bags, and calibration/psd_finger_sim.yaml, made as a user would calibrate his finger.

    python3 -m tactile_bringup.simulated_finger FOLDER
"""
from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from tactile_driver.nodes.conversions import header_of
from tactile_driver.nodes.ground_truth import TouchNumbers, contacts_message
from tactile_driver.nodes.voltage_stream import instants, voltages_message
from tactile_driver.samples import SampleBlock
from tactile_driver.simulation.psd_scene import open_psd_scene
from tactile_perception.nodes.serialization import MessageCodec
from tactile_perception.offline.bags import BagWriter
from tactile_perception.offline.calibrate_psd import calibrate_psd

from .parameter_files import LICENCE
from .sensor_launch import share

SENSOR_TYPE = 'psd_finger'
_SECOND_NS = 10**9
_BATCH_S = 0.01


def write_psd_scene(path: Path, name: str, rate: float, seed: int = 0, namespace: str = SENSOR_TYPE) -> int:
    """Write a scene to a new bag as psd_node publishes it, at rate samples/s, with ground truth; the number of samples written.

    Raises BadArgument for an unknown scene or a bag that exists.
    """
    scene, codec, numbers = open_psd_scene(name, rate, seed), MessageCodec(), TouchNumbers()
    scale, count = scene.electronics.full_scale / 2**scene.electronics.bits, max(round(_BATCH_S * rate), 1)
    with BagWriter(path, codec.store) as writer:
        for first in range(0, scene.samples, count):
            counts, truth = scene.play(first, min(count, scene.samples - first))
            block = SampleBlock((counts * scale).astype(np.float32), _stamp(first, rate), 1 / rate)
            messages = [('voltages', block.stamp_ns, voltages_message(block, namespace))]
            for k in instants(truth.touching):
                touches, stamp = truth.touches(k), _stamp(first + k, rate)
                known = contacts_message(touches, numbers.assign(touches), header_of(stamp, namespace))
                messages.append(('ground_truth/contacts', stamp, known))
            for topic, stamp, message in messages:
                type_name, data = codec.encode(message)
                writer.write(f'/{namespace}/{topic}', type_name, stamp, data)
    return scene.samples


def _stamp(number: int, rate: float) -> int:
    """ns; a stamp of zero means «no time» to much of ROS."""
    return _SECOND_NS + round(number / rate * _SECOND_NS)


def calibrate_finger(output: Path) -> str:
    """Write the calibration of the simulated specimen to output; how it went."""
    with TemporaryDirectory() as folder:
        bag = Path(folder) / SENSOR_TYPE
        write_psd_scene(bag, 'calibration', 1000.0)
        told = calibrate_psd([bag], Path(share('params', f'{SENSOR_TYPE}_sim.yaml')), output)
    output.write_text(LICENCE + output.read_text())
    return told


def main() -> int:
    """Write the file into the folder named on the command line."""
    print(calibrate_finger(Path(sys.argv[1], f'{SENSOR_TYPE}_sim.yaml')))
    return 0


if __name__ == '__main__':
    sys.exit(main())
