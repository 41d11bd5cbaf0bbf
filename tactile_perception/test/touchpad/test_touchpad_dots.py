# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From an image to numbered dots in 3D, with numbers against the scene's truth."""
import dataclasses

import numpy as np
import pytest
from tactile_perception.dots.tracker import find_pattern, make_tracker
from tactile_perception.touchpad.places import TouchpadDots


def rms(values):
    return float(np.sqrt(np.mean(np.sum(values**2, axis=1))))


@pytest.fixture(scope='module')
def begun(ball):
    stage = TouchpadDots(ball.sensor, ball.camera, ball.values)
    for k, image in enumerate(ball.rest[:3]):
        stage.process(image, 1 + 0.1 * k)
    return stage


def test_dots_and_places_of_a_press(ball, begun):
    tracks = begun.process(ball.pressed, 2.0)
    assert len(tracks) > 515 and len(set(tracks.id.tolist())) == len(tracks)
    assert np.median(np.linalg.norm(tracks.uv - ball.truth.dot_uv[tracks.id], axis=1)) < 0.05
    moved = ball.truth.dot_uv - ball.untouched.dot_uv
    known = np.isfinite(tracks.duv).all(axis=1)
    assert np.median(np.linalg.norm(tracks.duv - moved[tracks.id], axis=1)[known]) < 0.08
    placed = np.isfinite(tracks.xyz).all(axis=1)
    assert placed.mean() > 0.98 and rms((tracks.xyz - ball.truth.dot_xyz[tracks.id])[placed]) < 0.1e-3


def test_nothing_moves_at_rest(ball, begun):
    tracks = begun.process(ball.rest[3], 3.0)
    assert rms(tracks.xyz - ball.untouched.dot_xyz[tracks.id]) < 0.08e-3
    assert np.nanmedian(np.abs(tracks.duv)) < 0.03 and begun.warning == ''


def test_set_reference_takes_the_next_frame(ball, begun):
    begun.process(ball.rest[3], 4.0)
    begun.set_reference()
    tracks = begun.process(ball.pressed, 4.1)
    assert np.abs(tracks.duv).max() == 0 and 'touched' in begun.warning
    begun.set_reference()
    assert np.abs(begun.process(ball.rest[3], 4.2).duv).max() == 0 and begun.warning == ''


def test_without_a_camera_or_a_surface_dots_have_no_places(ball):
    flat = dataclasses.replace(ball.sensor, cap=None)
    for stage in (TouchpadDots(ball.sensor, None, ball.values), TouchpadDots(flat, ball.camera, ball.values)):
        tracks = stage.process(ball.rest[0], 1.0)
        assert tracks.xyz is None and len(tracks) > 515


def test_a_pattern_without_a_grid_numbers_any_image_of_it(ball):
    sensor, values = dataclasses.replace(ball.sensor, cap=None, rows=0, columns=0), {**ball.values, 'numbering': 'tracks'}
    pattern = find_pattern(ball.rest[0], values)
    assert len(pattern) > 515 and (np.diff(pattern[:, 1]) >= 0).all()
    tracks = make_tracker(sensor, values, pattern).process(ball.pressed, 1.0)  # the first image that the tracker sees
    assert len(tracks) > 0.9 * len(pattern) and np.abs(tracks.uv - pattern[tracks.id]).max() < 12.0
