# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The dome model: method and library."""
import dataclasses
from itertools import product

import numpy as np
import pytest
from changed_constants import changed
from dome_library import EYES, MATERIAL, MESH, PLAN, POINTS, evaluate, inverse, library_field, press, small_library
from dome_scenes import DOME, EYE, markers, seen

from tactile_perception.common.marker_sensor import first_touch_height
from tactile_perception.core.errors import BadArgument, BadCalibration
from tactile_perception.press import constants
from tactile_perception.press.calibration import restored, stored
from tactile_perception.press.dome.library import AsSeen
from tactile_perception.press.dome.mechanics import DomeMaterial, DomeMesh, MeshPlan, appear_at, outlines, press_dome, shift_of
from tactile_perception.press.dome.model import DEPTH, DomeCalibration, DomeModelMethod, FieldNoise
from tactile_perception.press.estimate import OUT_OF_RANGE

pytestmark = pytest.mark.full  # simulates a small library


@pytest.fixture(scope='module')
def calibration():
    return DomeCalibration(small_library(), seen(markers()), EYES, FieldNoise(1.5e-5, 0.003, 0.002), 1e-4, 0.01, 1.0, 1.0,
                           1.0, 0.0, 0.035, 0.08, 1.0)


def touch_height(one):
    """Height, m, of the tip of a press at first contact."""
    return first_touch_height(one[:2], PLAN.radius * np.exp(constants.DOME.radius_spread * one[3]), DOME)[0]


@pytest.fixture
def method(calibration):
    return DomeModelMethod(calibration, DOME)


def test_straight_and_dragged_presses_of_any_tip_are_one_contact(method):
    for k, one in enumerate((press(0.02, 0.01, 0.02), press(-0.03, 0.02, 0.012, 0.5, 0.2), press(0.0, 0.0, 0.03, -0.4),
                             press(0.03, -0.03, 0.025, drag=(0.5, 0.1)), press(-0.02, 0.0, 0.02, 0.3, drag=(0.0, -0.6)))):
        assert method.estimate(library_field(seed=k)) == []  # the touch before is over
        touch, = method.estimate(library_field(one, seed=k))
        position, height = one[:2] + np.exp(one[2]) * one[5:], touch_height(one) - np.exp(one[2])
        assert np.hypot(*(touch.position[:2] - position)) < 2e-3 and touch.position[2] == pytest.approx(height, abs=1.5e-3)
        assert touch.depth == pytest.approx(first_touch_height(touch.position[:2], touch.radius, DOME)[0] - touch.position[2], abs=1e-9)
        assert touch.position[2] < DOME.height and 0.01 < touch.radius < 0.06 and not touch.flags


def test_the_force_of_one_press_acts_at_the_tip(method):
    one = press(0.03, 0.02, 0.02)
    touch, = method.estimate(library_field(one))
    force, moment = touch.wrench[:3], touch.wrench[3:]
    assert np.allclose(force, small_library().push(one), atol=0.02 * abs(force[2])) and force[2] < 0
    axis = np.cross(force, moment) / (force @ force)  # of the points on the line of action, the nearest to the origin
    direction = force / np.linalg.norm(force)
    tip = touch.position + [0.0, 0.0, touch.radius]
    assert np.linalg.norm(np.cross(tip - axis, direction)) < touch.radius and abs(force @ moment) < 1e-9


def test_two_presses_are_separated_and_tracked(method):
    for depth in (0.012, 0.016, 0.02):
        touches = method.estimate(library_field(press(0.045, 0.02, depth), press(-0.04, -0.01, depth)))
        assert np.isnan([touch.wrench for touch in touches]).all()
        assert sorted(np.sign(touch.position[0]) for touch in touches) == [-1, 1]
        assert all(abs(touch.depth - depth) < 3e-3 for touch in touches)
        assert all(touch.depth_sigma > touch.depth / 9 for touch in touches)
        for touch in touches:
            assert np.linalg.norm(touch.lowest + [0, 0, touch.radius] - touch.position) == pytest.approx(touch.radius), 'on the tip'
            aside, steep = (touch.lowest - touch.position)[:2], DOME.normal(touch.position[:2])[:2]
            assert aside @ steep == pytest.approx(touch.radius * steep @ steep, rel=0.4), 'where the dome inclines to it'


def test_a_press_is_found_independently_of_the_last_one(method):
    for x, y, depth in ((0.05, 0.0, 0.02), (0.052, 0.001, 0.021), (-0.05, 0.02, 0.005), (-0.05, 0.02, 0.025), (0.0, -0.06, 0.015)):
        touch, = method.estimate(library_field(press(x, y, depth)))
        assert np.hypot(*(touch.position[:2] - [x, y])) < 5e-4 and touch.depth == pytest.approx(depth, rel=0.05)


def test_two_faint_presses_are_not_reported_as_one_between_them(method):
    faint = [method.estimate(library_field(press(0.045, 0.02, depth), press(-0.04, -0.015, depth), seed=seed))
             for seed in range(10) for depth in (2e-4, 4e-4, 6e-4)]
    assert len([touch for touches in faint for touch in touches if np.hypot(*touch.position[:2]) < 0.02]) <= 1


def test_a_press_that_hardly_moves_the_markers_is_not_reported(method):
    assert not any(method.estimate(library_field(seed=k)) for k in range(100))
    assert method.estimate(library_field(press(0.02, 0.0, 1e-4))) == []


def test_an_ambiguous_faint_press_is_not_reported_at_a_wrong_position(method):
    reported = [(touch, one) for one in [press(0.05, 0.0, depth) for depth in (2e-4, 8e-4, 2e-3)] for seed in range(8)
                for touch in method.estimate(library_field(one, seed=seed))]
    off = np.array([touch.position - [*one[:2], touch_height(one) - np.exp(one[2])] for touch, one in reported])
    squares = [each @ np.linalg.solve(touch.covariance, each) / 3 for each, (touch, _) in zip(off, reported)]
    assert len(reported) >= 8 and np.mean(squares) < 3, 'the height of one goes with its position'


def test_a_misfit_increases_the_covariance_and_deep_presses_are_flagged(method):
    plain, = method.estimate(library_field(press(0.02, 0.01, 0.02)))
    field = library_field(press(0.02, 0.01, 0.02))
    field.shift[:] += np.random.default_rng(5).normal(0, 2e-4, field.shift.shape)
    assert all(touch.covariance[0, 0] > 2 * plain.covariance[0, 0] for touch in method.estimate(field))
    field.shift[:] += np.random.default_rng(6).normal(0, 3e-3, field.shift.shape)
    assert method.estimate(field) == [], 'nothing is reported of a position that the markers do not show'
    assert method.estimate(library_field(press(0.02, 0.01, 0.039)))[0].flags & OUT_OF_RANGE


def test_markers_are_lowered_under_the_tip(method):
    raised = method.raised(library_field(press(0.02, 0.01, 0.02)))
    under = np.nanargmin(np.hypot(*(markers()[:, :2] - [0.02, 0.01]).T))
    assert raised[under] == pytest.approx(-0.019, abs=2e-3)
    assert method.raised(library_field()) is None


def test_inconsistent_input_is_refused(method, calibration):
    numbers = stored(calibration)
    again = DomeModelMethod(restored(DomeCalibration, numbers), DOME)
    assert np.allclose(again.solver.points, method.solver.points, equal_nan=True) and EYE[2] < 0
    library = numbers['library']
    for wrong in ({key: value for key, value in numbers.items() if key != 'noise'}, {**numbers, 'camera_centres': [[0, 0, 0]]},
                  {**numbers, 'library': {**library, 'shown': {**library['shown'], 'odd_table': np.zeros(3)}}},
                  {**numbers, 'library': {**library, 'plan': {}}}):
        with pytest.raises(BadCalibration, match='run calibrate again'):
            restored(DomeCalibration, wrong)
    with pytest.raises(BadArgument, match='289 markers'):
        field = library_field()
        method.estimate(type(field)(*(getattr(field, part.name)[:50] for part in dataclasses.fields(field))))


def test_the_covariance_of_a_straight_press_covers_any_friction():
    squares = []
    for seed, number in enumerate(-np.abs(np.random.default_rng(3).normal(0, constants.DOME.unknown_friction, 30))):
        true = press(0.022, -0.031, 0.021, 0.3, number)
        found = inverse().solve(library_field(true, seed=seed), true[None])
        squares.append((found.presses[0, DEPTH] - true[DEPTH])**2 / found.covariance[DEPTH, DEPTH])
    assert 0.3 < np.mean(squares) < 2.0


KNOWN = np.isfinite(POINTS).all(1)


def moved(*numbers):
    """Positions (K, 3), m, of the known markers."""
    return small_library().moved(POINTS, np.array(numbers))[KNOWN]


def test_presses_between_the_simulated_ones_are_interpolated():
    step, across, turn, radius = PLAN.load_steps[7], 0.037, 0.6, 0.3
    tip = PLAN.radius * np.exp(constants.DOME.radius_spread * radius)
    mesh = DomeMesh(shift_of(across, tip, PLAN.cap), PLAN.cap, MESH)
    direct = press_dome(mesh, PLAN.load_steps[:8], tip, MATERIAL, drags=0).straight[-1]
    turned = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    shown = AsSeen(mesh, PLAN.marker, PLAN.camera_centre).fields(*(direct[None] for _ in range(3)))[0][0]
    expected = evaluate(shown, mesh, POINTS[KNOWN] @ turned.T) @ turned
    found = moved(press(across * np.cos(turn), across * np.sin(turn), step, radius))
    assert np.sqrt(np.mean((found - expected)**2)) < 0.02 * np.abs(expected).max()


def test_the_force_of_a_sticking_or_sliding_tip_is_that_of_the_simulation():
    step, across, turn = PLAN.load_steps[7], 0.037, 0.6
    mesh = DomeMesh(shift_of(across, PLAN.radius, PLAN.cap), PLAN.cap, MESH)
    stuck = press_dome(mesh, PLAN.load_steps[:8], PLAN.radius, MATERIAL)
    rubs = press_dome(mesh, PLAN.load_steps[:8], PLAN.radius, DomeMaterial(MATERIAL.squeeze, MATERIAL.gas, 0.0))
    turned = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    position, library = (across * np.cos(turn), across * np.sin(turn)), small_library()
    for drag, (direct, friction) in product(((0.0, 0.0), (0.3, 0.0), (0.0, 0.3)), ((stuck, 0.0), (rubs, -1.0))):
        expected = (direct.push[-1] + drag[0] * direct.push_along[-1] + drag[1] * direct.push_across[-1]) @ turned
        found = library.push(press(*position, step, friction=friction, drag=np.array(drag) @ turned[:2, :2]))
        assert expected[2] < 0 and np.linalg.norm(found - expected) < 0.03 * np.linalg.norm(expected)


def test_the_library_has_the_symmetry_of_the_dome():
    one, turned = moved(press(0.03, 0.02, 0.02, drag=(0.1, 0.2))), moved(press(0.02, 0.03, 0.02, drag=(0.2, 0.1)))
    swapped = POINTS[KNOWN][:, [1, 0, 2]]
    partner = np.argmin(np.linalg.norm(POINTS[KNOWN][:, None] - swapped, axis=2), axis=0)
    assert np.allclose(one[partner], turned[:, [1, 0, 2]], atol=2e-5)
    assert np.allclose(moved(press(1e-9, 0, 0.02)), moved(press(0, 1e-9, 0.02)), atol=1.5e-4)


def test_apparent_fields_move_markers_as_their_outlines_do():
    """The apparent displacement of a marker is that of the centroid of its outline, also for drags along and across."""
    mesh, marker, camera_centre = DomeMesh(shift_of(0.04, 0.025, PLAN.cap), PLAN.cap, MeshPlan()), 5e-3, np.array([0.0, 0.0, -0.045])
    found = press_dome(mesh, np.linspace(0.002, 0.03, 12), 0.025, MATERIAL, drags=12)
    parts = found.straight[-1:], found.along[-1:], found.across[-1:]
    shown = AsSeen(mesh, marker, camera_centre[2]).fields(*parts)
    points = POINTS[KNOWN]
    round_it = outlines(points, marker, PLAN.cap)
    for kind, part in ((1, 0.0), (1, 0.5), (2, 0.5)):
        field, seen = (sum(share * evaluate(of[k][0], mesh, at.reshape(-1, 3), k == 2).reshape(at.shape)
                           for k, share in ((0, 1), (kind, part))) for of, at in ((parts, round_it), (shown, points)))
        true = appear_at(round_it + field, camera_centre) - appear_at(round_it, camera_centre)
        from_camera = points - camera_centre
        reported, plain = ((from_camera + by)[:, :2] / (from_camera + by)[:, 2:] - from_camera[:, :2] / from_camera[:, 2:]
                           for by in (seen, field[:, 0]))
        off, of_centres = (np.sqrt(np.mean((reported - true)**2)) * 0.165 for reported in (reported, plain))
        assert off < 2e-5 and off < 0.2 * of_centres


def test_a_dome_that_cannot_be_simulated_is_refused():
    from tactile_perception.press.dome import library
    with changed(constants.DOME, max_newton_steps=1), pytest.raises(BadCalibration, match='do not converge'):
        library.build_library(type(PLAN)(**vars(PLAN) | {'order': 1, 'levels': 2}), DomeMaterial(), MESH)
