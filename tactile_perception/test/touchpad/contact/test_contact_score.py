# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest
from tactile_perception.common.geometry import Cap
from tactile_perception.touchpad.contact.contact_score import contact_score
from tactile_perception.touchpad.contact.loads import LoadEstimator
from tactile_perception.touchpad.membrane.forces import MembraneMaterial

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
    loads = balance.loads(np.arange(len(xyz)), xyz)
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


def test_one_dot_alone_is_no_contact():
    balance = _balance()
    free = balance.loads(np.arange(361), balance.membrane.rest)
    loads = replace(free, load=np.where(np.arange(361) == 180, 1.5, 0.0))
    assert not (contact_score(balance.membrane, loads) > 0.5).any()
