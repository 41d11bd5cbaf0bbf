# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from functools import partial

import pytest

from tactile_driver.simulation.scene.specimen import UNTOUCHED, act, one_after_the_other, press


def test_act_comes_from_above_and_leaves_upwards():
    tool, keys = act('sphere', 2.0, {'t': 0.5, 'press': 0.003}, {'t': 1.0, 'x': 0.004}, x=0.001)
    assert tool == 'sphere'
    assert [key.t for key in keys] == [1.75, 2.0, 2.5, 3.0, 3.25]
    assert [key.x for key in keys] == [0.001, 0.001, 0.001, 0.004, 0.004]
    assert [key.press for key in keys] == [-0.0015, 0.0, 0.003, 0.003, -0.0015]


def test_acts_follow_one_another_with_a_pause():
    first, second = one_after_the_other([partial(press, 'sphere', 0, 0, 0.001)] * 2, pause=0.5)
    assert first[1][0].t == UNTOUCHED
    assert second[1][0].t - first[1][-1].t == pytest.approx(0.5)
