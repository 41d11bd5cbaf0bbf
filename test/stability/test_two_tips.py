# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Two fingertips at once on simulated sheets, like and unlike ones of which one moves, at other frictions than the calibrated one."""
import dataclasses

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

from tactile_driver.simulation.sensors.scenes import SCENES

from moving_rig import errors_of_two

pytestmark = [pytest.mark.ros, pytest.mark.full]


# Largest errors of place and depth, mean and 95 %, mm: of a sheet with one camera, and with two.
LARGEST = {'areal_single_two': ((0.25, 0.6), (0.1, 0.3)), 'areal_single_two_unlike': ((0.25, 0.6), (0.3, 0.7)),
           'areal_dual_two': ((0.3, 0.6), (0.08, 0.2)), 'areal_dual_two_unlike': ((0.7, 1.3), (0.08, 0.2))}


@pytest.mark.parametrize('friction', [0.2, 1.0])
@pytest.mark.parametrize('name', LARGEST)
def test_two_tips_are_told_as_two_where_they_touch(tmp_path, monkeypatch, name, friction):
    monkeypatch.setitem(SCENES, name, dataclasses.replace(SCENES[name], friction=friction))
    found, told = errors_of_two(tmp_path, name)
    for errors_mm, limits in zip(found.T, LARGEST[name]):
        assert errors_mm.mean() < limits[0] and np.percentile(errors_mm, 95) < limits[1]
    assert found[:, 2].mean() < 2.0 and told > 0.85
