# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The border of the compiled module: whatever array NumPy can make, a function answers or raises ValueError with the argument's name."""
import re
from pathlib import Path

import numpy as np
import pytest
from border_checks import check_any_array, check_memory, check_wrong_type
from tactile_perception import _core
from tactile_perception.press.sheet.mechanics import SheetMesh

PLACES = np.random.default_rng(1).uniform(5, 55, (40, 2))


SHEET = {name: getattr(SheetMesh(np.zeros(2), np.array([0.03, 0.03]), 8e-3, 2), name)
         for name in ('value', 'slope', 'laplacian', 'weight', 'rest')} | {'depths': np.array([5e-4, 1e-3])}


def call_press_sheet(**arrays):
    """A small sheet, pressed."""
    return _core.press_sheet(**SHEET | arrays, place=(0.0, 0.0), radius=7e-3, prestretch=1.05, bending=2e-7, friction=0.5, slides=False,
                             drag=(0.0, 0.0))


COLOURS = np.random.default_rng(3).integers(0, 256, (60, 80, 3), dtype=np.uint8)
PATH = np.array([-0.005, -0.038, 0.018, 0.2, 0.0, 0.0, -0.04])
PAD = {
    'path': PATH, 'lengths': np.full(12, 0.036), 'rays': np.random.default_rng(4).normal((0, 0, 1), (0.1, 0.1, 0), (12, 3)),
    'id': np.arange(12), 'rest_ranges': np.full(12, 0.05), 'rest_normals': np.tile([0.0, 0.0, 1.0], (12, 1)),
}
LIGHT = {'path': PATH, 'places': np.random.default_rng(5).normal(0, 0.004, (12, 3)), 'normals': PAD['rest_normals'], 'rays': PAD['rays']}

SKIN = {'path': PATH, 'places': PAD['rays'] * 0.05, 'border_normals': PAD['rest_normals']}
SEEN = {'ratios': np.random.default_rng(6).normal(-1.5, 0.1, (12, 2)), 'count': np.full(12, 16), 'patchiness': np.zeros(12),
        'excess': np.linspace(-0.1, 0.2, 12), 'excess_sigma': np.full(12, 0.02), 'colour': np.full((12, 2), 0.5)}


def call_skin_light(**arrays):
    """Light on a skin of 3 x 4 places, with the arrays given in place of the good ones."""
    return _core.skin_light(**{**SKIN, **arrays}, rows=3, columns=4)


def call_water_lengths(**arrays):
    """Path lengths with glare, with the arrays given in place of the good ones."""
    return _core.water_lengths(**{**SEEN, **arrays}, constants=(-0.5, -0.4), absorptions=(35.0, 27.0), noise=(1e-5, 5e-6, 5e-6, 1e-5),
                               probability=0.3, size=0.1)


def call_ring_colours(image=COLOURS, uv=PLACES):
    """Colours with the arguments that are no arrays as they are in use."""
    return _core.ring_colours(image, uv, 8.0)


def call_path_lengths(**arrays):
    """Lengths of paths, with the arrays given in place of the good ones."""
    return _core.path_lengths(**{**LIGHT, **arrays})


def call_water_ranges(**arrays):
    """Ranges on a grid of 3 x 4 dots, with the arrays given in place of the good ones."""
    return _core.water_ranges(**{**PAD, **arrays}, rows=3, columns=4, ring_share=0.45)


SPLINES, EYES = np.zeros((16, 3), np.float32), np.tile([0.0, 0.0, -0.06], (40, 1))
PRESSES = np.array([[1e-3, 2e-3, 2e-3, 0.0, 0.0, 0.0], [8e-3, 2e-3, 1e-3, 0.0, 0.0, 0.0]])
NOISE = (1e-5, 1e-2, 1e-2, 1.0, 0.0, 0.0)
VIEWED = {'rest': 1e-3 * (PLACES - 30), 'eye': EYES, 'presses': PRESSES}
VALUES = {'value': np.random.default_rng(3).normal(0, 1e-4, (40, 3)), 'sigma': np.full(40, 1e-5),
          'motion': np.random.default_rng(5).normal(0, 1e-5, (40, 3))}


def table(numbers=np.array([0.03, 0.03, 0.02, 0.02, 8e-3, 8e-3, 0.3, 1.5, 0.2]), sizes=np.array([1, 2, 3, 2, 1, 0, 1]),
          coefficients=np.random.default_rng(4).normal(0, 1, 12 * 4 * 6 * 13).astype(np.float32), shapes=np.full(48, 1e-3, np.float32)):
    """Of a sheet library."""
    return numbers, sizes, coefficients, shapes


def call_fit_presses(**arrays):
    """Two presses, fitted."""
    return _core.fit_presses(table(), **VIEWED | VALUES | arrays, noise=NOISE, tip=(0.0, 0.15), marker_radius=1e-3, drags=True, near=0.01)


def call_show_presses(**arrays):
    """Two presses, shown."""
    return _core.show_presses(table(), **VIEWED | arrays, mixed=0.3, marker_radius=1e-3, near=0.01)


def call_show_field(field=SPLINES, rest=VIEWED['rest'], eye=EYES):
    """A field, shown."""
    return _core.show_field(field, rest, eye, place=(0.0, 0.0), half=(0.03, 0.03), scale=8e-3, marker_radius=1e-3)[None]


CAMERA = {'uv': np.array([[300.0, 200.0], [640.0, 480.0], [320.0, 240.0]]), 'matrix': np.array([[600.0, 0, 320], [0, 605, 240], [0, 0, 1]]),
          'distortion': np.array([-0.1, 0.02, 1e-4, -2e-4, 0.0]), 'rotation': np.eye(3), 'centre': np.array([0.0, 0.0, -0.06])}


def call_back_project(**arrays):
    """Pixels of a camera with a usual lens."""
    return _core.back_project(**CAMERA | arrays, farthest=1.5, plane_z=0.0)


def call_camera_rays(**arrays):
    """Pixels of a camera with a usual lens."""
    return _core.camera_rays(**{name: value for name, value in (CAMERA | arrays).items() if name != 'centre'}, farthest=1.5)


DOME_ARRAYS = {'numbers': np.array([0.15, -0.04, 0.9, 0.3, 0.04, 1.5, 0.02, 0.8]), 'edges': np.linspace(0, 1, 4),
               'even_table': np.full((6, 6, 2, 2, 2), 1e-3, np.float32), 'odd_table': np.full((6, 2, 2, 2, 2), 1e-3, np.float32),
               'even_modes': np.full((2, 4, 3, 3), 1e-3, np.float32), 'odd_modes': np.full((2, 4, 3, 3), 1e-3, np.float32),
               'points': np.full((5, 3), 0.01), 'eyes': np.zeros((5, 3))}
DOME_PRIOR = np.array([np.zeros(7), np.ones(7), np.full(7, -3.0), np.full(7, 3.0), np.full(7, 0.1)])


def call_press_dome(**arrays):
    """Displacements under a press, all arrays but those given as they are in use."""
    return _core.press_dome(**DOME_ARRAYS | {'presses': np.zeros((1, 7))} | arrays)


def call_fit_dome(**arrays):
    """The press of a dome, all arrays but those given as they are in use."""
    known = {'shift': np.full((5, 2), 1e-3), 'weight': np.ones(5), 'shared': np.full((2, 5), 0.1), 'starts': np.zeros((1, 7)),
             'prior': DOME_PRIOR}
    return _core.fit_dome(**DOME_ARRAYS | known | arrays, plane_z=0.12)


#: Function of the module: how it is called here, and an example of each of its arrays.
CALLS = {
    'press_sheet': (call_press_sheet, SHEET),
    'ring_colours': (call_ring_colours, {'image': COLOURS, 'uv': PLACES}),
    'path_lengths': (call_path_lengths, LIGHT),
    'water_ranges': (call_water_ranges, PAD),
    'skin_light': (call_skin_light, SKIN),
    'water_lengths': (call_water_lengths, SEEN),
    'fit_presses': (call_fit_presses, VIEWED | VALUES),
    'show_presses': (call_show_presses, VIEWED),
    'show_field': (call_show_field, {'field': SPLINES, 'rest': VIEWED['rest'], 'eye': EYES}),
    'back_project': (call_back_project, CAMERA),
    'camera_rays': (call_camera_rays, {name: value for name, value in CAMERA.items() if name != 'centre'}),
    'press_dome': (call_press_dome, DOME_ARRAYS | {'presses': np.zeros((1, 7))}),
    'fit_dome': (call_fit_dome, DOME_ARRAYS | {'shift': np.full((5, 2), 1e-3), 'weight': np.ones(5), 'shared': np.full((2, 5), 0.1),
                                               'starts': np.zeros((1, 7)), 'prior': DOME_PRIOR}),
}
ARRAYS = [(function, name) for function, (_, arrays) in CALLS.items() for name in arrays]


def test_every_function_of_the_module_is_tried():
    files = Path(__file__).parent.glob('test_border*.py')
    tried = [name for path in files for name in re.findall(r"^    '(\w+)': \(", path.read_text(), re.MULTILINE)]
    # Modules of rooms are tried by their tests; classes are tried by their methods.
    functions = {name for name in dir(_core) if not name.startswith('__') and not isinstance(getattr(_core, name), type)}
    assert functions - {'finger', 'dots', 'taxel'} <= set(tried)


@pytest.mark.parametrize('check', [check_any_array, check_wrong_type, check_memory])
@pytest.mark.parametrize('function, name', ARRAYS)
def test_any_array_is_answered_or_refused_by_name_however_it_lies_in_memory(function, name, check):
    check(*CALLS[function], name)


@pytest.mark.parametrize('wrong', [{'numbers': np.full(8, np.nan)}, {'sizes': np.array([1, 2, 3, 2, 1, 0, 9])}, {'sizes': np.full(7, -1)},
                                   {'coefficients': np.zeros(5, np.float32)}, {'shapes': np.zeros((2, 2), np.float32)}])
def test_a_table_that_does_not_fit_together_is_refused(wrong):
    with pytest.raises(ValueError, match='^table: '):
        _core.show_presses(table(**wrong), **VIEWED, mixed=0.0, marker_radius=0.0, near=0.0)


@pytest.mark.parametrize('member', ['coefficients', 'shapes'])
@pytest.mark.parametrize('value', [np.nan, np.inf, 1e38])
def test_a_table_of_anything_is_answered(member, value):
    broken = table(**{member: np.full_like(table()[2 if member == 'coefficients' else 3], value)})
    state, *_ = _core.fit_presses(broken, **VIEWED | VALUES, noise=NOISE, tip=(0.0, 0.15), marker_radius=0.0, drags=True, near=0.0)
    assert np.isfinite(state).all()
