# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contacts of a touchpad: which dots are in contact, and where the object is."""
import cv2
import numpy as np
import pytest

from tactile_perception import _core
from tactile_perception.core.errors import BadFrame
from tactile_perception.touchpad.contact import CONTACT_METHODS, border_network, make_method
from tactile_perception.touchpad.membrane import MembraneMaterial
from tactile_perception.touchpad.region import find_contact, find_regions

PITCH = 1.3e-3
PAPER = {'paper.d_max': 0.91e-3, 'paper.delta_d': 0.19e-3}
ORIGIN = np.array([0.0, 0.0, -0.04])


@pytest.fixture
def method(request, pad):
    made = make_method(pad.rows, pad.columns, MembraneMaterial(), ORIGIN, {'contact': request.param, **PAPER})
    made.set_rest(pad.rest)
    return made


@pytest.mark.parametrize('method', CONTACT_METHODS, indirect=True)
def test_without_contact_no_dot_is_classified_as_touching(pad, method):
    for k in range(5):
        found = method.classify(pad.ids, pad.rest, 0.1 * k)
    assert not found.state.any() and (found.score < 0.5).all()


@pytest.mark.parametrize('method', CONTACT_METHODS, indirect=True)
def test_results_are_in_the_order_of_the_given_dots(pad, method):
    method.classify(pad.ids, pad.rest, 0.0)
    some = np.flatnonzero(pad.ids % 7)[::-1]
    found = method.classify(some, pad.rest[some], 0.1)
    assert found.state.shape == found.score.shape == some.shape and found.state.dtype == np.uint8


@pytest.mark.parametrize('method', ['paper'], indirect=True)
def test_the_papers_method_finds_a_moving_plate_and_estimates_no_forces(pad, method):
    """A disc is pressed in step by step, so that the dots under it move together. One dot beside it has a wrong range in each frame."""
    for k, height in enumerate(np.linspace(0.0128, 0.0100, 15)):
        xyz = pad.disc(height=height).xyz.copy()
        xyz[100, 2] -= 1e-3 * k
        found = method.classify(pad.ids, xyz, 0.05 * k)
    assert found.all_dots is None and np.isnan(found.wrench).all()
    inside = np.hypot(*pad.rest[:, :2].T) < 4e-3
    assert (found.state[inside] > 0).mean() > 0.9
    assert (found.state[np.hypot(*pad.rest[:, :2].T) > 9e-3] > 0).mean() < 0.05


@pytest.mark.parametrize('method', ['membrane'], indirect=True)
def test_collinear_dots_are_refused(pad, method):
    line = pad.rest[:1] + np.linspace(0, 1, 529)[:, None] * (pad.rest[-1:] - pad.rest[:1])
    with pytest.raises(BadFrame, match='collinear'):
        method.classify(pad.ids, line, 0.0)


@pytest.mark.full
@pytest.mark.parametrize('name', ['tp_rect_release'])
def test_no_state_remains_after_a_hundred_presses_drags_and_lifts(recording, name):
    truth = recording(name)
    method = make_method(23, 23, MembraneMaterial(), ORIGIN, {'contact': 'membrane', **PAPER})
    method.set_rest(truth['dot_rest_xyz'].astype(float))
    ids, rng, free = np.arange(529), np.random.default_rng(0), ~truth['dot_contact'].any(axis=1)
    for turn in range(100):
        found = [method.classify(ids, xyz + rng.normal(0, 1e-6, xyz.shape), 0.03 * k).state for k, xyz in enumerate(truth['dot_xyz'])]
        assert not np.array(found)[free].any(), turn
        if turn == 1:  # friction is known after the first time
            second = np.array(found)
    assert np.mean(np.array(found) != second) < 0.02  # a frame in which slip begins may be classified as either


def random_loads(seed):
    """Positions and normals (rows, columns, 3), and loads (rows, columns)."""
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(3, 25, 2))
    positions = np.stack([*np.mgrid[:shape[0], :shape[1]] * PITCH, rng.normal(0, 1e-4, shape)], axis=-1)
    normals = rng.normal(0, 0.2, (*shape, 3)) + [0, 0, 1]
    return positions, normals / np.linalg.norm(normals, axis=2, keepdims=True), rng.normal(0.5, 1.5, shape)


def scored(positions, normals, load):
    flat = np.ascontiguousarray(positions.reshape(-1, 3)), np.ascontiguousarray(normals.reshape(-1, 3)), np.ascontiguousarray(load.ravel())
    loads = _core.touchpad.DotLoads(xyz=flat[0], seen=np.ones(load.size, bool), normal=flat[1], force=np.zeros_like(flat[0]), load=flat[2])
    return border_network().scores(loads, rows=load.shape[0], columns=load.shape[1], pitch=PITCH).reshape(load.shape)


@pytest.mark.parametrize('seed', range(4))
def test_scores_are_invariant_to_rotation_and_mirroring_of_the_grid(seed):
    dots = random_loads(seed)
    found = scored(*dots)
    assert found.max() > 0.5
    np.testing.assert_allclose(scored(*(np.rot90(part) for part in dots)), np.rot90(found), atol=1e-5)
    np.testing.assert_allclose(scored(*(part[::-1] for part in dots)), found[::-1], atol=1e-5)


@pytest.mark.parametrize('value', [np.nan, np.inf, -np.inf, 1e300])
def test_extreme_numbers_give_finite_scores_and_no_load_gives_zero(value):
    for number in range(3):
        dots = random_loads(2)
        dots[number].ravel()[::3] = value
        found = scored(*dots)
        assert ((found >= 0) & (found <= 1)).all()
    assert not scored(*dots[:2], np.minimum(random_loads(2)[2], 0.3)).any()


def test_a_fingertip_is_located_at_its_tip(pad):
    dots = pad.sphere(tip=(2e-3, -1e-3, 10.5e-3), radius=8e-3)
    found = find_contact(dots, find_regions(dots)[0], pad.cap)
    position, covariance, normal = found.position, found.covariance, found.normal
    np.testing.assert_allclose(position, [2e-3, -1e-3, 10.5e-3], atol=20e-6)
    np.testing.assert_allclose(normal, [0, 0, 1], atol=0.01)
    assert (np.linalg.eigvalsh(covariance) > 0).all()


def test_a_tip_at_the_border_of_the_region_is_found(pad):
    dots = pad.sphere(tip=(5e-3, 0.0, 10.0e-3), radius=8e-3)
    region, = find_regions(dots)
    position = find_contact(dots, region, pad.cap).position
    assert abs(position[0] - 5e-3) < 0.1e-3 < 0.8e-3 < 5e-3 - region.moments.centroid[0]


@pytest.mark.parametrize('noise', [0, 20e-6, 40e-6])
def test_a_face_is_located_at_its_centroid(pad, noise):
    for dots in (pad.disc(centre=(1e-3, 1e-3), noise=noise), pad.ring(noise=noise)):
        region, = find_regions(dots)
        np.testing.assert_array_equal(find_contact(dots, region, pad.cap).position, region.moments.centroid)


def test_the_covariance_of_a_tip_matches_its_errors(pad):
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
def test_the_depth_is_the_travel_of_the_stage(pad, noise, limit):
    flat = pad.disc(height=11e-3, noise=noise)
    assert find_contact(flat, find_regions(flat)[0], pad.cap).depth == pytest.approx(2e-3, abs=limit)
    tip, radius = np.array([3e-3, 0, 10.5e-3]), 8e-3
    round_ = pad.sphere(tip=tuple(tip), radius=radius, noise=noise)
    # Two spheres touch on the line between their centres: retract until the centres are both radii apart.
    apart = pad.cap.curvature_radius + radius
    first = pad.cap.centre_z + np.sqrt(apart**2 - tip[0]**2) - radius
    assert find_contact(round_, find_regions(round_)[0], pad.cap).depth == pytest.approx(first - tip[2], abs=limit + 10e-6)


def test_a_light_touch_of_a_fingertip_and_one_that_is_too_light(pad):
    for tip, limit, known in ((12.65e-3, 0.15e-3, True), (12.75e-3, 1.5e-3, False)):
        dots = pad.sphere(tip=(3e-3, 0, tip), noise=10e-6)
        region, = find_regions(dots)
        found = find_contact(dots, region, pad.cap)
        position, covariance = found.position, found.covariance
        assert (region.members.sum() >= 5) == known and region.members.sum() < 9
        error = position[0] - 3e-3
        assert abs(error) < limit and abs(error) < 3 * np.sqrt(covariance[0, 0])


def test_a_cylinder_is_located_at_the_middle_of_its_lowest_line(pad):
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


def test_dots_between_two_regions_belong_to_the_nearer_one(pad):
    dots, other = pad.disc(centre=(-5e-3, 0), radius=3e-3), pad.disc(centre=(5e-3, 0), radius=3e-3)
    dots.score = np.maximum(dots.score, other.score)
    dots.force = np.random.default_rng(0).normal(0, 1e-3, (529, 3)) - [0, 0, 0.01]
    regions = find_regions(dots)
    assert len(regions) == 2
    for one, beside in (regions, regions[::-1]):
        near = (apart(one.members) < 6) & (apart(one.members) <= apart(beside.members))
        assert find_contact(dots, one, pad.cap).force == pytest.approx(-one.moments.normal @ dots.force[near].sum(axis=0))


@pytest.mark.parametrize('seed', range(3))
def test_the_force_includes_the_dots_around_the_region(pad, seed):
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
