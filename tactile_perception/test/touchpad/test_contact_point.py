# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import cv2
import numpy as np
import pytest
from tactile_perception.touchpad.region import find_contact, find_regions


def test_fingertip_is_at_its_tip(pad):
    dots = pad.sphere(tip=(2e-3, -1e-3, 10.5e-3), radius=8e-3)
    found = find_contact(dots, find_regions(dots)[0], pad.cap)
    position, covariance, normal = found.position, found.covariance, found.normal
    np.testing.assert_allclose(position, [2e-3, -1e-3, 10.5e-3], atol=20e-6)
    np.testing.assert_allclose(normal, [0, 0, 1], atol=0.01)
    assert (np.linalg.eigvalsh(covariance) > 0).all()


def test_tip_at_the_border_of_the_region_is_found(pad):
    dots = pad.sphere(tip=(5e-3, 0.0, 10.0e-3), radius=8e-3)
    region, = find_regions(dots)
    position = find_contact(dots, region, pad.cap).position
    assert abs(position[0] - 5e-3) < 0.1e-3 < 0.8e-3 < 5e-3 - region.moments.centroid[0]


@pytest.mark.parametrize('noise', [0, 20e-6, 40e-6])
def test_face_is_at_its_centroid(pad, noise):
    for dots in (pad.disc(centre=(1e-3, 1e-3), noise=noise), pad.ring(noise=noise)):
        region, = find_regions(dots)
        np.testing.assert_array_equal(find_contact(dots, region, pad.cap).position, region.moments.centroid)


def test_tip_covariance_is_honest(pad):
    errors, variances = [], []
    for seed in range(60):
        dots = pad.sphere(noise=30e-6, seed=seed)
        found = find_contact(dots, find_regions(dots)[0], pad.cap)
        position, covariance = found.position, found.covariance
        errors.append((position - [2e-3, -1e-3, 11e-3])[:2])
        variances.append(np.diag(covariance)[:2])
    ratio = np.mean(np.square(errors), axis=0) / np.mean(variances, axis=0)
    assert ((ratio > 0.05) & (ratio < 2)).all()


@pytest.mark.parametrize('noise, limit', [(0, 5e-6), (30e-6, 40e-6)])
def test_depth_is_how_far_the_stage_went(pad, noise, limit):
    flat = pad.disc(height=11e-3, noise=noise)
    assert find_contact(flat, find_regions(flat)[0], pad.cap).depth == pytest.approx(2e-3, abs=limit)
    tip, radius = np.array([3e-3, 0, 10.5e-3]), 8e-3
    round_ = pad.sphere(tip=tuple(tip), radius=radius, noise=noise)
    # Both spheres touch where the line of their centres meets them: go back until the centres are both radii apart.
    apart = pad.cap.curvature_radius + radius
    first = pad.cap.centre_z + np.sqrt(apart**2 - tip[0]**2) - radius
    assert find_contact(round_, find_regions(round_)[0], pad.cap).depth == pytest.approx(first - tip[2], abs=limit + 10e-6)


def test_light_touch_of_a_fingertip_and_one_too_light(pad):
    for tip, limit, known in ((12.65e-3, 0.15e-3, True), (12.75e-3, 1.5e-3, False)):
        dots = pad.sphere(tip=(3e-3, 0, tip), noise=10e-6)
        region, = find_regions(dots)
        found = find_contact(dots, region, pad.cap)
        position, covariance = found.position, found.covariance
        assert (region.members.sum() >= 5) == known and region.members.sum() < 9
        error = position[0] - 3e-3
        assert abs(error) < limit and abs(error) < 3 * np.sqrt(covariance[0, 0])


def test_a_cylinder_is_at_its_lowest_line_over_its_middle(pad):
    x, y = pad.rest[:, :2].T
    dots = pad.pressed(np.maximum(np.abs(x - 1e-3) - 3e-3, np.abs(y) - 5e-3), 10.5e-3 + (x - 2e-3)**2 / 16e-3, noise=10e-6)
    region, = find_regions(dots)
    found = find_contact(dots, region, pad.cap)
    position, covariance = found.position, found.covariance
    assert position[0] == pytest.approx(2e-3, abs=50e-6)
    assert position[1] == pytest.approx(region.moments.centroid[1], abs=20e-6)
    assert covariance[0, 0] < covariance[1, 1]


def apart(members):
    """Steps (529,) from each dot of the grid to the nearest of members (529,) bool."""
    held = members.astype(np.uint8).reshape(23, 23)
    return sum(1 - cv2.dilate(held, np.ones((2 * reach + 1,) * 2)).ravel().astype(int) for reach in range(23))


def test_dots_between_two_regions_count_for_the_nearer_one(pad):
    dots, other = pad.disc(centre=(-5e-3, 0), radius=3e-3), pad.disc(centre=(5e-3, 0), radius=3e-3)
    dots.score = np.maximum(dots.score, other.score)
    dots.force = np.random.default_rng(0).normal(0, 1e-3, (529, 3)) - [0, 0, 0.01]
    regions = find_regions(dots)
    assert len(regions) == 2
    for one, beside in (regions, regions[::-1]):
        near = (apart(one.members) < 6) & (apart(one.members) <= apart(beside.members))
        assert find_contact(dots, one, pad.cap).force == pytest.approx(-one.moments.normal @ dots.force[near].sum(axis=0))


@pytest.mark.parametrize('seed', range(3))
def test_the_force_is_that_on_the_dots_and_on_those_around(pad, seed):
    dots = pad.disc(radius=5e-3)
    dots.force = np.random.default_rng(seed).normal(0, 1e-3, (529, 3)) - [0, 0, 0.01]
    region, = find_regions(dots)
    near = apart(region.members) < 6
    force = find_contact(dots, region, pad.cap).force
    assert force == pytest.approx(-region.moments.normal @ dots.force[near].sum(axis=0)) and force > 0
    dots.force = -dots.force
    assert find_contact(dots, region, pad.cap).force == 0
    dots.force = None
    assert np.isnan(find_contact(dots, region, pad.cap).force)
