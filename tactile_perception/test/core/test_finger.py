# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernels of the PSD finger (src/finger.cpp) against one sample after the other."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tactile_perception._core import count_repeats, finger_contact, finger_samples, place_covariance, place_values

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


def contact_of(mean, values):
    """(place, unit normal) of mean sums."""
    place = np.clip(mean[:2] / mean[2], -1, 1)
    normal = at(values, place)[:3]
    return place, normal / np.linalg.norm(normal)


@given(seed=seeds, count=st.integers(1, 30))
@settings(max_examples=60, deadline=None)
def test_a_contact_is_that_of_the_mean_and_its_covariance_that_of_differences(seed, count):
    rng = np.random.default_rng(seed)
    values, used = table(rng, 3), rng.random(count) < 0.7
    used[0] = True
    sums = rng.uniform(-0.4, 0.4, (count, 4)) + [0, 0, 3, 0]
    spread = rng.normal(0, 0.01, (4, 4))
    noise, shot = spread @ spread.T, 1e-4
    found, place, normal, covariance, row = finger_contact(sums, used, values, noise=noise, shot=shot)
    mean = sums[used].mean(0)
    expected_place, expected_normal = contact_of(mean, values)
    np.testing.assert_allclose(found, mean, atol=1e-12)
    np.testing.assert_allclose(place, expected_place, atol=1e-12)
    np.testing.assert_allclose(normal, expected_normal, atol=1e-12)
    np.testing.assert_allclose(row, at(values, expected_place), atol=1e-12)
    step = 1e-6
    slopes = np.column_stack([(contact_of(np.r_[(place + d) * mean[2], mean[2:]], values)[1] - normal) / step
                              for d in (np.array([step, 0]), np.array([0, step]))])
    of_place = place_covariance(place, mean[2], noise, shot) / used.sum()
    np.testing.assert_allclose(covariance, slopes @ of_place @ slopes.T, atol=1e-4 * np.abs(covariance).max() + 1e-15)


def test_a_contact_without_samples_or_light_is_not_known():
    values = table(np.random.default_rng(0))
    for sums, used in ((np.ones((3, 4)), [False] * 3), (-np.ones((3, 4)), [True] * 3), (np.full((3, 4), np.nan), [True] * 3),
                       (np.zeros((0, 4)), [])):
        _, *found = finger_contact(sums, np.array(used, bool), values, noise=np.eye(4), shot=0.0)
        assert all(np.isnan(part).all() for part in found)


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
