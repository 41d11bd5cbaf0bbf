# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From the dots' true places to region, contacts, slip and wrench, against the scene's truth; unknown is NaN, bad dots are refused."""
import dataclasses

import numpy as np
import pytest
from tactile_perception.calibration.files.format import CalibrationFile
from tactile_perception.common.dots import DotTracks
from tactile_perception.common.estimates import AMBIGUOUS, OUT_OF_RANGE
from tactile_perception.common.surface_points import UNKNOWN
from tactile_perception.errors import BadArgument, BadFrame
from tactile_perception.touchpad.estimator import ContactEstimator


def tracks_of(ball, truth, keep=slice(None)):
    """The scene's own dots as a tracker with no error would give them."""
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


def test_a_ball_is_one_contact_where_it_is(ball):
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


def test_nothing_touches_nothing_is_found(ball):
    stage, _ = pressed(ball)
    result = stage.process(tracks_of(ball, ball.untouched), 1.3)
    assert result.contacts == [] and result.region.area == 0 and not result.region.dot_state.any()
    assert np.isnan(result.region.centroid).all() and np.isnan(result.region.normal).all() and np.isnan(result.region.orientation)
    assert not result.wrench.any()


def test_dots_without_places_are_left_out(ball):
    stage, _ = pressed(ball)
    tracks = tracks_of(ball, ball.truth)
    tracks.xyz[::20] = np.nan
    result = stage.process(tracks, 1.3)
    assert len(result.region.dot_id) == 529 - len(tracks.xyz[::20]) and len(result.contacts) == 1
    assert result.contacts[0].depth == pytest.approx(ball.truth.contacts[0].depth, abs=0.2e-3)


def test_no_dots_at_all(ball):
    stage, _ = pressed(ball)
    result = stage.process(tracks_of(ball, ball.truth, slice(0, 0)), 1.3)
    assert result.contacts == [] and result.region.area == 0 and len(result.region.dot_id) == 0


def test_what_cannot_be_used_is_refused(ball):
    stage, _ = pressed(ball)
    tracks = tracks_of(ball, ball.truth)
    with pytest.raises(BadFrame, match='5 x 23 grid'):
        stage.process(dataclasses.replace(tracks, rows=5), 1.3)
    with pytest.raises(BadFrame, match='surface cap'):
        stage.process(dataclasses.replace(tracks, xyz=None), 1.3)
    with pytest.raises(BadArgument, match='surface is none'):
        ContactEstimator(dataclasses.replace(ball.sensor, cap=None), ball.camera, ball.values)


def test_a_press_beyond_the_calibrated_range_is_flagged(ball):
    for deepest, flag in ((1e-3, OUT_OF_RANGE), (6e-3, 0)):
        calibration = CalibrationFile('touchpad', {}, {}, {}, {'depth': [0, deepest], 'x': [-8e-3, 8e-3], 'y': [-8e-3, 8e-3]})
        stage = ContactEstimator(ball.sensor, ball.camera, ball.values, calibration)
        stage.process(tracks_of(ball, ball.untouched), 1.0)
        assert stage.process(tracks_of(ball, ball.truth), 1.1).contacts[0].flags & OUT_OF_RANGE == flag


def test_a_reference_taken_under_a_press_makes_no_numbers(ball):
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
    """Standard deviation, m, of a contact's place along the ray that sees it."""
    ray = contact.position - ball.camera.centre
    ray /= np.linalg.norm(ray)
    return np.sqrt(ray @ contact.position_covariance @ ray)


def test_covariance_holds_what_all_ranges_are_wrong_by(ball):
    """0.15 mm from the rest shape alone; calibrated, what places that were left out were wrong by."""
    assert along_the_ray(ball, pressed(ball)[1].contacts[0]) == pytest.approx(0.15e-3, rel=0.1)
    span = {'depth': [0.0, 1.0], 'x': [-1.0, 1.0], 'y': [-1.0, 1.0]}
    for known, expected in ((0.05e-3, 0.05e-3), (np.nan, 0.15e-3)):
        calibration = CalibrationFile('touchpad', {}, {}, {'held_out_places_range_rms': known}, span)
        stage = ContactEstimator(ball.sensor, ball.camera, ball.values, calibration)
        stage.process(tracks_of(ball, ball.untouched), 1.0)
        stage.process(tracks_of(ball, ball.truth), 1.1)
        assert along_the_ray(ball, stage.process(tracks_of(ball, ball.truth), 1.2).contacts[0]) == pytest.approx(expected, rel=0.3)


def test_points_are_the_dots_and_their_forces_the_wrench(ball):
    _, result = pressed(ball)
    points, truth = result.points(), ball.truth
    assert points.shape == (23, 23) and points.xyz == pytest.approx(truth.dot_xyz, abs=1e-12)
    assert points.force.sum(axis=0) == pytest.approx(result.wrench[:3], rel=1e-9)
    assert np.cross(points.xyz, points.force).sum(axis=0) == pytest.approx(result.wrench[3:], rel=1e-6, abs=1e-12)
    assert np.linalg.norm(points.force.sum(axis=0) - truth.wrench[:3]) < 0.1 * np.linalg.norm(truth.wrench[:3])
    assert np.array_equal(points.state[result.region.dot_id], result.region.dot_state)
    far = np.linalg.norm(points.xyz - truth.contacts[0].position, axis=1) > 17e-3
    assert far.any() and not points.force[far].any() and points.normal_force.max() > 0


def test_points_are_displaced_by_what_they_moved_and_point_outwards(ball):
    _, result = pressed(ball)
    points, inner = result.points(), np.pad(np.ones((21, 21), bool), 1).ravel()
    moved = ball.truth.dot_xyz - ball.untouched.dot_xyz
    assert np.median(np.linalg.norm(points.displacement - moved, axis=1)) < 0.05e-3
    assert np.linalg.norm(points.normal, axis=1) == pytest.approx(np.ones(529)) and (points.normal[inner, 2] > 0.3).all()


def test_a_dot_that_is_not_seen_is_where_the_membrane_has_it(ball):
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
