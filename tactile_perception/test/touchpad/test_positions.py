# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots of a touchpad and their positions, and its geometry from parameters."""
import dataclasses

import cv2
import numpy as np
import pytest

from tactile_driver.parameters.table import defaults
from tactile_driver.simulation.optics.light import Lighting
from tactile_driver.simulation.optics.rendering import Imaging
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_driver.simulation.sensors.touchpad import touchpad
from tactile_perception.common.camera import CameraModel
from tactile_perception.common.dots import DotTracks
from tactile_perception.common.geometry import Cap
from tactile_perception.core.errors import BadArgument, BadFrame
from tactile_perception.dots.tracker import find_pattern, make_tracker
from tactile_perception.touchpad.parameters import TOUCHPAD_SENSOR_PARAMETERS
from tactile_perception.touchpad.positions import DotPositions, RestPositions, touchpad_tracker
from tactile_perception.touchpad.sensor import Touchpad

CAMERA = CameraModel([[700, 0, 320], [0, 700, 240], [0, 0, 1]], translation=[0, 0, 0.04])


def tracks(uv, duv):
    n = len(uv)
    return DotTracks(3, 3, np.arange(n), uv + duv, np.full(n, 90.0), np.full(n, 0.02), np.broadcast_to(duv, (n, 2)).astype(float))


@pytest.fixture
def rest():
    return RestPositions(Cap(), CAMERA, 3, 3)


def test_reference_positions_are_on_the_sphere_and_project_to_the_untouched_image(rest):
    uv = np.array([[300.0, 220.0], [320.0, 240.0], [420.0, 300.0]])
    assert rest.update(tracks(uv, np.array([4.0, -2.0]))) == 1
    assert np.linalg.norm(rest.xyz[:3] - [0, 0, -0.007], axis=1) == pytest.approx(0.02, abs=1e-12)
    assert CAMERA.project(rest.xyz[:3]) == pytest.approx(uv, abs=1e-9)
    assert np.isnan(rest.xyz[3:]).all()


def test_only_a_moved_reference_or_a_new_dot_changes_the_version(rest):
    uv = np.array([[300.0, 220.0], [320.0, 240.0]])
    assert rest.update(tracks(uv, np.zeros(2))) == 1
    assert rest.update(tracks(uv + 0.01, np.array([9.0, 9.0]))) == 1
    assert rest.update(tracks(uv + 0.05, np.zeros(2))) == 2
    assert rest.update(tracks(np.vstack([uv, [[350.0, 260.0]]]), np.zeros(2))) == 3
    missing = tracks(uv, np.zeros(2))
    missing.duv[0] = np.nan
    rest.update(missing)
    assert np.isfinite(rest.xyz[:3]).all()


@pytest.fixture(scope='module')
def seen(ball):
    """Tracks of an untouched and of the pressed image."""
    tracker = make_tracker(ball.values)
    rest = tracker.process(ball.rest[0], 1.0)
    return rest, tracker.process(ball.pressed, 1.1)


def part(tracks, keep):
    """Select tracks by keep (N,) bool."""
    return dataclasses.replace(tracks, **{n: getattr(tracks, n)[keep] for n in ('id', 'uv', 'area', 'sigma', 'duv')})


def errors(xyz, truth, tracks):
    return np.linalg.norm(xyz - truth.dot_xyz[tracks.id], axis=1)


def test_a_grey_image_gives_no_positions(ball, seen):
    rest, pressed = seen
    positions = DotPositions(ball.sensor, ball.camera)
    assert np.isnan(positions.locate(cv2.cvtColor(ball.rest[0], cv2.COLOR_BGR2GRAY), rest)).all()
    positions.locate(ball.rest[0], rest)
    assert np.isfinite(positions.locate(ball.pressed, pressed)).mean() > 0.97


def test_a_dot_without_a_reference_position_has_no_position(ball, seen):
    rest, pressed = seen
    positions = DotPositions(ball.sensor, ball.camera)
    hidden = rest.id % 50 == 7
    positions.locate(ball.rest[0], part(rest, ~hidden))
    unknown = dataclasses.replace(pressed, duv=np.where((pressed.id % 50 == 7)[:, None], np.nan, pressed.duv))
    xyz = positions.locate(ball.pressed, unknown)
    assert np.isnan(xyz[pressed.id % 50 == 7]).all() and np.isfinite(xyz[pressed.id % 50 != 7]).mean() > 0.97


def test_too_few_reference_positions_are_refused(ball, seen):
    rest, _ = seen
    with pytest.raises(BadFrame, match='get no 3D positions'):
        DotPositions(ball.sensor, ball.camera).locate(ball.rest[0], part(rest, rest.id % 4 == 0))


def test_an_image_in_other_light_has_no_positions_and_the_next_one_has(ball, seen):
    rest, pressed = seen
    positions = DotPositions(ball.sensor, ball.camera)
    positions.locate(ball.rest[0], rest)
    before = positions.locate(ball.pressed, pressed)
    assert np.isnan(positions.locate(cv2.add(ball.pressed, (20, 20, 20, 0)), pressed)).all()
    assert 'the light or the white balance has changed' in positions.warning
    brighter = cv2.convertScaleAbs(ball.pressed, alpha=1.05)
    again = positions.locate(brighter, pressed)
    assert np.nanmax(np.abs(again - before)) < 0.5e-3 and positions.warning == '', 'all colours change alike: exposure, not light'


def test_after_a_new_reference_the_colour_is_identified_again(ball, seen):
    """Half of the light, another white balance: after reset() positions are as accurate as before."""
    rest, pressed = seen
    positions = DotPositions(ball.sensor, ball.camera)
    positions.locate(ball.rest[0], rest)

    def other_light(image):
        return np.clip(image * [0.5, 0.6, 0.55], 0, 255).astype(np.uint8)

    positions.reset()
    positions.locate(other_light(ball.rest[0]), rest)
    for _ in range(3):
        off = errors(positions.locate(other_light(ball.pressed), pressed), ball.truth, pressed)
    assert np.sqrt(np.nanmean(off**2)) < 0.15e-3


@pytest.mark.parametrize('kind', ['stored_420', 'stored_jpeg'])
def test_positions_with_a_reduced_colour_resolution(ball, seen, kind, request):
    rest, pressed = seen
    positions, stored = DotPositions(ball.sensor, ball.camera), request.getfixturevalue(kind)
    for image in ball.rest[:3]:
        off = errors(positions.locate(stored(image), rest), ball.untouched, rest)
    assert np.sqrt(np.mean(off**2)) < 0.05e-3
    for _ in range(3):
        off = errors(positions.locate(stored(ball.pressed), pressed), ball.truth, pressed)
    assert np.sqrt(np.nanmean(off**2)) < 0.12e-3


@pytest.fixture(scope='module')
def glaring():
    """A pad with glare whose strength, width and number of lamps differ from the shipped scenes: frames and truth of a drag."""
    lighting = dataclasses.replace(Lighting(), gloss=500.0, gloss_width=0.012, sheen=0.11, sheen_width=0.06, lamps=6, lamp_radius=0.021)
    imaging = dataclasses.replace(Imaging(), drift=0.04, drift_period=30, reflections=((230.0, 260.0, 3.5, 150.0),))
    scene = open_scene('disc_tilt', rate=10.0, seed=5)
    scene._renderer = touchpad(5, 640, lighting, imaging).renderers[0]
    return scene, [scene.render(k / 10) for k in range(0, 34)]


def located(glaring, ball):
    """RMS of the errors of the dots' positions, m, frame by frame."""
    scene, frames = glaring
    camera = ball.sensor.camera(scene.camera.matrix, scene.camera.distortion)
    tracker, positions, found = make_tracker(ball.values), DotPositions(ball.sensor, camera), []
    for k, frame in enumerate(frames):
        tracks = tracker.process(frame.image, 1.0 + k / 10)
        found.append(np.sqrt(np.nanmean(errors(positions.locate(frame.image, tracks), frame.truth, tracks)**2)))
    return np.array(found)


@pytest.mark.full
def test_positions_on_a_pad_with_glare_and_drift(glaring, ball):
    off = located(glaring, ball)
    assert off[:14].max() < 0.04e-3  # untouched
    assert np.median(off[17:]) < 0.1e-3 and off.max() < 0.15e-3


@pytest.mark.full
@pytest.mark.parametrize('seed', [1, 2, 3])
def test_positions_below_white_highlights_that_hide_the_background(seed, ball):
    lighting = dataclasses.replace(Lighting(), gloss=660.0, gloss_width=0.01, sheen=0.19, sheen_width=0.041, sheen_water=0.0)
    scene = open_scene('rest', rate=10.0, seed=seed)
    scene._renderer = touchpad(seed, 640, lighting, dataclasses.replace(Imaging(), blur=0.66, read_noise=1.2)).renderers[0]
    assert located((scene, [scene.render(k / 10) for k in range(3)]), ball).max() < 0.06e-3


def rms(values):
    return float(np.sqrt(np.mean(np.sum(values**2, axis=1))))


@pytest.fixture(scope='module')
def begun(ball):
    stage = touchpad_tracker(ball.sensor, ball.camera, ball.values)
    for k, image in enumerate(ball.rest[:3]):
        stage.process(image, 1 + 0.1 * k)
    return stage


def test_dots_and_positions_of_a_press(ball, begun):
    tracks = begun.process(ball.pressed, 2.0)
    assert len(tracks) > 515 and len(set(tracks.id.tolist())) == len(tracks)
    assert np.median(np.linalg.norm(tracks.uv - ball.truth.dot_uv[tracks.id], axis=1)) < 0.05
    moved = ball.truth.dot_uv - ball.untouched.dot_uv
    known = np.isfinite(tracks.duv).all(axis=1)
    assert np.median(np.linalg.norm(tracks.duv - moved[tracks.id], axis=1)[known]) < 0.08
    placed = np.isfinite(tracks.xyz).all(axis=1)
    assert placed.mean() > 0.98 and rms((tracks.xyz - ball.truth.dot_xyz[tracks.id])[placed]) < 0.1e-3


def test_an_untouched_pad_shows_no_motion(ball, begun):
    tracks = begun.process(ball.rest[3], 3.0)
    assert rms(tracks.xyz - ball.untouched.dot_xyz[tracks.id]) < 0.08e-3
    assert np.nanmedian(np.abs(tracks.duv)) < 0.03 and begun.warning == ''


def test_set_reference_uses_the_next_frame(ball, begun):
    begun.process(ball.rest[3], 4.0)
    begun.set_reference()
    tracks = begun.process(ball.pressed, 4.1)
    assert np.abs(tracks.duv).max() == 0 and 'touched' in begun.warning
    begun.set_reference()
    assert np.abs(begun.process(ball.rest[3], 4.2).duv).max() == 0 and begun.warning == ''


def test_without_a_camera_dots_have_no_positions(ball):
    tracks = touchpad_tracker(ball.sensor, None, ball.values).process(ball.rest[0], 1.0)
    assert tracks.xyz is None and len(tracks) > 515


def test_a_pattern_without_a_grid_is_numbered_in_any_image(ball):
    values = {**ball.values, 'rows': 0, 'columns': 0, 'numbering': 'tracks'}
    pattern = find_pattern(ball.rest[0], values)
    assert len(pattern) > 515 and (np.diff(pattern[:, 1]) >= 0).all()
    tracks = make_tracker(values, pattern).process(ball.pressed, 1.0)  # the first image that the tracker sees
    assert len(tracks) > 0.9 * len(pattern) and np.abs(tracks.uv - pattern[tracks.id]).max() < 12.0


DEFAULT = defaults(TOUCHPAD_SENSOR_PARAMETERS)


def test_the_default_is_the_papers_pad_with_a_camera_40_mm_behind_the_rim():
    sensor = Touchpad.from_parameters(DEFAULT)
    camera = sensor.camera(np.diag([700.0, 700.0, 1.0]), np.zeros(5))
    assert (sensor.rows, sensor.columns, sensor.cap.curvature_radius, sensor.cap.height) == (23, 23, 0.020, 0.013)
    assert camera.centre == pytest.approx([0, 0, -0.04])


@pytest.mark.parametrize('changes, message', [
    ({'camera.rotation': [0.0, 1.0]}, 'three numbers'), ({'rows': 0, 'columns': 0}, 'at least 3'),
    ({'cap.height': 0.05}, 'cap: need'), ({'membrane.rest_pressure': 9e5}, 'membrane')])
def test_inconsistent_parameters_are_refused_by_name(changes, message):
    with pytest.raises(BadArgument, match=message):
        Touchpad.from_parameters({**DEFAULT, **changes})
