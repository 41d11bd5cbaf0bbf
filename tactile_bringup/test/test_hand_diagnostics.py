# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import yaml

from tactile_bringup.hand_diagnostics import aggregator_configuration
from tactile_bringup.hand_file import Hand, HandSensor


def test_one_analyzer_for_each_sensor_takes_its_nodes():
    page = yaml.safe_load(aggregator_configuration(Hand('palm', (HandSensor('left/thumb', 'touchpad', 'palm'),))))
    assert page == {'analyzers': {'ros__parameters': {'path': 'palm', 'left_thumb': {
        'type': 'diagnostic_aggregator/GenericAnalyzer', 'path': 'left/thumb', 'startswith': ['/left/thumb/']}}}}
