# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.touch.estimate import TouchEstimate
from tactile_perception.touch.spread import held_out_spread


class Off:
    """Always tells the same place and depth."""

    def estimate(self, field):
        return [TouchEstimate(np.array([1e-3, 0.0, -2e-3]), 2e-3, np.eye(3), 0.0)]


def test_the_spread_is_that_of_the_places_left_out(bell_presses):
    presses = bell_presses([(0, 0), (0, 0.002), (0, -0.002)], depths=(1e-3, 3e-3))
    place, depth = held_out_spread(lambda some: Off(), presses)
    assert depth == pytest.approx(1e-3)
    assert place == pytest.approx(np.sqrt((3 * 1e-6 + 2 * 4e-6) / 6))


def test_one_place_tells_no_spread(bell_presses):
    assert np.isnan(held_out_spread(lambda some: Off(), bell_presses([(0, 0)]))).all()
