# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Ambient light during a contact (src/psd/held_light.cpp), on sums made up for the test: a detector whose four outputs are bilinear, so the
cross term is x y; and against the same in NumPy."""
import numpy as np
import pytest
from held_reference import HeldLight
from hypothesis import given, settings
from hypothesis import strategies as st
from tactile_perception._core import held_before, held_begin, held_follow, held_interrupt
from tactile_perception.psd.geometry import MIX, TOTAL
from tactile_perception.psd.model import CROSS

PERIOD, NOISE = 1e-3, 0.006  # s; V of an output
SPREAD = NOISE**2 * MIX.T @ MIX
ROOM = np.array([0.30, 0.26, 0.36, 0.40])  # V, of the untouched outputs


def table(calibrated=True):
    """A finger's table with the cross term of that detector."""
    y, x = np.mgrid[-1:1:9j, -1:1:9j]
    values = np.ones((9, 9, 13))
    values[..., CROSS] = x * y if calibrated else np.nan
    return values


class Held:
    """The kernels with their state. shade: the part of the room's light that the object shades beyond the expected, the fifth number."""

    def __init__(self, calibrated=True):
        self.state, self._table = held_before(), table(calibrated)

    shade = property(lambda self: float(self.state[4]))

    def begin(self, offset, calibrated=np.zeros(4)):
        self.state = held_begin(self.state, offset, calibrated)

    def interrupt(self):
        self.state = held_interrupt(self.state)

    def follow(self, sums, inside=None, saturated=None, period=PERIOD):
        """(corrected sums, shift or None)."""
        inside = np.ones(len(sums), bool) if inside is None else inside
        saturated = np.zeros(len(sums), bool) if saturated is None else saturated
        self.state, sums, shift = held_follow(self.state, sums, inside, saturated, self._table, SPREAD, cross_volts=0.005, period=period)
        return sums, shift


def spot(x, y, light=1.0):
    """Sums of one spot."""
    return light * np.array([x, y, 1.0, x * y])


def followed(sums, size=5, room=ROOM, held=None, calibrated=ROOM):
    """(corrected sums (N, 4), sum of shifts (4,)) of a contact with sums (N, 4) in batches, with noise."""
    held = held or Held()
    held.begin(room, calibrated)
    rng, shifts, found = np.random.default_rng(0), np.zeros(4), []
    for k in range(0, len(sums), size):
        some = sums[k:k + size] + rng.normal(0, NOISE, (len(sums[k:k + size]), 4)) @ MIX - shifts @ MIX
        corrected, shift = held.follow(some)
        found.append(corrected)
        if shift is not None:
            shifts = shifts + shift
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


@pytest.mark.parametrize('creep', [0.0, 0.03])
def test_a_lamp_at_the_contacts_own_place_is_told_when_the_object_goes(creep):
    beside = (ROOM[1] + ROOM[2] - ROOM[0] - ROOM[3]) / ROOM.sum(), (ROOM[2] + ROOM[3] - ROOM[0] - ROOM[1]) / ROOM.sum()
    room = lamp(1000, 300, 10, 0.6)
    grows = 1 - creep * np.exp(-np.maximum(np.arange(1000) - 250, 0) / 80)
    sums, shifts = followed(spot(*beside, 2.5) * (grows * (np.arange(1000) < 700))[:, None] + room)
    assert shifts == pytest.approx(0.6 * ROOM / ROOM.sum(), abs=0.02) and np.abs(sums[-100:].mean(0)).max() < 0.02


def test_a_contact_that_grows_weak_at_its_own_place_stays_one():
    light = np.interp(np.arange(1000), [300, 310, 700, 710], [2.0, 2.6, 2.6, 1.0])
    _, shifts = followed(light[:, None] * spot(0.05, 0.05))
    assert not shifts.any()


@pytest.mark.parametrize('part', [0.0, 0.06])
def test_the_shaded_part_of_the_rooms_light_is_measured(part):
    held = Held()
    for x, y in ((0.4, 0.4), (-0.4, 0.4), (0.4, -0.4), (-0.4, -0.4)) * 3:
        sums, _ = followed(np.tile(spot(x, y, 0.8) - part * (ROOM @ MIX), (300, 1)), held=held, calibrated=np.zeros(4))
    assert held.shade + 0.05 == pytest.approx(part, abs=0.015)
    assert far(sums[-100:], (-0.4, -0.4)) < 0.02


def test_a_twentieth_of_what_the_room_has_beyond_that_of_the_calibration_is_expected_to_be_shaded():
    sums, _ = followed(np.tile(spot(0.3, 0.3, 0.8), (5, 1)), held=Held(calibrated=False), calibrated=0.4 * ROOM)
    assert sums.mean(0) == pytest.approx(spot(0.3, 0.3, 0.8) + 0.05 * 0.6 * ROOM @ MIX, abs=0.03)


def test_nothing_is_known_of_a_room_without_light_or_a_detector_without_a_cross_term():
    held = Held(calibrated=False)
    given = np.tile(spot(0.4, 0.4, 0.8), (300, 1)) + lamp(300, 100, 5, 0.5)
    sums, shifts = followed(given, room=np.zeros(4), held=held, calibrated=np.zeros(4))
    assert not shifts.any() and held.shade == 0.0 and sums[-50:, TOTAL].mean() == pytest.approx(1.3, abs=0.02)


def test_after_missing_samples_nothing_is_compared():
    held = Held(calibrated=False)
    followed(np.tile(spot(-0.35, 0.2, 2.5), (300, 1)), held=held)
    held.interrupt()
    given = np.tile(spot(-0.35, 0.2, 2.5) + 0.6 * ROOM @ MIX, (5, 1))
    corrected, shift = held.follow(given)
    assert shift is None and np.array_equal(corrected, given)


def any_contact(rng, size, count=400):
    """Sums (count, 4) of a spot that rests, moves or grows while lamps are switched, and which samples are in contact and saturated."""
    place, light, lamps = rng.uniform(-0.5, 0.5, 2), rng.uniform(0.5, 3), np.zeros(count)
    for at in rng.integers(0, count, 2):
        lamps[at:] += rng.uniform(-0.4, 0.8)
    parts = np.clip((np.arange(count) - rng.integers(count)) / 50, 0, 1)[:, None] * rng.choice([0, 0, 1])
    sums = np.array([spot(*(place + 0.2 * p), light * (1 + p)) for p in parts[:, 0]]) + lamps[:, None] * (ROOM / ROOM.sum() @ MIX)
    if rng.random() < 0.3:
        sums[rng.integers(count):] -= spot(*place, light)
    return sums + rng.normal(0, NOISE, (count, 4)) @ MIX, rng.random(count) < 0.95, rng.random(count) < 0.1


@given(seed=st.integers(0, 2**32 - 1), size=st.sampled_from([1, 5, 7, 25]), calibrated=st.booleans())
@settings(max_examples=40, deadline=None)
def test_it_is_what_numpy_computes(seed, size, calibrated):
    rng = np.random.default_rng(seed)
    held, plain = Held(calibrated), HeldLight((lambda place: place[:, 0] * place[:, 1]) if calibrated else None, 0.005)
    for contact in range(2):
        sums, inside, saturated = any_contact(rng, size)
        held.begin(ROOM, 0.3 * ROOM)
        plain.begin(ROOM, 0.3 * ROOM)
        for k in range(0, len(sums), size):
            some, inner, clipped = (part[k:k + size] for part in (sums, inside, saturated))
            corrected, shift = held.follow(some, inner, clipped)
            used, expected = inner & ~clipped, some.copy()
            if used.any():
                change = plain.follow(some[used].mean(0), int(used.sum()), SPREAD, PERIOD)
                expected[inner] += change.net
                assert (shift is None) == (change.shift is None)
                if shift is not None:
                    np.testing.assert_allclose(shift, change.shift, atol=1e-9)
            np.testing.assert_allclose(corrected, expected, atol=1e-9)
            if k == 200:
                held.interrupt()
                plain.interrupt()
        assert held.shade == pytest.approx(plain.shade, abs=1e-9)


@pytest.mark.parametrize('bins', [-1.0, 6.0, np.nan])
def test_a_state_that_is_none_is_refused(bins):
    held = Held()
    held.state[18] = bins
    with pytest.raises(ValueError, match='^state: '):
        held.follow(np.ones((5, 4)))


@pytest.mark.parametrize('wrong', [{'cross_volts': -1.0}, {'period': np.nan}])
def test_numbers_are_checked(wrong):
    numbers, five = {'cross_volts': 0.0, 'period': PERIOD} | wrong, np.ones(5, bool)
    with pytest.raises(ValueError, match=f'^{next(iter(wrong))}: '):
        held_follow(held_before(), np.ones((5, 4)), five, five, table(), SPREAD, **numbers)
