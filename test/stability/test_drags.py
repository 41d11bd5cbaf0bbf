# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dragged tips on simulated sheets: at other frictions than the calibrated one, and through the seam of two cameras at 70 to 100 mm/s."""
import dataclasses

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

from tactile_driver.simulation.scene.shutters import Shutters
from tactile_driver.simulation.sensors.scenes import SCENES

from moving_rig import errors

pytestmark = [pytest.mark.ros, pytest.mark.full]


def check(found, beside, place, depth, squared):
    """place, depth: mm, largest mean and 95 % of the errors; squared: largest mean of the normalised squared error."""
    assert beside == 0
    for errors_mm, limits in ((found[:, 0], place), (found[:, 1], depth)):
        assert errors_mm.mean() < limits[0] and np.percentile(errors_mm, 95) < limits[1]
    assert found[:, 2].mean() < squared


@pytest.mark.parametrize('friction, place, depth', [(0.2, (0.2, 0.4), (0.1, 0.2)), (0.35, (0.2, 0.4), (0.12, 0.25)),
                                                    (1.0, (0.25, 0.7), (0.35, 0.8))])
def test_a_drag_is_told_whatever_the_friction(tmp_path, monkeypatch, friction, place, depth):
    name = 'areal_single_drag'
    monkeypatch.setitem(SCENES, name, dataclasses.replace(SCENES[name], friction=friction))
    check(*errors(tmp_path, name), place, depth, 2.0)


@pytest.mark.parametrize('offset', [-0.0115, 0.0, 0.0115])
def test_fast_drags_are_told_at_any_offset_of_the_shutters(tmp_path, offset):
    found = errors(tmp_path, 'areal_dual_fast_drag', Shutters(offset, jitter=2e-4 if offset else 0.0))[0]
    check(found, 0, (0.45, 1.0), (0.04, 0.1), 2.0)  # frames in which a touch begins between the exposures are not counted as beside it
