# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The coefficient of friction from what sticks and what slips."""
import math

import numpy as np
import pytest

from tactile_bringup.grasp.friction import FrictionEstimate, load_share


def slipping_part(load):
    """Cattaneo and Mindlin, solved for the area that slips: independent of what the estimate computes."""
    return 1.0 - (1.0 - load)**(2 / 3)


@pytest.mark.parametrize('load', [0.1, 0.5, 0.9, 1.0])
def test_the_load_at_which_a_part_of_the_contact_slips(load):
    assert load_share(slipping_part(load)) == pytest.approx(load)


@pytest.mark.parametrize('true', [0.2, 0.6, 1.2])
def test_partial_slip_at_growing_load_shows_the_coefficient(true):
    friction = FrictionEstimate()
    for load in np.linspace(0.05, 0.7, 30):
        friction.add(2.0, 2.0 * true * load, slipping_part(load))
    assert abs(friction.value - true) < 2 * friction.error and friction.value == pytest.approx(true, rel=0.25)
    assert friction.error < 0.35 * true < FrictionEstimate().error * true / 0.5, 'it knows more than before'
    assert friction.cautious < friction.value


def test_a_contact_that_sticks_has_more_friction_than_it_uses():
    friction = FrictionEstimate()
    before = friction.value
    friction.add(1.0, 0.9, 0.0)
    assert friction.cautious > 0.85 and friction.value > before
    friction.add(1.0, 0.1, 0.0)
    assert friction.cautious > 0.85, 'a smaller load says nothing new'


def test_slip_at_a_load_that_was_passed_before_shows_nothing():
    friction = FrictionEstimate()
    friction.add(1.0, 0.5, 0.6)
    known = friction.value
    friction.add(1.0, 0.2, 0.9)  # the border has slipped already
    assert friction.value == known


@pytest.mark.parametrize('unknown', [(math.nan, 1.0, 0.5), (1.0, math.nan, 0.5), (1.0, 1.0, math.nan), (0.1, 0.3, 0.9), (0.0, 0.0, 0.0)])
def test_what_is_unknown_or_within_the_noise_changes_nothing(unknown):
    friction = FrictionEstimate()
    before = friction.value, friction.error
    friction.add(*unknown)
    assert (friction.value, friction.error) == before


def test_another_object_begins_anew():
    friction = FrictionEstimate()
    before = friction.value
    friction.add(1.0, 0.9, 0.0)
    friction.reset()
    assert friction.value == before
