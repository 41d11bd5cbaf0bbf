# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contacts with other noises and constants: errors grow as the noise does."""
from contextlib import ExitStack

import numpy as np
import pytest
from changed_constants import changed
from press_scenes import OnDome, OnSheet, results

from tactile_perception.press.constants import DOME, PRESS, SHEET


def right(surface, noise=1.0):
    """Share of random scenes in which all contacts are reported within three standard deviations."""
    counted, _, _, chi_squares = results(surface, noise)
    return np.mean(counted) - np.sum(chi_squares > 18) / len(counted)


@pytest.mark.full  # simulates a small dome
@pytest.mark.parametrize('seed', range(4))
@pytest.mark.parametrize('surface, names', [
    (OnSheet, 'tip stands_out sure ordinary strange unexplained unseen floor dragged radius apart'),
    (OnDome, 'alike stands_out quieter sure faint ordinary unexplained not_linear added scaled apart')])
def test_results_hold_with_halved_and_doubled_constants(surface, names, seed):
    """All constants of the decisions change at once, each by a factor between 0.5 and 2."""
    def other(value):
        return tuple(map(other, value)) if isinstance(value, tuple) else value * 2**draw.uniform(-1, 1)

    draw, own = np.random.default_rng(seed), SHEET if surface is OnSheet else DOME
    with ExitStack() as stack:
        for constants, some in ((own, names), (PRESS, 'values_per_error dragged_odds two_odds')):
            stack.enter_context(changed(constants, **{name: other(getattr(constants, name)) for name in some.split()}))
        assert right(surface()) > 0.8


@pytest.mark.full  # simulates a small dome
@pytest.mark.parametrize('surface', [OnSheet, OnDome])
def test_errors_grow_with_three_times_the_noise(surface):
    assert right(surface(), 3.0) > 0.8
