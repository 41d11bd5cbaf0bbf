# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import sys
from pathlib import Path

import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
from tactile_bringup.installed import share  # noqa: E402
from tactile_bringup.simulate.taxel import write_taxel_scene  # noqa: E402

sys.path.insert(0, str(Path(__file__).parent))
import taxel_turns  # noqa: E402


def test_every_method_is_judged_on_every_frame(tmp_path):
    frames = write_taxel_scene(tmp_path / 'drag', 'drag', 25.0)
    found = taxel_turns.run([tmp_path / 'drag'], Path(share('params', 'taxel_array_sim.yaml')),
                            Path(share('calibration', 'taxel_array_sim.yaml')))
    assert set(found) == {'mechanics', 'paper', 'Lucas-Kanade'} and {len(turns.seconds) for turns in found.values()} == {frames}
    rows = {name: turns.row() for name, turns in found.items()}
    assert rows['mechanics']['slip states'] < 0.3 < rows['Lucas-Kanade']['slip states']
    assert rows['mechanics']['region overlap'] < 0.1 < rows['paper']['region overlap'] and rows['mechanics']['force'] < 5
    assert rows['Lucas-Kanade']['force'] != rows['Lucas-Kanade']['force'], 'not told'
