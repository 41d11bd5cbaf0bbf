# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""States of dots, frame by frame, against NumPy with stacked equations."""
from dataclasses import dataclass

import numpy as np
import pytest
import stick_slip_reference as reference
from tactile_perception.touchpad.contact.stick_slip import StickSlipTracker

ORIGIN, SIDE = np.array([0.0, 0.0, -0.04]), 17
ROW, COLUMN = np.divmod(np.arange(SIDE**2), SIDE)


@dataclass
class Loads:
    xyz: np.ndarray
    seen: np.ndarray
    normal: np.ndarray
    force: np.ndarray


def frames(seed):
    """Loads and scores of two objects that stick, slip in part, slip, rest, merge and go, frame by frame."""
    rng = np.random.default_rng(seed)
    xyz = np.column_stack([(COLUMN - 8) * 1.4e-3, (ROW - 8) * 1.4e-3, 0.0105 - 2e-6 * ((COLUMN - 8)**2 + (ROW - 8)**2)])
    rays = (xyz - ORIGIN) / np.linalg.norm(xyz - ORIGIN, axis=1, keepdims=True)
    normal = rng.normal((0, 0, 1), (0.1, 0.1, 0), (SIDE**2, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    way = rng.normal(size=(2, 3)) * [120e-6, 120e-6, 50e-6]
    for frame in range(30):
        far = 5 - frame // 12  # the objects come together
        objects = [np.hypot(ROW - 8, COLUMN - 8 + side * far) for side in (-1, 1)]
        found = objects[1 - frame % 2] if frame in (10, 21) else np.minimum(*objects)  # in two frames only one of them is found
        score = np.clip(0.5 + 3.4 - found, 0, 1) if frame not in (0, 25) else np.zeros(SIDE**2)
        which = (objects[1] < objects[0]).astype(int)
        carried = np.clip(rng.uniform(0.6, 1.4, SIDE**2) - max(0, frame - 5) / 8 * (COLUMN % 5 > 1), 0.05, 1) * (frame % 11 < 9)
        xyz = xyz + (score > 0.5)[:, None] * carried[:, None].round(1) * way[which] * (1 if which.any() else -1)
        ratio = np.minimum(0.1 * (frame % 12) * (2 - carried), 0.6)
        force = (score > 0.5)[:, None] * 6e-3 * (ratio[:, None] * way[which] / np.linalg.norm(way[which], axis=1, keepdims=True) - normal)
        noise = rng.normal(size=xyz.shape) * 1e-6 + rays * rng.normal(size=(SIDE**2, 1)) * 10e-6
        yield Loads(xyz + noise, rng.random(SIDE**2) < 0.98, normal, force + rng.normal(size=force.shape) * 2e-4), score


@pytest.mark.parametrize('seed', range(12))
def test_states_and_what_is_learnt_are_the_references(seed):
    ours, theirs = StickSlipTracker(SIDE, SIDE, ORIGIN), reference.StickSlipTracker(SIDE, SIDE, ORIGIN)
    kinds = set()
    for loads, score in frames(seed):
        found, expected = ours.update(loads, score), theirs.update(loads, score)
        np.testing.assert_array_equal(found, expected)
        kinds |= set(found.tolist())
        assert ours.noise == pytest.approx(theirs.noise, rel=1e-9)
        assert ours.depth_noise == pytest.approx(theirs.depth_noise, rel=1e-6)
        assert ours.friction == pytest.approx(theirs.friction, rel=1e-6, nan_ok=True)
    assert kinds == {0, 1, 2}
