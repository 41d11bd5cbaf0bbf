# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from dome_scenes import DOME, EYE, markers
from tactile_perception.press.dome.outlines import STRETCH, appear_at, centres_of, outlines
from tactile_perception.press.sensor import dome_cap

CAP, MARKER = dome_cap(DOME), 4.6e-3
POINTS = markers()[np.isfinite(markers()).all(1)]


def seen(points):
    """Tangents of the directions of points (..., 3), m, from EYE."""
    return (points - EYE)[..., :2] / (points - EYE)[..., 2:]


def pixels_mean(point, radius, steps=400):
    """Where the middle of the pixels lies that look at a disc around a point of the dome."""
    edge = seen(outlines(point[None], 1.02 * radius, CAP)[0, 1:])
    low, high = edge.min(0), edge.max(0)
    grid = np.stack(np.meshgrid(*(np.linspace(*ends, steps) for ends in zip(low, high))), axis=-1).reshape(-1, 2)
    rays = np.column_stack([grid, np.ones(len(grid))])
    meets = CAP.meet(EYE, rays / np.linalg.norm(rays, axis=1, keepdims=True))
    arc = 2 * CAP.curvature_radius * np.arcsin(np.linalg.norm(meets - point, axis=1) / (2 * CAP.curvature_radius))
    return grid[arc < radius].mean(0)


def test_an_outline_lies_around_its_point_on_the_dome():
    found = outlines(POINTS, MARKER, CAP)
    from_centre = found - [0, 0, CAP.centre_z]
    assert np.allclose(np.linalg.norm(from_centre, axis=-1), CAP.curvature_radius) and np.allclose(found[:, 0], POINTS)
    angle = np.arccos(np.sum(from_centre[:, :1] * from_centre[:, 1:], axis=-1) / CAP.curvature_radius**2)
    assert np.allclose(angle * CAP.curvature_radius, STRETCH * MARKER) and np.allclose(found[:, 1:].mean(1), POINTS, atol=1e-4)


def test_a_marker_appears_in_the_middle_of_the_pixels_that_look_at_it():
    slanted = POINTS[np.argsort(POINTS[:, 2])[[0, 40, 80]]]
    found = appear_at(outlines(slanted, MARKER, CAP), EYE)
    true = np.array([pixels_mean(point, MARKER) for point in slanted])
    off_centre = np.linalg.norm(seen(slanted) - true, axis=1)
    # at the plane through the top: some 0.165 m away
    assert off_centre.max() * 0.165 > 1e-4 and np.linalg.norm(found - true, axis=1).max() * 0.165 < 4e-6


def test_a_folded_outline_appears_within_itself():
    rng = np.random.default_rng(0)
    folded = outlines(POINTS[:50], MARKER, CAP) + rng.normal(0, 4e-3, (50, 13, 3))
    found, edge = appear_at(folded, EYE), seen(folded)
    assert (found >= edge.min(1)).all() and (found <= edge.max(1)).all()


def test_centres_of_untouched_markers_are_told_from_where_they_appear():
    away = DOME.plane_z - EYE[2]
    rest = EYE[:2] + away * appear_at(outlines(POINTS, MARKER, CAP), EYE)
    eyes = np.tile(EYE, (len(POINTS), 1))
    assert np.linalg.norm(centres_of(rest, eyes, MARKER, DOME) - POINTS, axis=1).max() < 2e-6
    assert np.linalg.norm(centres_of(rest, eyes, 1e-6, DOME) - POINTS, axis=1).max() > 5e-5
    rest[3] = np.nan
    assert np.isnan(centres_of(rest, eyes, MARKER, DOME)[3]).all()


@pytest.mark.parametrize('scale', [0.5, 1.0])
def test_a_plane_seen_from_the_front_is_seen_at_its_centre(scale):
    disc = np.exp(2j * np.pi * np.arange(12) / 12) * MARKER * scale
    flat = np.column_stack([np.r_[0, disc.real] + 0.01, np.r_[0, disc.imag], np.full(13, 0.1)])
    assert appear_at(flat, np.zeros(3)) == pytest.approx([0.1, 0.0], abs=1e-12)
