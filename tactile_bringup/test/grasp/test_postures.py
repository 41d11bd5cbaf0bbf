# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The wrench of a held object at postures of the wrist, against the engine's."""
import numpy as np
import pytest

pytest.importorskip('mujoco', reason='MuJoCo is an optional extra: pip install mujoco')

from tactile_bringup.grasp.constants import GRASP  # noqa: E402
from tactile_bringup.grasp.objects import OBJECTS  # noqa: E402
from tactile_bringup.grasp.postures import FORCE, FRAMES, METHODS, OBJECT, wrenches  # noqa: E402


def test_the_wrench_is_that_of_the_engine_at_the_force_sensor_and_at_the_wrist():
    upright, tilted = wrenches(((0, 0, 0), (40, 0, 0)))
    half = 0.5 * OBJECTS[OBJECT].mass * GRASP.gravity
    assert upright.true['wrist'][:3] == pytest.approx([-FORCE, 0.0, -half], abs=0.1), 'the array is on the left finger'
    assert np.linalg.norm(tilted.true['wrist'][1:3]) == pytest.approx(half, rel=0.02)
    for found in (upright, tilted):
        for method in METHODS:
            for frame in FRAMES:
                error = found.estimated[method, frame] - found.true[frame]
                assert np.linalg.norm(error[:3]) < 0.4 and np.linalg.norm(error[3:]) < 0.02, (method, frame)
