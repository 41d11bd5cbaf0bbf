# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from dome_scenes import BALL, CENTRE, DOME, EYE, RADIUS, calibration, dome_field, dome_presses, markers, seen
from tactile_perception.markers.regression.dome_basis import Dent, DentFit
from tactile_perception.markers.view.sensor import dome_cap

RIDGE = 1e-5


def dent():
    rest = markers()
    eye = np.tile(EYE, (len(rest), 1))
    return Dent(seen(rest), eye, rest, dome_cap(DOME), DOME.plane_z, BALL / (RADIUS + BALL), 0.019)


def pressed(place, depth):
    return np.array([*place, np.log(depth), np.log(depth)])


def fit_to(presses):
    presses = presses.select(presses.touching)
    return DentFit(dent(), [field.shift for field in presses.fields], presses.position[:, :2], presses.depth)


@pytest.fixture(scope='module')
def learned():
    return dent().with_coefficients(fit_to(calibration()).coefficients(RIDGE))


def test_a_dent_elsewhere_appears_as_learned(learned):
    for place, depth in (((0.015, -0.02), 0.02), ((-0.03, 0.035), 0.03)):
        shift = dome_field([(place, depth)], noise=0.0).shift
        off = np.hypot(*(learned.appear(pressed(place, depth)) - shift).T)
        away = np.hypot(*(markers()[:, :2] - place).T) > 0.02
        assert np.sqrt(np.nanmean(off[away]**2)) < 0.015 * np.nanmax(np.hypot(*shift.T))


def test_a_dent_turned_about_the_axis_is_the_same_dent_turned(learned):
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    points = markers()
    place = np.array([0.03, 0.01])
    other = Dent(seen(points), np.tile(EYE, (len(points), 1)), np.column_stack([points[:, :2] @ turn.T, points[:, 2]]), dome_cap(DOME),
                 DOME.plane_z, BALL / (RADIUS + BALL), 0.019, learned.coefficients)
    moved, turned = learned.moved(pressed(place, 0.02)), other.moved(pressed(turn @ place, 0.02))
    assert turned[:, :2] == pytest.approx(moved[:, :2] @ turn.T, nan_ok=True) and turned[:, 2] == pytest.approx(moved[:, 2], nan_ok=True)


def test_points_that_do_not_move_appear_where_they_were(learned):
    still = learned.seen_at(np.zeros((len(markers()), 3)))
    assert np.nanmax(np.abs(still)) < 1e-12
    up = CENTRE + (markers() - CENTRE) * 1.01
    assert learned.seen_at(up - markers()) == pytest.approx(seen(up) - seen(markers()), nan_ok=True)


def test_a_press_unlike_the_others_hardly_counts(learned):
    presses = calibration()
    odd = dome_presses([(0.02, 0.02)], (0.02,), still=0)
    odd.fields[0].shift[:] += 4e-3  # the whole dome was dragged aside
    both = type(presses)(presses.fields + odd.fields, *(np.concatenate([getattr(presses, name), getattr(odd, name)]) for name in (
        'position', 'depth', 'segment', 'wrench', 'radius')))
    told = dent().with_coefficients(fit_to(both).coefficients(RIDGE)).appear(pressed((0.02, 0.02), 0.02))
    off = np.hypot(*(told - learned.appear(pressed((0.02, 0.02), 0.02))).T)
    assert np.nanmedian(off) < 0.4e-3


def test_what_is_roughly_known_is_of_a_dents_size(learned):
    place, depth = np.array([0.03, -0.02]), 0.02
    rows, target = learned.anchors(place, depth)
    assert target.reshape(-1, 3)[:, 2].min() == -depth and target.max() == 0.0
    told = (rows @ learned.coefficients.ravel()).reshape(-1, 3)
    assert np.abs(told - target.reshape(-1, 3)).max() < 0.5 * depth
    assert told[0, 2] == pytest.approx(-depth, rel=0.2)
