# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The detector against the Cramer-Rao bound in the benchmark's scenes, one seed; dots.py measures more scenes, and time."""
import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

HERE = Path(__file__).parent


def load(name):
    """A module beside this file, by path: the benchmark is no package."""
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, HERE / f'{name}.py')
        sys.modules[name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]


scenes, dots = load('scenes'), load('dots')


@pytest.mark.parametrize('name', scenes.NAMES)
def test_error_sigma_and_completeness(name):
    scene, rng = scenes.make_scene(name, 11), np.random.default_rng(11)
    for noise in dots.NOISES:
        detector = dots.DotDetector('dark')
        cells = [dots.score(scene, detector.detect(scene.frame(noise, rng)), noise) for _ in range(3)]
        sums = {key: sum(cell[key] for cell in cells) for key in cells[0]}
        found = dots.summary({**sums, 'ms': np.nan})
        assert found['error_over_bound'] < 1.25
        assert 0.8 < found['normalised_variance'] < 1.25
        assert found['false_per_1000'] <= 1.0
        assert found['missed_per_1000'] <= (8.0 if name == 'all at once' else 1.0)


@pytest.mark.parametrize('name', ('plain', 'compressed', 'sheared'))
def test_error_of_small_sharp_dots(name):
    scene, rng = scenes.make_scene(name, 13, size=(320, 240), pitch=9.0, psf=0.45), np.random.default_rng(13)
    detector = dots.DotDetector('dark')
    cells = [dots.score(scene, detector.detect(scene.frame(1.0, rng)), 1.0) for _ in range(8)]
    assert (sum(cell['error2'] for cell in cells) / sum(cell['bound2'] for cell in cells)) ** 0.5 < 1.1


def test_the_bound_follows_noise_contrast_and_edge_length():
    bound = scenes.position_bound(np.array([5.0, 9.0]), np.array([130.0, 130.0]), 0.9, 2.0)
    assert bound[1] < bound[0]
    twice = scenes.position_bound(np.array([5.0, 9.0]), np.array([65.0, 65.0]), 0.9, 2.0)
    np.testing.assert_allclose(twice, 2 * bound)
    # a disc's edge, blurred by a Gaussian and the pixel, knows its place by amplitude^2 * length / (4 sqrt(pi) blur)
    blur = np.hypot(0.9, 12**-0.5)
    rough = np.sqrt(2 * (4 + 1 / 12)) / 130 / np.sqrt(np.pi * 9 / (4 * np.sqrt(np.pi) * blur))
    assert bound[1] == pytest.approx(rough, rel=0.1)


def test_an_unknown_scene_lists_the_known_ones():
    with pytest.raises(ValueError, match='plain'):
        scenes.make_scene('moon')
