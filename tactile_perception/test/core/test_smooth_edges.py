# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots that stick out of a region or dent it, against the same in NumPy."""
import cv2
import numpy as np
import pytest
from tactile_perception import _core


def smoothed(score):
    rows, columns = score.shape
    return _core.smooth_edges(score.ravel(), rows=rows, columns=columns).reshape(score.shape)


def reference(score):
    touching = score > 0.5
    around = np.pad(touching.astype(int), 1)
    next_to = around[:-2, 1:-1] + around[2:, 1:-1] + around[1:-1, :-2] + around[1:-1, 2:]
    _, label = cv2.connectedComponents(touching.astype(np.uint8))
    large = np.bincount(label.ravel())[label] >= 8
    found = np.where(touching & large & (next_to <= 1), score - 0.1, score)
    return np.where(~touching & (score > 0) & (next_to >= 3), np.minimum(score + 0.1, 1.0), found)


@pytest.mark.parametrize('seed', range(20))
def test_random_scores(seed):
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(2, 24, 2))
    score = cv2.GaussianBlur(rng.normal(0.45, 0.8, shape), (3, 3), 0).clip(0, 1)
    np.testing.assert_array_equal(smoothed(score), reference(score))


def test_a_dot_that_sticks_out_and_a_dent_go_where_their_score_hardly_decides():
    score = np.zeros((10, 10))
    score[3:7, 2:8] = 1.0
    score[2, 4], score[6, 5], score[3, 7], score[7, 2] = 0.56, 0.44, 0.44, 0.7
    found = smoothed(score)
    assert found[2, 4] == pytest.approx(0.46) and found[6, 5] == pytest.approx(0.54)
    assert found[3, 7] == 0.44 and found[7, 2] == pytest.approx(0.6)  # a corner has two next to it; a sure dot stays


def test_few_dots_in_contact_are_left_as_they_are():
    score = np.zeros((7, 7))
    score[3, 2:5] = score[2:5, 3] = 0.55
    np.testing.assert_array_equal(smoothed(score), score)


def test_what_is_unknown_stays_unknown():
    score = np.ones((5, 6))
    score[2, 3] = np.nan
    assert np.isnan(smoothed(score)[2, 3]) and (np.delete(smoothed(score), 15) == 1).all()
