# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Simulated runs of slip are scored correctly."""
import sys
from pathlib import Path

import numpy as np
import pytest
from tactile_driver.simulation.truth import TruthFrame
from tactile_perception.common.estimates import SlipEstimate

sys.path.insert(0, str(Path(__file__).parent))
import taxel_runs  # noqa: E402


def frames(count, states, motion):
    truths = []
    for k in range(count):
        truth = TruthFrame(np.zeros(0, int), np.zeros((0, 2)), np.zeros((0, 3)), np.zeros(0, np.uint8), wrench=np.zeros(6))
        truth.area, truth.slip_state, truth.centroid = 1e-4, states[k], np.array([1e-3, 0, 0])
        truth.motion = np.array(motion) / taxel_runs.RATE
        truths.append(truth)
    return truths


def slips(states, linear, turn=0.0, centre=(np.nan, np.nan)):
    return [SlipEstimate(state, 0.5, np.array([*linear, 0.0]), np.array([0.0, 0.0, turn]), np.array([*centre, 0.0])) for state in states]


def test_a_translation_is_judged_by_its_velocity():
    truths = frames(20, [0, 0, 1] + [2] * 17, [1e-3, 0, 0, 0, 0, 0])
    run = taxel_runs._judged('bar', slips([0, 1, 1] + [2] * 17, (0.9e-3, 0.0)), truths, False)
    assert run.warned and run.errors['velocity'] == pytest.approx([0.1] * 14) and not run.errors['turn']
    said = taxel_runs.text([run], 'mechanics')
    assert 'in 1 of 1 runs' in said and 'velocity 0.100 (0.100)' in said and 'turn untold' in said


def test_a_turn_is_judged_by_its_rate_and_centre():
    # About (2, 0) mm, at 0.5 rad/s, the point at the origin moves by -1 mm/s along y.
    run = taxel_runs._judged('bar', slips([2] * 20, (0.0, -1e-3), 0.4, (2e-3, 1e-3)), frames(20, [2] * 20, [0, -1e-3, 0, 0, 0, 0.5]), True)
    assert not run.warned, 'all slips from the first frame on'
    assert run.errors['turn'] == pytest.approx([0.2] * 14) and run.errors['centre'] == pytest.approx([1.0] * 14)


def test_a_false_alarm_is_no_warning():
    assert not taxel_runs._judged('bar', slips([1, 0, 2], (0, 0)), frames(3, [0, 1, 2], np.zeros(6)), False).warned


def test_scripts_press_hold_and_move_ever_faster():
    keys = taxel_runs.script(np.random.default_rng(1), 'bar', False).keys
    ways = [np.hypot(b.x - a.x, b.y - a.y) / (b.time - a.time) for a, b in zip(keys, keys[1:])]
    assert ways[:3] == [0, 0, 0] and 0 < ways[3] < ways[4] < ways[5] and keys[0].depth < 0 < keys[-1].depth
