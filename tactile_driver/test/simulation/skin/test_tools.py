# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_driver.errors import BadArgument
from tactile_driver.simulation.skin.tools import TOOLS, tool_named


@pytest.mark.parametrize('name, place, distance', [
    ('rectangle', (0, 0, -0.002), 0.002), ('rectangle', (0.009, 0, 0.005), 0.002), ('rectangle', (0, 0, 0.001), -0.001),
    ('disc', (0.008, 0, 0.005), 0.002), ('disc', (0.003, 0, 0), 0.0),
    ('ring', (0, 0, 0.005), 0.0045), ('ring', (0.006, 0, -0.001), 0.001), ('ring', (0, -0.006, 0), 0.0),
    ('sphere', (0, 0, -0.010), 0.002), ('sphere', (0.008, 0, 0), 0.0), ('prism', (0, 0, -0.001), 0.001), ('prism', (0.005, 0, 0), 0.0),
    ('two_spheres', (-0.0065, 0, -0.0055), 0.001), ('two_spheres', (0.0065, 0, -0.0041), 0.0)])
def test_distances(name, place, distance):
    assert tool_named(name).distance(np.array([place]))[0] == pytest.approx(distance, abs=1e-9)


@pytest.mark.parametrize('name', sorted(TOOLS))
def test_distance_grows_by_one_along_its_slope_outside(name):
    tool = TOOLS[name]
    places = np.random.default_rng(2).uniform(-0.012, 0.012, (300, 3))
    distance, normal = tool.distance_and_normal(places)
    nearest = np.sort(np.vstack([tool.part_distances(places), np.full(len(places), np.inf)]), axis=0)
    outside = (distance > 1e-4) & (nearest[1] - nearest[0] > 3e-4)  # two balls' distance has a crease between them
    np.testing.assert_allclose(tool.distance(places + 1e-4 * normal)[outside], distance[outside] + 1e-4, atol=2e-6)


def test_unknown_tool_lists_the_known_ones():
    with pytest.raises(BadArgument, match='fingertips_37mm, fingertips_46mm'):
        tool_named('hammer')
