# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception.dots.detect.neighbours import PairList, near_pairs


@pytest.mark.parametrize('reach', [3.0, 14.0, 500.0])
def test_pairs_are_those_of_a_full_search(reach):
    rng = np.random.default_rng(3)
    grid = np.stack(np.meshgrid(np.arange(20.0, 300, 11), np.arange(20.0, 200, 11)), -1).reshape(-1, 2)
    u, v = rng.permutation(grid + rng.uniform(-5, 5, grid.shape)).T
    i, j = near_pairs(u, v, reach)
    expected = np.triu((np.abs(u[:, None] - u) < reach) & (np.abs(v[:, None] - v) < reach), 1)
    assert len(i) == expected.sum()
    assert set(zip(np.minimum(i, j), np.maximum(i, j))) == set(zip(*np.nonzero(expected)))


@pytest.mark.parametrize('count', [0, 1])
def test_no_pairs(count):
    i, j = near_pairs(np.zeros(count), np.zeros(count), 5.0)
    assert len(i) == len(j) == 0


def test_a_list_holds_all_near_pairs_while_places_move():
    rng = np.random.default_rng(5)
    places = rng.uniform(0, 200, (2, 150))
    pairs = PairList(12.0, 3.0)
    for step in (0.3, 0.3, 2.0, 20.0, 0.1):
        places = places + rng.uniform(-step, step, places.shape) + 7.0
        listed = {tuple(sorted(p)) for p in zip(*pairs.of(places))}
        assert {tuple(sorted(p)) for p in zip(*near_pairs(*places, 12.0))} <= listed
    fewer = places[:, :100]
    assert {tuple(sorted(p)) for p in zip(*near_pairs(*fewer, 12.0))} <= {tuple(sorted(p)) for p in zip(*pairs.of(fewer))}
