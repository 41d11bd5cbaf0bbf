# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel of src/dots/detect/blob_regions.cpp against a flood fill in NumPy."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tactile_perception._core import find_blob_regions

SEEDS = st.integers(0, 2**32 - 1)


def flooded(mask):
    """Labels of the connected regions of a mask, as their first pixels come row by row."""
    labels, count = np.zeros(mask.shape, int), 0
    for start in np.argwhere(mask):
        todo, count = [tuple(start)], count + (labels[tuple(start)] == 0)
        while todo:
            row, column = todo.pop()
            if mask[row, column] and not labels[row, column]:
                labels[row, column] = count
                todo += [(r, c) for r in range(max(row - 1, 0), min(row + 2, mask.shape[0]))
                         for c in range(max(column - 1, 0), min(column + 2, mask.shape[1]))]
    return labels


@given(seed=SEEDS, rows=st.integers(1, 20), columns=st.integers(1, 40), share=st.floats(0, 1))
@settings(max_examples=150, deadline=None)
def test_regions_are_those_of_a_flood_fill(seed, rows, columns, share):
    mask = (np.random.default_rng(seed).random((rows, columns)) < share).astype(np.uint8) * 255
    box, centre, area, label, labels = find_blob_regions(mask, speck=1, least=0.2, most=3.0)
    expected = flooded(mask)
    np.testing.assert_array_equal(labels, expected)
    sizes = np.bincount(expected.ravel())[1:]
    some = np.sort(sizes[sizes > 1])
    middle = some[len(some) // 2] if len(some) else 0
    kept = []
    for number, size in enumerate(sizes, 1):
        at = np.argwhere(expected == number)
        inside = (at.min(0) > 0).all() and (at.max(0) < np.array(mask.shape) - 1).all()
        if inside and 0.2 * middle < size < 3.0 * middle:
            low, extent = at.min(0), np.ptp(at, axis=0) + 1
            kept.append((number, [*low[::-1], *extent[::-1]], at.mean(0)[::-1], size))
    assert label.tolist() == [number for number, *_ in kept] and area.tolist() == [size for *_, size in kept]
    assert box.tolist() == [corner for _, corner, _, _ in kept]
    assert centre == pytest.approx(np.array([middle for *_, middle, _ in kept]).reshape(-1, 2))


def test_more_regions_than_labels_are_ground():
    mask = np.zeros((1000, 400), np.uint8)
    mask[1::2, 1::2] = 1  # 99 500 single pixels
    _, _, area, label, labels = find_blob_regions(mask, speck=0, least=0.5, most=2.0)
    assert labels.max() == 65535 and (labels[mask > 0] == 0).sum() == 100000 - 65535
    assert len(np.unique(label)) == len(label) and (area == 1).all()
