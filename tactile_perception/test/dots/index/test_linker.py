# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.dots.index.linker import LOST, TRACKED, Linker, assign
from tactile_perception.errors import BadArgument


def scattered(count=120, least=20.0, seed=0):
    """Places at random, none nearer than least px to another."""
    rng, places = np.random.default_rng(seed), []
    while len(places) < count:
        p = rng.uniform(0, 450, 2)
        if all(np.hypot(*(p - q)) > least for q in places):
            places.append(p)
    return np.array(places)


def test_assignment_is_one_to_one_and_of_least_squares():
    places, dots = np.array([[0.0, 0], [10, 0]]), np.array([[6.0, 0], [14, 0]])
    place, dot = assign(places, dots, 9.0)  # the nearest pair alone (10 to 6 or 14) would leave one out
    assert dict(zip(place.tolist(), dot.tolist())) == {0: 0, 1: 1}


def test_assignment_leaves_out_what_is_too_far():
    place, dot = assign(np.array([[0.0, 0], [100, 0]]), np.array([[3.0, 0], [160, 0]]), 9.0)
    assert place.tolist() == [0] and dot.tolist() == [0]
    assert len(assign(np.zeros((0, 2)), np.zeros((3, 2)), 5.0)[0]) == 0


def test_numbers_stay_through_a_drag_of_two_spacings():
    uv, linker, rng = scattered(), Linker(), np.random.default_rng(1)
    linker.update(uv, -0.02)
    for step in range(40):
        order = rng.permutation(len(uv))
        shift = 45.0 * np.sin(np.pi * step / 39) * np.exp(-((uv - 225) ** 2).sum(axis=1, keepdims=True) / (2 * 90**2))
        number = linker.update((uv + shift * [1, 0] + rng.normal(0, 0.1, uv.shape))[order], step / 60)
        np.testing.assert_array_equal(number, order)


def test_lost_dots_come_back_under_their_number_and_none_is_used_twice():
    uv, linker = scattered(30), Linker(keep_s=0.5)
    linker.update(uv, 0.0)
    assert linker.update(uv[1:], 0.1).tolist() == list(range(1, 30))
    assert linker.state[linker.id == 0] == LOST
    assert linker.update(uv, 0.2)[0] == 0
    for step in range(10):
        linker.update(uv[1:], 0.3 + 0.1 * step)
    assert 0 not in linker.id
    for step in range(3):
        number = linker.update(uv, 2.0 + 0.1 * step)
    assert number[0] >= 30
    assert (linker.state == TRACKED).all()


def test_a_false_dot_of_one_frame_is_never_handed_out():
    uv, linker = scattered(30), Linker()
    linker.update(uv, 0.0)
    assert linker.update(np.vstack([uv, [[600.0, 600.0]]]), 0.1)[-1] == -1
    linker.update(uv, 0.2)
    assert len(linker.id) == 30


def test_no_dots():
    linker = Linker()
    assert len(linker.update(np.zeros((0, 2)), 0.0)) == 0
    assert linker.update(scattered(5), 1.0).tolist() == [0, 1, 2, 3, 4]
    assert len(linker.update(np.zeros((0, 2)), 1.1)) == 0


def test_wrong_parameters():
    with pytest.raises(BadArgument, match='gate > 0'):
        Linker(gate=0)
