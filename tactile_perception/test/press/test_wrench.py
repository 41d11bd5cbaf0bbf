# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from types import SimpleNamespace

import numpy as np
import pytest
from tactile_perception.errors import BadCalibration
from tactile_perception.press.presses import Presses
from tactile_perception.press.estimate import TouchEstimate
from tactile_perception.press.wrench import fit_stiffness

STIFFNESS = 80.0  # N/m


class Model:
    """A method that knows each wrench over the stiffness, with small errors; of a field without a wrench it finds nothing."""

    def estimate(self, field):
        if field.wrench is None:
            return []
        wrench = field.wrench / STIFFNESS * (1 + 0.01 * np.sin(1e5 * field.wrench[0]))
        return [TouchEstimate(np.zeros(3), 1e-3, 1e-8 * np.eye(3), 1e-4, wrench=wrench)]


def recording(count, blind=0):
    rng = np.random.default_rng(3)
    wrench = np.column_stack([rng.normal(0, 0.1, (count, 2)), -rng.uniform(0.5, 2, count), rng.normal(0, 1e-3, (count, 3))])
    fields = tuple(SimpleNamespace(wrench=None if k < blind else row) for k, row in enumerate(wrench))
    depth, nan = rng.uniform(1e-3, 5e-3, count), np.full(count, np.nan)
    return Presses(fields, np.column_stack([np.zeros((count, 2)), -depth]), depth, np.arange(count), wrench, nan)


def test_the_stiffness_is_found_with_the_errors_at_the_presses():
    stiffness, errors = fit_stiffness(recording(30, blind=5), Model())
    assert stiffness == pytest.approx(STIFFNESS, rel=0.01)
    assert 0 < errors['force'] < 0.02 and 0 < errors['moment'] < 0.02


def test_too_few_presses_with_an_estimated_wrench_are_refused():
    with pytest.raises(BadCalibration, match='5 presses .* too few'):
        fit_stiffness(recording(20, blind=15), Model())
