# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Properties that hold for any input, tested on many examples (hypothesis, derandomized)."""
import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from tactile_perception.clock import StampClock
from tactile_perception.common.geometry import rotation_matrix, rotation_vector
from tactile_perception.errors import BadFrame
from tactile_perception.finger.map import direction, error_angle, exp_map, log_map
from tactile_perception.touchpad.pose import fit_rigid

pytestmark = pytest.mark.filterwarnings('ignore::RuntimeWarning')
few = settings(derandomize=True, database=None, deadline=None, max_examples=60, suppress_health_check=list(HealthCheck))
EDGES = [0.0, -0.0, 5e-324, 1e-310, 1e-30, 1e-9, 1.0, np.pi, 1e30, 1e300, np.inf, -np.inf, np.nan]
hard = st.one_of(st.sampled_from(EDGES), st.floats())
unit = st.floats(-1, 1)
phis, thetas = st.floats(-np.pi, np.pi), st.one_of(st.sampled_from([0.0, 1e-15, 1e-9, np.pi / 2, np.pi - 1e-9]), st.floats(0, np.pi))
turns = st.tuples(unit, unit, unit, st.one_of(st.sampled_from([0.0, 1e-12, 1e-9, np.pi - 1e-9, np.pi]), st.floats(0, np.pi)))


def turn_of(parts):
    axis = np.array(parts[:3])
    assume(np.linalg.norm(axis) > 1e-3)
    return axis / np.linalg.norm(axis) * parts[3]


@few
@given(turns)
def test_a_rotation_and_its_vector_are_each_others(parts):
    turn = turn_of(parts)
    matrix = rotation_matrix(turn)
    assert np.abs(matrix @ matrix.T - np.eye(3)).max() < 1e-14
    assert np.abs(rotation_matrix(rotation_vector(matrix)) - matrix).max() < 1e-14
    assert min(np.abs(rotation_vector(matrix) - sign * turn).max() for sign in (1, -1)) < 1e-13


@few
@given(turns, st.integers(0, 10**6), st.integers(3, 30), st.floats(1e-4, 1e3))
def test_a_motion_is_found_whatever_it_is(parts, seed, count, size):
    rng, turn = np.random.default_rng(seed), turn_of(parts)
    p = rng.normal(0, size, (count, 3))
    spread = np.linalg.svd(p - p.mean(axis=0))[1]
    assume(spread[1] > 1e-2 * spread[0])
    q = p @ rotation_matrix(turn).T + size * rng.normal(0, 1, 3)
    fit = fit_rigid(p, q)
    assert np.abs(fit.rotation - rotation_matrix(turn)).max() < 1e-11
    assert np.abs(p @ fit.rotation.T + fit.translation - q).max() < 1e-11 * size


@few
@given(phis, thetas)
def test_the_sphere_and_its_plane_are_each_others(phi, theta):
    normal = direction(np.float64(phi), np.float64(theta))
    assert error_angle(exp_map(log_map(normal)), normal) < 1e-14 * max(1, theta / max(np.sin(theta), 1e-9))


@few
@given(st.lists(st.one_of(st.sampled_from([np.nan, np.inf, -np.inf, 0.0, 100.0]), st.floats(-5, 5)), max_size=30))
def test_the_clock_names_what_goes_back_and_begins_anew_only_then(stamps):
    clock, last = StampClock(), -np.inf
    for stamp in stamps:
        try:
            anew = clock.begins_anew(stamp)
        except BadFrame:
            assert stamp < last
            continue
        assert not (anew and stamp > last)
        last = stamp if anew or (np.isfinite(stamp) and stamp > last) else last
