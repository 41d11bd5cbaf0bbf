# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np

from tactile_perception.dots.detect.appearance import measure_look
from tactile_perception.dots.detect.candidates import find_candidates


def test_each_dot_has_one_peak_within_a_pixel(draw_dots, lattice):
    uv, diameter = lattice
    image = np.clip(draw_dots(uv, diameter) + np.random.default_rng(2).normal(0, 4, (120, 160)), 0, 255).astype(np.uint8)
    places = find_candidates(image, measure_look(image, -1))
    distance = np.hypot(*(uv[:, None] - places).transpose(2, 0, 1))
    assert distance.min(1).max() < 1.0
    assert len(places) <= len(uv) + 1


def test_an_even_image_has_none(draw_dots, lattice):
    look = measure_look(np.clip(draw_dots(*lattice), 0, 255).astype(np.uint8), -1)
    assert find_candidates(np.full((120, 160), 90, np.uint8), look).shape == (0, 2)
