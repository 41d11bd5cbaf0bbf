# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A bar that two fingers hold: each pad carries half of the weight, and of its moment."""
import numpy as np
import pytest

from tactile_driver.errors import BadArgument
from tactile_driver.simulation.taxel.held import HELD_SCENES, HeldKey, HeldScene, HeldScript, open_held_scene

RATE = 20.0  # Hz


def carried(script):
    scene = HeldScene(script, RATE, 0)
    for number in range(scene.frames):
        truth = scene.render(number / RATE)[1]
    middle = truth.centroid
    return scene, truth.wrench[:3], truth.wrench[3:] - np.cross(middle, truth.wrench[:3])


@pytest.mark.parametrize('turn, rise, down', [(0.0, 0.0, (0, 1, 0)), (np.pi / 2, 0.0, (1, 0, 0)), (0.0, np.pi / 2, (0, 0, -1))])
def test_a_pad_carries_half_of_the_weight_whatever_the_posture(turn, rise, down):
    pressed = HeldKey(0.6, 3e-4, 0.0, turn, rise)
    script = HeldScript((HeldKey(0.0, -1e-4, 0.0, turn, rise), pressed, HeldKey(1.0, 3e-4, 1.0, turn, rise),
                         HeldKey(2.0, 3e-4, 1.0, turn, rise)), weight=2.0, off_centre=0.005, angle=0.0)
    scene, force, moment = carried(script)
    grip = scene.specimen.press * 0.024 * 0.010 * 3e-4
    assert force == pytest.approx(np.array(down) * 1.0 - [0, 0, grip], abs=0.02)
    assert moment == pytest.approx(np.cross([0.005, 0, 0], np.array(down) * 1.0), abs=5e-4)


def test_a_table_carries_the_bar_until_it_is_lifted():
    _, force, moment = carried(HeldScript((HeldKey(0.0, -1e-4, 0.0), HeldKey(0.6, 3e-4, 0.0), HeldKey(1.0, 3e-4, 0.0))))
    assert force[:2] == pytest.approx([0, 0], abs=0.01) and moment == pytest.approx([0, 0, 0], abs=1e-4)


def test_a_pushed_bar_leans_on_the_pad():
    lifted = HeldKey(0.8, 3e-4)
    _, _, moment = carried(HeldScript((HeldKey(0.0, -1e-4, 0.0), HeldKey(0.5, 3e-4, 0.0), lifted, HeldKey(1.2, 3e-4, push_y=0.015),
                                       HeldKey(2.0, 3e-4, push_y=0.015)), off_centre=0.0))
    assert moment[1] == pytest.approx(0.015, abs=5e-4)


def test_an_unknown_scene_is_named():
    with pytest.raises(BadArgument, match='|'.join(HELD_SCENES)):
        open_held_scene('another', RATE)
