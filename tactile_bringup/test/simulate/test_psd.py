# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_bringup.installed import share
from tactile_bringup.simulate.bags import write_psd_scene
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_perception.tools.process_bag import main as process_bag


def contacts_in(bag, topic):
    with BagReader(bag) as reader:
        return {raw.stamp_ns: decode(raw.data, raw.type_name).contacts for raw in reader.messages({f'/psd_finger/{topic}'})}


@pytest.mark.full
def test_the_calibration_that_ships_tells_where_a_touch_is(tmp_path):
    assert write_psd_scene(tmp_path / 'bag', 'grid', 1000.0) > 11_000
    words = ['--params', share('params', 'psd_finger_sim.yaml'), '--calibration', share('calibration', 'psd_finger_sim.yaml')]
    assert process_bag([str(tmp_path / 'bag'), str(tmp_path / 'out'), *words]) == 0
    told, true = (contacts_in(tmp_path / 'out', topic) for topic in ('contacts', 'ground_truth/contacts'))
    both = [(told[s][0], true[s][0]) for s in told if told[s] and true.get(s)]
    error = [np.degrees(np.linalg.norm([getattr(a.normal, k) - getattr(b.normal, k) for k in 'xyz'])) for a, b in both]
    assert len(both) > 500 and np.median(error) < 0.6
    assert np.median([abs(a.force / b.force - 1) for a, b in both]) < 0.15
