# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import json
import os
import pathlib

import numpy as np
import pytest
from dome_library import evaluate
from dome_scenes import DOME, EYE, markers

from tactile_perception.common.geometry import Cap
from tactile_perception.common.marker_sensor import dome_cap
from tactile_perception.core.errors import BadArgument
from tactile_perception.press.dome.mechanics import DomeMaterial, DomeMesh, MeshPlan, appear_at, centres_of, outlines, press_dome, shift_of

CAP, MESH = Cap(0.15375, 0.12), MeshPlan(even=10, rings=18, width=0.0145, harmonics=3, around=8)
FOLDER = pathlib.Path(os.environ.get('TACTILE_RECORDINGS', ''), 'simulated', 'ac_calib_small')
TIP = 0.025


def pressed(across, depths, material, radius=TIP):
    """Mesh and fields of a press."""
    mesh = DomeMesh(shift_of(across, radius, CAP), CAP, MESH)
    return mesh, press_dome(mesh, np.array(depths), radius, material)


def test_the_skin_lies_on_the_tip_without_penetration():
    mesh, found = pressed(0.03, np.linspace(0.002, 0.02, 10), DomeMaterial(0.8, 60.0, 0.5))
    positions = mesh.rest.reshape(-1, 3) + evaluate(found.straight[-1], mesh, mesh.rest.reshape(-1, 3))
    centre = np.array([0.03, 0, CAP.centre_z + np.sqrt((CAP.curvature_radius + TIP)**2 - 0.03**2) - 0.02])
    gap = np.linalg.norm(positions - centre, axis=1) - TIP
    assert -1e-4 < gap.min() < 2e-5


@pytest.mark.parametrize('squeeze', [0.0, 0.8])
def test_a_dome_at_constant_pressure_is_softer_than_a_sealed_one(squeeze):
    push = [pressed(0.0, [0.005, 0.01], DomeMaterial(squeeze, gas, 0.5))[1].push[-1] for gas in (0.0, 60.0)]
    assert push[1][2] < push[0][2] < 0 and np.abs([one[:2] for one in push]).max() < 1e-6 * abs(push[0][2])


def test_a_drag_moves_the_skin_and_is_isotropic_at_the_top():
    mesh, found = pressed(0.0, [0.005, 0.01, 0.015], DomeMaterial(0.8, 60.0, 0.5))
    points = np.array([[0.0, 0.0, CAP.height], [0.02, 0.0, np.nan], [0.0, 0.02, np.nan]])
    points[1:, 2] = CAP.heights(points[1:, :2])
    along, across = evaluate(found.along[-1], mesh, points), evaluate(found.across[-1], mesh, points, odd=True)
    assert along[0, 0] == pytest.approx(0.015, rel=0.01), 'as far aside as the tip is deep: it sticks'
    assert np.allclose(along[0, 1:], 0, atol=1e-9) and np.abs(along[1:, 0]).max() < along[0, 0]
    assert np.allclose(along[[0, 1, 2]][:, [0, 1]], across[[0, 2, 1]][:, [1, 0]], rtol=1e-3, atol=1e-6)


def test_the_skin_sticks_where_the_tip_meets_it_with_any_load_steps():
    mesh, few = pressed(0.05, np.linspace(0, 0.02, 11)[1:], DomeMaterial(0.0, 73.0, 0.6))
    many = pressed(0.05, np.linspace(0, 0.02, 61)[1:], DomeMaterial(0.0, 73.0, 0.6))[1]
    points = mesh.rest.reshape(-1, 3)
    moved = [evaluate(found.straight[-1], mesh, points) for found in (few, many)]
    assert np.abs(moved[1]).max() > 0.015 and np.abs(moved[0] - moved[1]).max() < 0.1e-3


def test_numbers_out_of_range_are_refused():
    for wrong in ({'squeeze': 1.0}, {'gas': -1.0}, {'friction': np.nan}):
        with pytest.raises(BadArgument, match='need 0 <= squeeze < 1'):
            DomeMaterial(**wrong)


@pytest.mark.skipif(not (FOLDER / 'truth.npz').exists(), reason='TACTILE_RECORDINGS names no folder with simulated/ac_calib_small')
def test_markers_move_as_in_an_independent_simulation_of_the_same_dome():
    truth, sensor = np.load(FOLDER / 'truth.npz'), json.loads((FOLDER / 'sensor.json').read_text())['info']
    tension = sensor['rest_gauge_pressure'] * CAP.curvature_radius / 2
    gas = (101325 + sensor['rest_gauge_pressure']) / sensor['rest_gauge_pressure']
    material = DomeMaterial(1 - tension / sensor['shear_modulus_times_thickness'], gas, 0.6)
    depths = truth['depth'][truth['segment'] == 5]
    steps = np.union1d(depths[-1] * (np.arange(1, 25) / 24)**1.3, depths)
    mesh, found = pressed(0.0, steps, material)
    for frame, depth in zip(np.flatnonzero(truth['segment'] == 5), depths):
        moved = evaluate(found.straight[np.searchsorted(steps, depth)], mesh, truth['dot_rest_xyz'].astype(float))
        off = moved - (truth['dot_xyz'][frame] - truth['dot_rest_xyz'])
        assert np.sqrt(np.mean(np.sum(off**2, axis=1))) < 0.15e-3


DOME_CAP, MARKER = dome_cap(DOME), 4.6e-3
POINTS = markers()[np.isfinite(markers()).all(1)]


def seen(points):
    """Tangents of the directions of points (..., 3), m, from EYE."""
    return (points - EYE)[..., :2] / (points - EYE)[..., 2:]


def pixels_mean(point, radius, steps=400):
    """Mean of the pixels whose rays meet a disc around a point of the dome."""
    edge = seen(outlines(point[None], 1.02 * radius, DOME_CAP)[0, 1:])
    low, high = edge.min(0), edge.max(0)
    grid = np.stack(np.meshgrid(*(np.linspace(*ends, steps) for ends in zip(low, high))), axis=-1).reshape(-1, 2)
    rays = np.column_stack([grid, np.ones(len(grid))])
    meets = DOME_CAP.meet(EYE, rays / np.linalg.norm(rays, axis=1, keepdims=True))
    arc = 2 * DOME_CAP.curvature_radius * np.arcsin(np.linalg.norm(meets - point, axis=1) / (2 * DOME_CAP.curvature_radius))
    return grid[arc < radius].mean(0)


def test_a_marker_appears_at_the_mean_of_its_pixels():
    slanted = POINTS[np.argsort(POINTS[:, 2])[[0, 40, 80]]]
    found = appear_at(outlines(slanted, MARKER, DOME_CAP), EYE)
    true = np.array([pixels_mean(point, MARKER) for point in slanted])
    off_centre = np.linalg.norm(seen(slanted) - true, axis=1)
    # at the plane through the top: some 0.165 m away
    assert off_centre.max() * 0.165 > 1e-4 and np.linalg.norm(found - true, axis=1).max() * 0.165 < 4e-6


def test_centres_of_untouched_markers_follow_from_their_apparent_positions():
    away = DOME.plane_z - EYE[2]
    rest = EYE[:2] + away * appear_at(outlines(POINTS, MARKER, DOME_CAP), EYE)
    camera_centres = np.tile(EYE, (len(POINTS), 1))
    assert np.linalg.norm(centres_of(rest, camera_centres, MARKER, DOME) - POINTS, axis=1).max() < 2e-6
    assert np.linalg.norm(centres_of(rest, camera_centres, 1e-6, DOME) - POINTS, axis=1).max() > 5e-5
    rest[3] = np.nan
    assert np.isnan(centres_of(rest, camera_centres, MARKER, DOME)[3]).all()
