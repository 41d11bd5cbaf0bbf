# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Outlines, moments and points of a surface against NumPy."""
import numpy as np
import outline_reference as reference
import pytest
from tactile_perception import _core
from tactile_perception.common.surface import DotSurface, axes, region_outlines


def bumpy(seed, rows=15, columns=19):
    """A surface, and a smooth score with several regions and holes."""
    rng = np.random.default_rng(seed)
    row, column = np.mgrid[:rows, :columns].astype(float)
    place = np.stack([column, row, 0.3 * np.sin(row / 3) * np.cos(column / 4)], axis=2) + rng.uniform(-0.15, 0.15, (rows, columns, 3))
    waves = rng.uniform(0.4, 1.5, (6, 2)), rng.uniform(0, 6, 6)
    score = 0.5 + 0.4 * sum(np.cos(a * row + b * column + c) for (a, b), c in zip(*waves))
    return DotSurface(1e-3 * place), score


def contours(field, level):
    places, start, region = _core.find_contours(field, level=level)
    assert start[-1] == len(places) and len(region) == len(start) - 1
    return [places[a:b] for a, b in zip(start[:-1], start[1:])], region


def turned(loop):
    """A closed polygon from its smallest vertex on."""
    return np.roll(loop, -np.lexsort(loop.T[::-1])[0], axis=0)


def alike(a, b):
    assert len(a) == len(b)
    for one, other in zip(a, b):
        np.testing.assert_allclose(turned(one), turned(other), atol=1e-9)


def test_contour_of_one_node_is_a_diamond():
    field = np.zeros((3, 3))
    field[1, 1] = 1
    (loop,), _ = contours(field, 0.5)
    assert {tuple(point) for point in loop.tolist()} == {(0.5, 1.0), (1.5, 1.0), (1.0, 0.5), (1.0, 1.5)}
    assert reference.signed_area(loop[:, ::-1]) == pytest.approx(0.5)  # from +x (column) to +y (row)


def test_contour_settles_diagonal_cells_by_their_mean():
    field = np.zeros((4, 4))
    field[1, 1] = field[2, 2] = 0.9
    assert len(contours(field, 0.5)[0]) == 2
    field[1, 2] = field[2, 1] = 0.4
    assert len(contours(field, 0.5)[0]) == 1


@pytest.mark.parametrize('seed', range(30))
def test_contours_are_the_references_with_holes_in_the_regions_around_them(seed):
    field = np.pad(np.random.default_rng(seed).uniform(0, 1, (12, 15)), 1)
    loops, region = contours(field, 0.5)
    expected = reference.group_loops(reference.contour(field, 0.5), np.zeros((1000, 3)))
    assert region.max() + 1 == len(expected)
    expected_loops = [loop for one in expected for loop in (one.grid_points, *one.grid_holes)]
    alike(*(sorted(map(turned, some), key=lambda loop: loop.tolist()) for some in (loops, expected_loops)))
    assert sorted(np.bincount(region)) == sorted(1 + len(one.grid_holes) for one in expected)


@pytest.mark.parametrize('refine', [1, 2, 3])
@pytest.mark.parametrize('seed', range(8))
def test_outlines_and_moments_are_the_references(seed, refine):
    surface, score = bumpy(seed)
    (found, moments, pitch), expected = region_outlines(score, surface, refine=refine), reference.outlines_of(score, surface, refine=refine)
    assert len(found) == len(expected) > 0
    for one, other in zip(found, expected):
        alike(one.loops, other.loops)
    field = reference.MomentField(surface, expected, refine)
    assert pitch == pytest.approx(field.pitch, rel=1e-12)
    for one, outline, same in zip(moments, expected, found):
        other = field.of(outline)
        np.testing.assert_allclose(one.vector_area, other.vector_area, rtol=1e-9, atol=1e-15)
        np.testing.assert_allclose([one.area, *one.first, *one.second], [other.area, *other.first, *other.second], rtol=1e-9, atol=1e-17)
        np.testing.assert_allclose(axes(one, same.loops, pitch), reference.axes(other, outline.loops, pitch), rtol=1e-6)


@pytest.mark.parametrize('rows, columns', [(2, 2), (2, 5), (7, 3), (23, 23)])
def test_a_surface_is_extended_as_the_references(rows, columns):
    places = np.random.default_rng(rows).uniform(-1, 1, (rows, columns, 3))
    np.testing.assert_array_equal(_core.extend_surface(places), reference.extended(places))


def test_points_of_a_surface_are_the_references():
    surface, _ = bumpy(3)
    places = np.random.default_rng(0).uniform(-1, 18, (300, 2))
    np.testing.assert_allclose(surface.points(places), reference.values_at(surface.wide, places), atol=1e-15)


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
