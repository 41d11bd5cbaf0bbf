# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Properties that hold for any input (hypothesis, derandomized). Numbers at the edges of floating point, few entries, another order, single
numbers spoilt at random: a result on the sensor, none, or a named error; the next good message is processed as if there had been none."""
import copy

import numpy as np
import pytest
import rig
from hypothesis import HealthCheck, assume, given, settings, strategies as st

from tactile_perception.common.geometry import error_angle, rotation_matrix, rotation_vector
from tactile_perception.core.clock import StampClock
from tactile_perception.core.errors import BadFrame, TactileError
from tactile_perception.finger.map import direction, exp_map, log_map
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
            is_restart = clock.restarts_at(stamp)
        except BadFrame:
            assert stamp < last
            continue
        assert not (is_restart and stamp > last)
        last = stamp if is_restart or (np.isfinite(stamp) and stamp > last) else last


FIELDS = ('id', 'u', 'v', 'du', 'dv', 'area', 'x', 'y', 'z')
LARGEST = float(np.finfo(np.float32).max)
SPOILT = (np.nan, np.inf, 0.0, 1e-44, 1e30, -LARGEST)
HALF_SIZES = {'touchpad': 0.03, 'areal_single': 0.031, 'air_cushion': 0.16}  # m


class Pressed:
    """A chain of a sensor with dots that has seen it untouched; dots: of a press, not yet given to the contact stage."""

    def __init__(self, sensor):
        self.sensor, of = sensor, rig.seen(sensor)
        self.chain = of.chain().begun()
        self.dots = self.chain.dots(of.pressed)
        self.values = {name: np.array(getattr(self.dots, name)) for name in FIELDS}

    def contact(self, values):
        """Contacts of other values, one frame later, which lie on the sensor; None for a named error."""
        self.chain.stamp_ns += rig.STEP_NS
        message = copy.deepcopy(self.dots)
        for name, value in values.items():
            setattr(message, name, np.asarray(value).tolist())
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(self.chain.stamp_ns, 10**9)
        try:
            with np.errstate(all='ignore'):
                found = rig.contacts(self.chain.contact(message))
        except TactileError as error:
            assert str(error)
            return None
        assert all(np.abs(contact.position).max() <= HALF_SIZES[self.sensor] for contact in found)
        return found


@pytest.fixture(scope='module', params=('touchpad', 'areal_single', 'air_cushion'))
def pressed(request):
    return Pressed(request.param)


def check_next(pressed):
    """The good dots are one contact where it is."""
    found = pressed.contact(pressed.values)
    assert len(found) == 1 and found[0].position == pytest.approx(rig.seen(pressed.sensor).truth[0].position, abs=6e-3)


@pytest.mark.parametrize('count', [0, 1, 2, 5])
def test_hardly_an_entry_reports_nothing(pressed, count):
    assert not pressed.contact({name: value[:count] for name, value in pressed.values.items()})
    check_next(pressed)


def test_entries_in_another_order_are_the_same_contact(pressed):
    check_next(pressed)
    order = np.random.default_rng(8).permutation(len(pressed.values['id']))
    (one,), (other,) = (pressed.contact({name: value[some] if len(value) else value for name, value in pressed.values.items()})
                        for some in (np.arange(len(order)), order))
    assert other.position == pytest.approx(one.position, abs=2e-5) and other.depth == pytest.approx(one.depth, abs=2e-5)


def test_all_at_one_place_or_on_a_line_is_nothing_that_is_sure(pressed):
    for change in (lambda v: np.full_like(v, v[0]), lambda v: np.linspace(v[0], v[-1], len(v))):
        pressed.contact({name: change(value) if name in 'uvxyz' and len(value) else value for name, value in pressed.values.items()})
    check_next(pressed)


def test_numbers_at_the_edges_of_floating_point_anywhere(pressed):
    """In whole fields, and at some positions of some fields."""
    rng = np.random.default_rng(4)
    fields = [name for name in FIELDS[1:] if len(pressed.values[name])]
    for some in [*([name] for name in fields for _ in SPOILT), *(rng.choice(fields, rng.integers(1, 4)) for _ in range(20))]:
        values = copy.deepcopy(pressed.values)
        for name in some:
            if len(some) == 1:
                values[name][:] = rng.choice(SPOILT)
            else:
                positions = rng.integers(0, len(values[name]), rng.integers(1, 30))
                values[name][positions] = rng.choice([*SPOILT, *(10.0**rng.integers(-30, 30, 4))], len(positions))
        pressed.contact(values)
    check_next(pressed)
