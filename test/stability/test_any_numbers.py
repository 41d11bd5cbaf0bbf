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
REACH = {'touchpad': 0.03, 'areal_single': 0.031, 'air_cushion': 0.16}  # m


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
        assert all(np.abs(contact.position).max() <= REACH[self.sensor] for contact in found)
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
    """In whole fields, and at some places of some fields."""
    rng = np.random.default_rng(4)
    fields = [name for name in FIELDS[1:] if len(pressed.values[name])]
    for some in [*([name] for name in fields for _ in EDGES), *(rng.choice(fields, rng.integers(1, 4)) for _ in range(20))]:
        values = copy.deepcopy(pressed.values)
        for name in some:
            if len(some) == 1:
                values[name][:] = rng.choice(EDGES)
            else:
                places = rng.integers(0, len(values[name]), rng.integers(1, 30))
                values[name][places] = rng.choice([*EDGES, *(10.0**rng.integers(-30, 30, 4))], len(places))
        pressed.contact(values)
    check_next(pressed)
