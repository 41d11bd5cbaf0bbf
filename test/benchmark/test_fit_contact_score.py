# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest

_SPEC = importlib.util.spec_from_file_location('fit_contact_score', Path(__file__).with_name('fit_contact_score.py'))
fitting = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(fitting)

SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]])


def test_distances_from_an_outline_with_a_hole():
    points = np.array([[0, 0], [0.9, 0], [3, 0], [0.5, 0], [2, 2]])
    np.testing.assert_allclose(fitting.signed_distance([SQUARE], points), [1, 0.1, -2, 0.5, -2**0.5])
    np.testing.assert_allclose(fitting.signed_distance([SQUARE, 0.4 * SQUARE], points), [-0.4, 0.1, -2, 0.1, -2**0.5])


def test_surroundings_are_those_of_the_grid_in_its_eight_symmetries():
    load, score, rise = np.random.default_rng(0).uniform(size=(3, 5, 6))
    fed = fitting.surroundings(load, score, rise)[2 * 6 + 3]
    assert fed.shape == (fitting.FED,) and (fed[12], fed[37], fed[62]) == (load[2, 3], score[2, 3], rise[2, 3])
    turned = fed[fitting.symmetries()]
    assert len(np.unique(turned, axis=0)) == 8 and (turned[:, [12, 37, 62, 75]] == fed[[12, 37, 62, 75]]).all()
    assert (np.sort(turned[:, 25:50]) == np.sort(fed[25:50])).all()


def test_a_simulated_press_gives_examples_and_the_network_learns_them():
    fed, told, weight = fitting.examples(fitting.random_scene(1, 3), 0.5)
    assert fed.shape == (len(told), fitting.FED) and len(told) > 500 and np.abs(told).max() == 1
    assert weight[:round(0.5 / weight[0])].sum() == pytest.approx(0.5)
    layers = fitting.fit(fed, told, weight, np.random.default_rng(0))
    answer = fed
    for number, (weights, biases) in enumerate(zip(layers[::2], layers[1::2])):
        answer = (np.maximum(answer, 0) if number else answer) @ weights + biases
    assert np.sqrt(np.mean((answer[:, 0] - fitting.OUTWARDS - told)**2)) < 0.5 * told.std()


def test_the_header_holds_all_numbers():
    layers = [np.array([[0.12346, -2.0]]), np.array([1e-9, 3.0])]
    text = fitting.as_header(layers)
    found = [[float(number) for number in part.split(',') if number.strip()] for part in re.findall(r'= \{([^}]*)\}', text)]
    assert found == [[pytest.approx(0.1235), -2.0], [0.0, 3.0]] and 'WEIGHTS_1[2]' in text and 'BIASES_1[2]' in text
