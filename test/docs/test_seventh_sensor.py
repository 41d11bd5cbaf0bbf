# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sensor type that docs/extending.md adds runs offline, live and by launch, in a folder that has nothing but what the page shows."""
import subprocess
import sys

import numpy as np
import pytest
from pages import ROOT, files
from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import header_of, image_to_message
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_driver.recordings.writer import write_messages

UNTOUCHED, PRESSED = [[10, 11], [12, 13]], [[40, 71], [22, 33]]  # counts of 0.1 N


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """A folder with the files of the page and a recording of ten frames, of which five are of a press."""
    path = tmp_path_factory.mktemp('plate')
    shown = files(ROOT / 'docs/extending.md')
    for name in ('plate.py', 'plate.yaml'):
        (path / name).write_text(shown[name])
    frames = [Frame(np.array(PRESSED if k >= 5 else UNTOUCHED, np.uint8), k, 'mono8') for k in range(10)]
    write_messages(path / 'bag', 'plate', [(k * 10**8 + 10**9, '/plate/image_raw',
                                            image_to_message(frame, '', header_of(k * 10**8 + 10**9, 'plate')))
                                           for k, frame in enumerate(frames)])
    return path


def run(folder, code, *words):
    """What a Python program prints that begins with the sensor type."""
    done = subprocess.run([sys.executable, '-c', f'import sys, plate\n{code}', *words], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_process_bag_computes_its_contacts(folder):
    run(folder, 'from tactile_perception.tools.process_bag import main\nsys.exit(main())', 'bag', 'results', '--params', 'plate.yaml')
    with BagReader(folder / 'results') as reader:
        found = [decode(raw.data, raw.type_name) for raw in reader.messages({'/plate/contacts'})]
    assert [len(message.contacts) for message in found] == [0] * 5 + [1] * 5
    contact = found[-1].contacts[0]
    assert contact.force == pytest.approx(12.0)  # 3, 6, 1 and 2 N at the corners of 0.3 m
    assert (contact.position.x, contact.position.y) == pytest.approx((0.05, 0.075))


def test_a_node_runs_it(folder):
    code = """
import rclpy
from tactile_driver.nodes.runtime.host import Host
from tactile_perception.node import make_node
rclpy.init()
node = make_node('plate_node', Host(['-r', '__ns:=/plate', '--params-file', 'plate.yaml']))
print(node.get_fully_qualified_name(), node.get_parameter('size').value)
node.destroy_node()
"""
    assert run(folder, code).split() == ['/plate/plate_node', '0.3']


def test_launch_starts_its_nodes(folder):
    code = """
from tactile_bringup.launch.arguments import sensor_arguments, sensor_plan
values = {name: default for name, (default, _) in sensor_arguments('plate').items()}
print(*sensor_plan(values | {'source': 'file', 'path': 'bag', 'params': 'plate.yaml'}, 'plate').nodes)
"""
    assert run(folder, code).split() == ['taxel_array_node', 'plate_node', 'taxel_markers_node']
