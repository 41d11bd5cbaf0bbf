# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The methods behind one call: a name makes each, and each judges the dots it is given and no others."""
import numpy as np
import pytest
from tactile_perception.errors import BadFrame
from tactile_perception.touchpad.contact import CONTACT_METHODS, make_method
from tactile_perception.touchpad.membrane import MembraneMaterial

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
    assert found.force is None or found.force.shape == (len(some), 3)


@pytest.mark.parametrize('method', ['membrane'], indirect=True)
def test_the_membranes_balance_knows_forces(pad, method):
    found = method.classify(pad.ids, pad.rest, 0.0)
    assert found.force.shape == (529, 3) and np.array_equal(found.wrench, np.zeros(6))
    inner = (np.abs(pad.rest[:, :2]) < 0.01).all(axis=1)
    assert np.abs(found.force[inner]).max() < 1e-3


@pytest.mark.parametrize('method', ['paper'], indirect=True)
def test_the_papers_method_finds_a_plate_that_moves_and_knows_no_forces(pad, method):
    """A disc pressed in step by step: the dots under it move together."""
    for k, height in enumerate(np.linspace(0.0128, 0.0100, 15)):
        dots = pad.disc(height=height)
        found = method.classify(pad.ids, dots.xyz, 0.05 * k)
    assert found.force is None and np.isnan(found.wrench).all()
    inside = np.hypot(*pad.rest[:, :2].T) < 4e-3
    assert (found.state[inside] > 0).mean() > 0.9
    assert (found.state[np.hypot(*pad.rest[:, :2].T) > 9e-3] > 0).mean() < 0.05


@pytest.mark.parametrize('method', ['membrane'], indirect=True)
def test_dots_on_a_line_are_refused(pad, method):
    line = pad.rest[:1] + np.linspace(0, 1, 529)[:, None] * (pad.rest[-1:] - pad.rest[:1])
    with pytest.raises(BadFrame, match='on a line'):
        method.classify(pad.ids, line, 0.0)


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
    assert np.mean(np.array(found) != second) < 0.01
