# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernels of the PSD finger (src/psd/finger.cpp) against one sample after the other."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tactile_perception._core import count_repeats, finger_samples, finger_touch, held_before, held_begin, place_covariance, place_values

LIMITS = {'lit': 0.1, 'least': 0.2, 'saturation': 4.5, 'level': 3}
seeds = st.integers(0, 2**32 - 1)


def table(rng, nodes=5, channels=5):
    """Random values whose first three are far from zero."""
    return rng.uniform(0.5, 1.5, (nodes, nodes, channels))


def at(values, place):
    """Bilinear value of a table at one place."""
    cells = len(values) - 1
    x, y = (np.clip(place, -1, 1) + 1) / 2 * cells
    c, r = min(int(x), cells - 1), min(int(y), cells - 1)
    s, t = x - c, y - r
    return (1 - t) * ((1 - s) * values[r, c] + s * values[r, c + 1]) + t * ((1 - s) * values[r + 1, c] + s * values[r + 1, c + 1])


def finger(rng, nodes=5):
    """The table of a finger, whose normals bend with the light."""
    values = table(rng, nodes, 13)
    values[..., 9] *= 3
    values[..., 10:] -= 1
    return values


def mixed(net):
    """Differences along x and y, total, cross term (eq 1) of outputs x1, y1, x2, y2."""
    x1, y1, x2, y2 = net
    return np.array([y1 + x2 - x1 - y2, x2 + y2 - x1 - y1, x1 + y1 + x2 + y2, x1 + x2 - y1 - y2])


@given(seed=seeds, count=st.integers(0, 40), nodes=st.integers(2, 9), spoil=st.booleans())
@settings(max_examples=60, deadline=None)
def test_samples_are_those_of_one_after_the_other(seed, count, nodes, spoil):
    rng = np.random.default_rng(seed)
    volts, offset, values = rng.uniform(-0.1, 5, (count, 4)), rng.uniform(0, 0.3, 4), table(rng, nodes)
    if spoil and count:
        volts[rng.integers(count), rng.integers(4)] = rng.choice([np.nan, np.inf, -np.inf])
    sums, place, over, saturated, known, lowest, highest, least_over = finger_samples(volts, offset, values, **LIMITS)
    assert known == np.isfinite(volts).all(1).sum()
    np.testing.assert_array_equal(saturated, (volts >= 4.5).any(1))
    for k in np.flatnonzero(np.isfinite(volts).all(1)):
        expected = mixed(volts[k] - offset)
        np.testing.assert_allclose(sums[k], expected, atol=1e-12)
        if expected[2] > 0.1:
            where = np.clip(expected[:2] / expected[2], -1, 1)
            np.testing.assert_allclose(place[k], where, atol=1e-12)
            np.testing.assert_allclose(over[k], expected[2] - max(0.2, at(values, where)[3]), atol=1e-9)
        else:
            assert np.isnan(place[k]).all() and over[k] == -np.inf
    if known == count > 0:
        assert (lowest, highest, least_over) == (sums[:, 2].min(), sums[:, 2].max(), over.min())


OUT_OF_RANGE, AMBIGUOUS, SATURATED = 1, 4, 8
RADIUS, SHOT, CROSS_VOLTS, OFFSET_VOLTS = 0.016, 1e-4, 0.05, 0.03
SHADE = 0.05  # part of the room's light, standard deviation before it is measured


def contact_of(mean, values, relative=None):
    """(place, unit normal) of mean sums; relative: light over the typical one, less 1, None for that at the place."""
    place = np.clip(mean[:2] / mean[2], -1, 1)
    row = at(values, place)
    relative = np.clip(mean[2] / row[9] - 1, -1, 1) if relative is None else relative
    normal = row[:3] + relative * row[10:]
    return place, normal / np.linalg.norm(normal)


def covariance_of(place, normal, total, count, values, noise, room):
    """Covariance (3, 3) of the position, m^2, by differences: that of the light's noise, of room (4,) sums, V, that are taken off wrongly,
    and the deviation of the map along the surface."""
    step, relative = 1e-6, np.clip(total / at(values, place)[9] - 1, -1, 1)
    slopes = np.column_stack([(contact_of(np.r_[(place + d) * total, total], values, relative)[1] - normal) / step
                              for d in (np.array([step, 0]), np.array([0, step]))])
    of_place = place_covariance(place, total, noise, SHOT) / count
    if room[2] > 0:
        moved = (place * total + 1e-6 * np.clip(room[:2] / room[2], -1, 1)) / (total + 1e-6) - place
        of_place += (OFFSET_VOLTS**2 + (SHADE * room[2])**2) * np.outer(moved, moved) / 1e-12
    along = np.eye(3) - np.outer(normal, normal)
    return RADIUS**2 * (slopes @ of_place @ slopes.T + at(values, place)[3] ** 2 * along)


def touch(sums, inside, saturated, values, noise, loads, stuck=False, state=held_before()):
    """finger_touch of this finger."""
    return finger_touch(sums, inside, saturated, values, noise, loads, state, shot=SHOT, cross_volts=CROSS_VOLTS, offset_volts=OFFSET_VOLTS,
                        radius=RADIUS, stuck=stuck)


@given(seed=seeds, count=st.integers(1, 30), calibrated=st.booleans(), lit=st.booleans())
@settings(max_examples=80, deadline=None)
def test_a_touch_is_that_of_the_mean_and_its_covariance_that_of_differences(seed, count, calibrated, lit):
    rng = np.random.default_rng(seed)
    values, inside, saturated = finger(rng, 3), rng.random(count) < 0.8, rng.random(count) < 0.2
    inside[0], saturated[0] = True, False
    values[..., 3:5] *= [0.01, 0.5]
    if not calibrated:
        values[..., 6:9] = np.nan
    sums = rng.uniform(-0.4, 0.4, (count, 4)) + [0, 0, 3, 3 + 0.3 * rng.standard_normal()]
    spread = rng.normal(0, 0.01, (4, 4))
    noise, loads = spread @ spread.T, rng.normal(0, 0.3, (2, 8)) if calibrated else np.full((2, 8), np.nan)
    offset = rng.uniform(0.05, 0.4, 4)
    state, room = (held_begin(held_before(), offset, np.zeros(4)), mixed(offset)) if lit else (held_before(), np.zeros(4))
    position, normal, force, depth, covariance, flags = touch(sums, inside, saturated, values, noise, loads, state=state)
    used = inside & ~saturated
    mean = sums[used].mean(0)
    expected_place, expected_normal = contact_of(mean, values)
    row, light, square = at(values, expected_place), np.log(mean[2]), expected_place @ expected_place
    np.testing.assert_allclose(normal, expected_normal, atol=1e-12)
    np.testing.assert_allclose(position, RADIUS * expected_normal, atol=1e-14)
    expected = covariance_of(expected_place, expected_normal, mean[2], used.sum(), values, noise, room)
    np.testing.assert_allclose(covariance, expected, atol=1e-4 * np.abs(covariance).max())
    expected_loads = [np.exp(part + c[1] * light + c[2] * light**2 + c[7] * square * light) for part, c in zip(row[7:9], loads)]
    np.testing.assert_allclose([force, depth], expected_loads, rtol=1e-9)
    two = abs(mean[3] - row[6] * mean[2]) > 6 * np.hypot(np.sqrt(noise[3, 3] / used.sum()), CROSS_VOLTS)
    assert flags == SATURATED * saturated.any() + AMBIGUOUS * (two and calibrated) + OUT_OF_RANGE * (row[4] < 0.5)


@pytest.mark.parametrize('lamp, counts', [
    ((0.02, 0.01, 0.25, 0.0), True), ((-0.02, -0.01, -0.25, 0.0), True), ((0.1, 0.1, 0.25, 0.0), False), ((0.4, 0.0, 0.1, 0.0), False),
    ((0.004, 0.002, 0.05, 0.0), False)])
def test_where_sudden_light_may_be_a_lamps_the_covariance_holds_the_place_without_it(lamp, counts):
    values, one, none = finger(np.random.default_rng(1), 3), np.ones(1, bool), np.zeros(1, bool)
    values[..., 3] *= 0.01
    mean = np.array([0.3, -0.2, 2.5, 0.0])
    state = held_begin(held_before(), np.full(4, 0.1), np.zeros(4))  # a room whose centroid is the middle
    state[8], state[9:13] = 1.0, mean
    base, found = (touch(mean[None], one, none, values, np.diag([1e-4] * 4), np.ones((2, 8)), state=np.r_[state[:43], light, state[47:]])[4]
                   for light in (np.zeros(4), np.array(lamp)))
    relative = np.clip(mean[2] / at(values, mean[:2] / mean[2])[9] - 1, -1, 1)
    with_it, without = (RADIUS * contact_of(sums, values, relative)[1] for sums in (mean, mean - lamp))
    assert np.trace(found - base) == pytest.approx(counts * ((with_it - without) ** 2).sum(), rel=0.1, abs=1e-15)
    assert not counts or np.trace(found) > 1.02 * np.trace(base)


def test_a_touch_without_usable_samples_or_light_is_not_known():
    values, three, none = finger(np.random.default_rng(0)), np.ones(3, bool), np.zeros(3, bool)
    known = values, np.eye(4), np.ones((2, 8))
    for sums, saturated, stuck, expected in ((np.ones((3, 4)), three, False, SATURATED), (-np.ones((3, 4)), none, False, 0),
                                             (np.full((3, 4), np.nan), none, False, 0), (np.ones((3, 4)), none, True, AMBIGUOUS),
                                             (np.ones((3, 4)), three, True, SATURATED)):
        *found, flags = touch(sums, three, saturated, *known, stuck)
        assert all(np.isnan(part).all() for part in found) and flags == expected
    assert touch(np.ones((3, 4)), none, none, *known) is None
    assert touch(np.zeros((0, 4)), none[:0], none[:0], *known) is None


def test_light_on_the_detectors_edge_is_out_of_range():
    values, one, none = finger(np.random.default_rng(0)), np.ones(1, bool), np.zeros(1, bool)
    assert touch(np.array([[1.2, 0.0, 1.0, 1.0]]), one, none, values, np.eye(4), np.ones((2, 8)))[-1] & OUT_OF_RANGE


@given(seed=seeds, count=st.integers(0, 30), nodes=st.integers(2, 9))
@settings(max_examples=40, deadline=None)
def test_values_between_the_nodes_are_bilinear_and_clipped(seed, count, nodes):
    rng = np.random.default_rng(seed)
    values, places = table(rng, nodes), rng.uniform(-1.5, 1.5, (count, 2))
    found = place_values(places, values)
    assert found.shape == (count, 5)
    for place, row in zip(places, found):
        np.testing.assert_allclose(row, at(values, place), atol=1e-12)
    assert np.isnan(place_values(np.array([[np.nan, 0.0], [0.0, np.inf]]), values)).all()


def test_repeats_go_on_through_batches_and_saturation_is_none():
    volts = np.array([[1, 1, 5, 1], [1, 2, 5, 1], [1, 2, 5, np.nan], [1, 2, 5, 1]], float)
    last, same = count_repeats(volts[:2], np.full(4, np.nan), np.zeros(4), saturation=4.5)
    assert last.tolist() == volts[1].tolist() and same.tolist() == [2, 1, 0, 2]
    last, same = count_repeats(volts[2:], last, same, saturation=4.5)
    assert same.tolist() == [4, 3, 0, 1]
    assert count_repeats(np.zeros((0, 4)), last, same, saturation=4.5)[1].tolist() == same.tolist()


@pytest.mark.parametrize('wrong', [np.ones((1, 1, 3)), np.ones((3, 2, 3)), np.ones((3, 3, 2))])
def test_a_table_that_is_none(wrong):
    with pytest.raises(ValueError, match='^table: '):
        place_values(np.zeros((1, 2)), wrong)


@pytest.mark.parametrize('number', ['lit', 'least', 'saturation', 'level'])
def test_limits_are_checked(number):
    with pytest.raises(ValueError, match=f'^{number}: '):
        finger_samples(np.zeros((2, 4)), np.zeros(4), table(np.random.default_rng(0)), **LIMITS | {number: -1})


def test_a_touch_needs_a_fingers_table():
    with pytest.raises(ValueError, match='^table: 13 channels'):
        touch(np.ones((1, 4)), np.ones(1, bool), np.zeros(1, bool), table(np.random.default_rng(0), 5, 8), np.eye(4), np.ones((2, 8)))
