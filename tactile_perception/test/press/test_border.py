# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Kernels of sheets and domes with arbitrary arguments."""
import copy
from types import SimpleNamespace

import numpy as np
import pytest
from border_checks import arrays_test

from tactile_perception._core import press
from tactile_perception.press import constants
from tactile_perception.press.estimate import constants_of
from tactile_perception.press.sheet.mechanics import SheetMesh

# Sheets.
MESH = {name: getattr(SheetMesh(np.zeros(2), np.array([0.03, 0.03]), 8e-3, 2), name)
        for name in ('value', 'slope', 'laplacian', 'weight', 'rest')} | {'depths': np.array([5e-4, 1e-3])}
LOAD = press.SheetLoad(position=np.zeros(2), radius=7e-3, prestretch=1.05, bending=2e-7, friction=0.5, drag=np.zeros(2))
POSITIONS = {'rest': 1e-3 * (np.random.default_rng(1).uniform(5, 55, (40, 2)) - 30), 'camera_centre': np.tile([0.0, 0.0, -0.06], (40, 1))}
PRESSES = {'presses': np.array([[1e-3, 2e-3, 2e-3, 0.0, 0.0, 0.0], [8e-3, 2e-3, 1e-3, 0.0, 0.0, 0.0]])}
FRAME = {'value': np.random.default_rng(3).normal(0, 1e-4, (40, 3)), 'motion': np.random.default_rng(5).normal(0, 1e-5, (40, 3))}
SHEET_FIELD = POSITIONS | {'shift': 1e-3 + FRAME['value'][:, :2], 'growth': FRAME['value'][:, 2]}
START = {'start': PRESSES['presses']}
FIELD = {'field': np.zeros((16, 3), np.float32)}
NOISE = press.MarkerNoise(shift=1e-5, growth=1e-2, share_shift=1e-2, share_growth=1.0)
PLAN = {'half': np.full(2, 0.03), 'reach': np.full(2, 0.02), 'scale': 8e-3, 'depth': 8e-3, 'spread': 0.3, 'power': 1.5, 'widening': 0.2,
        'n': 1, 'order': 2, 'levels': 3}
TABLE = {'modes': np.array([2, 1, 0, 1]), 'coefficients': np.random.default_rng(4).normal(0, 1, 12 * 4 * 6 * 13).astype(np.float32),
         'shapes': np.full(48, 1e-3, np.float32)}

# Domes.
DOME = {'edges': np.linspace(0, 1, 4),
        'even_table': np.full((6, 6, 2, 2, 2), 1e-3, np.float32), 'odd_table': np.full((6, 2, 2, 2, 2), 1e-3, np.float32),
        'even_modes': np.full((2, 4, 3, 3), 1e-3, np.float32), 'odd_modes': np.full((2, 4, 3, 3), 1e-3, np.float32)}
DOME_PLAN = press.DomePlan(curvature=0.15, centre_z=-0.04, disc_scale=0.9, reach=0.3, depth=0.04, power=1.5, radius=0.02, radius_spread=0.8)
DOME_PRESS = {'points': np.full((5, 3), 0.01), 'presses': np.zeros((1, 7))}
DOME_MARKERS = {'points': np.full((5, 3), 0.01), 'camera_centres': np.zeros((5, 3))}
DOME_MARKERS['smooth'] = np.full((5, 2), 0.1)
DOME_FRAME = {'shift': np.full((5, 2), 1e-3)}
LONGEST = {'longest': np.full(7, 0.1)}


def markers(**arrays):
    return press.SheetMarkers(**POSITIONS | arrays, radius=1e-3, near=0.01)


def table(plan=PLAN, **arrays):
    """A table of a sheet library."""
    return press.SheetTable(press.SheetPlan(**plan), **TABLE | arrays)


def fields(found):
    """All arrays of a result."""
    values = [getattr(found, name) for name in sorted(dir(found)) if not name.startswith('_')]
    return [np.asarray(value) for value in values if isinstance(value, (np.ndarray, float))]


def fit_sheet(fitted=None, start=START['start'], **arrays):
    frame = press.SheetFrame(**FRAME | {name: arrays.pop(name) for name in FRAME if name in arrays})
    return (fitted or table()).fit(markers(**arrays), frame, NOISE, press.SheetPrior(drags=True), start)


def show(presses=PRESSES['presses'], shown=None, **arrays):
    return fields((shown or table()).show(markers(**arrays), presses, 0.3))


def fit_dome(starts=np.zeros((1, 7)), shift=DOME_FRAME['shift'], longest=LONGEST['longest'], **arrays):
    errors = press.DomeErrors(still=1e-5, share=0.01, top=0.01, longest=longest)
    prior = press.DomePrior(drag=0.1, friction=0.1, tip_sigma=0.3, together=0.1)
    return press.DomeLibrary(DOME_PLAN, **DOME).fit(press.DomeMarkers(**DOME_MARKERS | arrays, plane_z=0.12), errors, prior, shift, starts)


def sheet_method(templates=PRESSES['presses'][:, :3]):
    shifts = press.CameraShifts(camera_centres=POSITIONS['camera_centre'][:1], shifts=np.zeros((1, 2)), printed=np.zeros(2))
    device = press.SheetDevice(shifts=shifts, noise=NOISE, tip_radius=7e-3, pitch=np.full(2, 4e-3), lowest=np.full(2, -1.0),
                               highest=np.ones(2))
    return press.SheetMethod(table(), device, constants_of(press.SheetRules, constants.SHEET), templates, 2)


def estimate_sheet(templates=PRESSES['presses'][:, :3], **arrays):
    return [value for one in sheet_method(templates).estimate(**SHEET_FIELD | arrays) for value in fields(one)]


def dome_method(starts=np.zeros((1, 7)), **arrays):
    prior = press.DomePrior(drag=0.1, friction=0.1, tip_sigma=0.3)
    surface = press.MarkerSurface(size=np.zeros(2), rim_radius=0.15, height=0.12)
    device = press.DomeDevice(markers=press.DomeMarkers(**DOME_MARKERS, plane_z=0.12), surface=surface, scales=press.DomeScales(),
                              errors=press.DomeErrors(still=1e-5, share=0.01, top=0.01, **LONGEST), straight=prior, dragged=prior,
                              two=prior, pitch=0.015)
    library = press.DomeLibrary(DOME_PLAN, **DOME)
    method = press.DomeMethod(library, library, device, constants_of(press.DomeRules, constants.DOME), starts)
    field = {'rest': np.full((5, 2), 0.01)} | DOME_FRAME | arrays
    return [value for one in method.estimate(**field) for value in fields(one)] + [method.score(field['shift'])]


#: Function of the module: how it is called here, and an example of each of its arrays.
CALLS = {
    'press_sheet': (lambda depths=MESH['depths'], **a: press.press_sheet(SimpleNamespace(**MESH | a), LOAD, depths), MESH),
    'fit': (lambda **a: fields(fit_sheet(**a)), POSITIONS | FRAME | START),
    'estimate': (estimate_sheet, SHEET_FIELD),
    'SheetMethod': (estimate_sheet, {'templates': PRESSES['presses'][:, :3].copy()}),
    'score': (lambda **a: [sheet_method().score(**SHEET_FIELD | a)], SHEET_FIELD),
    'show': (show, POSITIONS | PRESSES),
    'SheetTable': (lambda **a: show(shown=table(**a)), TABLE),
    'show_field': (lambda field=FIELD['field'], **a: press.show_field(field, markers(**a), position=(0.0, 0.0), half=(0.03, 0.03),
                                                                      scale=8e-3)[None], FIELD | POSITIONS),
    'DomeLibrary': (lambda **a: [press.DomeLibrary(DOME_PLAN, **DOME | a).moved(**DOME_PRESS)], DOME),
    'moved': (lambda **a: [press.DomeLibrary(DOME_PLAN, **DOME).moved(**DOME_PRESS | a)], DOME_PRESS),
    'DomeMethod': (dome_method, {'starts': np.zeros((1, 7)), 'rest': np.full((5, 2), 0.01)} | DOME_FRAME),
    'fit_dome': (lambda **a: fields(fit_dome(**a)), {'starts': np.zeros((1, 7))} | DOME_MARKERS | DOME_FRAME | LONGEST),
}

test_any_array_is_answered_or_refused_by_name_however_it_lies_in_memory = arrays_test(CALLS)


@pytest.mark.parametrize('member', ['coefficients', 'shapes'])
@pytest.mark.parametrize('value', [np.nan, np.inf, 1e38])
def test_a_table_of_arbitrary_numbers_raises_nothing_unexpected(member, value):
    broken = table(**{member: np.full_like(TABLE[member], value)})
    assert np.isfinite(fit_sheet(broken).presses).all()


@pytest.mark.parametrize('wrong', [{'plan': PLAN | {'scale': np.nan}}, {'plan': PLAN | {'levels': -1}}, {'modes': np.full(4, -1)},
                                   {'coefficients': np.zeros(5, np.float32)}, {'plan': PLAN | {'reach': np.full(2, 0.03)}}])
def test_a_table_of_numbers_out_of_range_is_refused_by_name(wrong):
    name = next(iter(wrong))
    with pytest.raises(ValueError, match=f"^{'scale|levels|reach' if name == 'plan' else name}: "):
        table(**wrong)


@pytest.mark.parametrize('one', [NOISE, LOAD, DOME_PLAN, press.SheetFrame(**FRAME)])
def test_structs_are_copied(one):
    for other in (copy.copy(one), copy.deepcopy(one)):
        for name in dir(one):
            if not name.startswith('_'):
                np.testing.assert_array_equal(getattr(other, name), getattr(one, name))


def test_rows_of_another_number_are_refused():
    with pytest.raises(ValueError, match='^camera_centre: 40 rows are needed, got 39'):
        markers(camera_centre=POSITIONS['camera_centre'][1:])
    with pytest.raises(ValueError, match='^value: 40 rows are needed, got 3'):
        fit_sheet(value=FRAME['value'][:3], motion=FRAME['motion'][:3])
