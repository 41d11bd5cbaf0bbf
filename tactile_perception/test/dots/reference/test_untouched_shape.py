# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.dots.reference.untouched_shape import rest_suspicion


def dome(rows=23, columns=23, pitch=18.0, printing=0.05, seed=0):
    """A printed dome seen by a tilted camera: id, uv with printing errors of so many pitches, and row and column from the middle."""
    row, column = np.divmod(np.arange(rows * columns), columns)
    p = np.stack([column - (columns - 1) / 2, row - (rows - 1) / 2], axis=1)
    seen = p * (1.1 - 0.1 * (p**2).sum(axis=1, keepdims=True) / (rows / 2) ** 2) / (1 + 0.004 * p[:, 1:])
    return np.arange(rows * columns), pitch * (seen + np.random.default_rng(seed).normal(0, printing / 2, p.shape)) + 240, p


@pytest.mark.parametrize('seed', range(10))
def test_untouched(seed):
    id, uv, _ = dome(seed=seed)
    assert rest_suspicion(id, uv, 23) == ''


@pytest.mark.parametrize('place', [(0.0, 0.0), (4.0, 0.0), (-3.0, 5.0)])
def test_a_press_of_a_quarter_pitch(place):
    id, uv, p = dome()
    away = p - place
    pressed = uv + 18.0 * 0.25 * away / 2.5 * np.exp(0.5 - (away**2).sum(axis=1, keepdims=True) / (2 * 2.5**2))
    assert 'set_reference' in rest_suspicion(id, pressed, 23)


def test_a_shear_over_a_patch():
    id, uv, p = dome()
    dragged = uv + [6.0, 0] * np.exp(-((p - [3, 2]) ** 2).sum(axis=1, keepdims=True) / (2 * 3.0**2))
    assert rest_suspicion(id, dragged, 23) != ''


def test_missing_dots_make_no_suspicion():
    id, uv, _ = dome()
    keep = np.random.default_rng(0).uniform(size=len(id)) > 0.1
    assert rest_suspicion(id[keep], uv[keep], 23) == ''


def test_too_few_dots_to_tell():
    id, uv, _ = dome(5, 5)
    assert rest_suspicion(id, uv, 5) == ''
