# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Which dots are in contact: the score of the membrane's loads, and the methods behind one call."""

import numpy as np
import pytest
from tactile_perception import _core
from tactile_perception.errors import BadFrame
from tactile_perception.touchpad.contact import CONTACT_METHODS, border_network, make_method
from tactile_perception.touchpad.membrane import MembraneMaterial

PITCH = 1.3e-3
PAPER = {'paper.d_max': 0.91e-3, 'paper.delta_d': 0.19e-3}
ORIGIN = np.array([0.0, 0.0, -0.04])


@pytest.fixture
def method(request, pad):
    made = make_method(pad.rows, pad.columns, MembraneMaterial(), ORIGIN, {'contact': request.param, **PAPER})
    made.set_rest(pad.rest)
    return made


@pytest.mark.parametrize('method', CONTACT_METHODS, indirect=True)
def test_nothing_touches(pad, method):
    for k in range(5):
        found = method.classify(pad.ids, pad.rest, 0.1 * k)
    assert not found.state.any() and (found.score < 0.5).all()


@pytest.mark.parametrize('method', CONTACT_METHODS, indirect=True)
def test_entries_belong_to_the_dots_that_are_given(pad, method):
    method.classify(pad.ids, pad.rest, 0.0)
    some = np.flatnonzero(pad.ids % 7)[::-1]
    found = method.classify(some, pad.rest[some], 0.1)
    assert found.state.shape == found.score.shape == some.shape and found.state.dtype == np.uint8


@pytest.mark.parametrize('method', ['paper'], indirect=True)
def test_the_papers_method_finds_a_plate_that_moves_and_knows_no_forces(pad, method):
    """A disc pressed in step by step: the dots under it move together. One dot beside it has a wrong range in each frame."""
    for k, height in enumerate(np.linspace(0.0128, 0.0100, 15)):
        xyz = pad.disc(height=height).xyz.copy()
        xyz[100, 2] -= 1e-3 * k
        found = method.classify(pad.ids, xyz, 0.05 * k)
    assert found.all_dots is None and np.isnan(found.wrench).all()
    inside = np.hypot(*pad.rest[:, :2].T) < 4e-3
    assert (found.state[inside] > 0).mean() > 0.9
    assert (found.state[np.hypot(*pad.rest[:, :2].T) > 9e-3] > 0).mean() < 0.05


@pytest.mark.parametrize('method', ['membrane'], indirect=True)
def test_dots_on_a_line_are_refused(pad, method):
    line = pad.rest[:1] + np.linspace(0, 1, 529)[:, None] * (pad.rest[-1:] - pad.rest[:1])
    with pytest.raises(BadFrame, match='on a line'):
        method.classify(pad.ids, line, 0.0)


@pytest.mark.full
@pytest.mark.parametrize('name', ['tp_rect_release'])
def test_laid_down_dragged_and_lifted_a_hundred_times_no_state_is_left_behind(recording, name):
    truth = recording(name)
    method = make_method(23, 23, MembraneMaterial(), ORIGIN, {'contact': 'membrane', **PAPER})
    method.set_rest(truth['dot_rest_xyz'].astype(float))
    ids, rng, free = np.arange(529), np.random.default_rng(0), ~truth['dot_contact'].any(axis=1)
    for turn in range(100):
        found = [method.classify(ids, xyz + rng.normal(0, 1e-6, xyz.shape), 0.03 * k).state for k, xyz in enumerate(truth['dot_xyz'])]
        assert not np.array(found)[free].any(), turn
        if turn == 1:  # friction is known from the first time on
            second = np.array(found)
    assert np.mean(np.array(found) != second) < 0.02  # a frame in which slip begins may be judged either way


def random_loads(seed):
    """Places, normals (rows, columns, 3) and loads (rows, columns)."""
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(3, 25, 2))
    places = np.stack([*np.mgrid[:shape[0], :shape[1]] * PITCH, rng.normal(0, 1e-4, shape)], axis=-1)
    normals = rng.normal(0, 0.2, (*shape, 3)) + [0, 0, 1]
    return places, normals / np.linalg.norm(normals, axis=2, keepdims=True), rng.normal(0.5, 1.5, shape)


def scored(places, normals, load):
    flat = np.ascontiguousarray(places.reshape(-1, 3)), np.ascontiguousarray(normals.reshape(-1, 3)), np.ascontiguousarray(load.ravel())
    loads = _core.DotLoads(flat[0], np.ones(load.size, bool), flat[1], np.zeros_like(flat[0]), flat[2])
    return border_network().scores(loads, rows=load.shape[0], columns=load.shape[1], pitch=PITCH).reshape(load.shape)


@pytest.mark.parametrize('seed', range(4))
def test_a_turned_or_mirrored_grid_scores_the_same(seed):
    dots = random_loads(seed)
    found = scored(*dots)
    assert found.max() > 0.5
    np.testing.assert_allclose(scored(*(np.rot90(part) for part in dots)), np.rot90(found), atol=1e-5)
    np.testing.assert_allclose(scored(*(part[::-1] for part in dots)), found[::-1], atol=1e-5)


@pytest.mark.parametrize('value', [np.nan, np.inf, -np.inf, 1e300])
def test_any_number_gives_a_score_and_none_without_a_load(value):
    for number in range(3):
        dots = random_loads(2)
        dots[number].ravel()[::3] = value
        found = scored(*dots)
        assert ((found >= 0) & (found <= 1)).all()
    assert not scored(*dots[:2], np.minimum(random_loads(2)[2], 0.3)).any()
