# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Skins, tools and their contact, against elasticity, balance and friction."""

import numpy as np
import pytest

from tactile_driver.simulation.skin.contact import FrictionalContact
from tactile_driver.simulation.skin.surfaces import Membrane, Rubber, Sheet
from tactile_driver.simulation.skin.tools import TOOLS, Key, Motion, attitude


@pytest.fixture(scope='module')
def membrane():
    return Membrane(nodes=33)


def test_volume_area_and_pressure_are_the_cap_s(membrane):
    assert membrane.volume == pytest.approx(np.pi * 0.013**2 * (0.060 - 0.013) / 3, rel=0.005)
    assert np.linalg.norm(membrane.area_vectors(membrane.rest), axis=1).sum() == pytest.approx(2 * np.pi * 0.020 * 0.013, rel=0.005)
    assert membrane.pressure == pytest.approx(2 * 32 / 0.020)
    lift = membrane.area_vectors(membrane.rest).sum(axis=0)
    assert lift == pytest.approx([0, 0, np.pi * (0.020**2 - 0.007**2)], abs=1e-5)


def test_rest_is_in_balance(membrane):
    positions = membrane.slack + membrane.give(membrane.pressure * membrane.area_vectors(membrane.rest)[membrane.inner])
    np.testing.assert_allclose(membrane.with_rim(positions), membrane.rest, atol=1e-15)


TENSION, STRETCH, BENDING = 50.0, 1.3, 1e-4


@pytest.fixture(scope='module')
def sheet():
    return Sheet(0.060, 0.045, Rubber(TENSION, STRETCH, BENDING), 41)


def pressed(sheet, *keys):
    """State, tool and pose after a ball has gone through keys."""
    motion = Motion(TOOLS['ball_6mm'], list(keys), sheet)
    contact = FrictionalContact(sheet, 0.4)
    times = np.linspace(keys[0].t, keys[-1].t, 31)
    for before, now in zip(times[:-1], times[1:]):
        state = contact.step(motion.tool, motion.pose(before), motion.pose(now))
    return state, motion.tool, motion.pose(times[-1])


@pytest.fixture(scope='module')
def deep(sheet):
    return pressed(sheet, Key(0, 0.004, -0.003, 0.0), Key(1, 0.004, -0.003, 0.009))


def test_even_load_bends_the_sheet_as_the_series_of_sines_says(sheet):
    load, cell = 200.0, 0.060 / 40 * 0.045 / 40
    force = np.zeros((39 * 39, 3))
    force[:, 2] = load * cell
    odd = np.arange(1, 60, 2)
    p, q = np.meshgrid(np.pi * odd / 0.060, np.pi * odd / 0.045)
    wave = p**2 + q**2
    signs = np.sin(np.outer(odd, [np.pi / 2])).ravel()
    middle = (16 * load / (np.pi**2 * np.outer(odd, odd)) * np.outer(signs, signs) / (TENSION * wave + BENDING * wave**2)).sum()
    assert sheet.give(force).reshape(39, 39, 3)[19, 19, 2] == pytest.approx(middle, rel=2e-3)


def test_pressed_sheet_is_in_balance_and_lies_on_the_tip(sheet, deep):
    state, tool, pose = deep
    positions = state.shape.reshape(-1, 3)[sheet.inner]
    force = np.zeros_like(positions)
    force[state.touching] = state.force
    _, load = sheet.slack_at(state.shape, state.touching)
    off = sheet.slack + sheet.give(load + force) - positions
    assert np.abs(off).max() < 2e-5
    assert -3.0 < state.force[:, 2].sum() < -0.5 and np.hypot(*state.force[:, :2].sum(axis=0)) < -0.1 * state.force[:, 2].sum()
    gap = tool.distance(pose.to_tool(positions))
    assert gap.min() > -5e-6 and np.abs(gap[state.touching]).max() < 5e-6
    assert positions[:, 2].min() == pytest.approx(-0.009, abs=1.5e-4) and state.pressure == 0


def test_a_thick_sheet_bends_to_a_bell_and_draws_nothing_inwards():
    length, foundation = 6.8e-3, 0.9e6  # m, N/m^3
    sheet = Sheet(0.090, 0.080, Rubber(0.0, np.inf, foundation * length**4, foundation), 61)
    motion = Motion(TOOLS['ball_5mm'], [Key(0, 0.0, 0.0, 0.0), Key(1, 0.0, 0.0, 0.0005)], sheet)
    contact = FrictionalContact(sheet, 0.4)
    for k in range(5):
        state = contact.step(motion.tool, motion.pose(k / 5), motion.pose((k + 1) / 5))
    middle = state.shape[30]
    assert -middle[:, 2].min() == pytest.approx(0.0005, abs=2e-5)
    # Under a point load P a plate on a foundation sinks by P / (8 sqrt(k D)), to half of it at 1.3 lengths.
    assert -state.force[:, 2].sum() == pytest.approx(8 * foundation * length**2 * 0.0005, rel=0.1)
    assert np.interp(-0.00025, middle[30:, 2], middle[30:, 0]) == pytest.approx(1.3 * length, rel=0.08)
    assert np.abs(state.shape - sheet.rest)[..., :2].max() < 5e-6


@pytest.mark.full
@pytest.mark.parametrize('depths', [(0.0, 0.009, 0.009), (0.0, 0.012, 0.006)])
def test_the_force_of_a_press_is_that_of_its_depth_however_large_the_steps(sheet, depths):
    """While it deepens, where it stops, and while it is lifted."""
    keys = [Key(k, press=depth) for k, depth in enumerate(depths)]
    motion, forces = Motion(TOOLS['ball_6mm'], keys, sheet), []
    for count in (24, 240):
        contact, times = FrictionalContact(sheet, 0.0), np.linspace(0, 2, count + 1)
        steps = [contact.step(motion.tool, motion.pose(before), motion.pose(now)) for before, now in zip(times[:-1], times[1:])]
        forces.append([steps[at - 1].force[:, 2].sum() for at in (count * 5 // 12, count // 2, count)])
    np.testing.assert_allclose(*forces, rtol=5e-3)
    if depths[1] == depths[2]:
        assert forces[0][2] == pytest.approx(forces[0][1], rel=1e-3)


@pytest.mark.parametrize('name', sorted(TOOLS))
def test_distance_grows_by_one_along_its_slope_outside(name):
    tool = TOOLS[name]
    positions = np.random.default_rng(2).uniform(-0.012, 0.012, (300, 3))
    distance, normal = tool.distance_and_normal(positions)
    nearest = np.sort(np.vstack([tool.part_distances(positions), np.full(len(positions), np.inf)]), axis=0)
    outside = (distance > 1e-4) & (nearest[1] - nearest[0] > 3e-4)  # two balls' distance has a crease between them
    np.testing.assert_allclose(tool.distance(positions + 1e-4 * normal)[outside], distance[outside] + 1e-4, atol=2e-6)


@pytest.fixture(scope='module')
def coarse():
    return Membrane(nodes=13)


@pytest.mark.parametrize('name, x, height', [('rectangle', 0, 0.013), ('disc', 0.002, 0.013), ('sphere', 0, 0.021),
                                             ('sphere', 0.006, np.sqrt(0.028**2 - 0.006**2) - 0.007),
                                             ('ring', 0, np.sqrt(0.0205**2 - 0.005**2) - 0.007 - 0.0005)])
def test_touching_height_is_where_the_tool_meets_the_cap(coarse, name, x, height):
    found = coarse.touching_height(TOOLS[name].distance, np.eye(3), x, 0.0)
    assert found == pytest.approx(height, abs=1e-7)


def test_a_tilted_face_touches_off_its_middle(coarse):
    flat = coarse.touching_height(TOOLS['disc'].distance, np.eye(3), 0, 0)
    tilted = coarse.touching_height(TOOLS['disc'].distance, attitude(0, 0, 0.1), 0, 0)
    # the face's plane touches the ball where the ball's normal is the face's
    assert tilted - flat == pytest.approx(coarse.radius * (1 / np.cos(0.1) - 1), abs=1e-7)


FRICTION = 0.4


@pytest.fixture(scope='module')
def dome():
    return Membrane(nodes=41)


def play(dome, name, keys, until, rate=30):
    """The contact after the tool has gone through keys until a time, and the last pose."""
    motion = Motion(TOOLS[name], keys, dome)
    contact = FrictionalContact(dome, FRICTION)
    times = np.arange(keys[0].t, until + 1e-9, 1 / rate)
    for before, now in zip(times[:-1], times[1:]):
        contact.step(motion.tool, motion.pose(before), motion.pose(now))
    return contact, motion.tool, motion.pose(times[-1])


def out_of_balance(dome, state):
    """(m, 3) N left over at the inner nodes."""
    positions = state.shape.reshape(-1, 3)[dome.inner]
    pull = dome.springs[:, dome.inner] @ (positions - dome.slack)
    left = pull - state.pressure * dome.area_vectors(state.shape)[dome.inner]
    left[state.touching] -= state.force
    return left


def test_pressed_block_is_in_balance_keeps_the_volume_and_touches_the_face(dome):
    contact, tool, pose = play(dome, 'rectangle', [Key(0, press=0), Key(0.6, press=0.003), Key(0.8, press=0.003)], 0.8)
    state = contact.state
    force = state.force.sum(axis=0)
    assert -1.2 < force[2] < -0.4 and np.abs(force[:2]).max() < 1e-3
    assert np.abs(out_of_balance(dome, state).sum(axis=0)).max() < 0.003 * abs(force[2])
    assert dome.volume_of(state.shape) == pytest.approx(dome.volume, rel=1e-4)
    assert state.pressure > 1.15 * dome.pressure
    gap = tool.distance(pose.to_tool(state.shape.reshape(-1, 3)[dome.inner]))
    assert np.abs(gap[state.touching]).max() < 5e-6 and gap.min() > -5e-6


def test_an_oblique_press_in_one_step_is_that_in_many(dome):
    keys = [Key(0, x=0.01, press=0), Key(0.1, x=0.01, press=0.002)]
    one, many = (play(dome, 'sphere', keys, 0.1, rate)[0].state for rate in (10, 300))
    moved = [(state.shape - dome.rest).reshape(-1, 3)[dome.inner][many.touching].mean(axis=0) for state in (one, many)]
    assert moved[1][2] < -1.5e-3 and np.abs(moved[0] - moved[1]).max() < 5e-5
    np.testing.assert_allclose(one.force.sum(axis=0)[[0, 2]], many.force.sum(axis=0)[[0, 2]], rtol=0.15)


def test_friction_cone_holds_and_a_long_drag_reaches_it_everywhere(dome):
    keys = [Key(0, press=0), Key(0.5, press=0.003), Key(2.5, x=0.007, press=0.003)]
    contact, tool, pose = play(dome, 'rectangle', keys, 2.2)
    state = contact.state
    _, normal = tool.distance_and_normal(pose.to_tool(state.shape.reshape(-1, 3)[dome.inner][state.touching]))
    push = (state.force * (normal @ pose.turn.T)).sum(axis=1)
    along = np.linalg.norm(state.force - push[:, None] * (normal @ pose.turn.T), axis=1)
    assert (push > 0).all()
    assert (along <= FRICTION * push * 1.02 + 1e-6).all()
    assert state.force.sum(axis=0)[0] > 0.9 * FRICTION * -state.force.sum(axis=0)[2] * 0.85


def test_released_skin_returns_to_rest(dome):
    keys = [Key(0, press=0), Key(0.4, press=0.003), Key(0.8, x=0.004, press=0.003), Key(1.2, x=0.004, press=-0.002)]
    contact, _, _ = play(dome, 'sphere', keys, 1.2)
    np.testing.assert_array_equal(contact.state.shape, dome.rest)
    assert contact.state.pressure == dome.pressure
