# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.errors import BadArgument
from tactile_perception.press.presses import Presses


def presses():
    """Two untouched frames, then three places pressed to two depths."""
    position = np.vstack([np.full((2, 3), np.nan)] + [np.tile([x, 0.0, -0.001], (2, 1)) for x in (-0.01, 0.0, 0.01)])
    count = len(position)
    return Presses((None,) * count, position, np.array([0, 0] + [1e-3, 2e-3] * 3), np.arange(count), np.full((count, 6), np.nan),
                   np.full(count, np.nan))


def test_places_are_counted_in_order():
    assert presses().places().tolist() == [-1, -1, 0, 0, 1, 1, 2, 2]


def test_held_out_leaves_whole_places_out():
    pairs = list(presses().held_out(3))
    assert [len(held) for _, held in pairs] == [4, 2]  # a place and its mirror image, and the middle
    for fit, held in pairs:
        assert len(fit) + len(held) == 8 and not fit.touching[:2].any()
        assert not set(np.abs(fit.position[fit.touching, 0])) & set(np.abs(held.position[:, 0]))


def test_a_drag_is_no_press_straight_down():
    x = np.array([np.nan, 0, 0, 5e-4, 1e-3, 0, np.nan, 1e-3, 1.1e-3, 9e-3, 9.5e-3])
    depth = np.array([0, 1, 3, 3, 3, 3, 0, 2, 3, 3, 1]) * 1e-3
    count = len(x)
    position = np.stack([x, 0 * x, -depth], axis=1)
    tried = Presses((None,) * count, position, depth, np.arange(count), np.full((count, 6), np.nan), np.full(count, np.nan))
    assert tried.straight().tolist() == [False, True, True, False, False, True, False, True, True, True, True]


def test_a_tip_that_retreats_does_not_load():
    depth = np.array([0, 1, 2, 2.01, 2, 1, 1, 2, 0, 1]) * 1e-3
    segment = np.array([0, 1, 1, 1, 1, 1, 1, 1, 2, 3])
    position, wrench = np.zeros((10, 3)), np.full((10, 6), np.nan)
    tried = Presses((None,) * 10, position, depth, segment, wrench, wrench[:, 0])
    assert tried.loading().tolist() == [False, True, True, True, True, False, False, True, False, True]


def test_lengths_must_agree():
    whole = presses()
    with pytest.raises(BadArgument, match='depth'):
        Presses(whole.fields, whole.position, whole.depth[1:], whole.segment, whole.wrench, whole.radius)
