# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The light's way through the water, against lengths worked out by hand and by a fine sum."""
import numpy as np
import pytest
from tactile_perception.touchpad.water import LightPath

CENTRE = (0.0, 0.0, -0.04)
UP = np.array([[0.0, 0.0, 1.0]])


def test_eight_lamps_stand_for_a_ring_of_very_many():
    path = LightPath(-0.01, -0.037, 0.016, 0.25, CENTRE)
    places = np.array([[0.012, 0.004, 0.006], [-0.006, 0.009, 0.010], [0.0, 0.0, 0.013]])
    normals = places - [0, 0, -0.007]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    angle = np.linspace(0, 2 * np.pi, 721)[:-1]
    way = places[:, None] - np.column_stack([0.016 * np.cos(angle), 0.016 * np.sin(angle), np.full(720, -0.037)])
    distance = np.linalg.norm(way, axis=2)
    weight = (np.einsum('nkc,nc->nk', way, normals) / distance + 0.25) / distance**2
    slant = (weight * distance / way[..., 2]).sum(1) / weight.sum(1)
    back = np.linalg.norm(places - np.array(CENTRE), axis=1) / (places[:, 2] + 0.04)
    assert path.lengths(places, normals)[0] == pytest.approx((places[:, 2] + 0.01) * (slant + back), rel=2e-4)


def test_slope_is_that_of_the_length_along_the_ray():
    path = LightPath(-0.01, -0.037, 0.016, 0.25, CENTRE)
    place = np.array([[0.010, -0.006, 0.008]])
    ray = place - np.array(CENTRE)
    ray /= np.linalg.norm(ray)
    step = 1e-5
    numeric = (path.lengths(place + step * ray, UP)[0] - path.lengths(place - step * ray, UP)[0]) / (2 * step)
    assert path.lengths(place, UP, ray)[1] == pytest.approx(numeric, rel=0.01)
