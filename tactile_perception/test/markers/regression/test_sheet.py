# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.errors import BadArgument, BadCalibration
from tactile_perception.markers.regression.sheet import SheetRegression
from tactile_perception.markers.touches.cross_validation import judge
from tactile_perception.markers.touches.presses import Presses
from tactile_perception.markers.touches.touch import AT_EDGE, OUT_OF_RANGE
from tactile_perception.markers.view.sensor import MARKER_SENSORS

SHEET = MARKER_SENSORS['areal_single']


@pytest.fixture(scope='module')
def fitted(bell_presses, membrane):
    return SheetRegression.fit(bell_presses(shape=membrane), SHEET)


@pytest.fixture(scope='module')
def method(fitted):
    return SheetRegression.from_fitted(fitted, SHEET)


def test_other_presses_are_told_to_a_tenth_of_a_pitch(method, bell_presses, membrane):
    places = np.random.default_rng(4).uniform([-20e-3, -11e-3], [20e-3, 11e-3], (15, 2))
    score = judge(method, bell_presses(places, (1e-3, 2.5e-3, 5e-3), seed=8, shape=membrane))
    assert score.place_mean < 0.2e-3 and score.place_95 < 0.5e-3 and score.depth_mean < 0.1e-3 and score.missed == score.false == 0
    assert 0.2 < score.squares < 1.5


def test_untouched_frames_are_told_as_such(method, bell_field):
    assert not any(method.estimate(bell_field((0, 0), 0.0, seed=k)) for k in range(500))


def test_deeper_and_further_out_than_calibrated_is_flagged(method, bell_field, membrane):
    assert method.estimate(bell_field((2e-3, 1e-3), 10e-3, membrane))[0].flags == OUT_OF_RANGE
    assert method.estimate(bell_field((24e-3, 1e-3), 4e-3, membrane))[0].flags == AT_EDGE
    assert method.estimate(bell_field((2e-3, 1e-3), 4e-3, membrane))[0].flags == 0


def test_markers_that_are_lost_widen_the_covariance(method, bell_field, membrane):
    field = bell_field((7e-3, 3e-3), 4e-3, membrane)
    whole, = method.estimate(field)
    field.shift[np.hypot(*(field.rest - [7e-3, 3e-3]).T) < 5e-3] = np.nan
    part, = method.estimate(field)
    assert np.hypot(*(part.position[:2] - [7e-3, 3e-3])) < 1.5e-3 and part.covariance[0, 0] > whole.covariance[0, 0]


def test_what_does_not_fit_is_refused(fitted, method, bell_presses, bell_field):
    few = bell_presses([(0, 0)], (1e-3, 2e-3))
    with pytest.raises(BadCalibration, match='too few'):
        SheetRegression.fit(few, SHEET)
    with pytest.raises(BadCalibration, match='calibrate anew'):
        SheetRegression.from_fitted({key: value for key, value in fitted.items() if key != 'shape'}, SHEET)
    with pytest.raises(BadArgument, match='117 markers'):
        field = bell_field((0, 0), 1e-3)
        method.estimate(type(field)(*(getattr(field, name)[:50] for name in field.__dataclass_fields__)))


def test_presses_that_the_detector_lost_do_not_stop_the_fit(bell_presses, membrane):
    presses = bell_presses(shape=membrane)
    presses.fields[7].shift[:] = np.nan
    assert SheetRegression.fit(presses, SHEET)['deepest'] == pytest.approx(6e-3)


def drags(bell_field, membrane, ways, depth=4e-3):
    """Presses that go from (-3, 2) mm on by each of the ways (2,) m, in five steps; the sheet sticks to the tip."""
    fields, places = [], []
    for way in np.array(ways):
        for part in np.linspace(0, 1, 6):
            begin = np.array([-3e-3, 2e-3])
            field = bell_field(begin, depth, membrane)
            field.shift[:] += membrane(field.rest, begin, 1.0)[:, None] * way * part
            fields.append(field)
            places.append([*(begin + way * part), -depth])
    count = len(fields)
    return Presses(tuple(fields), np.array(places), np.full(count, depth), np.arange(count), np.full((count, 6), np.nan),
                   np.full(count, np.nan))


def both(presses, more):
    return Presses(presses.fields + more.fields, *(np.concatenate([getattr(presses, name), getattr(more, name)])
                                                   for name in ('position', 'depth', 'segment', 'wrench', 'radius')))


def test_where_drags_were_calibrated_the_tip_is_told_while_it_drags(method, bell_presses, bell_field, membrane):
    ways = [(2e-3, 0), (0, -2e-3), (-1.4e-3, 1.4e-3), (1.4e-3, 1.4e-3)]
    numbers = SheetRegression.fit(both(bell_presses(shape=membrane), drags(bell_field, membrane, ways)), SHEET)
    others = drags(bell_field, membrane, [(-1.8e-3, -0.5e-3), (0.6e-3, 1.9e-3)])
    told = SheetRegression.from_fitted(numbers, SHEET)
    assert numbers['drag'] > 0 and numbers['carry'] == pytest.approx(1.0, abs=0.2)
    assert judge(told, others).place_mean < 0.4e-3 < 0.8e-3 < judge(method, others).place_mean
    straight = judge(told, bell_presses([(9e-3, 4e-3), (-12e-3, -6e-3)], (2e-3, 5e-3), seed=8, shape=membrane))
    assert straight.place_mean < 0.2e-3 and straight.depth_mean < 0.1e-3
