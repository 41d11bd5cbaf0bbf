# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel taxel_score (src/taxel/taxel_score.cpp) against the same steps in NumPy and SciPy."""
import numpy as np
import pytest
from scipy import ndimage
from tactile_perception._core import taxel_score

RULE = {'smooth': 1.0, 'reach': 2, 'share': 0.6, 'ramp': 0.33}


def blurred(image, sigma):
    """image, blurred, its border repeated."""
    return ndimage.gaussian_filter(image, sigma, mode='nearest', truncate=4.0)


def largest(image, reach):
    """Largest of image within reach along both axes."""
    return ndimage.maximum_filter(image, 2 * reach + 1, mode='nearest')


def near(pressure, smooth, reach, least):
    """Level by what is near, continued to the border of a contact."""
    wide = np.pad(largest(blurred(pressure, smooth), reach), reach, mode='edge')
    middle = wide[reach:-reach, reach:-reach]
    far = np.max([wide[:-2 * reach, reach:-reach], wide[2 * reach:, reach:-reach], wide[reach:-reach, :-2 * reach],
                  wide[reach:-reach, 2 * reach:]], axis=0)
    return np.maximum(np.maximum(2 * middle - far, 0.3 * middle), least)


def fitted(pressure, weight):
    """Coefficients of 1, y, x, yy, xy, xx, and mean, between a plane and the quadratic that explains more."""
    row, column = np.nonzero(weight > 0)
    if len(row) < 16:
        return None
    terms = np.stack([np.ones(len(row)), row, column, row * row, row * column, column * column], axis=1).astype(float)
    value, root = pressure[row, column].astype(float), np.sqrt(weight[row, column])
    found = []
    for count in (3, 6):
        share = np.linalg.lstsq(terms[:, :count] * root[:, None], value * root, rcond=None)[0]
        found.append((np.append(share, np.zeros(6 - count)), (root**2) @ (value - terms[:, :count] @ share)**2))
    (plane, left), (bent, less) = found
    return plane + np.clip(5 * (1 - less / left) - 1, 0, 1) * (bent - plane), np.average(value, weights=root**2)


def border_of(share, mean, patch_pressure, full, y, x, share_of_step, ramp):
    """Expected pressure at the border, on all taxels, of a patch with that level."""
    level = share[0] + share[1] * y + share[2] * x + share[3] * y * y + share[4] * x * y + share[5] * x * x
    bend = np.array([[2 * share[3], share[4]], [share[4], 2 * share[5]]])
    if share[3] < 0 and share[5] < 0 and np.linalg.det(bend) > 0:
        at = np.linalg.solve(bend, -share[1:3])
        top = share[0] + 0.5 * share[1:3] @ at
        if top > 0 and 2 * np.pi * top / np.sqrt(np.linalg.det(bend)) < 2.5 * (np.where(full, level, patch_pressure) > top / 2).sum():
            slope = np.hypot(share[1] + 2 * share[3] * y + share[4] * x, share[2] + share[4] * y + 2 * share[5] * x)
            return ramp * slope * np.sqrt(top / np.maximum(top - level, 1e-6 * top))
    return share_of_step * np.clip(level, 0.3 * mean, 1.7 * mean)


def scored(pressure, full, least, smooth, reach, share, ramp):
    """The score as the kernel should have it; full: saturated taxels, which hide the level."""
    if not (pressure > share * least).any():
        return np.zeros_like(pressure)
    nearby = near(pressure, smooth, reach, least)
    soft = np.clip(2.5 * pressure / nearby - 1, 0, 1)
    inner = np.clip(5 * blurred(soft, smooth) - 3.75, 0, 1)
    labels, count = ndimage.label(largest((pressure > share * nearby).astype(np.uint8), (reach + 1) // 2), np.ones((3, 3)))
    expected = share * nearby
    y, x = np.mgrid[:pressure.shape[0], :pressure.shape[1]].astype(float)
    for label in range(1, count + 1):
        mine = labels == label
        level = None
        if mine.sum() >= 16:
            level = fitted(pressure, inner * mine * ~full) or fitted(pressure, inner * mine) or fitted(pressure, soft * mine)
        if level:
            around = largest(mine.astype(np.uint8), (reach + 1) // 2) > 0
            border = border_of(*level, np.where(mine, pressure, 0), full & mine, y, x, share, ramp)
            expected[around] = np.maximum(border, share * least)[around]
    score = np.clip(0.5 * pressure / expected, 0, 1)
    dips, count = ndimage.label(score <= 0.5)
    for dip in range(1, count + 1):
        inside = dips == dip
        touches = inside[0].any() or inside[-1].any() or inside[:, 0].any() or inside[:, -1].any()
        if not touches and score[inside].min() >= 0.5 * 0.35 / share:
            score[inside] = 1
    row, column = np.nonzero(pressure > share * least)
    far = 2 * reach + 2 * int(np.ceil(4 * smooth)) + 2
    near_box = np.zeros(score.shape, bool)
    near_box[max(row.min() - far, 0):row.max() + far + 1, max(column.min() - far, 0):column.max() + far + 1] = True
    return np.where(near_box, score, 0)


def picture(rng, rows, columns):
    """Pressure of a few faces, flat, tilted and curved, with noise."""
    y, x = np.mgrid[:rows, :columns].astype(float)
    found = np.zeros((rows, columns))
    for _ in range(rng.integers(1, 4)):
        away = np.hypot(y - rng.uniform(0, rows), (x - rng.uniform(0, columns)) * rng.uniform(0.5, 1)) / rng.uniform(2, 8)
        flat = rng.random() < 0.5
        found += rng.uniform(1e4, 6e4) * (away < 1) * (1 + rng.uniform(-0.02, 0.02) * x if flat else np.maximum(1 - away**2, 0))
    return (ndimage.gaussian_filter(found, 0.9) + rng.normal(0, 100, found.shape)).astype(np.float32)


@pytest.mark.parametrize('seed', range(30))
def test_scores_are_those_of_the_same_steps_in_numpy(seed):
    rng = np.random.default_rng(seed)
    rows, columns = rng.integers(1, 40, 2)
    image = picture(rng, rows, columns)
    clip = np.float32(np.inf if seed % 2 else 0.6 * image.max())
    image, full = np.minimum(image, clip), image >= clip
    np.testing.assert_allclose(taxel_score(image, full, least=1e3, **RULE), scored(image, full, 1e3, **RULE), atol=5e-3)


@pytest.mark.parametrize('value', [np.nan, np.inf, -np.inf, -5.0])
def test_what_is_no_pressure_has_scores_of_0_to_1(value):
    image = picture(np.random.default_rng(0), 20, 20)
    image[5:9, 3:8] = value
    score = taxel_score(image, np.zeros(image.shape, bool), least=1e3, **RULE)
    assert ((score >= 0) & (score <= 1)).all()
    assert not taxel_score(np.full((9, 9), np.nan, np.float32), np.ones((9, 9), bool), least=1e3, **RULE).any()


def test_the_border_of_a_face_that_is_about_as_curved_as_flat_does_not_jump():
    y, x = np.mgrid[-12:13, -12:13]
    noise = np.random.default_rng(3).normal(0, 1500, y.shape)
    scores = []
    for bend in np.linspace(0, 200, 101):
        face = np.where((abs(x) < 9) & (abs(y) < 6), 3e4 + bend * x * y + noise, 0).astype(np.float32)
        scores.append(taxel_score(face, np.zeros(face.shape, bool), least=1e3, **RULE))
    assert max(np.abs(b - a).max() for a, b in zip(scores[:-1], scores[1:])) < 0.05
