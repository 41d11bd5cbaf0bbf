# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Overlaps of squares, by hand."""
import numpy as np
import pytest
from tactile_perception.evaluation.overlap import region_iou


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
