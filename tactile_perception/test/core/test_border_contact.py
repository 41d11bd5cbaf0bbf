# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The border of the compiled module, of the kernels of a touchpad's membrane and contact; see test_border.py."""
import numpy as np
import pytest
from border_checks import check_any_array, check_memory, check_wrong_type
from tactile_perception import _core

GRID = {'rows': 6, 'columns': 7}
DOTS = np.stack([*(np.mgrid[:6, :7][::-1] * 1.3e-3).reshape(2, -1), np.zeros(42)], axis=1)
AT_REST = _core.membrane_at_rest(DOTS, stiffness=90.0, area_share=0.8, **GRID)
UP = np.tile([0.0, 0.0, 1.0], (42, 1))


FRAME = {'rays': UP[:40], 'ranges': np.full(40, 0.04), 'sigma': np.full(40, 2e-5), 'id': np.arange(40), 'rest': DOTS + [0, 0, 0.04],
         'places': DOTS + [0, 0, 0.04], 'touched': np.zeros(42), 'triangles': AT_REST, 'residual': np.zeros((42, 3)),
         'response': np.full((20, 20), 1e-9, np.float32), 'origin': np.zeros(3)}
LEANING = {'places': DOTS, 'rays': UP, 'touched': np.zeros(42), 'moved': np.full(42, 1e-4), 'triangles': AT_REST, 'residual': 0 * UP}


NUMBERS = np.arange(42)
HELD = np.where(np.arange(42) % 7 < 4, 1, 0)
LOADED = {'id': NUMBERS[NUMBERS % 5 > 0], 'places': DOTS[NUMBERS % 5 > 0] * 1.01, 'rest': DOTS, 'triangles': AT_REST, 'residual': 0 * UP,
          'origin': -0.04 * UP[0]}
LAST = {'last_places': DOTS, 'last_seen': HELD > -1, 'last_score': 1.0 * HELD}
NOW = {'places': DOTS + 1e-4, 'score': 1.0 * HELD, 'seen': HELD > -1, 'normals': UP, 'force': 0.01 * UP}
STICKING = LAST | NOW | {'held': HELD, 'objects': np.zeros((1, 27)), 'origin': -0.04 * UP[0]}


def call_stick_slip(**arrays):
    """States of dots under one object."""
    given = STICKING | arrays
    return _core.stick_slip(tuple(given[name] for name in LAST), tuple(given[name] for name in NOW), given['held'], given['objects'],
                            given['origin'], tolerance=1e-5, noise=2e-6, depth_noise=2e-5, friction=0.3, **GRID)


WIDE = 1e-3 * np.stack([*np.mgrid[:10.0, :11.0][::-1], np.zeros((10, 11))], axis=2)
SCORE = np.pad(np.ones((3, 4)), ((1, 2), (2, 1)))
PLACES, START, _, POINTS, *_ = _core.find_outlines(SCORE, WIDE, level=0.5, ceiling=1.0, refine=2)
SUMS = np.array([1.0, 0.1, 0.2, 3.0, 0.1, 2.0])
PATCH = {'id': NUMBERS, 'places': DOTS, 'inside': NUMBERS % 7 < 4, 'touched': NUMBERS % 7 < 5, 'force': UP, 'border': POINTS,
         'start': START, 'wide': WIDE, 'centroid': DOTS[:20].mean(axis=0), 'normal': UP[0]}


def call_region_contact(**arrays):
    """The contact of a patch of dots."""
    return _core.region_contact(**PATCH | arrays, area=1e-5, pitch=1.3e-3, sigma=3e-5, centre_z=-0.01, radius=0.02, **GRID)


#: Function of the module: how it is called here, and an example of each of its arrays.
CALLS = {
    'membrane_at_rest': (lambda rest=DOTS: [_core.membrane_at_rest(rest, stiffness=90.0, area_share=0.8, **GRID)], {'rest': DOTS}),
    'membrane_forces': (lambda places=DOTS, triangles=AT_REST: _core.membrane_forces(places, triangles, **GRID),
                        {'places': DOTS, 'triangles': AT_REST}),
    'membrane_slopes': (lambda places=DOTS, rays=UP, triangles=AT_REST, residual=0 * UP: [
        _core.membrane_slopes(places, rays, triangles, residual, pressure=2000.0, **GRID)],
        {'places': DOTS, 'rays': UP, 'triangles': AT_REST, 'residual': 0 * UP}),
    'membrane_loads': (lambda **arrays: _core.membrane_loads(**LOADED | arrays, rest_pressure=2000.0, settled=0.25, **GRID), LOADED),
    'solve_membrane': (lambda **arrays: _core.solve_membrane(**FRAME | arrays, pressure=2000.0, scale=1.0, fresh=False, **GRID), FRAME),
    'scale_leaning': (lambda **arrays: _core.scale_leaning(
        **LEANING | arrays, pressure=2000.0, lifted=10.0, step=0.01, spread=0.2, scale=1.0, **GRID), LEANING),
    'contact_score': (lambda load=np.linspace(0, 2, 42), places=DOTS, normals=UP: [
        _core.contact_score(load, places, normals, pitch=1.3e-3, **GRID)], {'load': np.linspace(0, 2, 42), 'places': DOTS, 'normals': UP}),
    'edge_distance': (lambda score=np.linspace(0, 1, 42), load=np.linspace(0, 2, 42), places=DOTS, normals=UP: [
        _core.edge_distance(score, load, places, normals, pitch=1.3e-3, **GRID)],
        {'score': np.linspace(0, 1, 42), 'load': np.linspace(0, 2, 42), 'places': DOTS, 'normals': UP}),
    'stick_slip': (call_stick_slip, STICKING),
    'grid_normals': (lambda xyz=WIDE: [_core.grid_normals(xyz)], {'xyz': WIDE}),
    'extend_surface': (lambda xyz=WIDE: [_core.extend_surface(xyz)], {'xyz': WIDE}),
    'surface_points': (lambda wide=WIDE, places=PLACES: [_core.surface_points(wide, places)], {'wide': WIDE, 'places': PLACES}),
    'find_contours': (lambda field=SCORE: _core.find_contours(field, level=0.5), {'field': SCORE}),
    'find_outlines': (lambda score=SCORE, wide=WIDE: _core.find_outlines(score, wide, level=0.5, ceiling=1.0, refine=2),
                      {'score': SCORE, 'wide': WIDE}),
    'region_axes': (lambda sums=SUMS, points=POINTS, start=START: [_core.region_axes(sums, points, start, pitch=1e-3)],
                    {'sums': SUMS, 'points': POINTS, 'start': START}),
    'region_contact': (call_region_contact, PATCH),
    'carried_loads': (lambda places=DOTS, force=UP, load=np.linspace(0, 2, 42): _core.carried_loads(
        places, force, load, loaded=0.5, **GRID), {'places': DOTS, 'force': UP, 'load': np.linspace(0, 2, 42)}),
    'lie_on_a_line': (lambda points=DOTS: [_core.lie_on_a_line(points, thinnest=1e-3)], {'points': DOTS}),
    'all_within': (lambda values=WIDE: [_core.all_within(values, most=0.0105)], {'values': WIDE}),
    'planar_twist': (lambda place=PLACES, velocity=PLACES / 9: _core.planar_twist(place, velocity, far=4.0),
                     {'place': PLACES, 'velocity': PLACES / 9}),
    'deepest_notch': (lambda corners=PLACES: [_core.deepest_notch(corners)], {'corners': PLACES}),
    'rigid_motion': (lambda before=DOTS, after=DOTS + 1e-3, weights=np.full(42, 1e9): _core.rigid_motion(before, after, weights, steps=9),
                     {'before': DOTS, 'after': DOTS + 1e-3, 'weights': np.full(42, 1e9)}),
}
ARRAYS = [(function, name) for function, (_, arrays) in CALLS.items() for name in arrays]


@pytest.mark.parametrize('check', [check_any_array, check_wrong_type, check_memory])
@pytest.mark.parametrize('function, name', ARRAYS)
def test_any_array_is_answered_or_refused_by_name_however_it_lies_in_memory(function, name, check):
    check(*CALLS[function], name)
