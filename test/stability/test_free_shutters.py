# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Two cameras that run free: presses at 30, 65 and 100 mm/s under each camera and at the seam are told as by cameras of one trigger.

The scene, its optics and mechanics share nothing with the estimator; the calibration is that of the same specimen at rest.
"""

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

from tactile_driver.simulation.scene.shutters import Shutters

from moving_rig import errors

pytestmark = [pytest.mark.ros, pytest.mark.full]
SCENE = 'areal_dual_fast'


@pytest.fixture(scope='module')
def together(tmp_path_factory):
    """Errors of cameras of one trigger."""
    return errors(tmp_path_factory.mktemp('together'), SCENE, Shutters())[0]


@pytest.mark.parametrize('shutters', [*(Shutters(skew, jitter=2e-4) for skew in (-0.0055, 0.0115, -0.0115, -0.0164)),
                                      Shutters(0.003, 0.009, 2e-4)])
def test_fast_presses_are_told_as_by_cameras_of_one_trigger(tmp_path, together, shutters):
    found, beside = errors(tmp_path, SCENE, shutters)
    assert len(found) >= 0.95 * len(together) and beside == 0
    place, depth, squared = found.mean(axis=0)
    assert place < together[:, 0].mean() + 0.1 and np.percentile(found[:, 0], 95) < 0.5  # mm
    assert depth < 0.12 and np.percentile(found[:, 1], 95) < 0.3 and squared < 2.0
