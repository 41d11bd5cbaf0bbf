# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import yaml
from tactile_bringup.hand.configurations import aggregator_configuration, main
from tactile_bringup.hand.description import Hand, HandSensor


def test_one_analyzer_for_each_sensor_takes_its_nodes():
    page = yaml.safe_load(aggregator_configuration(Hand('palm', (HandSensor('left/thumb', 'touchpad', 'palm'),))))
    assert page == {'analyzers': {'ros__parameters': {'path': 'palm', 'left_thumb': {
        'type': 'diagnostic_aggregator/GenericAnalyzer', 'path': 'left/thumb', 'startswith': ['/left/thumb/']}}}}


EXAMPLE = Path(__file__).parents[2] / 'hands' / 'example_hand.yaml'


def test_both_files_are_written_and_named(tmp_path, capsys):
    assert main([str(EXAMPLE), str(tmp_path / 'out')]) == 0
    written = [Path(line) for line in capsys.readouterr().out.splitlines()]
    assert [path.name for path in written] == ['example_hand.rviz', 'example_hand_diagnostics.yaml']
    displays = yaml.safe_load(written[0].read_text())['Visualization Manager']['Displays']
    assert sum(d.get('Topic', {}).get('Value', '').endswith('/markers') for d in displays) == 5
    assert len(yaml.safe_load(written[1].read_text())['analyzers']['ros__parameters']) == 6


def test_a_file_that_is_no_hand_is_told(tmp_path, capsys):
    assert main([str(tmp_path / 'none.yaml'), str(tmp_path)]) == 1
    assert 'none.yaml: cannot be read' in capsys.readouterr().err
