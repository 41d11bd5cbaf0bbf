# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_driver.errors import BadArgument
from tactile_driver.simulation.scene.specimen import UNTOUCHED
from tactile_driver.simulation.sensors.scenes import SCENES, open_dual_scene, open_scene


def test_unknown_scene_lists_the_known_ones():
    with pytest.raises(BadArgument, match='demo, disc_tilt, disc_twist'):
        open_scene('nowhere')


@pytest.mark.parametrize('arguments', [{'rate': 0}, {'rate': float('nan')}, {'width': 640, 'height': 640}, {'width': 100, 'height': 75}])
def test_bad_numbers_are_refused(arguments):
    with pytest.raises(BadArgument, match='simulation'):
        open_scene('rest', **arguments)


def test_every_scene_starts_untouched_and_ends_before_its_duration():
    for name, script in SCENES.items():
        starts = [keys[0].t for _, keys in script.acts]
        assert all(start >= UNTOUCHED for start in starts), name
        ends = [keys[-1].t for _, keys in script.acts]
        assert all(end <= start for end, start in zip(ends, starts[1:])), name
        assert all(keys[0].press < 0 and keys[-1].press < 0 for _, keys in script.acts), name


@pytest.fixture(scope='module')
def demo():
    scene = open_scene('demo', width=320, height=240)
    return scene, [scene.observe(k).truth for k in range(scene.frames)]


def test_one_camera_and_two_are_opened_each_by_its_function():
    with pytest.raises(BadArgument, match='two cameras'):
        open_scene('areal_dual_rest')
    with pytest.raises(BadArgument, match='one camera; those with two are areal_dual_calibration'):
        open_dual_scene('demo')
    with pytest.raises(BadArgument, match='unknown'):
        open_dual_scene('nowhere')


@pytest.mark.parametrize('name', ['areal_single_rest', 'air_cushion_rest'])
def test_half_size_is_the_same_view(name):
    whole, half = (open_scene(name, width=width, height=width * 3 // 4).observe(0).truth.dot_uv for width in (640, 320))
    np.testing.assert_allclose((half + 0.5) * 2, whole + 0.5, atol=1e-9)
