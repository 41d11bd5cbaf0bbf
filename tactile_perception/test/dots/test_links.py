# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Links between two sets of places, and tracks."""

import numpy as np
from hypothesis import given, settings, strategies as st
from tactile_perception.common.dots import Dots
from tactile_perception.dots.links import Linker, link_places

SEEDS = st.integers(0, 2**32 - 1)


def update(linker, uv, stamp_s):
    return linker.update(Dots(uv, np.ones(len(uv)), np.ones(len(uv))), stamp_s)


@given(seed=SEEDS, places=st.integers(0, 40), dots=st.integers(0, 40), gate=st.floats(0.1, 60))
@settings(max_examples=100, deadline=None)
def test_places_and_dots_that_are_each_others_nearest_are_linked(seed, places, dots, gate):
    rng = np.random.default_rng(seed)
    p, d = rng.uniform(0, 100, (places, 2)), rng.uniform(0, 100, (dots, 2))
    away = np.linalg.norm(p[:, None] - d, axis=2)
    mutual = [(i, j) for i, j in np.ndindex(away.shape) if away[i, j] < gate and away[i, j] == away[i].min() == away[:, j].min()]
    assert [tuple(link) for link in link_places(p, d, gate).tolist()] == mutual


def scattered(count=120, least=20.0, seed=0):
    """Places at random, none nearer than least px to another."""
    rng, places = np.random.default_rng(seed), []
    while len(places) < count:
        p = rng.uniform(0, 450, 2)
        if all(np.hypot(*(p - q)) > least for q in places):
            places.append(p)
    return np.array(places)


def test_numbers_stay_through_a_drag_of_two_spacings():
    uv, linker, rng = scattered(), Linker(), np.random.default_rng(1)
    update(linker, uv, -0.02)
    for step in range(40):
        order = rng.permutation(len(uv))
        shift = 45.0 * np.sin(np.pi * step / 39) * np.exp(-((uv - 225) ** 2).sum(axis=1, keepdims=True) / (2 * 90**2))
        number = update(linker, (uv + shift * [1, 0] + rng.normal(0, 0.1, uv.shape))[order], step / 60)
        np.testing.assert_array_equal(number, order)


def test_lost_dots_come_back_under_their_number_and_none_is_used_twice():
    uv, linker = scattered(30), Linker()
    update(linker, uv, 0.0)
    assert update(linker, uv[1:], 0.1).tolist() == list(range(1, 30))
    assert update(linker, uv, 0.2)[0] == 0
    for step in range(25):
        update(linker, uv[1:], 0.3 + 0.1 * step)
    assert update(linker, uv, 2.8)[0] == -1 and update(linker, uv, 2.9)[0] >= 30


def test_a_false_dot_of_a_frame_or_two_is_never_handed_out():
    uv, linker = scattered(30), Linker()
    update(linker, uv, 0.0)
    for stamp_s in (0.02, 0.04, 0.1):
        assert update(linker, np.vstack([uv, [[600.0, 600.0]]]), stamp_s)[-1] == (-1 if stamp_s < 0.1 else 30)
    assert update(linker, np.vstack([uv, [[np.nan, 600.0]]]), 0.12).tolist() == [*range(30), -1]


def test_no_dots():
    linker = Linker()
    assert len(update(linker, np.zeros((0, 2)), 0.0)) == 0
    assert update(linker, scattered(5), 1.0).tolist() == [0, 1, 2, 3, 4]
    assert len(update(linker, np.zeros((0, 2)), 1.1)) == 0
