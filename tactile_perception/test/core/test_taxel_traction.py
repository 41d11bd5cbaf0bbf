# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernels taxel_traction_fit and taxel_traction (src/taxel/taxel_traction.cpp) against NumPy and SciPy."""
import numpy as np
import pytest
from scipy import ndimage
from tactile_perception._core import taxel_traction, taxel_traction_fit

SPREADS = np.array([[0.47, 1.24], [0.53, 3.7]])
RULE = {'reach': 5, 'thickness': 2.0, 'spreads': SPREADS}


def blurred(values, sigma, mode):
    return ndimage.gaussian_filter(values.astype(float), sigma, mode=mode, radius=int(np.ceil(4 * sigma)))


def scene(seed, size=(30, 34), at=(9, 12), sides=(12, 9)):
    """Picture before a motion, its touched taxels, and a later picture."""
    rng = np.random.default_rng(seed)
    touched = np.zeros(size, bool)
    touched[at[0]:at[0] + sides[0], at[1]:at[1] + sides[1]] = True
    before = blurred(2e4 * touched * rng.uniform(0.8, 1.2, size), 0.8, 'constant')
    later = ndimage.shift(before, rng.uniform(-0.3, 0.3, 2), order=3) + rng.normal(0, 200, size)
    return before.astype(np.float32), touched, later.astype(np.float32)


def reference(before, touched):
    """Box, and pseudoinverse (4, N) of the terms in it."""
    row, column = np.nonzero(touched)
    top, left = max(row.min() - RULE['reach'], 0), max(column.min() - RULE['reach'], 0)
    box = slice(top, row.max() + RULE['reach'] + 1), slice(left, column.max() + RULE['reach'] + 1)
    before, touched = before[box].astype(float), touched[box]
    down, across = np.gradient(blurred(before, 0.5, 'nearest'))
    even = blurred(touched * before[touched].mean(), 0.5, 'nearest')
    caused = [sum(-share * 2.0 * blurred(np.gradient(even, axis=axis), width, 'constant') for share, width in SPREADS) for axis in (1, 0)]
    y, x = (np.arange(n) - (place.mean() - first) for n, place, first in zip(before.shape, (row, column), (top, left)))
    terms = np.stack([-across, -down, *caused, y[:, None] * across - x * down, np.hypot(across, down), before], axis=-1).reshape(-1, 7)
    return box, np.linalg.pinv(terms.T @ terms, rcond=1e-9, hermitian=True)[:4] @ terms.T


@pytest.mark.parametrize('seed', range(5))
@pytest.mark.parametrize('at', [(9, 12), (0, 25), (20, 1)])
def test_shift_and_traction_are_those_of_least_squares(seed, at):
    before, touched, later = scene(seed, at=at)
    box, inverse = reference(before, touched)
    share, top, left, square = taxel_traction_fit(before, touched, **RULE)
    assert (top, left) == (box[0].start, box[1].start) and share.shape[:2] == before[box].shape
    assert share.reshape(-1, 4).T == pytest.approx(inverse, rel=1e-3, abs=1e-4 * np.abs(inverse).max())
    assert square == pytest.approx((inverse[2:]**2).sum(axis=1).max(), rel=1e-3)
    found = taxel_traction(share, later, before, top=top, left=left)
    assert found == pytest.approx(inverse @ (later - before).astype(float)[box].ravel(), rel=2e-3, abs=1e-3)


def test_a_face_of_one_taxel_or_without_pressure_and_none_are_answered():
    touched = np.zeros((6, 7), bool)
    share, *_, square = taxel_traction_fit(np.ones((6, 7), np.float32), touched, **RULE)
    assert share.shape == (0, 0, 4) and square == 0
    assert taxel_traction(share, np.ones((6, 7), np.float32), np.ones((6, 7), np.float32), top=0, left=0) == (0, 0, 0, 0)
    touched[2, 3] = True
    share, *_, square = taxel_traction_fit(np.zeros((6, 7), np.float32), touched, **RULE)
    assert not share.any() and square == 0


@pytest.mark.parametrize('more', [{'top': 30}, {'left': -1}])
def test_a_box_outside_the_picture_is_refused(more):
    before, touched, _ = scene(0)
    share, top, left, _ = taxel_traction_fit(before, touched, **RULE)
    with pytest.raises(ValueError, match=next(iter(more))):
        taxel_traction(share, before, before, **{'top': top, 'left': left} | more)
