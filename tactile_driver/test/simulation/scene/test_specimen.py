# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from functools import partial

import pytest

from tactile_driver.simulation.scene.specimen import UNTOUCHED, act, drag, one_after_the_other, press


def test_act_comes_from_above_and_leaves_upwards():
    tool, keys = act('sphere', 2.0, {'t': 0.5, 'press': 0.003}, {'t': 1.0, 'x': 0.004}, x=0.001)
    assert tool == 'sphere'
    assert [key.t for key in keys] == [1.75, 2.0, 2.5, 3.0, 3.25]
    assert [key.x for key in keys] == [0.001, 0.001, 0.001, 0.004, 0.004]
    assert [key.press for key in keys] == [-0.0015, 0.0, 0.003, 0.003, -0.0015]


def test_press_stops_at_each_depth():
    _, keys = press('sphere', 0.01, -0.02, 0.002, 0.005, start=1.0, move=0.3, hold=0.2)
    assert [key.press for key in keys] == [-0.0015, 0.0, 0.002, 0.002, 0.005, 0.005, 0.0, -0.0015]
    assert [key.t for key in keys] == pytest.approx([0.75, 1.0, 1.3, 1.5, 1.8, 2.0, 2.3, 2.55])
    assert {(key.x, key.y) for key in keys} == {(0.01, -0.02)}


def test_drag_goes_its_way_at_one_depth():
    _, keys = drag('sphere', 0.01, 0.0, 0.004, 0.02, -0.01, start=0.0, duration=2.0)
    moving = [key for key in keys if key.press == 0.004]
    assert (moving[0].x, moving[0].y) == (0.01, 0.0)
    assert (moving[-1].x, moving[-1].y) == pytest.approx((0.03, -0.01))
    assert moving[-1].t - moving[0].t == pytest.approx(0.2 + 2.0 + 0.2)


def test_acts_follow_one_another_with_a_pause():
    first, second = one_after_the_other([partial(press, 'sphere', 0, 0, 0.001)] * 2, pause=0.5)
    assert first[1][0].t == UNTOUCHED
    assert second[1][0].t - first[1][-1].t == pytest.approx(0.5)
