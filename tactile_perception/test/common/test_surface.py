# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The surface through dots, and regions on it."""
import numpy as np
import pytest
from tactile_perception import _core
from tactile_perception.common.surface import DotSurface, fill_unseen, grid_normals, label_score, region_outlines, scatter, to_grid
from tactile_perception.errors import BadArgument


def test_values_of_some_dots_among_all():
    assert scatter(np.array([1.5, 2.5]), np.array([3, 0]), 4) == pytest.approx([2.5, np.nan, np.nan, 1.5], nan_ok=True)
    assert scatter(np.array([1, 2], np.uint8), np.array([3, 0]), 4, 255).tolist() == [2, 255, 255, 1]
    components_first = np.arange(6.0).reshape(3, 2)
    assert scatter(components_first, np.array([3, 0]), 4, last=True)[:, [3, 0]].tolist() == components_first.tolist()


@pytest.mark.parametrize('ids', [[0, 6], [-1, 2], [1, 1]])
def test_refuses_ids_off_the_grid(ids):
    with pytest.raises(BadArgument):
        to_grid(np.array(ids), np.zeros(2), 2, 3)


def test_slopes_are_central_and_one_sided_at_gaps():
    column, row = np.meshgrid(np.arange(5.0), np.arange(2.0))
    normal = grid_normals(np.stack([column, row, np.tile([0.0, 1, 4, np.nan, 16], (2, 1))], axis=-1))
    np.testing.assert_allclose(-normal[..., 0] / normal[..., 2], np.tile([1, 2, 3, np.nan, np.nan], (2, 1)), rtol=1e-12)
    assert np.isnan(grid_normals(np.stack([column, row, column], axis=-1)[:1])).all()  # nothing tells the slope by row


def test_normals_of_a_sphere(pad):
    normals = grid_normals(pad.rest.reshape(23, 23, 3)).reshape(-1, 3)
    true = (pad.rest - [0, 0, pad.cap.centre_z]) / pad.cap.curvature_radius
    inner = np.hypot(*pad.rest[:, :2].T) < 10e-3
    assert np.degrees(np.arccos(np.sum(normals * true, axis=1)))[inner].max() < 1.0


def test_fills_a_plane_exactly():
    row, column = np.mgrid[:6, :7]
    plane = 2.0 * row - 3 * column
    holed = plane.copy()
    holed[2:4, 3] = holed[0, 0] = holed[5, 6] = np.nan
    np.testing.assert_allclose(fill_unseen(holed), plane)


def test_fill_ends_where_nothing_is_known():
    assert np.isnan(fill_unseen(np.full((4, 4), np.nan))).all()
    np.testing.assert_array_equal(fill_unseen(np.where(np.eye(3) > 0, 1.0, np.nan)), 1)


def test_points_lie_on_the_cap(pad):
    surface = DotSurface(pad.rest.reshape(23, 23, 3))
    places = np.random.default_rng(0).uniform(4, 18, (200, 2))
    points = surface.points(places)
    np.testing.assert_allclose(points[:, 0], (places[:, 1] - 11) * pad.pitch, atol=1e-12)
    assert np.abs(points[:, 2] - pad.cap.heights(points[:, :2])).max() < 1e-6


def test_unseen_dots_are_continued(pad):
    grid = pad.rest.reshape(23, 23, 3).copy()
    true = grid[10, 12].copy()
    grid[10, 12] = np.nan
    assert np.linalg.norm(DotSurface(grid).xyz[10, 12] - true) < 40e-6


def test_refuses_what_is_no_surface():
    with pytest.raises(BadArgument):
        DotSurface(np.zeros((23, 3)))
    with pytest.raises(BadArgument):
        DotSurface(np.full((23, 23, 3), np.nan))


def moments_of(score, surface):
    return region_outlines(score, surface)[1]


def test_area_of_a_part_of_the_cap(pad):
    score = np.clip(0.5 + (6e-3 - np.hypot(*pad.rest[:, :2].T)) / pad.pitch, 0, 1).reshape(23, 23)
    found, = moments_of(score, DotSurface(pad.rest.reshape(23, 23, 3)))
    tall = pad.cap.curvature_radius - np.sqrt(pad.cap.curvature_radius**2 - 36e-6)
    assert found.area == pytest.approx(2 * np.pi * pad.cap.curvature_radius * tall, rel=0.01)
    np.testing.assert_allclose(found.normal, [0, 0, 1], atol=1e-6)
    np.testing.assert_allclose(found.centroid, [0, 0, pad.cap.height - tall / 2], atol=10e-6)


def test_ring_loses_its_hole_and_keeps_its_middle(pad):
    radius = np.hypot(*(pad.rest[:, :2] - [1e-3, -0.5e-3]).T) / pad.pitch
    flat = pad.rest * [1, 1, 0]
    found, = moments_of(np.clip(0.5 + np.minimum(6 - radius, radius - 3.5), 0, 1).reshape(23, 23), DotSurface(flat.reshape(23, 23, 3)))
    assert found.area == pytest.approx(np.pi * (36 - 12.25) * pad.pitch**2, rel=0.02)
    np.testing.assert_allclose(found.centroid, [1e-3, -0.5e-3, 0], atol=30e-6)
    assert np.diag(found.spread) == pytest.approx((36 + 12.25) / 4 * pad.pitch**2 * np.ones(2), rel=0.03)


def test_regions_add_up(pad):
    place = pad.rest[:, :2] / pad.pitch
    score = np.clip(0.5 + 3 - np.minimum(np.hypot(*(place - [5, 0]).T), np.hypot(*(place + [5, 0]).T)), 0, 1).reshape(23, 23)
    one, other = moments_of(score, DotSurface((pad.rest * [1, 1, 0]).reshape(23, 23, 3)))
    both = one + other
    assert both.area == pytest.approx(2 * one.area, rel=1e-6)
    np.testing.assert_allclose(both.centroid, 0, atol=1e-8)
    assert both.spread[0, 0] == pytest.approx((2.25 + 25) * pad.pitch**2, rel=0.03)


def signed_area(loop):
    """Positive from +x to +y."""
    x, y = loop[:, :2].T
    return (x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def flat(rows=23, columns=23):
    row, column = np.mgrid[:rows, :columns].astype(float)
    return DotSurface(np.stack([column, row, np.zeros_like(row)], axis=2))


def test_disc_is_found_between_the_dots():
    row, column = np.mgrid[:23, :23]
    for radius in (1.3, 3.0, 6.2):
        score = np.clip(0.5 + radius - np.hypot(row - 11.3, column - 10.8), 0, 1)
        region, = region_outlines(score, flat())[0]
        assert signed_area(region.points) == pytest.approx(np.pi * radius**2, rel=0.08)
        assert np.abs(np.hypot(region.points[:, 0] - 10.8, region.points[:, 1] - 11.3) - radius).max() < 0.15


def test_hole_goes_to_the_region_around_it():
    row, column = np.mgrid[:23, :23]
    radius = np.hypot(row - 11, column - 11)
    score = np.clip(0.5 + np.maximum(np.minimum(10 - radius, radius - 7), 3 - radius), 0, 1)
    ring, disc = region_outlines(score, flat())[0]
    assert (len(ring.holes), len(disc.holes)) == (1, 0)
    assert len(ring.loops) == 2


def test_hard_edge_does_not_push_the_outline():
    score = np.zeros((23, 23))
    score[5:15, 5:15] = 1
    pressed = score.copy()
    pressed[5:15, 5] = 9
    a, b = (region_outlines(values, flat())[0][0] for values in (score, pressed))
    np.testing.assert_allclose(a.points, b.points)


def test_region_at_the_border_closes_half_a_pitch_outside():
    score = np.zeros((23, 23))
    score[:4, :5] = 1
    region, = region_outlines(score, flat())[0]
    assert region.points[:, :2].min(axis=0) == pytest.approx([-0.5, -0.5], abs=0.04)


def test_unseen_dots_leave_no_hole():
    row, column = np.mgrid[:23, :23]
    score = np.clip(6.5 - np.hypot(row - 11, column - 11), 0, 1)
    score[11, 11] = score[10, 14] = np.nan
    region, = region_outlines(score, flat())[0]
    assert not region.holes


def test_one_label_keeps_a_region():
    label = np.zeros((23, 23))
    label[4, 7] = 1
    region, = region_outlines(label_score(label), flat())[0]
    assert len(region.points) >= 3


def test_refuses_shapes_that_do_not_fit():
    with pytest.raises(BadArgument):
        region_outlines(np.zeros((22, 23)), flat())
    with pytest.raises(BadArgument):
        region_outlines(np.zeros((23, 23)), flat(), refine=0)
    for start in ([0, 3], [0, 5, 5, 9]):
        with pytest.raises(ValueError, match='^start: '):
            _core.region_axes(np.ones(6), np.zeros((9, 3)), np.array(start), pitch=1e-3)
    with pytest.raises(ValueError, match='^score: '):
        _core.find_outlines(np.zeros((22, 23)), flat().wide, level=0.5, ceiling=1.0, refine=2)
    with pytest.raises(ValueError, match='^xyz: '):
        _core.extend_surface(flat().xyz[:1])
