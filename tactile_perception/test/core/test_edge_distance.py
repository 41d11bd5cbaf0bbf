# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Distances of dots from a contact's border, against the same network in NumPy, turned grids, and faces pressed into a flat skin."""
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from tactile_perception import _core

PITCH = 1.3e-3
PARABOLA = np.linalg.pinv(np.vander(np.arange(-2, 3), 3))[2]  # its value in the middle of five points, by their values
HEADER = Path(__file__).parents[2] / 'src/touchpad/contact/edge_weights.hpp'


def distance(score, load, places, normals):
    rows, columns = score.shape
    found = _core.edge_distance(score.ravel(), load.ravel(), places.reshape(-1, 3), normals.reshape(-1, 3), rows=rows, columns=columns,
                                pitch=PITCH)
    return found.reshape(score.shape)


def network():
    parts = re.findall(r'\w+_\d\[\d+\] = \{([^}]*)\}', HEADER.read_text())
    numbers = [np.array([float(number) for number in part.split(',') if number.strip()]) for part in parts]
    return [(weights.reshape(-1, len(biases)), biases) for weights, biases in zip(numbers[::2], numbers[1::2])]


def windows(values, reach):
    return np.lib.stride_tricks.sliding_window_view(np.pad(values, reach), (2 * reach + 1, 2 * reach + 1)).reshape(values.size, -1)


def reference(score, load, places, normals):
    near = cv2.dilate((score > 0.25).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    bends, inner = np.zeros_like(score), np.s_[1:-1, 1:-1]
    off = places[:-2, 1:-1] + places[2:, 1:-1] + places[1:-1, :-2] + places[1:-1, 2:] - 4 * places[inner]
    bends[inner] = 4 * np.clip((off * normals[inner]).sum(axis=2) / PITCH, -0.5, 0.5)
    spread = np.full((score.size, 1), 20 * np.clip(np.median(np.abs(load)), 0.02, 0.06))
    total = np.zeros_like(score)
    for way in range(8):
        def turned(values, way=way):
            return np.rot90(values.T if way > 3 else values, way)
        fed = np.hstack([windows(turned(np.clip(load, -1, 4)), 2), windows(turned(score), 2), windows(turned(bends), 2), spread])
        for number, (weights, biases) in enumerate(network()):
            fed = (np.maximum(fed, 0) if number else fed) @ weights + biases
        back = np.rot90(fed.reshape(turned(score).shape), -way)
        total += back.T if way > 3 else back
    found = smoothed(np.where(near, np.clip(0.5 + total / 16, 0, 1), 0))
    high = (found > 0.5).astype(np.uint8)
    alone = (high > 0) & (cv2.boxFilter(high, -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT) == 1)
    large = (load >= min(1.5, load.max())) & (cv2.boxFilter(load, -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT) > 1.5)
    return np.where(alone & ~large, 0.5, found)


def smoothed(found):
    wide, told = np.pad(found, 2), found.copy()
    for row, column in np.argwhere(found[1:-1, 1:-1] > 0.5) + 1:
        for way in range(4):
            part = np.rot90(wide[row:row + 5, column:column + 5], way)
            if (part[3] > 0.5).all() and max(part[2, 1], part[2, 3], *part[1, 1:4]) <= 0.5:
                told[row, column] = max(0, min(part[2, 2], part[2] @ PARABOLA))
    return told


def random_dots(seed):
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(3, 25, 2))
    score = cv2.GaussianBlur(rng.normal(0.3, 0.8, shape), (3, 3), 0).clip(0, 1)
    places = np.stack([*np.mgrid[:shape[0], :shape[1]] * PITCH, rng.normal(0, 1e-4, shape)], axis=-1)
    normals = rng.normal(0, 0.2, (*shape, 3)) + [0, 0, 1]
    return score, rng.normal(0.5, 1.5, shape), places, normals / np.linalg.norm(normals, axis=2, keepdims=True)


@pytest.mark.parametrize('seed', range(8))
def test_random_dots(seed):
    dots = random_dots(seed)
    np.testing.assert_allclose(distance(*dots), reference(*dots), atol=1e-5)


@pytest.mark.parametrize('seed', range(4))
def test_a_turned_or_mirrored_grid_gives_the_same(seed):
    dots = random_dots(seed)
    found = distance(*dots)
    np.testing.assert_allclose(distance(*(np.ascontiguousarray(np.rot90(part)) for part in dots)), np.rot90(found), atol=1e-5)
    np.testing.assert_allclose(distance(*(np.ascontiguousarray(part[::-1]) for part in dots)), found[::-1], atol=1e-5)


@pytest.fixture
def flat_face():
    """Dots of a flat face, 7 x 7 of them, with its line load at the border, in a skin that rises beside it and carries noise."""
    off = np.abs(np.mgrid[:15, :15] - 7).max(axis=0)
    load = np.choose(np.clip(off - 2, 0, 3), [1.0, 1.3, 0.1, np.broadcast_to(0.04 * (-1)**np.arange(15), off.shape)])
    places = np.stack([*np.mgrid[:15, :15] * PITCH, 0.4 * PITCH * np.maximum(off - 3, 0)], axis=-1)
    return np.choose(np.clip(off - 2, 0, 2), [1.0, 0.6, 0.0]), load, places, np.broadcast_to([0.0, 0.0, 1.0], (*off.shape, 3)).copy()


def test_a_single_dot_does_not_stick_out_of_a_straight_border(flat_face):
    """A dot in front of the border carries load by an error; in a row of three such dots, all touch. The corners are outside."""
    score, load, places, normals = flat_face
    score[3, 7], load[3, 7], places[3, 7, 2] = 1, 2, 0.1 * PITCH
    told = distance(score, load, places, normals)
    assert (told > 0.5).sum() == 45 and told[3, 7] > 0.4
    score[3, 6:9], load[3, 6:9], places[3, 6:9, 2] = 1, 2, 0.1 * PITCH
    assert (distance(score, load, places, normals)[3, 6:9] > 0.5).all()


def test_without_a_likely_dot_nothing_touches():
    score, load, places, normals = random_dots(1)
    assert not distance(np.minimum(score, 0.25), load, places, normals).any()


@pytest.mark.parametrize('value', [np.nan, np.inf, -np.inf, 1e300])
def test_any_number_gives_a_score(value):
    for number in range(4):
        dots = random_dots(2)
        dots[number].ravel()[::3] = value
        found = distance(*dots)
        assert ((found >= 0) & (found <= 1)).all()
