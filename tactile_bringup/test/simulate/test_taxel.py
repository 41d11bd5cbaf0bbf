# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_bringup.installed import share
from tactile_bringup.simulate.bags import write_taxel_scene
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_perception.tools.process_bag import main as process_bag


def told(bag, topic):
    with BagReader(bag) as reader:
        return {raw.stamp_ns: decode(raw.data, raw.type_name) for raw in reader.messages({f'/taxel_array/{topic}'})}


@pytest.mark.full
def test_the_calibration_that_ships_tells_region_force_and_slip(tmp_path):
    assert write_taxel_scene(tmp_path / 'bag', 'turn', 50.0) == 230
    words = ['--params', share('params', 'taxel_array_sim.yaml'), '--calibration', share('calibration', 'taxel_array_sim.yaml')]
    assert process_bag([str(tmp_path / 'bag'), str(tmp_path / 'out'), *words]) == 0
    found = {topic: told(tmp_path / 'out', topic) for topic in ('contact_region', 'slip', 'wrench')}
    true = {topic: told(tmp_path / 'out', f'ground_truth/{topic}') for topic in found}
    held = [stamp for stamp, message in true['wrench'].items() if -message.wrench.force.z > 5]
    force = [found['wrench'][s].wrench.force.z / true['wrench'][s].wrench.force.z - 1 for s in held]
    assert np.median(np.abs(force)) < 0.06
    area = [found['contact_region'][s].area / true['contact_region'][s].area - 1 for s in held]
    assert np.median(np.abs(area)) < 0.1
    states = np.array([(true['slip'][s].state, found['slip'][s].state) for s in held])
    assert np.mean(states[:, 0] == states[:, 1]) > 0.8
    gross = [s for s in held if true['slip'][s].state == 2 == found['slip'][s].state]
    turn = [found['slip'][s].velocity.angular.z / true['slip'][s].velocity.angular.z - 1 for s in gross[5:]]
    assert np.median(np.abs(turn)) < 0.15
    centre = [np.hypot(found['slip'][s].rotation_center.x, found['slip'][s].rotation_center.y) for s in gross]
    assert np.nanmedian(centre) < 2e-3
