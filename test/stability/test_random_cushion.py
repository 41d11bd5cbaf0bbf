# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A cushion with randomly printed circles: calibrated by one recording of presses, tested on another recording, where the circles have to
be known again."""
from pathlib import Path

import pytest
from judged import Case, calibrated, judge, parameter_file
from tactile_bringup.installed import share
from tactile_bringup.simulate.bags import write_scene
from tactile_perception.press.calibration import read_touch

pytestmark = pytest.mark.slow


def test_presses_on_a_random_print_are_found_in_another_recording(tmp_path):
    params = parameter_file(tmp_path / 'params.yaml', Path(share('params', 'air_cushion_sim.yaml')), {'rows': 0, 'columns': 0})
    presses, demo = (Case(tmp_path / name, params) for name in ('calibration', 'demo'))
    write_scene(presses.bag, 'air_cushion_random_calibration', rate=1.5, frames=70)
    write_scene(demo.bag, 'air_cushion_random_demo', rate=2.0, frames=16)
    file = calibrated(presses, 'air_cushion', tmp_path / 'cushion.yaml')
    assert 150 < len(read_touch(file, 'air_cushion').pattern) < 400
    found = judge([demo], file, counts=lambda _estimated, true: not true.contacts or true.contacts[0].depth > 0.008)
    frames = found.evaluation.summary()['frames']
    assert frames['touched'] and frames['untouched'] and frames['missed'] == frames['false'] == found.refused == 0
    assert found.medians()['place'] < 8.0  # mm
