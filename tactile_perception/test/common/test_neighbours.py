# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Nearest neighbours and special functions are those of SciPy, which the processes of sensors do not import."""
import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.special import ndtr

from tactile_perception.common.neighbours import Neighbours
from tactile_perception.common.statistics import normal_cdf


@pytest.mark.parametrize('points, queries, count', [(1, 5, 1), (5, 9, 8), (500, 500, 7), (2000, 300, 1), (0, 4, 2)])
def test_nearest_points_are_those_of_a_tree(points, queries, count):
    rng = np.random.default_rng(points)
    among, asked = rng.normal(size=(points, 2)), rng.normal(size=(queries, 2))
    distance, index = Neighbours(among).query(asked, count)
    expected = cKDTree(among).query(asked, count)
    assert np.allclose(distance, expected[0], rtol=1e-12)
    assert np.array_equal(index, expected[1])


@pytest.mark.parametrize('points', [
    np.stack([np.arange(60.0), np.zeros(60)], axis=1), np.zeros((9, 2)), np.stack(np.divmod(np.arange(49), 7), axis=1).astype(float),
    np.concatenate([np.random.default_rng(0).normal(0, 1e-3, (40, 2)), [[1e4, -1e4]]])], ids=['line', 'all at one', 'grid', 'far one'])
def test_nearest_distances_are_those_of_a_full_search_however_points_lie(points):
    asked = np.concatenate([points, points + 0.3, [[1e6, 0]]])
    distance, index = Neighbours(points).query(asked, 6)
    every = np.hypot(*(asked[:, None] - points).transpose(2, 0, 1))
    np.testing.assert_allclose(distance, np.sort(every, axis=1)[:, :6], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(np.take_along_axis(every, index, axis=1), distance, rtol=1e-12, atol=1e-12)
    assert all(len(set(row)) == 6 for row in index.tolist())


def test_normal_distribution_function():
    x = np.linspace(-8, 8, 99)
    assert normal_cdf(x) == pytest.approx(ndtr(x), abs=1e-15)


@pytest.mark.parametrize('node', ['touchpad_contact_node', 'press_contact_node', 'taxel_contact_node', 'psd_contact_node'])
def test_a_process_of_a_sensor_starts_without_what_takes_long_to_import(node):
    slow = ('scipy.optimize', 'scipy.spatial', 'scipy.special', 'scipy.sparse', 'rosbag2_py', 'matplotlib')
    code = (f'import sys; from tactile_perception.core.node import NODES; NODES[{node!r}]; '
            f'print(*(name for name in {slow!r} if name in sys.modules))')
    assert subprocess.run([sys.executable, '-c', code], check=True, capture_output=True, text=True).stdout.split() == []
