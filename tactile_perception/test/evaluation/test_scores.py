# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Scores of labels, by hand.
Overlaps of squares, by hand.
Errors of vectors, by hand and by drawing from known covariances."""
import numpy as np
import pytest
from tactile_perception.evaluation.scores import label_f1, normalised_square, region_iou


def test_label_f1_takes_the_last_column_for_what_was_not_found():
    confusion = np.array([[6, 2, 0, 2], [0, 3, 0, 0], [0, 0, 0, 0]])
    found = label_f1(confusion)
    assert found[:2] == pytest.approx([12 / 16, 6 / 8]) and np.isnan(found[2])


def square(side, centre=(0.0, 0.0)):
    return np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * side / 2 + [*centre, 0]


def test_holes_are_taken_off():
    whole, hole = square(10e-3), square(5e-3)
    assert region_iou([whole], [whole]) == 1
    assert region_iou([whole, hole], [whole]) == pytest.approx(0.75, abs=0.01)
    assert region_iou([whole], [square(10e-3, (5e-3, 0))]) == pytest.approx(1 / 3, abs=0.01)


def test_nothing_overlaps_with_nothing_unknown():
    assert region_iou([], [square(10e-3)]) == 0
    assert np.isnan(region_iou([], [])) and np.isnan(region_iou([square(1e-3)[:2]], []))


@pytest.mark.parametrize('side', [0.3, 0.01, 1e-3])
@pytest.mark.parametrize('centre', [(0.0, 0.0), (-0.06, 0.25)])
def test_neither_place_nor_size_matters(side, centre):
    shifted = np.array(centre) + [0.25 * side, 0]
    assert region_iou([square(side, centre)], [square(side, shifted)]) == pytest.approx(0.6, abs=0.03)


NAN = np.nan


def test_a_drawn_error_has_a_normalised_square_of_its_directions():
    rng = np.random.default_rng(0)
    root = rng.normal(size=(3, 3)) * 1e-4
    squares = [normalised_square(root @ rng.normal(size=3), root @ root.T) for _ in range(4000)]
    assert {directions for _, directions in squares} == {3}
    values = np.array([square for square, _ in squares]) / 3
    assert values.mean() == pytest.approx(1, abs=0.05) and values.var() == pytest.approx(2 / 3, rel=0.1)


def test_flat_directions_are_left_out():
    covariance = np.diag([4e-8, 1e-8, 0.0])
    assert normalised_square(np.array([2e-4, 1e-4, 5.0]), covariance) == (pytest.approx(2.0), 2)


@pytest.mark.parametrize('error, covariance', [
    (np.full(3, NAN), np.eye(3)), (np.zeros(3), np.full((3, 3), NAN)), (np.zeros(3), np.zeros((3, 3))),
    (np.zeros(3), np.diag([1.0, 1, -1]))])
def test_what_says_nothing_is_not_judged(error, covariance):
    square, directions = normalised_square(error, covariance)
    assert np.isnan(square) and directions == 0
