# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import dataclasses

import numpy as np
import pytest
import yaml
from sheet_scenes import EYE, GRID, MATERIAL, SENSOR, field_of, library, pressed
from tactile_perception.errors import BadCalibration
from tactile_perception.markers.mechanics.calibration import SheetCalibration
from tactile_perception.markers.mechanics.identification import EyeShifts
from tactile_perception.markers.mechanics.matched_filter import SheetStart
from tactile_perception.markers.mechanics.method import SheetModelMethod, SheetPresses, Tip, tips_of
from tactile_perception.markers.mechanics.projection import Press, appearance, read_press
from tactile_perception.markers.mechanics.solver import FieldNoise, SheetInverse, interaction
from tactile_perception.markers.touches.touch import AT_EDGE, OUT_OF_RANGE

NOISE, PITCH = FieldNoise(5e-6, 5e-3, 3e-3, 1.5), 4.5e-3
START = SheetStart(library(), NOISE.shift, NOISE.growth)
PRESSES = SheetPresses(library(), SheetInverse(library(), NOISE, 0.0, PITCH), START, PITCH)


def explained(field):
    found = PRESSES.explain(field, START.best(field)[0])
    return found, tips_of(library(), found)


def together(presses, mixed=0.4, seed=0):
    """The field of presses whose sum lacks a part of what they share."""
    each = [read_press(library(), press, GRID) for press in presses]
    return field_of(appearance(sum(each) + mixed * interaction(each), GRID, EYE), 2e-6, 2e-3, seed)


def test_the_sheet_between_two_presses_lacks_most_in_the_middle():
    places = np.array([[0.0, 0.0], [1e-6, 0.0], [0.01, 0.0]])
    each = [read_press(library(), Press(np.array([x, 0.0]), 3e-3), places) for x in (-0.01, 0.01)]
    lacks = interaction(each)
    assert lacks[0, 0, 2] == pytest.approx(-each[0][0, 0, 2] / 2, rel=1e-6) and (lacks[:, 0, 2] > 0).all()
    assert lacks[1, 1, 2] == pytest.approx((lacks[1, 0, 2] - lacks[0, 0, 2]) / 1e-6, abs=2e-3)
    assert not lacks[..., :2].any()


@pytest.mark.parametrize('one, other', [((-0.010, 0.003, 3e-3), (0.006, -0.004, 2.4e-3)), ((-0.008, -0.006, 4e-3), (0.004, 0.005, 3.5e-3)),
                                        ((0.0, 0.0, 2e-3), (0.012, 0.002, 2e-3))])
def test_two_presses_are_told_apart(one, other):
    truth = [Press(np.array(press[:2]), press[2]) for press in (one, other)]
    found, tips = explained(together(truth))
    assert len(tips) == 2 and found.misfit < 2 and found.mixed == pytest.approx(0.4, abs=0.25)
    places = sorted((press.place for press in found.presses), key=lambda place: place[0])
    assert np.abs(np.array(places) - [one[:2], other[:2]]).max() < 5e-4


def test_a_tip_beside_another_stands_where_the_sheet_is_inclined_to():
    truth = [Press(np.array([-0.008, 0.0]), 3e-3), Press(np.array([0.008, 0.0]), 3e-3)]
    found, tips = explained(together(truth))
    for press, tip in zip(found.presses, tips):
        nearer = abs(press.place[0]) - abs(tip.vector[0])
        assert 1e-4 < nearer < 1.5e-3 and tip.vector[2] > press.depth + 2e-4
        assert tip.covariance[0, 0] > (0.1 * nearer)**2


@pytest.mark.parametrize('place', [(0.0, 0.0), (0.012, -0.007), (-0.015, 0.010), (0.003, 0.0145)])
def test_one_tip_of_any_size_is_one(place):
    for depth, radius in ((1e-3, 7e-3), (4e-3, 5.6e-3), (4e-3, 8.75e-3)):
        for seed in range(8):
            _, tips = explained(field_of(pressed(*place, depth, radius), 5e-6, 5e-3, seed))
            assert len(tips) == 1 and np.hypot(*(tips[0].vector[:2] - place)) < 8e-4


def test_a_drag_is_told_from_a_press_elsewhere_and_from_two():
    press = Press(np.array([0.005, -0.003]), 4e-3, dragged=(1.5e-3, -1e-3))
    found, tips = explained(together([press]))
    assert len(tips) == 1 and found.presses[0].dragged == pytest.approx(press.dragged, abs=1e-4)
    assert np.abs(tips[0].vector[:2] - [0.00575, -0.0035]).max() < 1e-4 and tips[0].covariance[0, 0] > (3e-4)**2


class Counting:
    """Explains frame after frame, and counts the rounds of each."""

    def __init__(self, monkeypatch):
        inverse = SheetInverse(library(), NOISE, 0.0, PITCH)
        self.presses, self.rounds = SheetPresses(library(), inverse, START, PITCH), []
        within = inverse._within
        monkeypatch.setattr(inverse, '_within', lambda *state: self._count(within(*state)))

    def _count(self, state):
        self.rounds[-1] += 1
        return state

    def __call__(self, field):
        self.rounds.append(0)
        found = self.presses.explain(field, START.best(field)[0])
        return found, tips_of(library(), found)


def two_at(k):
    """Two presses that go deeper and along the sheet."""
    return [Press(np.array([-0.010 + 2e-4 * k, 0.003]), 2.5e-3 + 1e-4 * k), Press(np.array([0.007, -0.004 + 2e-4 * k]), 2e-3 + 1e-4 * k)]


def test_two_presses_are_followed_in_fewer_rounds_to_where_they_are_found_anew(monkeypatch):
    follow = Counting(monkeypatch)
    for k in range(10):
        found, tips = follow(together(two_at(k), seed=k))
        fresh = Counting(monkeypatch)(together(two_at(k), seed=k))[1]
        assert len(tips) == len(fresh) == 2
        for tip in tips:
            assert min(np.abs(tip.vector - other.vector).max() for other in fresh) < 1e-4
    assert max(follow.rounds[1:]) <= 9 < follow.rounds[0]


def test_a_second_press_is_found_as_soon_as_in_single_frames_and_lost_when_it_ends(monkeypatch):
    follow, one = Counting(monkeypatch), Press(np.array([-0.008, 0.0]), 4e-3)
    for k in [*range(25), *range(24, -1, -1)]:
        field = together([one] + ([Press(np.array([0.010, 0.004]), 1.5e-4 * k)] if k else []), seed=k)
        told, alone = len(follow(field)[1]), len(Counting(monkeypatch)(field)[1])
        assert told == alone or told > alone and k < 10, 'a press that ends is told a little longer than it would be anew'
    assert told == 1


def test_another_frame_is_not_told_by_what_was_before(monkeypatch):
    follow = Counting(monkeypatch)
    follow(together(two_at(0)))
    _, (tip,) = follow(together([Press(np.array([0.002, -0.008]), 3e-3)]))
    assert tip.vector == pytest.approx([0.002, -0.008, 3e-3], abs=1e-4)
    again, anew = follow(together(two_at(0)))[0], Counting(monkeypatch)(together(two_at(0)))[0]
    assert [press.vector.tolist() for press in again.presses] == [press.vector.tolist() for press in anew.presses]


NOISE_TOUCH = FieldNoise(5e-6, 5e-3, 3e-3, 1.5)
COVERED = np.array([[-0.018, -0.011], [0.018, 0.011]])
CALIBRATION = SheetCalibration(library(), MATERIAL, 1.2e-3, EyeShifts(np.array([[0, 0, -0.062]]), np.zeros((1, 2))), NOISE_TOUCH, 3e-5,
                               0.01,
                               COVERED, 6e-3, np.zeros(2))
METHOD = SheetModelMethod(CALIBRATION, SENSOR)


def touches(*press, noise=5e-6, growth=5e-3, seed=0):
    return METHOD.estimate(field_of(pressed(*press), noise, growth, seed))


def test_a_touch_is_told_with_its_uncertainty():
    touch, = touches(0.012, -0.007, 4e-3, 8e-3)
    assert touch.position == pytest.approx([0.012, -0.007, -4e-3], abs=1.5e-4) and touch.depth == -touch.position[2]
    assert touch.radius == pytest.approx(8e-3, rel=0.1) and touch.flags == 0 and touch.reason == ''
    assert 3e-5 < np.sqrt(touch.covariance[0, 0]) < 3e-4 and touch.depth_sigma == pytest.approx(np.sqrt(touch.covariance[2, 2]))
    assert np.linalg.eigvalsh(touch.covariance).min() > 0


def test_places_are_told_in_the_frame_of_the_presses():
    aside = SheetModelMethod(dataclasses.replace(CALIBRATION, offset=np.array([3e-4, -2e-4])), SENSOR)
    field = field_of(pressed(0.004, -0.003, 3e-3))
    (there,), (here,) = aside.estimate(field), METHOD.estimate(field)
    assert there.position - here.position == pytest.approx([-3e-4, 2e-4, 0])


def test_shallow_touches_are_told():
    touch, = touches(-0.006, 0.004, 3e-4)
    off = touch.position - [-0.006, 0.004, -3e-4]
    assert np.hypot(*off[:2]) < 2e-3 and abs(off[2]) < 5e-5 and off @ np.linalg.solve(touch.covariance, off) < 20


def test_nothing_touches_in_noise():
    still = np.zeros((len(GRID), 3))
    assert not any(METHOD.estimate(field_of(still, 5e-6, 5e-3, seed)) for seed in range(300))


def test_too_few_markers_tell_nothing():
    field = field_of(pressed(0.0, 0.0, 4e-3))
    shift = field.shift.copy()
    shift[5:] = np.nan
    assert METHOD.estimate(dataclasses.replace(field, shift=shift)) == []


def test_what_was_not_calibrated_is_flagged():
    deep, = touches(0.0, 0.0, 7e-3)
    outside, = touches(0.0, 0.0158, 3e-3)
    assert deep.flags & OUT_OF_RANGE and outside.flags & OUT_OF_RANGE


def test_a_touch_at_the_clamp_stays_on_the_sheet():
    field = field_of(pressed(0.0, 0.0160, 4e-3), 5e-6, 5e-3)
    beyond = dataclasses.replace(field, rest=field.rest - [0, 0.002])  # as if the sheet were printed a little aside
    for touch in METHOD.estimate(beyond):
        assert np.abs(touch.position[1]) < 0.0225
    assert METHOD._touch(Tip(np.append(library().plan.reach, 1e-3), np.eye(3) * 1e-10, 0.0), 1.0).flags & AT_EDGE


def test_the_calibration_file_keeps_it():
    fitted = yaml.safe_load(yaml.safe_dump(CALIBRATION.numbers()))
    field = field_of(pressed(0.012, -0.007, 4e-3, 8e-3), 5e-6, 5e-3)
    again, = SheetModelMethod.from_fitted(fitted, SENSOR).estimate(field)
    assert again.position == pytest.approx(METHOD.estimate(field)[0].position, abs=5e-6)


def test_a_broken_calibration_is_refused():
    with pytest.raises(BadCalibration, match='calibrate again'):
        SheetModelMethod.from_fitted({'noise': {}}, SENSOR)


def test_the_same_frames_are_told_the_same_to_the_bit_and_a_pause_forgets_what_was():
    press = [field_of(pressed(0.012, -0.007, 4e-3, 8e-3), 5e-6, 5e-3, seed) for seed in range(3)]
    still = field_of(np.zeros((len(GRID), 3)), 5e-6, 5e-3)
    told = [[touch.position.tolist() for field in press for touch in SheetModelMethod(CALIBRATION, SENSOR).estimate(field)]]
    for _ in range(2):
        method = SheetModelMethod(CALIBRATION, SENSOR)
        told.append([touch.position.tolist() for field in [press[0], still, press[1], still, press[2]] for touch in method.estimate(field)])
    assert told[0] == told[1] == told[2] and len(told[0]) == 3
