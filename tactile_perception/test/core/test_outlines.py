# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contours, outlines and the surface between dots: forms whose contours are known, and arrays that do not fit."""
import numpy as np
import pytest
from tactile_perception import _core
from tactile_perception.common.surface import DotSurface, region_outlines


def bumpy(seed, rows=15, columns=19):
    """A surface, and a smooth score with several regions and holes."""
    rng = np.random.default_rng(seed)
    row, column = np.mgrid[:rows, :columns].astype(float)
    place = np.stack([column, row, 0.3 * np.sin(row / 3) * np.cos(column / 4)], axis=2) + rng.uniform(-0.15, 0.15, (rows, columns, 3))
    waves = rng.uniform(0.4, 1.5, (6, 2)), rng.uniform(0, 6, 6)
    score = 0.5 + 0.4 * sum(np.cos(a * row + b * column + c) for (a, b), c in zip(*waves))
    return DotSurface(1e-3 * place), score


def test_arrays_that_do_not_fit_are_refused():
    surface, score = bumpy(0)
    outline = region_outlines(score, surface)[0][0]
    for start in ([0, 3], [0, 5, 5, len(outline.points)]):
        with pytest.raises(ValueError, match='^start: '):
            _core.region_axes(np.ones(6), outline.points, np.array(start), pitch=1e-3)
    with pytest.raises(ValueError, match='^score: '):
        _core.find_outlines(score[:-1], surface.wide, level=0.5, ceiling=1.0, refine=2)
    with pytest.raises(ValueError, match='^xyz: '):
        _core.extend_surface(surface.xyz[:1])
