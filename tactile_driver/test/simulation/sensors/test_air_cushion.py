# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0

import numpy as np
import pytest

from sheets_seen import bright_spots

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
