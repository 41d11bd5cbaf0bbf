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
from tactile_perception.touchpad.contact import border_network

PLACES = np.random.default_rng(1).uniform(5, 55, (40, 2))

# Light in a touchpad, and cameras.
COLOURS = {'image': np.random.default_rng(3).integers(0, 256, (60, 80, 3), dtype=np.uint8), 'uv': PLACES}
PATH = np.array([-0.005, -0.038, 0.018, 0.2, 0.0, 0.0, -0.04])
SEEN_DOTS = {'rays': np.random.default_rng(4).normal((0, 0, 1), (0.1, 0.1, 0), (12, 3)), 'id': np.arange(12),
             'rest_ranges': np.full(12, 0.05), 'rest_normals': np.tile([0.0, 0.0, 1.0], (12, 1))}
PAD = {'path': PATH, 'lengths': np.full(12, 0.036)} | SEEN_DOTS
LIGHT = {'path': PATH, 'positions': np.random.default_rng(5).normal(0, 0.004, (12, 3)), 'normals': PAD['rest_normals']}
DYED = {'ratios': np.random.default_rng(6).normal(-1.5, 0.1, (12, 2)), 'count': np.full(12, 16), 'patchiness': np.zeros(12),
        'excess': np.linspace(-0.1, 0.2, 12), 'excess_sigma': np.full(12, 0.02), 'colour': np.full((12, 2), 0.5)}
WATER = {'constants': np.array([-0.5, -0.4]), 'absorptions': np.array([35.0, 27.0]), 'noise': np.array([1e-5, 5e-6, 5e-6, 1e-5])}
GLARE = {'probability': 0.3, 'size': 0.1}
SEEN_PX = {'uv': np.array([[300.0, 200.0], [640.0, 480.0], [320.0, 240.0]])}
CAMERA = {'matrix': np.array([[600.0, 0, 320], [0, 605, 240], [0, 0, 1]]),
          'distortion': np.array([-0.1, 0.02, 1e-4, -2e-4, 0.0]), 'rotation': np.eye(3)}
CENTRE = {'centre': np.array([0.0, 0.0, -0.06])}

# Membrane and contact of a touchpad.
GRID = {'rows': 6, 'columns': 7}
DOTS = np.stack([*(np.mgrid[:6, :7][::-1] * 1.3e-3).reshape(2, -1), np.full(42, 0.04)], axis=1)
UP = np.tile([0.0, 0.0, 1.0], (42, 1))
NUMBERS = np.arange(42)
LOADS = {'xyz': DOTS, 'seen': NUMBERS % 5 > 0, 'normal': UP, 'force': -0.01 * UP, 'load': np.where(NUMBERS % 7 < 4, 1.0, 0.0)}
FRAME = {'rays': UP[:40], 'ranges': np.full(40, 0.04), 'sigma': np.full(40, 2e-5), 'id': NUMBERS[:40]}
SEEN = {'id': NUMBERS[NUMBERS % 5 > 0], 'xyz': DOTS[NUMBERS % 5 > 0] * 1.01}
LOCATED = COLOURS | {'id': np.arange(40)}
MOVED = {'p': DOTS, 'q': 1.01 * DOTS}
WIDE = 1e-3 * np.stack([*np.mgrid[:10.0, :11.0][::-1], np.zeros((10, 11))], axis=2)
SCORE = {'score': np.pad(np.ones((3, 4)), ((1, 2), (2, 1))), 'wide': WIDE}
OUTLINED = _core.common.find_outlines(**SCORE, level=0.5, refine=2)
START, POINTS = OUTLINED.start, OUTLINED.points
AXES = {'sums': np.array([1.0, 0.1, 0.2, 3.0, 0.1, 2.0]), 'points': POINTS, 'start': START}
PATCH = {'points': DOTS[NUMBERS % 7 < 4], 'border': POINTS, 'start': START, 'wide': WIDE}
SHAPE = {'centroid': DOTS[:20].mean(axis=0), 'normal': UP[0]}


def membrane(rest=DOTS, origin=np.zeros(3)):
    material = _core.touchpad.SkinMaterial(stiffness=90.0, area_share=0.8, pressure=2000.0)
    return _core.touchpad.Membrane(rest, **GRID, material=material, origin=origin)


def classifier():
    return _core.touchpad.DotClassifier(membrane(), border_network(), _core.touchpad.StickSlipModel())


def locator():
    found = _core.touchpad.DotLocator(camera(), membrane(), DOTS)
    colour = _core.touchpad.WaterColour(**WATER, disagree=2.5, patchy=2.5)
    water = _core.touchpad.PadWater(path=PATH, colour=colour, ring=8.0, ring_share=0.45, ink=0.75, glare=1.2, cap_z=-0.007, cap_radius=0.02)
    glare = _core.touchpad.PadGlare(colour=np.ones(2), field=np.zeros(7), kind=_core.touchpad.Glare(**GLARE), red=0.15, shading=0.015,
                                    min_ratio=0.01)
    found.take_water(water, glare, 0.05)
    return found


def water_ranges(path, lengths, **dots):
    return fields(_core.touchpad.water_ranges(path, _core.touchpad.SeenDots(**dots), 3, 4, lengths, 0.45))


def water_lengths(water=WATER, glare=GLARE, **seen):
    seen, glare = _core.touchpad.SeenColours(**DYED | seen), _core.touchpad.Glare(**glare)
    return fields(_core.touchpad.water_lengths(seen, _core.touchpad.WaterColour(**water, disagree=2.5, patchy=2.5), glare))


def camera(**given):
    return _core.common.Camera(**CAMERA | {name: given[name] for name in CAMERA if name in given}, farthest=1.5)


def marker_view(centre=CENTRE['centre'], **given):
    return _core.press.MarkerView(camera=camera(**given), centre=centre, camera_centres=np.zeros((2, 3)))


def contact_point(centroid=SHAPE['centroid'], normal=SHAPE['normal'], **patch):
    shape = _core.touchpad.RegionShape(centroid=centroid, normal=normal, area=1e-5, pitch=1.3e-3, sigma=3e-5)
    return fields(_core.touchpad.contact_point(**PATCH | patch, region=shape, rest=_core.touchpad.RestCap(centre_z=-0.01, radius=0.02)))


def fields(found):
    """All arrays of a result."""
    values = [getattr(found, name) for name in sorted(dir(found)) if not name.startswith('_')]
    return [np.asarray(value) for value in values if isinstance(value, (np.ndarray, float))]


def call_stick_slip(score=np.where(NUMBERS % 7 < 4, 1.0, 0.0), **arrays):
    """States of dots in the second of two frames."""
    states = _core.touchpad.StickSlip(6, 7, np.zeros(3))
    states.update(_core.touchpad.DotLoads(**LOADS), score, 0.03)
    return [states.update(_core.touchpad.DotLoads(**LOADS | arrays), score, 0.03), states.displacements()]


#: Function of the module: how it is called here, and an example of each of its arrays.
POINTS = {'xyz': DOTS, 'normal': UP, 'displacement': DOTS, 'force': UP, 'normal_force': np.ones(42), 'state': np.ones(42, np.uint8)}
BETWEEN = {'points': np.ascontiguousarray(DOTS[:, :2]), 'queries': np.ascontiguousarray(DOTS[:5, :2] + 1e-4)}

CALLS = {
    'ring_colours': (lambda **a: fields(_core.touchpad.ring_colours(**COLOURS | a, radius=8.0, ink=0.75, glare=1.2)), COLOURS),
    'path_lengths': (lambda **a: _core.touchpad.path_lengths(**LIGHT | a), LIGHT),
    'water_ranges': (lambda **a: water_ranges(**PAD | a), PAD),
    'locate': (lambda **a: fields(locator().locate(**LOCATED | a)), LOCATED),
    'water_lengths': (water_lengths, DYED),
    'rays': (lambda uv=SEEN_PX['uv'], **a: [camera(**a).rays(uv)], SEEN_PX | CAMERA),
    'back_project': (lambda uv=SEEN_PX['uv'], **a: [marker_view(**a).back_project(uv)], SEEN_PX | CAMERA | CENTRE),
    'Membrane': (lambda **a: fields(membrane(**a)), {'rest': DOTS, 'origin': np.zeros(3)}),
    'forces': (lambda xyz=DOTS: membrane().forces(xyz), {'xyz': DOTS}),
    'solve': (lambda **a: fields(membrane().solve(**FRAME | a)), FRAME),
    'loads': (lambda **a: fields(membrane().loads(**SEEN | a)), SEEN),
    'scores': (lambda **a: [border_network().scores(_core.touchpad.DotLoads(**LOADS | a), pitch=1.3e-3, **GRID)], LOADS),
    'classify': (lambda **a: fields(classifier().classify(**SEEN | a, seconds=0.03)), SEEN),
    'fit_rigid': (lambda **a: fields(_core.touchpad.fit_rigid(**MOVED | a)), MOVED),
    'stick_slip': (call_stick_slip, LOADS | {'score': np.where(NUMBERS % 7 < 4, 1.0, 0.0)}),
    'nearest_points': (lambda **a: list(_core.common.nearest_points(**BETWEEN | a, count=3)), BETWEEN),
    'grid_normals': (lambda xyz=WIDE: [_core.common.grid_normals(xyz)], {'xyz': WIDE}),
    'extend_surface': (lambda xyz=WIDE: [_core.common.extend_surface(xyz)], {'xyz': WIDE}),
    'pack_points': (lambda **a: [_core.common.pack_points(**POINTS | a)], POINTS),
    'find_outlines': (lambda **a: fields(_core.common.find_outlines(**SCORE | a, level=0.5, refine=2)), SCORE),
    'region_axes': (lambda **a: [_core.common.region_axes(**AXES | a, pitch=1e-3)], AXES),
    'contact_point': (contact_point, PATCH | SHAPE),
    'may_continue': (lambda: [_core.common.may_continue(seen_s=1.0, last_s=1.0, stamp_s=1.1)], {}),
}


def test_every_function_of_the_module_is_tried():
    files = Path(__file__).parents[1].rglob('test_*border*.py')
    tried = [name for path in files for name in re.findall(r"^    '(\w+)': \(", path.read_text(), re.MULTILINE)]
    # Modules of rooms are tried by their tests; classes are tried by their methods.
    functions = {name for module in (_core.touchpad, _core.common) for name, value in vars(module).items()
                 if callable(value) and not isinstance(value, type)}
    assert len(functions) > 5 and functions <= set(tried)


test_any_array_is_answered_or_refused_by_name_however_it_lies_in_memory = arrays_test(CALLS)


@pytest.mark.parametrize('call, wrong', [
    *[(lambda **wrong: water_lengths(glare=GLARE | wrong), wrong) for wrong in ({'probability': 0.0}, {'size': 0.0})],
    *[(lambda **wrong: water_lengths(WATER | wrong), wrong) for wrong in ({'absorptions': np.array([0.0, 1.0])}, {'noise': np.ones(4)})]])
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
