# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.contour import label_score, region_outlines
from tactile_perception.common.dot_surface import DotSurface
from tactile_perception.errors import BadArgument


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


def test_ring_has_its_hole():
    row, column = np.mgrid[:23, :23]
    radius = np.hypot(row - 11, column - 11)
    region, = region_outlines(np.clip(0.5 + np.minimum(7 - radius, radius - 4), 0, 1), flat())[0]
    assert len(region.holes) == 1
    assert signed_area(region.points) == pytest.approx(np.pi * 49, rel=0.03)
    assert signed_area(region.holes[0]) == pytest.approx(-np.pi * 16, rel=0.03)


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


def test_nothing_where_nothing_touches():
    assert region_outlines(np.zeros((23, 23)), flat())[0] == []
    assert region_outlines(np.full((23, 23), np.nan), flat())[0] == []


def test_labels_alone_lose_little():
    row, column = np.mgrid[:23, :23]
    areas = []
    for shift in np.linspace(0, 0.9, 10):
        label = (np.hypot(row - 11 - shift, column - 11.4) < 4.0).astype(float)
        areas.append(signed_area(region_outlines(label_score(label), flat())[0][0].points))
    assert np.mean(areas) == pytest.approx(np.pi * 16, rel=0.03)


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
