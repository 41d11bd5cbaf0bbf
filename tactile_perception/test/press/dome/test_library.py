# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from itertools import product

import numpy as np
import pytest
from dome_library import MATERIAL, MESH, PLAN, POINTS, evaluate, press, small_library
from tactile_perception.errors import BadCalibration
from tactile_perception.press.dome.library import RADIUS_SPREAD, AsSeen
from tactile_perception.press.dome.mechanics import DomeMaterial, DomeMesh, MeshPlan, appear_at, outlines, press_dome, shift_of

pytestmark = pytest.mark.full  # simulates a small library
KNOWN = np.isfinite(POINTS).all(1)


def moved(*numbers):
    """(K, 3) m, of the markers that there are."""
    return small_library().moved(POINTS, np.array(numbers))[KNOWN]


def test_presses_between_the_simulated_ones_are_interpolated():
    step, across, turn, radius = PLAN.load_steps[7], 0.037, 0.6, 0.3
    mesh = DomeMesh(shift_of(across, PLAN.radius * np.exp(RADIUS_SPREAD * radius), PLAN.cap), PLAN.cap, MESH)
    direct = press_dome(mesh, PLAN.load_steps[:8], PLAN.radius * np.exp(RADIUS_SPREAD * radius), MATERIAL, drags=0).straight[-1]
    turned = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    shown = AsSeen(mesh, PLAN.marker, PLAN.camera_centre).fields(*(direct[None] for _ in range(3)))[0][0]
    expected = evaluate(shown, mesh, POINTS[KNOWN] @ turned.T) @ turned
    found = moved(press(across * np.cos(turn), across * np.sin(turn), step, radius))
    assert np.sqrt(np.mean((found - expected)**2)) < 0.02 * np.abs(expected).max()


def test_the_force_of_a_tip_that_sticks_or_rubs_is_that_of_the_simulated_presses():
    step, across, turn = PLAN.load_steps[7], 0.037, 0.6
    mesh = DomeMesh(shift_of(across, PLAN.radius, PLAN.cap), PLAN.cap, MESH)
    stuck = press_dome(mesh, PLAN.load_steps[:8], PLAN.radius, MATERIAL)
    rubs = press_dome(mesh, PLAN.load_steps[:8], PLAN.radius, DomeMaterial(MATERIAL.squeeze, MATERIAL.gas, 0.0))
    turned = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    place, library = (across * np.cos(turn), across * np.sin(turn)), small_library()
    for drag, (direct, friction) in product(((0.0, 0.0), (0.3, 0.0), (0.0, 0.3)), ((stuck, 0.0), (rubs, -1.0))):
        expected = (direct.push[-1] + drag[0] * direct.push_along[-1] + drag[1] * direct.push_across[-1]) @ turned
        found = library.push(press(*place, step, friction=friction, drag=np.array(drag) @ turned[:2, :2]))
        assert expected[2] < 0 and np.linalg.norm(found - expected) < 0.03 * np.linalg.norm(expected)


def test_the_library_has_the_domes_symmetry():
    one, turned = moved(press(0.03, 0.02, 0.02, drag=(0.1, 0.2))), moved(press(0.02, 0.03, 0.02, drag=(0.2, 0.1)))
    swapped = POINTS[KNOWN][:, [1, 0, 2]]
    partner = np.argmin(np.linalg.norm(POINTS[KNOWN][:, None] - swapped, axis=2), axis=0)
    assert np.allclose(one[partner], turned[:, [1, 0, 2]], atol=2e-5)
    assert np.allclose(moved(press(1e-9, 0, 0.02)), moved(press(0, 1e-9, 0.02)), atol=1.5e-4)


def test_a_field_becomes_that_which_moves_the_outlines_of_markers():
    """Also dragged along and across: what a marker shows at its place moves it as its outline's centroid moves."""
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


def test_a_dome_that_cannot_be_simulated_is_refused(monkeypatch):
    from tactile_perception.press.dome import library, mechanics
    monkeypatch.setattr(mechanics, 'STEPS', 1)
    with pytest.raises(BadCalibration, match='do not converge'):
        library.build_library(type(PLAN)(**vars(PLAN) | {'order': 1, 'levels': 2}), DomeMaterial(), MESH)
