# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Properties that hold for any input, tested on many examples (hypothesis, derandomized)."""
from fractions import Fraction

import numpy as np
import pytest

hypothesis = pytest.importorskip('hypothesis', reason='pip install hypothesis')
from hypothesis import HealthCheck, assume, given, settings, strategies as st  # noqa: E402
from hypothesis.extra import numpy as arrays  # noqa: E402

from hard_dots import COLUMNS, ROWS, SIZE, bulge, grid, random_pattern  # noqa: E402
from hard_geometry import CAMERA  # noqa: E402
from outline_reference import signed_area  # noqa: E402
from tactile_perception import _core  # noqa: E402
from tactile_perception.common.surface import fill_unseen  # noqa: E402
from tactile_perception.common.rigid_motion import fit_rigid, fit_rigid_robust  # noqa: E402
from tactile_perception.common.geometry import rotation_matrix, rotation_vector  # noqa: E402
from tactile_perception.common.estimates import planar_twist  # noqa: E402
from tactile_perception._core.dots import link_places  # noqa: E402
from tactile_perception.dots.number import Linker, number_grid  # noqa: E402
from tactile_perception.errors import BadFrame, TactileError  # noqa: E402
from tactile_perception.markers.published.gaussian_peak import gaussian  # noqa: E402
from tactile_perception.markers.touches.touch import TouchEstimate  # noqa: E402
from tactile_perception.markers.touches.tracker import TouchTracker  # noqa: E402
from tactile_perception.clock import StampClock  # noqa: E402
from tactile_perception._core.finger import SphereFilter  # noqa: E402
from tactile_perception.finger.map import angles, direction, error_angle, exp_map, log_map  # noqa: E402
from tactile_perception.taxel.estimator import ContinuousDirection  # noqa: E402
from tactile_perception.taxel.repair import fill  # noqa: E402

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
    for fit in (fit_rigid(p, q), fit_rigid_robust(p, q, 1e-3 * size)):
        assert np.abs(fit.rotation - rotation_matrix(turn)).max() < 1e-11 and np.abs(fit.apply(p) - q).max() < 1e-11 * size


@few
@given(arrays.arrays(float, st.tuples(st.integers(0, 8), st.just(3)), elements=hard), st.integers(0, 100))
def test_a_fit_of_any_numbers_is_one_or_is_refused(p, seed):
    """A rotation, never a mirror image or a NaN."""
    q = np.random.default_rng(seed).permutation(p)
    for make in (lambda: fit_rigid(p, q), lambda: fit_rigid_robust(p, q, 1e-5)):
        try:
            fit = make()
        except TactileError:
            continue
        assert np.abs(fit.rotation @ fit.rotation.T - np.eye(3)).max() < 1e-9 and np.linalg.det(fit.rotation) > 0
        assert np.isfinite(fit.translation).all()


@few
@given(arrays.arrays(float, st.tuples(st.integers(0, 8), st.just(2)), elements=hard), st.integers(0, 100))
def test_a_twist_is_finite_or_nan(place, seed):
    with np.errstate(all='ignore'):
        linear, turn, centre = planar_twist(place, np.random.default_rng(seed).normal(0, 1e-3, place.shape))
    assert not np.isinf([*linear, turn, *centre]).any()


@few
@given(phis, thetas)
def test_the_sphere_and_its_plane_are_each_others(phi, theta):
    normal = direction(np.float64(phi), np.float64(theta))
    assert error_angle(exp_map(log_map(normal)), normal) < 1e-14 * max(1, theta / max(np.sin(theta), 1e-9))
    back_phi, back_theta = angles(normal)
    assert abs(back_theta - theta) < 1e-14
    assert error_angle(direction(back_phi, back_theta), normal) < 1e-14


@few
@given(st.lists(st.tuples(phis, thetas, st.sampled_from([0.0, -1.0, 1e-12, 1e-3, 100.0, 1e6])), min_size=1, max_size=12))
def test_the_spheres_filter_stays_on_the_sphere(steps):
    """Times of 0, backwards, and of days; jumps to the other side: a unit vector and a covariance, always."""
    smooth = SphereFilter(20.0)
    for phi, theta, seconds in steps:
        normal = direction(np.float64(phi), np.float64(theta))
        found, spread = smooth.update(normal, 1e-6 * (np.eye(3) - np.outer(normal, normal)), seconds)
        assert abs(np.linalg.norm(found) - 1) < 1e-9
        assert np.linalg.eigvalsh(spread).min() > -1e-9 * max(1.0, np.abs(spread).max())


@few
@given(st.lists(st.tuples(st.floats(-0.02, 0.02), st.floats(1e-6, 0.01), st.sampled_from([1e-9, 1e-3, 0.1, 100.0, 1e6])), max_size=12))
def test_the_touch_filter_gives_covariances_and_each_number_once(steps):
    tracker, stamp, largest = TouchTracker(), 0.0, 0
    for x, depth, seconds in steps:
        stamp += seconds
        found, = tracker.process([TouchEstimate(np.array([x, -x, -depth]), depth, 1e-8 * np.eye(3), 1e-4)], stamp)
        assert 0 < found.id <= largest + 1 and np.isfinite(found.estimate.position).all() and found.estimate.depth >= 0
        assert np.linalg.eigvalsh(found.estimate.covariance).min() > -1e-12
        largest = max(largest, found.id)


@few
@given(arrays.arrays(float, (6, 7), elements=st.one_of(st.just(np.nan), st.floats(-1, 1))))
def test_what_is_seen_is_kept_when_gaps_are_filled(values):
    filled, dead = fill_unseen(values), np.isnan(values)
    assert np.array_equal(filled[~dead], values[~dead])
    assert dead.all() == np.isnan(filled).any()
    repaired = fill(values.astype(np.float32), dead)
    assert np.array_equal(repaired[~dead], values[~dead].astype(np.float32)) and np.isfinite(repaired).all()
    assert dead.all() or np.abs(repaired).max() <= 1 + 1e-6, 'a mean is no larger than what it is of'


@few
@given(arrays.arrays(float, (7, 8), elements=st.floats(0, 1)))
def test_outlines_are_closed_and_hold_what_is_above(field):
    """By fractions: the areas that loops turn around add up to one of the same sign as what is above."""
    wide = np.zeros((9, 10))
    wide[1:-1, 1:-1] = np.where(np.abs(field - 0.5) < 1e-3, 0.4, field)
    places, start, _ = _core.find_contours(wide, level=0.5)
    loops = np.split(places, start[1:-1]) if len(places) else []
    assert bool(loops) == (wide > 0.5).any()
    for loop in loops:
        assert (np.abs(np.diff(np.vstack([loop, loop[:1]]), axis=0)).max(axis=1) <= 1 + 1e-12).all(), 'from cell to cell'
        x, y = ([Fraction(v) for v in part.tolist()] for part in loop.T)
        exact = sum(a * d - c * b for a, b, c, d in zip(x, y, x[1:] + x[:1], y[1:] + y[:1])) / 2
        assert abs(signed_area(loop) - float(exact)) < 1e-12


@few
@given(st.integers(0, 10**6), st.floats(-30, 30), st.floats(-30, 30), st.floats(0.5, 1.0))
def test_numbers_of_a_grid_mind_neither_order_nor_place_nor_size(seed, across, down, size):
    order = np.random.default_rng(seed).permutation(ROWS * COLUMNS)
    uv = (bulge(grid())[order] - np.array(SIZE) / 2) * size + np.array(SIZE) / 2 + [across, down]
    found = number_grid(uv, ROWS, COLUMNS)
    assert found.certain and np.array_equal(found.id, order)


@few
@given(arrays.arrays(float, st.tuples(st.integers(0, 40), st.just(2)), elements=st.one_of(hard, st.floats(0, 500))))
def test_numbers_of_any_places_are_each_given_once(uv):
    for found in (number_grid(uv, 3, 4).id, Linker().update(uv, 0.0)):
        given_ = found[found >= 0]
        assert len(set(given_.tolist())) == len(given_) and (found[~np.isfinite(uv).all(axis=1)] == -1).all()


@few
@given(st.integers(0, 10**6), st.floats(0.1, 60))
def test_links_are_one_to_one_and_within_reach(seed, gate):
    rng = np.random.default_rng(seed)
    places, dots = random_pattern(), rng.permutation(random_pattern())[:60] + rng.normal(0, 8, (60, 2))
    a, b = link_places(places, dots, gate=gate).T
    assert len(set(a.tolist())) == len(a) == len(b) == len(set(b.tolist()))
    assert (np.hypot(*(places[a] - dots[b]).T) <= gate).all()


@few
@given(st.lists(st.floats(-4 * np.pi, 4 * np.pi), min_size=2, max_size=20))
def test_a_direction_never_jumps_and_stays_the_same_but_for_half_turns(raw):
    follow = ContinuousDirection()
    found = np.array([follow.process(angle) for angle in raw])
    assert (np.abs(np.diff(found)) <= np.pi / 2 + 1e-9).all()
    assert np.abs(np.sin(found - raw)).max() < 1e-9


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


@few
@given(arrays.arrays(float, (20, 2), elements=st.floats(0, 1)))
def test_rays_appear_where_they_come_from(share):
    uv = share * [640, 480]
    assert np.abs(CAMERA.project(CAMERA.centre + 0.03 * CAMERA.rays(uv)) - uv).max() < 0.02


@few
@given(st.floats(-8e-3, 8e-3), st.floats(1e-8, 1e3), st.floats(2e-3, 2e-2))
def test_a_gaussian_is_found_whatever_its_size(centre, height, width):
    x = np.arange(-2, 3) * 4.5e-3
    y = height * np.exp(-(x - centre)**2 / (2 * width**2))
    assume(y.min() > 0)
    place, found = gaussian(x, y)
    if np.isnan(place):
        assert np.ptp(np.log(y)) < 0.1, 'only a flat top has no peak'
    else:
        assert abs(place - centre) < 1e-9 and abs(found / height - 1) < 1e-9
