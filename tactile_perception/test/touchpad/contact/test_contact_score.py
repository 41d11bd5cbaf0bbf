# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest
from tactile_perception.common.spherical_cap import Cap
from tactile_perception.touchpad.contact.contact_score import contact_score, heights_over_face, load_share
from tactile_perception.touchpad.contact.loads import LoadEstimator
from tactile_perception.touchpad.membrane.forces import MembraneMaterial

PITCH = 1.4e-3


def _scene(shape=(12, 12)):
    row, column = np.mgrid[:shape[0], :shape[1]] * PITCH
    xyz = np.stack([column, row, 0.01 + 0.2 * column - 5.0 * row**2], -1)
    normal = np.stack([-0.2 + 0 * row, 10 * row, 1 + 0 * row], -1)
    return xyz, normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def test_dots_on_a_curved_face_lie_on_it_and_those_beyond_the_edge_stand_out():
    xyz, normal = _scene()
    loaded = np.zeros((12, 12), bool)
    loaded[3:9, 2:10] = True
    xyz[3, 2:10] += 0.25e-3 * normal[3, 2:10]
    xyz += np.random.default_rng(0).normal(size=xyz.shape) * 5e-6
    heights = heights_over_face(loaded, xyz, normal)
    assert np.abs(heights[4:9, 2:10]).max() < 60e-6
    assert heights[3, 2:10].min() > 150e-6
    assert np.isnan(heights[~loaded]).all()


def test_a_patch_too_small_for_a_face_is_left_alone():
    xyz, normal = _scene()
    loaded = np.zeros((12, 12), bool)
    loaded[3:5, 3:6] = True
    assert np.isnan(heights_over_face(loaded, xyz, normal)).all()


ORIGIN = np.array([0.0, 0.0, -0.04])


def _balance():
    y, x = np.meshgrid(np.linspace(-0.25, 0.25, 19), np.linspace(-0.25, 0.25, 19), indexing='ij')
    rays = np.stack([x, y, np.ones_like(x)], -1).reshape(-1, 3)
    rest = Cap().meet(ORIGIN, rays / np.linalg.norm(rays, axis=1, keepdims=True))
    return _of(rest, 19)


def _of(rest, side):
    balance = LoadEstimator(side, side, MembraneMaterial(), ORIGIN)
    balance.set_rest(rest)
    return balance


def _score(balance, xyz):
    loads = balance.loads(*balance.displacements(np.arange(len(xyz)), xyz))
    return contact_score(balance.membrane, loads)


def test_an_untouched_membrane_scores_nothing():
    balance = _balance()
    score = _score(balance, balance.membrane.rest.astype(np.float32))
    assert score.shape == (361,) and score.max() < 0.05


def test_a_dent_is_scored_where_it_is():
    balance = _balance()
    distance = np.linalg.norm(balance.membrane.rest[:, :2], axis=1)
    dented = balance.membrane.rest - np.outer(1.5e-3 * np.exp(-(distance / 3e-3)**2), [0, 0, 1])
    score = _score(balance, dented)
    assert score[distance < 1.5e-3].min() > 0.5
    assert score[distance > 8e-3].max() < 0.5


@pytest.mark.parametrize('name, least', [('tp_rect_drag', 0.95), ('tp_ring_press', 0.87), ('tp_disc_twist', 0.93)])
def test_dots_of_a_recording_seen_without_error(recording, name, least):
    truth = recording(name)
    balance = _of(truth['dot_rest_xyz'], 23)
    counts = np.zeros(3)
    for frame in range(len(truth['pressure'])):
        found = _score(balance, truth['dot_xyz'][frame]) > 0.5
        touched = truth['dot_contact'][frame]
        judged = touched | (truth['dot_gap'][frame] > 50e-6)
        counts += [(found & touched).sum(), (found & ~touched & judged).sum(), (~found & touched).sum()]
    assert 2 * counts[0] / (2 * counts[0] + counts[1] + counts[2]) > least


def test_full_contact_is_what_the_dots_around_carry():
    load = np.zeros((7, 7))
    load[2:5, 2:5] = 3.0
    load[2:5, 5] = 1.2
    share = load_share(load)
    assert share[3, 3] == 1 and share[2, 2] == 1
    assert share[3, 5] == pytest.approx(1.2 / (29.88 / 11.4), abs=1e-9)
    assert share[0, 0] == 0


def test_dots_beside_a_ridge_that_the_mesh_has_loaded_do_not_touch():
    load = np.zeros((9, 9))
    load[3:6, 1:8] = np.array([1.3, 4.3, 1.3])[:, None]
    share = load_share(load)
    assert share[4, 1:8].min() > 0.9 and share[[3, 5], 2:7].max() < 0.4


def test_one_dot_alone_is_no_contact():
    balance = _balance()
    free = balance.loads(*balance.displacements(np.arange(361), balance.membrane.rest))
    loads = replace(free, load=np.where(np.arange(361) == 180, 1.5, 0.0))
    assert not (contact_score(balance.membrane, loads) > 0.5).any()
