# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_driver.simulation.skin.contact import FrictionalContact
from tactile_driver.simulation.skin.motion import Key, Motion
from tactile_driver.simulation.skin.sheet import Sheet
from tactile_driver.simulation.skin.tools import tool_named

TENSION, STRETCH, BENDING = 50.0, 1.3, 1e-4


@pytest.fixture(scope='module')
def sheet():
    return Sheet(0.060, 0.045, TENSION, STRETCH, BENDING, 41)


def pressed(sheet, *keys):
    """State, tool and pose after a ball has gone through keys."""
    motion = Motion(tool_named('ball_6mm'), list(keys), sheet)
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


def test_compliance_is_what_the_sheet_gives(sheet):
    near = np.array([400, 401, 760, 1200])
    for k, node in enumerate(near):
        force = np.zeros((39 * 39, 3))
        force[node, 1] = 1.0
        np.testing.assert_allclose(sheet.compliance_among(near)[:, k], sheet.give(force)[near, 1], rtol=2e-5)


def test_single_precision_is_exact_to_ten_nanometres_under_a_newton_on_a_node(sheet):
    force = np.zeros((39 * 39, 3))
    force[[400, 760]] = [[0.3, 0.0, -1.0], [-0.2, 0.4, -0.5]]
    wave = np.arange(1, 40)
    sines = np.sqrt(2 / 40) * np.sin(np.pi * np.outer(wave, wave) / 40)
    curve, dx, dy = 2 - 2 * np.cos(np.pi * wave / 40), 0.060 / 40, 0.045 / 40
    waves = curve[:, None] / dy**2 + curve / dx**2
    modes = np.einsum('ai,bj,abk->ijk', sines, sines, force.reshape(39, 39, 3)) / (dx * dy * waves * (TENSION + BENDING * waves))[..., None]
    exact = np.einsum('ai,bj,ijk->abk', sines, sines, modes).reshape(-1, 3)
    assert np.abs(exact).max() > 5e-3 and np.abs(sheet.give(force) - exact).max() < 1e-8
    near = np.array([1, 401, 760, 1200])
    np.testing.assert_allclose(sheet.give(force, near), exact[near], atol=1e-8)


def test_thinning_does_nothing_at_rest_and_is_the_slope_of_its_energy_elsewhere(sheet):
    assert np.abs(sheet.push_apart(sheet.rest)[1:-1, 1:-1]).max() < 1e-12
    rng = np.random.default_rng(2)
    shape, way = sheet.rest + rng.normal(0, 1e-4, sheet.rest.shape), rng.normal(0, 1e-8, sheet.rest.shape)

    def energy(x):
        sizes = 0.5 * np.linalg.norm(np.cross(x[1:, 1:] - x[:-1, :-1], x[1:, :-1] - x[:-1, 1:]), axis=-1)
        cell = 0.060 / 40 * 0.045 / 40
        return (0.5 * TENSION * STRETCH**-6 * cell**3 / sizes**2).sum()

    found = (energy(shape + way) - energy(shape - way)) / 2
    assert found == pytest.approx(-(sheet.push_apart(shape) * way).sum(), rel=1e-4)


def test_pressed_sheet_is_in_balance_and_lies_on_the_tip(sheet, deep):
    state, tool, pose = deep
    places = state.shape.reshape(-1, 3)[sheet.inner]
    force = np.zeros_like(places)
    force[state.touching] = state.force
    _, load = sheet.slack_at(state.shape, state.touching)
    off = sheet.slack + sheet.give(load + force) - places
    assert np.abs(off).max() < 2e-5
    assert -3.0 < state.force[:, 2].sum() < -0.5 and np.hypot(*state.force[:, :2].sum(axis=0)) < -0.1 * state.force[:, 2].sum()
    gap = tool.distance(pose.to_tool(places))
    assert gap.min() > -5e-6 and np.abs(gap[state.touching]).max() < 5e-6
    assert places[:, 2].min() == pytest.approx(-0.009, abs=1.5e-4) and state.pressure == 0


@pytest.mark.parametrize('depths', [(0.0, 0.009, 0.009), (0.0, 0.012, 0.006)])
def test_the_force_of_a_press_is_that_of_its_depth_however_large_the_steps(sheet, depths):
    """While it deepens, where it stops, and while it is lifted."""
    keys = [Key(k, press=depth) for k, depth in enumerate(depths)]
    motion, forces = Motion(tool_named('ball_6mm'), keys, sheet), []
    for count in (24, 240):
        contact, times = FrictionalContact(sheet, 0.0), np.linspace(0, 2, count + 1)
        steps = [contact.step(motion.tool, motion.pose(before), motion.pose(now)) for before, now in zip(times[:-1], times[1:])]
        forces.append([steps[at - 1].force[:, 2].sum() for at in (count * 5 // 12, count // 2, count)])
    np.testing.assert_allclose(*forces, rtol=5e-3)
    if depths[1] == depths[2]:
        assert forces[0][2] == pytest.approx(forces[0][1], rel=1e-3)


def test_material_is_drawn_towards_the_tip(sheet, deep):
    moved = (deep[0].shape - sheet.rest).reshape(-1, 3)
    toward = np.array([0.004, -0.003]) - sheet.rest.reshape(-1, 3)[:, :2]
    distance = np.linalg.norm(toward, axis=1)
    ring = (distance > 0.008) & (distance < 0.012)
    inward = (moved[ring, :2] * toward[ring]).sum(axis=1) / distance[ring]
    assert (inward > 0).mean() > 0.93 and 0.03e-3 < inward.mean() < 0.3e-3


def test_a_dragged_tip_pulls_the_sheet_along_up_to_the_friction(sheet):
    state, _, _ = pressed(sheet, Key(0, -0.008, 0, 0.0), Key(1, -0.008, 0, 0.006), Key(3, 0.008, 0, 0.006))
    along, _, down = state.force.sum(axis=0)
    assert 0.3 < along / -down < 0.5
