# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.taxel.direction import ContinuousDirection


def test_no_jumps_by_half_turns():
    direction = ContinuousDirection()
    true = np.linspace(0, 7, 50)
    folded = (true + np.pi / 2) % np.pi - np.pi / 2
    assert [direction.process(angle) for angle in folded] == pytest.approx(true.tolist())


def test_a_frame_without_direction_is_bridged_and_reset_forgets():
    direction = ContinuousDirection()
    direction.process(1.5)
    assert np.isnan(direction.process(np.nan))
    assert direction.process(-1.5) == pytest.approx(np.pi - 1.5)
    direction.reset()
    assert direction.process(-1.5) == -1.5
