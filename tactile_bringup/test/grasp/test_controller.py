# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The grip force: first contact, slip, relaxation, limits, a lost sensor."""
import math

import pytest

from tactile_bringup.grasp.controller import GripController, GripLimits, Phase, Reading, slip_probability
from tactile_driver.errors import BadArgument

LIMITS = GripLimits()
STEP = 0.01


def held(limits=LIMITS):
    """A controller that holds since 0 s."""
    control = GripController(limits)
    control.close()
    control.take(Reading(0.0, 1.0, 0.0), 'array')
    return control


def run(control, seconds, slip=0.0, start=STEP):
    """Readings of one probability of slip; the commands."""
    return [control.take(Reading(start + k * STEP, 3.0, slip), 'array') for k in range(round(seconds / STEP))]


def test_it_closes_gently_until_it_touches_and_then_holds():
    control = GripController()
    assert control.take(Reading(0.0, 0.0, 0.0)) == 0.0, 'open'
    control.close()
    assert [control.take(Reading(STEP * k, force, math.nan)) for k, force in enumerate((0.0, 0.3, 0.6))] == [
        LIMITS.approach_force, LIMITS.approach_force, LIMITS.start_force]
    assert control.phase is Phase.HOLD


def test_slip_raises_the_force_at_once_and_again_while_it_is_reported():
    control = held()
    run(control, 0.1)
    before = control.force
    assert control.take(Reading(0.11, 3.0, 0.98), 'array') > 1.1 * before, 'in part: it is not sure yet'
    assert control.take(Reading(0.12, 3.0, 0.98), 'array') == pytest.approx(before * LIMITS.rise, rel=0.01)
    assert control.take(Reading(0.13, 3.0, 0.98), 'array') < before * LIMITS.rise**2 and control.rises == 1, 'it has not taken effect yet'
    control.take(Reading(0.17, 3.0, 0.98), 'array')
    assert control.take(Reading(0.18, 3.0, 0.98), 'array') == pytest.approx(before * LIMITS.rise**2, rel=0.02)
    assert control.rises == 2


@pytest.mark.parametrize('step', [0.01, 0.02])
def test_single_reports_of_slip_have_no_lasting_effect_and_weak_evidence_adds_up(step):
    control = held()
    run(control, 0.1)
    before = control.force
    for k in range(20):
        control.take(Reading(0.1 + step * (k + 1), 3.0, 0.98 if k % 5 == 0 else 0.05), 'array')
    assert control.rises == 0 and control.force < 1.01 * before
    for k in range(4):
        control.take(Reading(0.1 + step * (k + 21), 3.0, 0.85), 'array')
    assert control.rises == 1 and control.force > 1.5 * before


def test_it_relaxes_to_the_margin_over_the_force_that_slipped():
    control = held(GripLimits(margin=1.5))
    before = run(control, 1.0)[-1]
    assert before == pytest.approx(LIMITS.start_force * (1 - LIMITS.relaxation * STEP)**100)
    control.take(Reading(1.02, 3.0, 1.0), 'array')
    slipped = control.slipped_at
    assert run(control, 30.0, start=1.03)[-1] == pytest.approx(1.5 * slipped)


def test_without_slip_it_relaxes_to_the_smallest_force():
    assert run(held(), 120.0)[-1] == LIMITS.min_force


def test_the_force_never_leaves_its_limits():
    limits = GripLimits(max_force=5.0)
    assert max(run(held(limits), 5.0, slip=1.0)) == 5.0


@pytest.mark.parametrize('slip', [0.0, 0.2, math.nan])
def test_slip_that_is_not_probable_or_not_stated_raises_nothing(slip):
    assert max(run(held(), 1.0, slip)) <= 1.1 * LIMITS.start_force


def test_a_sensor_that_cannot_tell_slip_from_none_is_held_firmly():
    control = held()
    assert run(control, 1.0, 0.5) == [LIMITS.blind_force] * 100
    assert run(control, 1.0, 0.0, start=2.0)[-1] < LIMITS.blind_force, 'relaxes when slip is certain again'


def test_a_lost_sensor_keeps_the_last_force_and_comes_back():
    control = held()
    force = run(control, 0.5)[-1]
    assert control.wait(0.55) == force and control.phase is Phase.HOLD
    assert control.wait(0.75) == force and control.phase is Phase.SENSOR_LOST
    assert control.wait(60.0) == force
    assert control.take(Reading(60.0, 3.0, 0.0), 'array') == force and control.phase is Phase.HOLD, 'nothing was relaxed while it was blind'


def test_it_lets_go():
    control = held()
    control.open()
    assert control.force == 0.0 and control.take(Reading(1.0, 3.0, 1.0)) == 0.0


def test_limits_that_change_hold_at_once():
    control = held()
    control.change(max_force=2.0, start_force=1.0)
    assert control.force == 2.0


@pytest.mark.parametrize('wrong', [{'max_force': 1.0}, {'min_force': 0.0}, {'rise': 1.0}, {'margin': 0.9}, {'relaxation': 1.0},
                                   {'timeout': 0.0}, {'approach_force': 30.0}, {'slip_probability': 1.0}])
def test_limits_that_contradict_each_other_are_refused(wrong):
    with pytest.raises(BadArgument, match='^grip: '):
        GripLimits(**wrong)


def load(control, shear, seconds, start=STEP, slipping=0.0, sensor='touchpad'):
    """Readings of a sensor that measures the shear; the last command."""
    for k in range(round(seconds / STEP)):
        time_s = start + k * STEP
        control.take(Reading(time_s, 3.0, 0.05), 'array')
        control.take(Reading(time_s, control.force, 0.05, shear, slipping), sensor)
    return control.force


def test_where_the_shear_is_measured_the_force_follows_load_and_friction():
    control = held()
    light = load(control, 0.5, 10.0)
    assert light == pytest.approx(LIMITS.margin * 0.5 / control.friction.cautious, rel=0.01) and light > 0.5
    assert load(control, 1.5, STEP, start=10.1) == pytest.approx(LIMITS.margin * 1.5 / control.friction.cautious, rel=0.1), 'at once'


def test_what_sticks_at_a_smaller_force_allows_a_smaller_force():
    limits = GripLimits(margin=1.5)
    assert load(held(limits), 0.5, 20.0) < load(held(limits), 0.5, 1.5)


def test_slip_is_believed_of_any_sensor_and_ignorance_of_all():
    control = held()
    control.take(Reading(0.2, 3.0, 0.5), 'array')
    assert control.force == LIMITS.blind_force
    control = held()
    control.take(Reading(0.2, 3.0, 0.05, 0.1, 0.0), 'touchpad')
    before = control.take(Reading(0.2, 3.0, 0.5), 'array')
    assert before <= 1.01 * LIMITS.start_force, 'the other knows'
    control.take(Reading(0.22, 3.0, 0.98, 0.1, 1.0), 'touchpad')
    assert control.take(Reading(0.24, 3.0, 0.98, 0.1, 1.0), 'touchpad') == pytest.approx(before * LIMITS.rise, rel=0.02)


def test_one_lost_sensor_of_two_is_named_and_the_other_holds():
    control = held()
    load(control, 0.5, 1.0)
    for k in range(50):
        control.take(Reading(1.1 + k * STEP, 3.0, 0.05), 'array')
    assert control.lost == ('touchpad',) and control.phase is Phase.HOLD
    assert math.isnan(control.needed_force), 'the load is unknown again'


def test_a_sensor_that_has_sent_nothing_yet_is_lost():
    control = GripController(LIMITS, ['array', 'touchpad'])
    assert control.lost == ('array', 'touchpad')
    control.take(Reading(0.0, 0.0, 0.05), 'array')
    assert control.lost == ('touchpad',)
    control.take(Reading(0.01, 0.0, 0.05, 0.0, 0.0), 'touchpad')
    assert control.lost == ()


@pytest.mark.parametrize(('state', 'confidence', 'expected'), [(0, 0.9, 0.1), (1, 0.9, 0.9), (2, 0.7, 0.7)])
def test_the_probability_of_slip_of_a_state(state, confidence, expected):
    assert slip_probability(state, confidence) == pytest.approx(expected)
    assert math.isnan(slip_probability(state, math.nan))


@pytest.mark.parametrize(('state', 'expected'), [(0, 0.1), (1, 0.1), (2, 0.9)])
def test_a_contact_that_slips_in_part_does_not_move(state, expected):
    assert slip_probability(state, 0.9, partial=False) == pytest.approx(expected)
