# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Force taxels on the simulated gripper: forces and slip against the engine's."""
import numpy as np
import pytest

pytest.importorskip('mujoco', reason='MuJoCo is an optional extra: pip install mujoco')

from tactile_bringup.grasp.constants import GRASP  # noqa: E402
from tactile_bringup.grasp.force_pad import ForcePad  # noqa: E402
from tactile_bringup.grasp.objects import OBJECTS  # noqa: E402
from tactile_bringup.grasp.world import GraspWorld  # noqa: E402
from tactile_driver.force_taxels.sources import simulated_frame  # noqa: E402
from tactile_perception.force_taxels.estimator import ForceTaxelsEstimator, Response  # noqa: E402

OPEN_S, LIFT_S, HELD_S, END_S = 1.3, 2.5, 3.5, 6.5  # until the fingers close; the lift; the first slip; the end
FALLS_S, SLIPS_S = 0.5, 0.1  # of each second: the grip becomes weaker, and is too weak


def force_at(now_s, least):
    """Grip force, N: after the lift too weak for a tenth of each second."""
    if now_s < OPEN_S:
        return -1.0
    since = (now_s - HELD_S) % 1.0
    return least * np.interp(since, [0, FALLS_S, FALLS_S + SLIPS_S, FALLS_S + SLIPS_S], [3, 0.92, 0.92, 3]) if now_s > HELD_S else 3 * least


@pytest.mark.parametrize('name', ['box', 'cylinder'])
def test_slip_and_wrench_are_those_of_the_engine(name):
    held = OBJECTS[name]
    world, pad, estimator = GraspWorld(held, (), 'force_taxels'), ForcePad(1), ForceTaxelsEstimator(Response(np.eye(3)))
    least, slips, wrenches = held.mass * GRASP.gravity / (2 * held.friction), [], []
    while world.time_s < END_S:
        if world.time_s > LIFT_S > world.time_s - 0.01:
            world.lift()
        forces, truth = world.advance(force_at(world.time_s, least))
        frame = simulated_frame(pad.shape, pad.read(forces), 0)
        result = estimator.process(frame.positions, frame.forces, frame.normals, 1 + world.time_s)
        if world.time_s > OPEN_S + 0.3 and truth.is_held:
            assert np.allclose(forces.sum(axis=0), truth.array_wrench[:3], atol=1e-6)
            slips.append((result.slip.slipping_fraction > 0.5, np.linalg.norm(truth.velocity) > GRASP.slip_speed))
            wrenches.append((result.wrench, truth.array_wrench))
    found, true = np.array(slips).T
    precision, recall = (np.count_nonzero(found & true) / max(np.count_nonzero(of), 1) for of in (found, true))
    estimated, known = np.array(wrenches).transpose(1, 0, 2)[..., :3]
    error = np.sqrt(np.sum((estimated - known)**2) / np.sum(known**2))
    print(f'{name}: slip precision {precision:.2f}, recall {recall:.2f}, force {100 * error:.1f} % RMS')
    assert np.count_nonzero(true) > 20 and error < 0.05
    assert precision > 0.35 and recall > 0.5  # many reports are 50 ms early, while the object is near the limit of friction
