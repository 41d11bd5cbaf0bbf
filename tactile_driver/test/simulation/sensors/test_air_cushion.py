# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0

from functools import partial

import numpy as np
import pytest

from sheets_seen import bright_spots

from tactile_driver.simulation.optics.pattern import SurfaceSampler
from tactile_driver.simulation.scene.specimen import Script, one_after_the_other, press
from tactile_driver.simulation.sensors import scenes
from tactile_driver.simulation.sensors.air_cushion import air_cushion
from tactile_driver.simulation.sensors.scenes import open_scene


@pytest.fixture(scope='module')
def scene():
    return open_scene('air_cushion_press', rate=20.0, seed=3)


@pytest.fixture(scope='module')
def deepest(scene):
    return int(np.argmax([max([touch.depth for touch in scene.observe(k).truth.contacts], default=0.0) for k in range(scene.frames)]))


def test_circles_are_a_grid_without_corners_and_all_in_the_picture(scene):
    truth = scene.render(0).truth
    assert (scene.rows, scene.columns, scene.sensor) == (17, 17, 'air_cushion')
    assert 0 not in truth.dot_id and 8 * 17 + 8 in truth.dot_id and 200 < len(truth.dot_id) < 240
    assert truth.dot_uv.min() > 8 and (truth.dot_uv < [632, 472]).all()
    assert scene.membrane.rest[..., 2].max() == pytest.approx(0.120, abs=1e-4)
    assert np.hypot(*scene.membrane.rim(60)[:, :2].T) == pytest.approx(0.150, abs=1e-6)


def test_circles_are_seen_where_the_truth_says(scene, deepest):
    for number in (0, deepest):
        image, uv = scene.render_clean(number / scene.rate).image, scene.observe(number).truth.dot_uv
        found, _ = bright_spots(image, uv, 9)
        assert np.median(np.linalg.norm(found - uv, axis=1)) < 0.25


def test_circles_are_seen_at_the_centroid_of_their_bent_area(scene, deepest):
    """That is the mean over many small parts of a circle, weighed by the area of their image."""
    membrane, camera, pattern = scene.membrane, scene.camera, scene._pattern
    pressed = open_scene('air_cushion_press', rate=20.0, seed=3)
    pressed.observe(deepest)
    shape = pressed._contact.state.shape
    radius, turn = np.sqrt((np.arange(12) + 0.5) / 12), np.arange(24) * np.pi / 12
    disc = (radius[:, None] * np.exp(1j * turn)).ravel()
    rest = pattern.sampler.places(membrane.rest)
    aside = np.linalg.qr(pattern.sampler.tangents(membrane.rest))[0]
    parts = (rest[:, None] + np.einsum('k,kij,jp->kpi', pattern.radius, aside, [disc.real, disc.imag])).reshape(-1, 3)
    sampler = SurfaceSampler(membrane.square_of(parts), membrane.nodes)
    uv, slope = camera.project_with_slope(sampler.places(shape))
    printed = np.linalg.norm(np.cross(*np.moveaxis(sampler.tangents(membrane.rest), -1, 0)), axis=-1)
    weight = (np.abs(np.linalg.det(slope @ sampler.tangents(shape))) / printed).reshape(len(rest), -1)
    true = np.einsum('kp,kpi->ki', weight, uv.reshape(len(rest), -1, 2)) / weight.sum(axis=1, keepdims=True)
    places, seen, _ = pattern.seen(shape, camera)
    off, of_centres = (np.linalg.norm(at - true, axis=1) for at in (seen, camera.project(places)))
    assert of_centres.max() > 0.2 and off.max() < 0.03 and np.sqrt(np.mean(off**2)) < 0.005


def test_a_press_hardly_depends_on_the_frames_it_is_seen_in(monkeypatch):
    """Friction depends on the path: a tip that goes far in one step of contact would touch the skin too late."""
    act = partial(press, 'ball_30mm', 0.03, -0.02, 0.035, move=0.5, hold=1.0)
    monkeypatch.setitem(scenes.SCENES, 'one press', Script(air_cushion, one_after_the_other([act], untouched=0.0)))
    places = []
    for rate in (2.0, 40.0):
        seen = open_scene('one press', rate=rate, seed=3)
        number = max(range(seen.frames), key=lambda k: max([touch.depth for touch in seen.observe(k).truth.contacts], default=0.0))
        places.append(seen.observe(number).truth.dot_xyz)
    assert np.linalg.norm(places[0] - places[1], axis=1).max() < 1.5e-4


def test_light_is_low_and_noise_high(scene):
    noisy, clean = scene.render(0).image.astype(float), scene.render_clean(0).image.astype(float)
    assert np.median(clean) < 25 and 60 < np.percentile(clean, 99.5) < 200
    assert 2 < (noisy - clean)[100:200, 250:400].std() < 6


def test_gas_is_compressed_and_carries_the_indenter(scene, deepest):
    rest, truth = scene.observe(0).truth, scene.observe(deepest).truth
    touch, = truth.contacts
    assert touch.depth == pytest.approx(0.035, abs=1e-5) and touch.position[:2] == pytest.approx([0.030, -0.020], abs=1e-5)
    assert 1.02 < truth.pressure / rest.pressure < 1.4
    assert touch.force == pytest.approx(-truth.wrench[:3] @ truth.normal) and 5 < touch.force < 20
    # what presses on the contact's area, and the skin's pull at its edge
    assert touch.force > 0.8 * truth.pressure * truth.area
    volume = scene.membrane.volume_of(scene.observe(deepest).shape.astype(float))
    lost = 1 - volume / scene.membrane.volume
    assert lost == pytest.approx((truth.pressure - rest.pressure) / (101325 + rest.pressure), rel=0.05)


@pytest.mark.full
def test_random_circles_are_no_grid_and_do_not_overlap():
    scene = open_scene('air_cushion_random_test', rate=20.0, seed=1)
    truth = scene.observe(0).truth
    assert (scene.rows, scene.columns) == (0, 0) and 180 < len(truth.dot_id) < 320
    apart = np.linalg.norm(truth.dot_xyz[:, None] - truth.dot_xyz, axis=-1) + np.eye(len(truth.dot_id))
    assert apart.min() > 2.2 * 0.0046
    other = open_scene('air_cushion_random_test', rate=20.0, seed=2).observe(0).truth
    assert len(other.dot_uv) != len(truth.dot_uv) or np.abs(other.dot_uv - truth.dot_uv).max() > 20


@pytest.mark.full
def test_a_larger_indenter_makes_a_wider_contact():
    scene = open_scene('air_cushion_demo', rate=4.0)
    areas = {}
    for k in range(scene.frames):
        truth = scene.observe(k).truth
        if len(truth.contacts) == 1 and truth.contacts[0].depth > 0.024:
            place = tuple(np.round(truth.contacts[0].position[:2], 3))
            areas[place] = max(areas.get(place, 0), truth.area)
    assert areas[(0.040, 0.045)] < 0.6 * areas[(0.010, -0.015)] < 0.6 * areas[(-0.045, 0.020)]
