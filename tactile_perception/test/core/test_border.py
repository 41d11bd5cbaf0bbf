# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The compiled module: its stub, and what any argument gives."""
import ast
import re
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from border_checks import arrays_test

from tactile_perception import _core
from tactile_perception.press.sheet.mechanics import SheetMesh
from tactile_perception.touchpad.contact import border_network

# Sheets.
PLACES = np.random.default_rng(1).uniform(5, 55, (40, 2))
MESH = {name: getattr(SheetMesh(np.zeros(2), np.array([0.03, 0.03]), 8e-3, 2), name)
        for name in ('value', 'slope', 'laplacian', 'weight', 'rest')} | {'depths': np.array([5e-4, 1e-3])}
PRESS = {'place': (0.0, 0.0), 'radius': 7e-3, 'prestretch': 1.05, 'bending': 2e-7, 'friction': 0.5, 'slides': False, 'drag': (0.0, 0.0)}
PRESSED = {'rest': 1e-3 * (PLACES - 30), 'camera_centre': np.tile([0.0, 0.0, -0.06], (40, 1)),
           'presses': np.array([[1e-3, 2e-3, 2e-3, 0.0, 0.0, 0.0], [8e-3, 2e-3, 1e-3, 0.0, 0.0, 0.0]])}
VALUES = {'value': np.random.default_rng(3).normal(0, 1e-4, (40, 3)), 'motion': np.random.default_rng(5).normal(0, 1e-5, (40, 3))}
FIT = {'noise': (1e-5, 1e-2, 1e-2, 1.0, 0.0, 0.0), 'tip': (0.0, 0.15), 'marker_radius': 1e-3, 'drags': True, 'near': 0.01}
FIELD = {'field': np.zeros((16, 3), np.float32), 'rest': PRESSED['rest'], 'camera_centre': PRESSED['camera_centre']}


TABLE = {'numbers': np.array([0.03, 0.03, 0.02, 0.02, 8e-3, 8e-3, 0.3, 1.5, 0.2]), 'sizes': np.array([1, 2, 3, 2, 1, 0, 1]),
         'coefficients': np.random.default_rng(4).normal(0, 1, 12 * 4 * 6 * 13).astype(np.float32), 'shapes': np.full(48, 1e-3, np.float32)}


def table(**arrays):
    """Of a sheet library."""
    return _core.SheetTable(**TABLE | arrays)


# Domes.
DOME = {'numbers': np.array([0.15, -0.04, 0.9, 0.3, 0.04, 1.5, 0.02, 0.8]), 'edges': np.linspace(0, 1, 4),
        'even_table': np.full((6, 6, 2, 2, 2), 1e-3, np.float32), 'odd_table': np.full((6, 2, 2, 2, 2), 1e-3, np.float32),
        'even_modes': np.full((2, 4, 3, 3), 1e-3, np.float32), 'odd_modes': np.full((2, 4, 3, 3), 1e-3, np.float32)}
DOME_PRESS = {'points': np.full((5, 3), 0.01), 'presses': np.zeros((1, 7))}
DOME_SEEN = {'points': np.full((5, 3), 0.01), 'camera_centres': np.zeros((5, 3)), 'shift': np.full((5, 2), 1e-3), 'weight': np.ones(5),
             'shared': np.full((2, 5), 0.1), 'starts': np.zeros((1, 7)),
             'prior': np.array([np.zeros(7), np.ones(7), np.full(7, -3.0), np.full(7, 3.0), np.full(7, 0.1)])}


# Light in a touchpad, and cameras.
COLOURS = {'image': np.random.default_rng(3).integers(0, 256, (60, 80, 3), dtype=np.uint8), 'uv': PLACES}
PATH = np.array([-0.005, -0.038, 0.018, 0.2, 0.0, 0.0, -0.04])
PAD = {'path': PATH, 'lengths': np.full(12, 0.036), 'rays': np.random.default_rng(4).normal((0, 0, 1), (0.1, 0.1, 0), (12, 3)),
       'id': np.arange(12), 'rest_ranges': np.full(12, 0.05), 'rest_normals': np.tile([0.0, 0.0, 1.0], (12, 1))}
LIGHT = {'path': PATH, 'places': np.random.default_rng(5).normal(0, 0.004, (12, 3)), 'normals': PAD['rest_normals']}
DYED = {'ratios': np.random.default_rng(6).normal(-1.5, 0.1, (12, 2)), 'count': np.full(12, 16), 'patchiness': np.zeros(12),
        'excess': np.linspace(-0.1, 0.2, 12), 'excess_sigma': np.full(12, 0.02), 'colour': np.full((12, 2), 0.5)}
WATER = {'constants': (-0.5, -0.4), 'absorptions': (35.0, 27.0), 'noise': (1e-5, 5e-6, 5e-6, 1e-5), 'disagree': 2.5, 'patchy': 2.5,
         'probability': 0.3, 'size': 0.1}
CAMERA = {'uv': np.array([[300.0, 200.0], [640.0, 480.0], [320.0, 240.0]]), 'matrix': np.array([[600.0, 0, 320], [0, 605, 240], [0, 0, 1]]),
          'distortion': np.array([-0.1, 0.02, 1e-4, -2e-4, 0.0]), 'rotation': np.eye(3)}
PLACED_CAMERA = CAMERA | {'centre': np.array([0.0, 0.0, -0.06])}

# Membrane and contact of a touchpad.
GRID = {'rows': 6, 'columns': 7}
DOTS = np.stack([*(np.mgrid[:6, :7][::-1] * 1.3e-3).reshape(2, -1), np.full(42, 0.04)], axis=1)
UP = np.tile([0.0, 0.0, 1.0], (42, 1))
NUMBERS = np.arange(42)
LOADS = {'xyz': DOTS, 'seen': NUMBERS % 5 > 0, 'normal': UP, 'force': -0.01 * UP, 'load': np.where(NUMBERS % 7 < 4, 1.0, 0.0)}
FRAME = {'rays': UP[:40], 'ranges': np.full(40, 0.04), 'sigma': np.full(40, 2e-5), 'id': NUMBERS[:40]}
SEEN = {'id': NUMBERS[NUMBERS % 5 > 0], 'xyz': DOTS[NUMBERS % 5 > 0] * 1.01}
WIDE = 1e-3 * np.stack([*np.mgrid[:10.0, :11.0][::-1], np.zeros((10, 11))], axis=2)
SCORE = {'score': np.pad(np.ones((3, 4)), ((1, 2), (2, 1))), 'wide': WIDE}
PLACED, START, _, POINTS, *_ = _core.find_outlines(**SCORE, level=0.5, ceiling=1.0, refine=2)
AXES = {'sums': np.array([1.0, 0.1, 0.2, 3.0, 0.1, 2.0]), 'points': POINTS, 'start': START}
PATCH = {'points': DOTS[NUMBERS % 7 < 4], 'border': POINTS, 'start': START, 'wide': WIDE, 'centroid': DOTS[:20].mean(axis=0),
         'normal': UP[0]}


def membrane(rest=DOTS, origin=np.zeros(3)):
    return _core.Membrane(rest, **GRID, stiffness=90.0, area_share=0.8, pressure=2000.0, origin=origin)


def fields(found):
    """All arrays of a result."""
    values = [getattr(found, name) for name in sorted(dir(found)) if not name.startswith('_')]
    return [np.asarray(value) for value in values if isinstance(value, (np.ndarray, float))]


def call_stick_slip(score=np.where(NUMBERS % 7 < 4, 1.0, 0.0), **arrays):
    """States of dots in the second of two frames."""
    states = _core.StickSlip(6, 7, np.zeros(3))
    states.update(_core.DotLoads(**LOADS), score, 0.03)
    return [states.update(_core.DotLoads(**LOADS | arrays), score, 0.03), states.ways(), *states.motion()]


#: Function of the module: how it is called here, and an example of each of its arrays.
BETWEEN = {'points': np.ascontiguousarray(DOTS[:, :2]), 'queries': np.ascontiguousarray(DOTS[:5, :2] + 1e-4)}

CALLS = {
    'press_sheet': (lambda **a: _core.press_sheet(**MESH | a, **PRESS), MESH),
    'fit': (lambda **a: fields(table().fit(**PRESSED | VALUES | a, **FIT)), PRESSED | VALUES),
    'show': (lambda **a: table().show(**PRESSED | a, mixed=0.3, marker_radius=1e-3, near=0.01), PRESSED),
    'SheetTable': (lambda **a: table(**a).show(**PRESSED, mixed=0.3, marker_radius=1e-3, near=0.01), TABLE),
    'show_field': (lambda **a: _core.show_field(**FIELD | a, place=(0.0, 0.0), half=(0.03, 0.03), scale=8e-3, marker_radius=1e-3)[None],
                   FIELD),
    'DomeLibrary': (lambda **a: [_core.DomeLibrary(**DOME | a).moved(**DOME_PRESS)], DOME),
    'moved': (lambda **a: [_core.DomeLibrary(**DOME).moved(**DOME_PRESS | a)], DOME_PRESS),
    'fit_dome': (lambda **a: fields(_core.DomeLibrary(**DOME).fit(**DOME_SEEN | a, plane_z=0.12)), DOME_SEEN),
    'ring_colours': (lambda **a: _core.ring_colours(**COLOURS | a, radius=8.0, ink=0.75, glare=1.2), COLOURS),
    'path_lengths': (lambda **a: _core.path_lengths(**LIGHT | a), LIGHT),
    'water_ranges': (lambda **a: _core.water_ranges(**PAD | a, rows=3, columns=4, ring_share=0.45), PAD),
    'water_lengths': (lambda **a: _core.water_lengths(**DYED | a, **WATER), DYED),
    'camera_rays': (lambda **a: _core.camera_rays(**CAMERA | a, farthest=1.5), CAMERA),
    'back_project': (lambda **a: _core.back_project(**PLACED_CAMERA | a, farthest=1.5, plane_z=0.0), PLACED_CAMERA),
    'Membrane': (lambda **a: fields(membrane(**a)), {'rest': DOTS, 'origin': np.zeros(3)}),
    'forces': (lambda xyz=DOTS: membrane().forces(xyz), {'xyz': DOTS}),
    'solve': (lambda **a: fields(membrane().solve(**FRAME | a)), FRAME),
    'loads': (lambda **a: fields(membrane().loads(**SEEN | a)), SEEN),
    'scores': (lambda **a: [border_network().scores(_core.DotLoads(**LOADS | a), pitch=1.3e-3, **GRID)], LOADS),
    'stick_slip': (call_stick_slip, LOADS | {'score': np.where(NUMBERS % 7 < 4, 1.0, 0.0)}),
    'nearest_points': (lambda **a: list(_core.nearest_points(**BETWEEN | a, count=3)), BETWEEN),
    'extend_surface': (lambda xyz=WIDE: [_core.extend_surface(xyz)], {'xyz': WIDE}),
    'find_outlines': (lambda **a: _core.find_outlines(**SCORE | a, level=0.5, ceiling=1.0, refine=2), SCORE),
    'region_axes': (lambda **a: [_core.region_axes(**AXES | a, pitch=1e-3)], AXES),
    'contact_point': (lambda **a: _core.contact_point(**PATCH | a, area=1e-5, pitch=1.3e-3, sigma=3e-5, centre_z=-0.01, radius=0.02),
                      PATCH),
}


def test_every_function_of_the_module_is_tried():
    files = Path(__file__).parents[1].rglob('test_*border*.py')
    tried = [name for path in files for name in re.findall(r"^    '(\w+)': \(", path.read_text(), re.MULTILINE)]
    # Modules of rooms are tried by their tests; classes are tried by their methods.
    functions = {name for name in dir(_core) if not name.startswith('__') and not isinstance(getattr(_core, name), type | ModuleType)}
    assert functions <= set(tried)


test_any_array_is_answered_or_refused_by_name_however_it_lies_in_memory = arrays_test(CALLS)


@pytest.mark.parametrize('member', ['coefficients', 'shapes'])
@pytest.mark.parametrize('value', [np.nan, np.inf, 1e38])
def test_a_table_of_anything_is_answered(member, value):
    broken = table(**{member: np.full_like(TABLE[member], value)})
    assert np.isfinite(broken.fit(**PRESSED | VALUES, **FIT).state).all()


@pytest.mark.parametrize('call, wrong', [
    *[(table, wrong) for wrong in ({'numbers': np.full(9, np.nan)}, {'sizes': np.full(7, -1)}, {'coefficients': np.zeros(5, np.float32)})],
    *[(lambda **wrong: _core.water_lengths(**DYED, **WATER | wrong), wrong) for wrong in (
        {'probability': 0.0}, {'size': 0.0}, {'absorptions': (0.0, 1.0)}, {'noise': (1.0, 1.0, 1.0, 1.0)})]])
def test_numbers_out_of_range_are_refused_by_name(call, wrong):
    with pytest.raises(ValueError, match=f'^{next(iter(wrong))}: '):
        call(**wrong)


STUBS = Path(_core.__file__).resolve().parent / 'stubs' / '_core'
MODULES = {'__init__': _core, **{name: value for name, value in vars(_core).items() if isinstance(value, ModuleType)}}


def public(names) -> set:
    return {name for name in names if not name.startswith('_')}


def declared(body: list) -> dict:
    """Name to node of what a stub declares."""
    return {getattr(node, 'name', None) or node.target.id: node for node in body
            if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AnnAssign)}


@pytest.fixture(params=MODULES)
def name(request):
    """Of a module that has a stub."""
    if not STUBS.is_dir():
        pytest.skip('pybind11-stubgen was not installed when the module was built')
    return request.param


def parsed(name: str) -> ast.Module:
    return ast.parse((STUBS / f'{name}.pyi').read_text())


def test_the_stub_declares_what_the_module_holds(name):
    module, stub = MODULES[name], declared(parsed(name).body)
    assert public(vars(module)) - set(MODULES) == public(stub) - {'annotations'}
    for key in public(stub):
        value = getattr(module, key)
        if isinstance(value, type):
            assert public(vars(value)) == public(declared(stub[key].body)), key


def test_every_argument_and_result_has_a_type(name):
    for node in ast.walk(parsed(name)):
        if isinstance(node, ast.FunctionDef) and not node.name.startswith('__'):
            untyped = [argument.arg for argument in node.args.args if argument.arg != 'self' and argument.annotation is None]
            assert not untyped and node.returns is not None, f'{node.name}: {untyped}'
