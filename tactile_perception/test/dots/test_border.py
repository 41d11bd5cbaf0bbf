# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The border of _core.dots: whatever array NumPy can make, a call answers or raises ValueError with the argument's name."""
import numpy as np
import pytest
from border_checks import arrays_test

from tactile_perception._core import dots
from tactile_perception.dots.appearance import Appearance
from tactile_perception.dots.fit import DiscModel

UV = 20.0 * np.argwhere(np.ones((6, 7)))[:, ::-1] + 10
COLOUR = np.random.default_rng(1).integers(0, 256, (20, 30, 3), dtype=np.uint8)
IMAGE = np.random.default_rng(0).integers(0, 256, (60, 80), dtype=np.uint8)
TRACKS = {'last': UV, 'predicted': UV + 1.0, 'first': UV - 3.0, 'seen': np.ones(len(UV), bool), 'dots': UV + 0.8}
SEEN = {'id': np.arange(len(UV)), 'uv': UV + 0.3 * np.sin(UV), 'sigma': np.full(len(UV), 0.02)}
LOOK, MODEL = Appearance('grey', 1, 4.0, 6.0, 8.0, 0.9, -100.0, 150.0, 2.0), DiscModel(4.0, 8.0, 0.9)
TABLES = {name: getattr(MODEL, name) for name in ('basis', 'estimators', 'modes', 'gains', 'levers', 'profile')}


class Given:
    """An object with the attributes of another, some replaced."""

    def __init__(self, other, changes):
        self.__dict__ |= vars(other) | changes


def arrays_of(found, *names):
    return [getattr(found, name) for name in names]


def call_finder(image=IMAGE, **tables):
    """Dots, with the tables given in place of the good ones."""
    return arrays_of(dots.DotFinder(Given(MODEL, tables), LOOK).find(image), 'uv', 'area', 'sigma', 'candidates')


def call_reference(**arrays):
    """Displacements from a reference of some of the dots."""
    reference = dots.DotReference(30.0, 10)
    reference.take(SEEN['id'][:30], UV[:30], np.zeros(30, np.int64))
    return arrays_of(reference.update(**SEEN | arrays, stamp_s=0.0, is_touched=None), 'displacement', 'grown')


#: What is called, how it is called here, and an example of each of its arrays.
CALLS = {
    'DotFinder': (call_finder, {'image': IMAGE, **TABLES}),
    'extract_channel': (lambda image=COLOUR: [dots.extract_channel(image, 1)], {'image': COLOUR}),
    'BlobFinder': (lambda image=IMAGE: arrays_of(dots.BlobFinder(1, 2, 9, 4.0, 30.0).find(image), 'uv', 'area', 'sigma'), {'image': IMAGE}),
    'link_tracks': (lambda **arrays: arrays_of(dots.link_tracks(**TRACKS | arrays, size=(300.0, 200.0)), 'dot', 'position'), TRACKS),
    'GridNumbering': (lambda uv=UV: arrays_of(dots.GridNumbering(6, 7).number(uv), 'id', 'reason'), {'uv': UV}),
    'find_grid': (lambda uv=UV: [np.array(dots.find_grid(uv))], {'uv': UV}),
    'DotReference': (call_reference, SEEN),
    'find_lattice': (lambda positions=UV: arrays_of(dots.find_lattice(positions), 'rc', 'member'), {'positions': UV}),
}


test_any_array_is_answered_or_refused_by_name_however_it_lies_in_memory = arrays_test(CALLS)


@pytest.mark.parametrize('changes', [{'half': 0}, {'half': 1000}, {'per_square': np.nan}, {'smallest': -1.0}, {'largest': 4.0},
                                     {'blur': np.inf}])
def test_numbers_of_a_model_are_checked(changes):
    with pytest.raises(ValueError, match=f'^{next(iter(changes))}: '):
        dots.DotFinder(Given(MODEL, changes), LOOK)


@pytest.mark.parametrize('changes', [{'typical': 0.0}, {'contrast': np.nan}, {'ground': 256}, {'noise': -1.0}, {'step': 0}])
def test_numbers_of_a_look_are_checked(changes):
    with pytest.raises(ValueError, match=f'^{next(iter(changes))}: '):
        dots.DotFinder(MODEL, Given(LOOK, changes))
