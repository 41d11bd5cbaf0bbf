# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_bringup.visualization import markers as mesh


def circle(radius, n=60, z=0.0):
    angle = np.arange(n) * 2 * np.pi / n
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(n, z)], axis=1)


def area(corners):
    a, b, c = corners.reshape(-1, 3, 3).transpose(1, 0, 2)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


def polygon_area(radius, n=60):
    return 0.5 * n * radius**2 * np.sin(2 * np.pi / n)


def test_a_hole_stays_open():
    filled = mesh.fill([circle(0.01), circle(0.005)[::-1]], np.zeros((0, 3)))
    assert area(filled) == pytest.approx(polygon_area(0.01) - polygon_area(0.005), rel=1e-6)


def test_places_within_lift_the_fill_to_the_surface():
    filled = mesh.fill([circle(0.01)], np.array([(0.0, 0.0, 0.004), (0.05, 0.0, 0.9)]))
    assert filled[:, 2].max() == 0.004


@pytest.mark.parametrize('rings', [[], [np.zeros((2, 3))], [np.array([(0, 0, 0), (1, 1, 0), (2, 2, 0)], float)]])
def test_what_has_no_area_gives_no_triangles(rings):
    assert len(mesh.fill(rings, np.zeros((0, 3)))) == 0


def test_the_skin_does_not_bridge_a_notch_in_the_border():
    x, y = (part.ravel() for part in np.meshgrid(np.arange(9.0), np.arange(9.0)))
    kept = ~((x > 2) & (x < 6) & (y > 1))  # a notch as wide as four pitches
    places = np.column_stack([x, y, 0 * x])[kept]
    assert area(places[mesh.skin(places)].reshape(-1, 3)) < 42, 'of 36 without the notch, 64 with it'
    assert len(mesh.skin(places[:2])) == 0 and len(mesh.skin(np.zeros((5, 3)))) == 0


def test_light_falls_from_above():
    flat = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], float)
    level = mesh.light(flat, np.array([[0, 1, 2]]))
    assert np.ptp(level) == 0 and (mesh.light(flat, np.array([[2, 1, 0]])) == level).all(), 'whichever way round'
    steep = mesh.light(flat * (1, 1, 0) + [(0, 0, 0), (0, 0, -9), (0, 0, 0)], np.array([[0, 1, 2]]))
    assert (0 < steep).all() and (steep != level).all() and level[0] <= 1
