# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Ambient light during a contact, on sums made up for the test: a detector whose four outputs are bilinear, so the cross term is x y."""
import numpy as np
import pytest

from tactile_perception.psd.geometry import MIX, TOTAL
from tactile_perception.psd.held_light import HeldLight

PERIOD, NOISE = 1e-3, 0.006  # s; V of an output
SPREAD = NOISE**2 * MIX.T @ MIX
ROOM = np.array([0.30, 0.26, 0.36, 0.40])  # V, of the untouched outputs


def spot(x, y, light=1.0):
    """Sums of one spot."""
    return light * np.array([x, y, 1.0, x * y])


def followed(sums, size=5, room=ROOM, held=None):
    """(corrected sums (N, 4), sum of shifts (4,)) of a contact with sums (N, 4) in batches, with noise."""
    held = held or HeldLight(lambda place: place[:, 0] * place[:, 1], 0.005)
    held.begin(room)
    rng, shifts, found = np.random.default_rng(0), np.zeros(4), []
    for k in range(0, len(sums), size):
        some = sums[k:k + size] + rng.normal(0, NOISE, (len(sums[k:k + size]), 4)) @ MIX - shifts @ MIX
        change = held.follow(some.mean(0), len(some), SPREAD, PERIOD)
        found.append(some + change.net)
        if change.shift is not None:
            shifts = shifts + change.shift
    return np.concatenate(found), shifts


def lamp(count, at, rise, light):
    """Sums (count, 4) of a lamp that lights the room within rise samples."""
    return np.clip((np.arange(count) - at) / rise, 0, 1)[:, None] * (light * ROOM / ROOM.sum() @ MIX)


def far(sums, place):
    """Largest distance, half widths, of the mean place of 20 samples from a place."""
    mean = sums[:len(sums) // 20 * 20].reshape(-1, 20, 4).mean(1)
    return np.linalg.norm(mean[:, :2] / mean[:, 2:3] - place, axis=1).max()


@pytest.mark.parametrize('size', [1, 5, 25])
@pytest.mark.parametrize('light', [0.6, -0.6])
@pytest.mark.parametrize('rise', [1, 20, 100])
def test_a_lamp_moves_no_object_that_rests_and_its_light_becomes_the_offsets(size, light, rise):
    sums, shifts = followed(spot(-0.35, 0.2, 2.5) + lamp(1000, 300, rise, light), size)
    assert shifts.sum() == pytest.approx(light, abs=0.03)
    assert far(sums, (-0.35, 0.2)) < 0.015


def test_an_object_that_is_pressed_harder_is_no_lamp():
    light = 1.5 + np.clip((np.arange(1000) - 300) / 30, 0, 1)
    sums, shifts = followed(light[:, None] * spot(-0.35, 0.2))
    assert not shifts.any() and sums[-100:, TOTAL].mean() == pytest.approx(2.5, rel=0.05)


@pytest.mark.parametrize('samples', [30, 300, 900])
def test_an_object_that_moves_is_no_lamp(samples):
    part = np.clip((np.arange(1400) - 300) / samples, 0, 1)
    way = np.array([spot(-0.4 + 0.5 * p, 0.3 - 0.5 * p, 1.5 + 0.4 * p) for p in part])
    sums, shifts = followed(way)
    assert not shifts.any() and far(sums[-100:], (0.1, -0.2)) < 0.02


def test_room_light_that_stays_after_the_object_ends_the_contact():
    sums = np.concatenate([np.tile(spot(-0.35, 0.3, 2.0), (300, 1)), np.tile(0.5 * ROOM @ MIX, (200, 1))])
    _, shifts = followed(sums)
    assert shifts == pytest.approx(0.5 * ROOM, abs=0.02)


@pytest.mark.parametrize('part', [0.0, 0.06])
def test_the_shaded_part_of_the_rooms_light_is_measured(part):
    held = HeldLight(lambda place: place[:, 0] * place[:, 1], 0.005)
    for x, y in ((0.4, 0.4), (-0.4, 0.4), (0.4, -0.4), (-0.4, -0.4)) * 3:
        sums, _ = followed(np.tile(spot(x, y, 0.8) - part * (ROOM @ MIX), (300, 1)), held=held)
    assert held.shade == pytest.approx(part, abs=0.015)
    assert far(sums[-100:], (-0.4, -0.4)) < 0.02


def test_nothing_is_known_of_a_room_without_light_or_a_detector_without_a_cross_term():
    held = HeldLight(None, 0.0)
    sums, shifts = followed(np.tile(spot(0.4, 0.4, 0.8), (300, 1)) + lamp(300, 100, 5, 0.5), room=np.zeros(4), held=held)
    assert not shifts.any() and held.shade == 0.0 and sums[-50:, TOTAL].mean() == pytest.approx(1.3, abs=0.02)


def test_after_missing_samples_nothing_is_compared():
    held = HeldLight(None, 0.0)
    followed(np.tile(spot(-0.35, 0.2, 2.5), (300, 1)), held=held)
    held.interrupt()
    later = held.follow(spot(-0.35, 0.2, 2.5) + 0.6 * ROOM @ MIX, 5, SPREAD, PERIOD)
    assert later.shift is None and not later.net.any()
