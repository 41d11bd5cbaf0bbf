# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import cv2
import numpy as np
import pytest
from tactile_perception.errors import BadArgument
from tactile_perception.touchpad.contact import LoadEstimator
from tactile_perception.touchpad.membrane import MembraneMaterial

ORIGIN = np.array([0.0, 0.0, -0.04])


@pytest.fixture
def balance(pad):
    made = LoadEstimator(pad.rows, pad.columns, MembraneMaterial(), ORIGIN)
    made.set_rest(pad.rest)
    return made


def dent(rest, depth, width=3e-3):
    distance = np.linalg.norm(rest[:, :2], axis=1)
    return rest - np.outer(depth * np.exp(-(distance / width)**2), [0, 0, 1])


def test_an_untouched_pad_is_quiet_in_noise_and_when_it_has_moved_as_a_whole(pad, balance):
    noise = np.random.default_rng(0).normal(size=(529, 3)) * 2e-6
    loads = balance.loads(pad.ids, pad.rest + noise + [20e-6, 0, -30e-6])
    assert loads.seen.all() and loads.none


def test_quiet_is_told_from_touched(pad, balance):
    small, large = (balance.loads(pad.ids, dent(pad.rest, depth)) for depth in (20e-6, 0.4e-3))
    assert small.none and not large.none and large.load.max() > 0.5


def test_a_dent_carries_a_load_where_it_is_and_the_wrench_points_inwards(pad, balance):
    loads = balance.loads(pad.ids, dent(pad.rest, 1.5e-3))
    distance = np.linalg.norm(pad.rest[:, :2], axis=1)
    assert loads.load[distance < 1.5e-3].min() > 0.5 and np.abs(loads.load[distance > 9e-3]).max() < 0.3
    wrench = loads.carried(23, 23)[1]
    # the dots around pull: no object makes such a dent
    assert wrench[2] < -0.02 and np.abs(wrench[:2]).max() < 1e-3 and np.abs(wrench[3:]).max() < 1e-5


def test_the_moment_is_that_of_the_forces(pad, balance):
    loads = balance.loads(pad.ids, dent(pad.rest + [1e-3, 0, 0], 1.5e-3))
    loaded = (loads.load > 0.5).astype(np.uint8).reshape(23, 23)
    share = sum(cv2.dilate(loaded, np.ones((2 * reach + 1,) * 2)).ravel() / 4 for reach in (2, 3, 4, 5))
    force, wrench = loads.carried(23, 23)
    np.testing.assert_allclose(force, loads.force * share[:, None], rtol=1e-12)
    np.testing.assert_allclose(wrench, np.hstack([force, np.cross(loads.xyz, force)]).sum(axis=0), atol=1e-12)


def test_unseen_dots_are_placed_by_the_balance(pad, balance):
    whole = dent(pad.rest, 1.5e-3)
    all_loads = balance.loads(pad.ids, whole)
    some = np.flatnonzero(np.random.default_rng(0).random(529) > 0.05)
    loads = balance.loads(some, whole[some])
    assert not loads.seen.all()
    assert np.mean(np.abs(loads.load - all_loads.load) > 0.3) < 0.03


def test_no_dots_at_all_leave_finite_numbers(balance):
    loads = balance.loads(np.zeros(0, int), np.zeros((0, 3)))
    assert not loads.seen.any() and loads.none and np.isfinite(loads.load).all()


def test_numbers_outside_the_grid_are_refused(pad, balance):
    with pytest.raises(BadArgument, match='outside the grid'):
        balance.loads(np.array([529]), pad.rest[:1])


def test_another_rest_is_taken_as_untouched(pad, balance):
    other = pad.rest + [0.2e-3, 0, 0]
    balance.set_rest(other)
    np.testing.assert_allclose(balance.loads(pad.ids, other).load, 0, atol=1e-9)


@pytest.mark.parametrize('name', ['tp_rect_drag', 'tp_disc_twist', 'tp_ring_press'])
def test_force_and_pressure_of_a_recording_seen_without_error(recording, name):
    truth, errors = recording(name), []
    balance = LoadEstimator(23, 23, MembraneMaterial(), ORIGIN)
    balance.set_rest(truth['dot_rest_xyz'])
    for frame in range(len(truth['pressure'])):
        loads = balance.loads(np.arange(529), truth['dot_xyz'][frame].astype(float))
        true = truth['force'][frame]
        if np.linalg.norm(true) > 0.1 and truth['residual'][frame] < 0.03 * np.linalg.norm(true):
            errors.append(np.linalg.norm(loads.force[loads.load > 0.25].sum(axis=0) - true) / np.linalg.norm(true))
    assert np.median(errors) < 0.04
