# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Every part of the benchmark measures what it states; long parts are marked slow."""
import math
import sys
from pathlib import Path

import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
sys.path.insert(0, str(Path(__file__).parent))
from parts import PARTS, Plan  # noqa: E402

OURS = {'dots': 'likelihood', 'numbers': 'with a previous frame', 'touchpad': 'membrane', 'sheets and dome': 'model', 'finger': 'map',
        'taxels': 'mechanics'}
BASELINES = {'dots': 'SimpleBlobDetector', 'numbers': 'SimpleBlobDetector, nearest', 'taxels': 'Lucas-Kanade'}


@pytest.mark.parametrize('name', [pytest.param(name, marks=[] if name == 'finger' else pytest.mark.slow) for name in PARTS])
def test_ours_and_others_have_rows_and_ours_err_least(name, tmp_path):
    rows = PARTS[name](Plan(True, False, tmp_path)).measure(0)
    assert {row.part for row in rows} == {name} and all(set(row.errors) == set(PARTS[name].errors) and row.ms > 0 for row in rows)
    first = next(iter(PARTS[name].errors))
    told = [row for row in rows if math.isfinite(row.errors[first])]
    best = min(told, key=lambda row: row.errors[first])
    ours = min((row for row in rows if row.method == OURS[name]), key=lambda row: row.errors[first])
    assert ours.errors[first] <= 1.5 * best.errors[first]
    assert BASELINES.get(name, OURS[name]) in {row.method for row in rows}
