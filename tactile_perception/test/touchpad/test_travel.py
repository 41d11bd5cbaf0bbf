# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.estimates import ContactEstimate
from tactile_perception.touchpad.region import ContactDots
from tactile_perception.touchpad.slip import ContactTravel

SIGMA = 30e-6  # m, of each coordinate of a tip


def travelled(tips, rate=30.0, sigma=SIGMA, dots=0.0, seed=0, rises=0.0):
    """Velocity told after a tip was at tips (T, 2), m, seen with an error of sigma, m, while the dots moved by dots (T, 2) or 0, m, and
    the tip rose by rises, m a frame."""
    row, column = np.mgrid[:9, :9]
    rest = np.stack([column.ravel() - 4.0, row.ravel() - 4.0, np.zeros(81)], axis=1) * 1.4e-3
    travel, rng = ContactTravel(), np.random.default_rng(seed)
    for k, (tip, moved) in enumerate(zip(tips, np.broadcast_to(dots, np.shape(tips)))):
        xyz = rest + [*moved, 0]
        members = np.linalg.norm(rest[:, :2] - tip + moved, axis=1) < 3.5e-3
        frame = ContactDots(9, 9, np.arange(81), xyz, rest, members.astype(float), members.astype(np.uint8))
        place = np.array([*(tip + sigma * rng.normal(size=2)), 0.0])
        travel.add(frame, [ContactEstimate(7, place, np.array([0, 0, 1.0]), 1e-3 - k * rises, 1.0, np.eye(3) * sigma**2, 0,
                                           members)], k / rate)
    return travel.velocity(7)


def line(way, count):
    return np.outer(np.arange(count), way)


@pytest.mark.parametrize('speed, rate', [(3e-3, 30.0), (8e-3, 30.0), (20e-3, 30.0), (8e-3, 60.0)])
def test_an_even_slide_is_known_to_an_eighth(speed, rate):
    way = np.array([0.6, -0.8]) * speed
    found = np.array([travelled(line(way / rate, int(0.2 * rate) + 1), rate, seed=seed) for seed in range(40)])
    told = found[np.isfinite(found).all(axis=1)]
    errors = np.linalg.norm(told - way, axis=1) / speed
    assert len(told) > 30 and np.sqrt(np.mean(errors**2)) < 1 / 8


@pytest.mark.parametrize('rises, known', [(0.0, True), (0.02e-3, True), (0.1e-3, False)])
def test_the_velocity_of_a_tip_that_is_lifted_is_unknown(rises, known):
    assert np.isfinite(travelled(line([6e-3 / 30, 0], 7), rises=rises)).all() == known


def test_a_tip_that_carries_the_dots_with_it_does_not_travel():
    way = line([0.2e-3, 0], 7)
    assert np.isnan(travelled(way, dots=way)).all()
    np.testing.assert_allclose(travelled(2 * way, dots=way), [6e-3, 0], atol=1e-3)


def test_a_slow_drift_within_the_noise_is_not_told():
    assert np.isnan([travelled(line([10e-6, 0], 7), seed=seed) for seed in range(20)]).all()


def test_a_tip_that_has_stopped_or_jumped_has_no_speed():
    way = line([0.3e-3, 0], 5)
    assert np.isnan(travelled(np.vstack([way, way[-1:], way[-1:], way[-1:]]))).all()
    assert np.isnan(travelled(np.vstack([np.zeros((6, 2)), [[1e-3, 0]]]))).all()


def test_a_tip_under_which_the_dots_come_to_rest_slows_down():
    way, shaken = line([0.2e-3, 0], 7), 10e-6 * (np.arange(7) % 2)[:, None] * [0, 1]
    assert np.isfinite(travelled(way, dots=shaken)).all()
    shaken[-1] = shaken[-2]
    assert np.isnan(travelled(way, dots=shaken)).all()


def test_a_tip_that_turns_back_has_its_new_velocity():
    way = line([0.3e-3, 0], 5)
    assert np.isnan(travelled(np.vstack([way, way[-2:-3:-1]]))).all()
    np.testing.assert_allclose(travelled(np.vstack([way, way[-2:1:-1]])), [-9e-3, 0], atol=2e-3)


def test_nothing_is_known_of_a_face_of_two_frames_or_of_other_contacts():
    assert np.isnan(travelled(line([0.3e-3, 0], 7), sigma=0.2e-3)).all()
    assert np.isnan(travelled(line([0.3e-3, 0], 2))).all()
    assert np.isnan(ContactTravel().velocity(1)).all()


def test_a_contact_on_other_dots_than_before_is_unknown():
    assert np.isnan(travelled(line([4e-3, 0], 5) - [8e-3, 0])).all()
