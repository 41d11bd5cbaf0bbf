# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""README's plot and table are of a run that measured every sensor, and only methods that exist."""
import json
from pathlib import Path

import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
import dots
import results
from parts import TOUCHPAD_METHODS
from tactile_perception.finger.parameters import PSD_METHODS
from tactile_perception.press.methods import METHOD_NAMES
from tactile_perception.sensors import SENSOR_TYPES
from tactile_perception.taxel.estimator import TAXEL_METHODS

HERE = Path(__file__).parent
METHODS = {'dots': {*dots.detectors(), 'trackpy'}, 'touchpad': TOUCHPAD_METHODS,
           'sheets and dome': METHOD_NAMES, 'finger': PSD_METHODS, 'taxels': TAXEL_METHODS}


def test_every_sensor_is_shown_and_only_methods_that_exist():
    kept = results.from_plain(json.loads((HERE / 'doc/benchmark.json').read_text())['entries'])
    assert set(SENSOR_TYPES) <= {entry.source for entry in kept}
    gone = {entry.name for entry in kept if entry.method not in METHODS[entry.part]}
    assert not gone, 'measure again: python3 test/benchmark/run.py --out test/benchmark/doc'
    assert results.summary(kept) in (HERE.parents[1] / 'README.md').read_text()
