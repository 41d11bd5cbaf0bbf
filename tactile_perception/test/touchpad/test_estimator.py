# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A touchpad's contacts from the positions of its dots, and their regions."""
import dataclasses

import numpy as np
import pytest

from tactile_perception.common.dots import DotTracks
from tactile_perception.common.estimates import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE
from tactile_perception.common.surface_points import UNKNOWN
from tactile_perception.core.calibration_file import CalibrationFile
from tactile_perception.core.errors import BadArgument, BadFrame
from tactile_perception.touchpad.estimator import ContactEstimator
from tactile_perception.touchpad.region import ContactDots, ContactFinder, describe, find_regions


def tracks_of(ball, truth, keep=slice(None)):
    """The true dots of a scene, as an error-free tracker would report them."""
    id = truth.dot_id[keep]
    count = len(id)
    moved = truth.dot_uv - ball.untouched.dot_uv
    return DotTracks(23, 23, id, truth.dot_uv[keep], np.full(count, 60.0), np.full(count, 0.02), moved[keep], truth.dot_xyz[keep].copy())


def pressed(ball, **changes):
    """Stage and result after an untouched and two pressed frames."""
    stage = ContactEstimator(ball.sensor, ball.camera, {**ball.values, **changes})
    stage.process(tracks_of(ball, ball.untouched), 1.0)
    stage.process(tracks_of(ball, ball.truth), 1.1)
    return stage, stage.process(tracks_of(ball, ball.truth), 1.2)


def test_a_ball_is_one_contact_at_its_true_position(ball):
    _, result = pressed(ball)
    true = ball.truth.contacts[0]
    assert len(result.contacts) == 1
    found = result.contacts[0]
    assert np.linalg.norm(found.position - true.position) < 0.15e-3
    assert found.depth == pytest.approx(true.depth, abs=0.1e-3) and found.force == pytest.approx(true.force, rel=0.1)
    assert np.linalg.norm(result.wrench - ball.truth.wrench) < 0.1 * np.linalg.norm(ball.truth.wrench)
    assert result.region.area == pytest.approx(ball.truth.area, rel=0.25)
    there, touched = set(np.flatnonzero(ball.truth.dot_state)), set(result.region.dot_id[result.region.dot_state > 0])
    assert 2 * len(there & touched) / (len(there) + len(touched)) > 0.9


def test_no_contact_is_found_on_an_untouched_pad(ball):
    stage, _ = pressed(ball)
    result = stage.process(tracks_of(ball, ball.untouched), 1.3)
    assert result.contacts == [] and result.region.area == 0 and not result.region.dot_state.any()
    assert np.isnan(result.region.centroid).all() and np.isnan(result.region.normal).all() and np.isnan(result.region.orientation)
    assert not result.wrench.any()


def test_dots_without_positions_are_left_out(ball):
    stage, _ = pressed(ball)
    tracks = tracks_of(ball, ball.truth)
    tracks.xyz[::20] = np.nan
    result = stage.process(tracks, 1.3)
    assert len(result.region.dot_id) == 529 - len(tracks.xyz[::20]) and len(result.contacts) == 1
    assert result.contacts[0].depth == pytest.approx(ball.truth.contacts[0].depth, abs=0.2e-3)


def test_a_frame_without_dots_is_an_empty_result(ball):
    stage, _ = pressed(ball)
    result = stage.process(tracks_of(ball, ball.truth, slice(0, 0)), 1.3)
    assert result.contacts == [] and result.region.area == 0 and len(result.region.dot_id) == 0


def test_unusable_frames_are_refused(ball):
    stage, _ = pressed(ball)
    tracks = tracks_of(ball, ball.truth)
    with pytest.raises(BadFrame, match='5 x 23 grid'):
        stage.process(dataclasses.replace(tracks, rows=5), 1.3)
    with pytest.raises(BadFrame, match='3D positions'):
        stage.process(dataclasses.replace(tracks, xyz=None), 1.3)


def test_a_press_beyond_the_calibrated_range_is_flagged(ball):
    for deepest, flag in ((1e-3, OUT_OF_RANGE), (6e-3, 0)):
        calibration = CalibrationFile('touchpad', {}, {}, {}, {'depth': [0, deepest], 'x': [-8e-3, 8e-3], 'y': [-8e-3, 8e-3]})
        stage = ContactEstimator(ball.sensor, ball.camera, ball.values, calibration)
        stage.process(tracks_of(ball, ball.untouched), 1.0)
        assert stage.process(tracks_of(ball, ball.truth), 1.1).contacts[0].flags & OUT_OF_RANGE == flag


def test_after_a_reference_under_a_press_depth_and_force_are_unknown(ball):
    stage = ContactEstimator(ball.sensor, ball.camera, ball.values)
    at_press, released = tracks_of(ball, ball.truth), tracks_of(ball, ball.untouched)
    at_press.duv, released.duv = np.zeros_like(at_press.duv), ball.untouched.dot_uv - ball.truth.dot_uv
    for k in range(3):
        stage.process(at_press, 1.0 + 0.1 * k)
    result = stage.process(released, 1.3)
    assert np.isnan(result.wrench).all()
    assert all(c.flags & AMBIGUOUS and np.isnan(c.depth) and np.isnan(c.force) for c in result.contacts)
    good = tracks_of(ball, ball.untouched)
    stage.process(good, 1.4)
    assert not stage.process(good, 1.5).wrench.any()


def along_the_ray(ball, contact):
    """Standard deviation, m, of a contact's position along the ray that sees it."""
    ray = contact.position - ball.camera.centre
    ray /= np.linalg.norm(ray)
    return np.sqrt(ray @ contact.position_covariance @ ray)


def test_the_covariance_includes_the_common_range_error(ball):
    """It is 0.15 mm without a calibration, and the cross-validation error with one."""
    assert along_the_ray(ball, pressed(ball)[1].contacts[0]) == pytest.approx(0.15e-3, rel=0.1)
    span = {'depth': [0.0, 1.0], 'x': [-1.0, 1.0], 'y': [-1.0, 1.0]}
    for known, expected in ((0.05e-3, 0.05e-3), (np.nan, 0.15e-3)):
        calibration = CalibrationFile('touchpad', {}, {}, {'held_out_places_range_rms': known}, span)
        stage = ContactEstimator(ball.sensor, ball.camera, ball.values, calibration)
        stage.process(tracks_of(ball, ball.untouched), 1.0)
        stage.process(tracks_of(ball, ball.truth), 1.1)
        assert along_the_ray(ball, stage.process(tracks_of(ball, ball.truth), 1.2).contacts[0]) == pytest.approx(expected, rel=0.3)


def test_surface_points_are_the_dots_and_their_forces_sum_to_the_wrench(ball):
    _, result = pressed(ball)
    points, truth = result.points(), ball.truth
    assert points.shape == (23, 23) and points.xyz == pytest.approx(truth.dot_xyz, abs=1e-12)
    assert points.force.sum(axis=0) == pytest.approx(result.wrench[:3], rel=1e-9)
    assert np.cross(points.xyz, points.force).sum(axis=0) == pytest.approx(result.wrench[3:], rel=1e-6, abs=1e-12)
    assert np.linalg.norm(points.force.sum(axis=0) - truth.wrench[:3]) < 0.1 * np.linalg.norm(truth.wrench[:3])
    assert np.array_equal(points.state[result.region.dot_id], result.region.dot_state)
    far = np.linalg.norm(points.xyz - truth.contacts[0].position, axis=1) > 17e-3
    assert far.any() and not points.force[far].any() and points.normal_force.max() > 0


def test_surface_points_have_true_displacements_and_outward_normals(ball):
    _, result = pressed(ball)
    points, inner = result.points(), np.pad(np.ones((21, 21), bool), 1).ravel()
    moved = ball.truth.dot_xyz - ball.untouched.dot_xyz
    assert np.median(np.linalg.norm(points.displacement - moved, axis=1)) < 0.05e-3
    assert np.linalg.norm(points.normal, axis=1) == pytest.approx(np.ones(529)) and (points.normal[inner, 2] > 0.3).all()


def test_an_unseen_dot_is_interpolated_by_the_membrane(ball):
    stage, whole = pressed(ball)
    keep = np.arange(529) % 50 != 7
    result = stage.process(tracks_of(ball, ball.truth, keep), 1.3)
    points = result.points()
    assert np.linalg.norm(points.xyz[~keep] - ball.truth.dot_xyz[~keep], axis=1).max() < 0.3e-3
    assert points.force.sum(axis=0) == pytest.approx(result.wrench[:3], rel=1e-9)
    assert result.wrench[2] == pytest.approx(whole.wrench[2], rel=0.1)


def test_the_papers_method_knows_the_places_of_the_dots_that_are_seen_and_no_forces(ball):
    stage, _ = pressed(ball, contact='paper')
    keep = np.arange(529) % 50 != 7
    points = stage.process(tracks_of(ball, ball.truth, keep), 1.3).points()
    assert np.isnan(points.xyz[~keep]).all() and (points.state[~keep] == UNKNOWN).all() and np.isfinite(points.xyz[keep]).all()
    assert np.isnan(points.force).all() and np.isnan(points.normal_force).all()


def block(pad, angle, length=12e-3, width=7e-3):
    x, y = pad.rest[:, :2].T
    along, across = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    distance = np.maximum(np.abs(along) - length / 2, np.abs(across) - width / 2)
    return pad.pressed(distance, np.full(len(x), 10e-3))


def test_without_contact_no_dot_is_classified_as_touching(pad):
    dots = pad.disc(radius=-1e-2)
    assert find_regions(dots) == []
    estimate = describe(dots, [])
    assert (estimate.area, estimate.outlines, estimate.holes) == (0, [], [])
    assert len(estimate.dot_state) == 529 and not estimate.dot_state.any()
    for name in ('centroid', 'normal', 'orientation', 'major_axis', 'motion_rotation', 'motion_interval'):
        assert np.isnan(getattr(estimate, name)).all()


def test_one_dot_is_a_region(pad):
    dots = pad.disc(radius=0.3e-3)
    region, = find_regions(dots)
    assert region.members.sum() == 1
    assert describe(dots, [region]).area < 1.5e-6


def test_disc_is_described(pad):
    dots = pad.disc(centre=(1e-3, -2e-3), radius=5e-3, noise=20e-6)
    estimate = describe(dots, find_regions(dots))
    assert estimate.area == pytest.approx(np.pi * 25e-6, rel=0.04)
    np.testing.assert_allclose(estimate.centroid, [1e-3, -2e-3, 11e-3], atol=0.1e-3)
    assert estimate.normal[2] > 0.995 and np.linalg.norm(estimate.normal) == pytest.approx(1)
    assert estimate.major_axis == pytest.approx(10e-3, rel=0.04)
    assert np.isnan(estimate.orientation)


@pytest.mark.parametrize('degrees', [-80, -45, 0, 10, 45, 90])
def test_a_block_has_an_orientation(pad, degrees):
    dots = block(pad, np.radians(degrees))
    estimate = describe(dots, find_regions(dots))
    assert -np.pi / 2 < estimate.orientation <= np.pi / 2
    error = (np.degrees(estimate.orientation) - degrees + 90) % 180 - 90
    assert abs(error) < 2
    assert estimate.area == pytest.approx(84e-6, rel=0.05)
    assert estimate.major_axis / estimate.minor_axis == pytest.approx(12 / 7, rel=0.06)


def test_a_ring_has_a_hole_and_no_orientation(pad):
    dots = pad.ring()
    region, = find_regions(dots)
    estimate = describe(dots, [region])
    assert (len(estimate.outlines), len(estimate.holes)) == (1, 1)
    assert estimate.area == pytest.approx(np.pi * (42.25 - 12.25) * 1e-6, rel=0.04)
    assert np.isnan(estimate.orientation)
    np.testing.assert_array_equal(region.members, dots.score > 0.5)


def test_numbers_that_are_not_finite_are_refused(pad):
    dots = pad.disc()
    for name in ('xyz', 'score'):
        values = {key: getattr(dots, key).copy() for key in ('xyz', 'score')}
        values[name][7] = np.nan
        with pytest.raises(BadArgument, match=name):
            ContactDots(23, 23, dots.ids, values['xyz'], values['score'], dots.state)
    with pytest.raises(BadArgument):
        find_regions(ContactDots(5, 5, dots.ids, dots.xyz, dots.score, dots.state))


def test_two_dots_just_below_the_threshold_make_no_region_between_them(pad):
    """The interpolated score exceeds the threshold between two neighbours just below it, beside a real region."""
    dots = pad.disc(radius=3e-3)
    dots.score[[14 * 23 + 13, 14 * 23 + 14]] = 0.5
    assert len(find_regions(dots)) == 1


def discs(pad, *centres, radius=2.2e-3, **more):
    distance = np.min([np.hypot(*(pad.rest[:, :2] - centre).T) for centre in centres], axis=0) - radius
    return pad.pressed(distance, np.full(529, 11e-3), **more)


class Finder(ContactFinder):
    """Contacts of frames at 30 a second."""

    stamp_s = 0.0

    def see(self, dots):
        self.stamp_s += 1 / 30
        return self.process(dots, find_regions(dots), self.stamp_s)


def test_a_fast_drag_keeps_its_id(pad):
    finder = Finder(pad.cap)
    assert [finder.see(discs(pad, (x, 0)))[0].id for x in (0, 4.5e-3, 0)] == [1, 1, 1]


def test_a_contact_keeps_its_id_when_another_one_ends(pad):
    finder, both = Finder(pad.cap), discs(pad, (-5e-3, 0), (5e-3, 0))
    first = finder.see(discs(pad, (-5e-3, 0)))[0].id
    positions = {contact.id: contact.position[0] for contact in finder.see(both)}
    assert positions[first] == pytest.approx(-5e-3, abs=0.1e-3)
    for lost in (1, 5):
        for _ in range(lost):
            assert finder.see(discs(pad, (5e-3, 0)))[0].id in set(positions) - {first}
        assert (first in [contact.id for contact in finder.see(both)]) == (lost == 1)


def test_two_joined_discs_are_ambiguous_but_a_disc_and_a_ring_are_not(pad):
    assert Finder(pad.cap).see(discs(pad, (-3.6e-3, 0), (3.6e-3, 0), radius=3.7e-3))[0].flags == AMBIGUOUS
    assert Finder(pad.cap).see(pad.disc())[0].flags == 0
    assert Finder(pad.cap).see(pad.ring())[0].flags == 0


def test_edge_and_range_are_flagged(pad):
    finder = Finder(pad.cap, calibrated_depth=3e-3, calibrated_radius=5e-3)
    assert finder.see(pad.disc(height=11e-3))[0].flags == 0
    assert finder.see(pad.disc(height=9e-3))[0].flags == OUT_OF_RANGE
    assert finder.see(pad.disc(centre=(6e-3, 0)))[0].flags == OUT_OF_RANGE
    assert Finder(pad.cap).see(pad.disc(centre=(10e-3, 0)))[0].flags & AT_EDGE
