# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_driver.simulation.skin.contact import FrictionalContact
from tactile_driver.simulation.skin.dome import Membrane
from tactile_driver.simulation.skin.motion import Key, Motion
from tactile_driver.simulation.skin.tools import tool_named

FRICTION = 0.4


@pytest.fixture(scope='module')
def membrane():
    return Membrane(nodes=41)


def play(membrane, name, keys, until, rate=30):
    """The contact after the tool has gone through keys until a time, and the last pose."""
    motion = Motion(tool_named(name), keys, membrane)
    contact = FrictionalContact(membrane, FRICTION)
    times = np.arange(keys[0].t, until + 1e-9, 1 / rate)
    for before, now in zip(times[:-1], times[1:]):
        contact.step(motion.tool, motion.pose(before), motion.pose(now))
    return contact, motion.tool, motion.pose(times[-1])


def out_of_balance(membrane, state):
    """(m, 3) N left over at the inner nodes."""
    places = state.shape.reshape(-1, 3)[membrane.inner]
    pull = membrane.springs[:, membrane.inner] @ (places - membrane.slack)
    left = pull - state.pressure * membrane.area_vectors(state.shape)[membrane.inner]
    left[state.touching] -= state.force
    return left


def test_pressed_block_is_in_balance_keeps_the_volume_and_touches_the_face(membrane):
    contact, tool, pose = play(membrane, 'rectangle', [Key(0, press=0), Key(0.6, press=0.003), Key(0.8, press=0.003)], 0.8)
    state = contact.state
    force = state.force.sum(axis=0)
    assert -1.2 < force[2] < -0.4 and np.abs(force[:2]).max() < 1e-3
    assert np.abs(out_of_balance(membrane, state).sum(axis=0)).max() < 0.003 * abs(force[2])
    assert membrane.volume_of(state.shape) == pytest.approx(membrane.volume, rel=1e-4)
    assert state.pressure > 1.15 * membrane.pressure
    gap = tool.distance(pose.to_tool(state.shape.reshape(-1, 3)[membrane.inner]))
    assert np.abs(gap[state.touching]).max() < 5e-6 and gap.min() > -5e-6


def test_an_oblique_press_in_one_step_is_that_in_many(membrane):
    keys = [Key(0, x=0.01, press=0), Key(0.1, x=0.01, press=0.002)]
    one, many = (play(membrane, 'sphere', keys, 0.1, rate)[0].state for rate in (10, 300))
    moved = [(state.shape - membrane.rest).reshape(-1, 3)[membrane.inner][many.touching].mean(axis=0) for state in (one, many)]
    assert moved[1][2] < -1.5e-3 and np.abs(moved[0] - moved[1]).max() < 5e-5
    np.testing.assert_allclose(one.force.sum(axis=0)[[0, 2]], many.force.sum(axis=0)[[0, 2]], rtol=0.15)


def test_friction_cone_holds_and_a_long_drag_reaches_it_everywhere(membrane):
    keys = [Key(0, press=0), Key(0.5, press=0.003), Key(2.5, x=0.007, press=0.003)]
    contact, tool, pose = play(membrane, 'rectangle', keys, 2.2)
    state = contact.state
    _, normal = tool.distance_and_normal(pose.to_tool(state.shape.reshape(-1, 3)[membrane.inner][state.touching]))
    push = (state.force * (normal @ pose.turn.T)).sum(axis=1)
    along = np.linalg.norm(state.force - push[:, None] * (normal @ pose.turn.T), axis=1)
    assert (push > 0).all()
    assert (along <= FRICTION * push * 1.02 + 1e-6).all()
    assert state.force.sum(axis=0)[0] > 0.9 * FRICTION * -state.force.sum(axis=0)[2] * 0.85


def test_a_short_drag_sticks(membrane):
    keys = [Key(0, press=0), Key(0.5, press=0.003), Key(1.5, x=0.0004, press=0.003)]
    contact, tool, pose = play(membrane, 'rectangle', keys, 0.9)
    first = contact.state.shape.reshape(-1, 3)[membrane.inner]
    middle = contact.state.touching[np.linalg.norm(first[contact.state.touching, :2], axis=1) < 0.003]
    later, _, _ = play(membrane, 'rectangle', keys, 1.4)
    moved = later.state.shape.reshape(-1, 3)[membrane.inner][middle] - first[middle]
    motion = Motion(tool, keys, membrane)
    way = motion.pose(42 / 30).origin[0] - motion.pose(27 / 30).origin[0]
    np.testing.assert_allclose(moved[:, 0], way, atol=3e-6)


def test_released_skin_returns_to_rest(membrane):
    keys = [Key(0, press=0), Key(0.4, press=0.003), Key(0.8, x=0.004, press=0.003), Key(1.2, x=0.004, press=-0.002)]
    contact, _, _ = play(membrane, 'sphere', keys, 1.2)
    np.testing.assert_array_equal(contact.state.shape, membrane.rest)
    assert contact.state.pressure == membrane.pressure
