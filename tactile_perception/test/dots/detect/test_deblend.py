# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np

from tactile_perception.dots.detect.methods import DotDetector


def test_dots_that_touch_are_told_apart(draw_dots, lattice):
    uv, diameter = lattice
    for first, second in ((9, 10), (20, 28)):
        step = uv[second] - uv[first]
        uv[second] = uv[first] + step / np.hypot(*step) * (diameter[first] + diameter[second]) / 2
    image = np.clip(draw_dots(uv, diameter) + np.random.default_rng(4).normal(0, 2, (120, 160)), 0, 255).astype(np.uint8)
    dots = DotDetector('dark').detect(image)
    assert len(dots) == len(uv)
    distance = np.hypot(*(uv[:, None] - dots.uv).transpose(2, 0, 1))
    assert distance.min(1).max() < 0.08
