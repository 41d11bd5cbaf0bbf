# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The border of the compiled module, of the kernels of a touchpad's membrane and contact; see test_border.py."""
import numpy as np
import pytest
from border_checks import check_any_array, check_memory, check_wrong_type
from tactile_perception import _core
from tactile_perception.touchpad.contact import border_network

GRID = {'rows': 6, 'columns': 7}
DOTS = np.stack([*(np.mgrid[:6, :7][::-1] * 1.3e-3).reshape(2, -1), np.full(42, 0.04)], axis=1)
UP = np.tile([0.0, 0.0, 1.0], (42, 1))
NUMBERS = np.arange(42)
LOADS = {'xyz': DOTS, 'seen': NUMBERS % 5 > 0, 'normal': UP, 'force': -0.01 * UP, 'load': np.where(NUMBERS % 7 < 4, 1.0, 0.0)}
FRAME = {'rays': UP[:40], 'ranges': np.full(40, 0.04), 'sigma': np.full(40, 2e-5), 'id': NUMBERS[:40]}
SEEN = {'id': NUMBERS[NUMBERS % 5 > 0], 'xyz': DOTS[NUMBERS % 5 > 0] * 1.01}


def membrane(rest=DOTS, origin=np.zeros(3), response=np.full((20, 20), 1e-9, np.float32)):
    made = _core.Membrane(rest, **GRID, stiffness=90.0, area_share=0.8, pressure=2000.0, origin=origin)
    made.set_response(response)
    return made


def fields(found):
    """All arrays of a result."""
    values = [getattr(found, name) for name in sorted(dir(found)) if not name.startswith('_')]
    return [np.asarray(value) for value in values if isinstance(value, (np.ndarray, float))]


def call_stick_slip(score=np.where(NUMBERS % 7 < 4, 1.0, 0.0), **arrays):
    """States of dots in the second of two frames."""
    tracker = _core.StickSlip(6, 7, np.zeros(3))
    tracker.update(_core.DotLoads(**LOADS), score, 0.03)
    return [tracker.update(_core.DotLoads(**LOADS | arrays), score, 0.03), tracker.slides()]


WIDE = 1e-3 * np.stack([*np.mgrid[:10.0, :11.0][::-1], np.zeros((10, 11))], axis=2)
SCORE = np.pad(np.ones((3, 4)), ((1, 2), (2, 1)))
PLACES, START, _, POINTS, *_ = _core.find_outlines(SCORE, WIDE, level=0.5, ceiling=1.0, refine=2)
SUMS = np.array([1.0, 0.1, 0.2, 3.0, 0.1, 2.0])
PATCH = {'id': NUMBERS, 'places': DOTS, 'inside': NUMBERS % 7 < 4, 'touched': NUMBERS % 7 < 5, 'force': UP, 'border': POINTS,
         'start': START, 'wide': WIDE, 'centroid': DOTS[:20].mean(axis=0), 'normal': UP[0]}


def call_region_contact(**arrays):
    """The contact of a patch of dots."""
    return fields(_core.region_contact(**PATCH | arrays, area=1e-5, pitch=1.3e-3, sigma=3e-5, centre_z=-0.01, radius=0.02, **GRID))


#: Function of the module: how it is called here, and an example of each of its arrays.
CALLS = {
    'Membrane': (lambda **arrays: fields(membrane(**arrays)), {'rest': DOTS, 'origin': np.zeros(3)}),
    'set_response': (lambda **arrays: [membrane(**arrays).rest], {'response': np.full((20, 20), 1e-9, np.float32)}),
    'forces': (lambda xyz=DOTS: membrane().forces(xyz), {'xyz': DOTS}),
    'slopes': (lambda xyz=DOTS, rays=UP: [membrane().slopes(xyz, rays, 2000.0)], {'xyz': DOTS, 'rays': UP}),
    'solve': (lambda **arrays: fields(membrane().solve(**FRAME | arrays)), FRAME),
    'loads': (lambda **arrays: fields(membrane().loads(**SEEN | arrays)), SEEN),
    'classify': (lambda **arrays: fields(_core.DotClassifier(membrane(), np.zeros(3), border_network()).classify(**SEEN | arrays,
                                                                                                              seconds=0.1)), SEEN),
    'scores': (lambda **arrays: [border_network().scores(_core.DotLoads(**LOADS | arrays), pitch=1.3e-3, **GRID)], LOADS),
    'stick_slip': (call_stick_slip, LOADS | {'score': np.where(NUMBERS % 7 < 4, 1.0, 0.0)}),
    'extend_surface': (lambda xyz=WIDE: [_core.extend_surface(xyz)], {'xyz': WIDE}),
    'surface_points': (lambda wide=WIDE, places=PLACES: [_core.surface_points(wide, places)], {'wide': WIDE, 'places': PLACES}),
    'find_contours': (lambda field=SCORE: _core.find_contours(field, level=0.5), {'field': SCORE}),
    'find_outlines': (lambda score=SCORE, wide=WIDE: _core.find_outlines(score, wide, level=0.5, ceiling=1.0, refine=2),
                      {'score': SCORE, 'wide': WIDE}),
    'region_axes': (lambda sums=SUMS, points=POINTS, start=START: [_core.region_axes(sums, points, start, pitch=1e-3)],
                    {'sums': SUMS, 'points': POINTS, 'start': START}),
    'region_contact': (call_region_contact, PATCH),
    'rigid_motion': (lambda before=DOTS, after=DOTS + 1e-3, weights=np.full(42, 1e9): _core.rigid_motion(before, after, weights, steps=9),
                     {'before': DOTS, 'after': DOTS + 1e-3, 'weights': np.full(42, 1e9)}),
}
ARRAYS = [(function, name) for function, (_, arrays) in CALLS.items() for name in arrays]


@pytest.mark.parametrize('check', [check_any_array, check_wrong_type, check_memory])
@pytest.mark.parametrize('function, name', ARRAYS)
def test_any_array_is_answered_or_refused_by_name_however_it_lies_in_memory(function, name, check):
    check(*CALLS[function], name)
