# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers at the edges of floating point, few entries, another order, single numbers spoilt at random: a result on the sensor, none, or a
named error; and the next good message is processed as if there had been no bad one."""
import copy

import numpy as np
import pytest
import rig
from tactile_perception.errors import TactileError

pytestmark = pytest.mark.filterwarnings('ignore::RuntimeWarning')
FIELDS = ('id', 'u', 'v', 'du', 'dv', 'area', 'x', 'y', 'z')
LARGEST = float(np.finfo(np.float32).max)
EDGES = (np.nan, np.inf, 0.0, 1e-44, 1e30, -LARGEST)
REACH = {'touchpad': 0.03, 'areal_single': 0.031, 'areal_dual': 0.067, 'air_cushion': 0.16, 'psd_finger': 0.02, 'taxel_array': 0.04}  # m


def on_sensor(sensor, results):
    """The contacts of results, which lie on the sensor."""
    found = rig.contacts(results)
    assert all(np.abs(contact.position).max() <= REACH[sensor] for contact in found)
    return found


def values_of(dots):
    """Field -> array of a message of dots."""
    return {name: np.array(getattr(dots, name)) for name in FIELDS}


def with_values(dots, values):
    """The message with other values."""
    other = copy.copy(dots)
    for name, value in values.items():
        setattr(other, name, np.asarray(value).tolist())
    return other


class Pressed:
    """A chain of a sensor with dots that has seen it untouched; dots: of a press, not yet given to the contact stage."""

    def __init__(self, sensor):
        self.sensor, of = sensor, rig.seen(sensor)
        self.chain = of.chain().begun()
        self.dots = self.chain.dots(of.pressed)
        self.values = values_of(self.dots)

    def contact(self, values):
        """Contacts of other values, one frame later; None for a named error."""
        self.chain.stamp_ns += rig.STEP_NS
        message = with_values(self.dots, values)
        message.header = copy.deepcopy(self.dots.header)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(self.chain.stamp_ns, 10**9)
        try:
            with np.errstate(all='ignore'):
                return on_sensor(self.sensor, self.chain.contact(message))
        except TactileError as error:
            assert str(error)
            return None


@pytest.fixture(scope='module', params=('touchpad', 'areal_single', 'air_cushion'))
def pressed(request):
    return Pressed(request.param)


def check_next(pressed):
    """The good dots are one contact where it is."""
    found = pressed.contact(pressed.values)
    assert len(found) == 1 and found[0].position == pytest.approx(rig.seen(pressed.sensor).truth[0].position, abs=6e-3)


@pytest.mark.parametrize('name', FIELDS[1:])
def test_numbers_at_the_edges_of_floating_point(pressed, name):
    for value in EDGES:
        for part in (np.s_[7], np.s_[:]):
            values = copy.deepcopy(pressed.values)
            if len(values[name]):
                values[name][part] = value
                pressed.contact(values)
    check_next(pressed)


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


def test_spoilt_at_random(pressed):
    rng = np.random.default_rng(4)
    for _ in range(20):
        values = copy.deepcopy(pressed.values)
        for name in rng.choice(FIELDS[1:], rng.integers(1, 4)):
            if count := len(values[name]):
                some = rng.integers(0, count, rng.integers(1, 30))
                values[name][some] = rng.choice([*EDGES, *(10.0**rng.integers(-30, 30, 4))], len(some))
        pressed.contact(values)
    check_next(pressed)


@pytest.mark.parametrize('sensor', ['psd_finger', 'taxel_array'])
def test_any_raw_numbers(sensor):
    """Any voltages, and any counts, between good frames: the good ones are as without them."""
    of, rng = rig.seen(sensor), np.random.default_rng(5)
    chain, good = of.chain().begun(), 0
    for _ in range(40):
        if sensor == 'psd_finger':
            raw = rng.normal(1, 2, (rng.integers(1, 40), 4))
            raw.ravel()[rng.integers(0, raw.size, 8)] = rng.choice(EDGES[:4], 8)
        else:
            raw = rng.integers(0, 2**rng.integers(1, 9), of.rest[0].shape).astype(np.uint8)
        try:
            results = chain(raw)
            if results:  # a few samples may be too few for a result
                on_sensor(sensor, results)
                good += 1
        except TactileError as error:
            assert str(error)
    fresh = of.chain().begun()
    if sensor == 'taxel_array':
        for raw in of.rest:
            results = chain(raw)
        assert rig.untouched(results) and on_sensor(sensor, chain(of.pressed))
    assert good and len(on_sensor(sensor, fresh(of.pressed))) == 1
