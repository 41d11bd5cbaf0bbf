# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Stamps that repeat, go back, are NaN or jump by 100 s; and all dots lost for a second and found again."""

import numpy as np
import pytest

import hard_taxels
from hard_dots import COLUMNS, ROWS, drawn, grid, random_pattern
from hard_geometry import _moved, cap_dots
from hard_psd import PERIOD, REST, finger, scene
from hard_sheets import pad_inputs, pad_tracks, sheet, stage_of_pad
from tactile_perception.dots.number import Linker
from tactile_perception.dots.tracker import DotTracker
from tactile_perception.errors import BadFrame
from tactile_perception.markers.touches.touch import TouchEstimate
from tactile_perception.markers.touches.tracker import TouchTracker
from tactile_perception.pipeline.marker_stage import TouchEstimator
from tactile_perception.touchpad.contact.published import PaperRegion
from tactile_perception.touchpad.contact.region import ContactDots
from tactile_perception.touchpad.contact.object_motion import MotionEstimate, ObjectMotion
from tactile_perception.touchpad.contact.slip import SlipEstimator

BEGUN = 10.0  # s, stamp of the last frame before the fault


def _dots(state=1):
    points = _moved()
    return ContactDots(5, 8, np.arange(40), points['p'], points['p'], np.ones(40), np.full(40, state, np.uint8))


def _motion():
    follow = ObjectMotion(5, 8)
    follow.process(_dots(), BEGUN)
    return lambda stamp: follow.process(_dots(), stamp).motion.translation


def _slip():
    follow, still = SlipEstimator(), MotionEstimate(None, np.nan, np.full((40, 3), np.nan))
    follow.process(_dots(2), [], still, BEGUN)
    return lambda stamp: np.array([follow.process(_dots(2), [], still, stamp).slipping_fraction])


def _paper_region():
    (id, rest), follow = cap_dots(), PaperRegion(23, 23)
    follow.process(id, rest, rest, BEGUN)
    return lambda stamp: follow.process(id, rest + [2e-3, 0, 0], rest, stamp).state


def _touches():
    follow = TouchTracker()
    place = TouchEstimate(np.array([1e-3, 2e-3, -2e-3]), 2e-3, 1e-8 * np.eye(3), 1e-4)
    follow.process([place], BEGUN)
    return lambda stamp: follow.process([place], stamp)[0].estimate.position


def _taxels(method):
    estimator = hard_taxels.begun(method)
    estimator.process(hard_taxels.bar() + 3, BEGUN)
    return lambda stamp: hard_taxels.told(estimator.process(hard_taxels.bar() + 3, stamp))['centroid']


def _tracker():
    tracker = DotTracker(ROWS, COLUMNS, 'bright', 'blobs')
    tracker.process(drawn(grid(), 13.0), BEGUN)
    return lambda stamp: tracker.process(drawn(grid(), 13.0), stamp).uv


def _sheet():
    rig, tracks = sheet('areal_single')
    stage = TouchEstimator(rig.sensor, rig.make_view, rig.values, rig.calibration)
    for k, one in enumerate(tracks):
        stage.process(one, BEGUN + 0.1 * (k + 1 - len(tracks)))
    return lambda stamp: stage.process(tracks[-1], stamp).contacts[0].position


def _pad():
    stage = stage_of_pad()
    stage.process(pad_tracks(pad_inputs()), BEGUN)
    return lambda stamp: stage.process(pad_tracks(pad_inputs()), stamp).contacts[0].position


FOLLOWERS = {'object motion': _motion, 'slip': _slip, 'paper region': _paper_region, 'touch filter': _touches,
             'taxels, mechanics': lambda: _taxels('mechanics'), 'taxels, paper': lambda: _taxels('paper'), 'dot tracker': _tracker,
             'sheet': _sheet, 'pad': _pad}
STEPS = {'0 s': 0.0, 'back by 1 ms': -1e-3, 'back by 100 s': -100.0, 'NaN': np.nan, 'infinite': np.inf}


@pytest.mark.parametrize('name', FOLLOWERS)
def test_time_that_does_not_go_on_is_refused_and_leaves_no_trace(record, name):
    follow, plain = FOLLOWERS[name](), FOLLOWERS[name]()
    for case, step in STEPS.items():
        with pytest.raises(BadFrame):
            follow(BEGUN + step)
        record.note(name, f'time step {case}', 'refused', 'refused')
    assert np.array_equal(follow(BEGUN + 0.1), plain(BEGUN + 0.1), equal_nan=True)


@pytest.mark.parametrize('step', [1e-6, 100.0, 1e6])
@pytest.mark.parametrize('name', FOLLOWERS)
def test_any_step_ahead_tells_the_same_of_what_does_not_move(record, name, step):
    found, plain = FOLLOWERS[name]()(BEGUN + step), FOLLOWERS[name]()(BEGUN + 0.1)
    error = float(np.nanmax(np.abs(np.asarray(found, float) - plain)))
    record.note(name, f'time step {step:g} s', 'the same', 'told', error, 'px' if name == 'dot tracker' else 'm')
    assert error < (0.05 if name == 'dot tracker' else 1e-4)


@pytest.mark.parametrize('period', [0.0, -1e-3, np.nan, np.inf])
@pytest.mark.parametrize('method', ['map', 'paper'])
def test_samples_of_no_period_are_refused(method, period):
    with pytest.raises(BadFrame):
        finger(method).detect(scene()[0], period)


@pytest.mark.parametrize('method', ['map', 'paper'])
def test_samples_gone_for_a_second_and_back(record, method):
    """The contact before and after 1000 samples that are no numbers, and after 1000 of no light."""
    volts, truth = scene()
    inside = np.flatnonzero(truth.touching > 0)
    pressed = volts[inside[inside > REST][0]:][:150]
    ramp = np.linspace(0, 1, 30)[:, None] * (pressed[0] - volts[:REST].mean(axis=0)) + volts[:REST].mean(axis=0)
    made = finger(method)
    made.detect(ramp, PERIOD)
    first = made.detect(pressed, PERIOD)
    before = made.touch(first, 50, 150).normal
    gone = made.detect(np.full((1000, 4), np.nan), PERIOD)
    assert not gone.known.any() and not gone.contact.any()
    again = made.detect(pressed, PERIOD)
    after = made.touch(again, 50, 150).normal
    error = float(np.linalg.norm(after - before))
    record.note(f'PSD {method}', 'samples gone for 1 s', 'the same contact', 'told', error, 'rad')
    assert error < 0.01 and again.contact[50:].all()
    assert not made.detect(np.tile(volts[:REST], (3, 1))[:1000], PERIOD).contact[-500:].any()


def _gone(name):
    """(what follows, its good input, input with everything gone) for a second of gone ones, ten a second."""
    if name == 'pad':
        stage, inputs = stage_of_pad(), pad_inputs()
        return lambda part, stamp: stage.process(pad_tracks(part), stamp).contacts, inputs, {k: v[:0] for k, v in inputs.items()}
    if name == 'touch filter':
        follow = TouchTracker()
        place = TouchEstimate(np.array([1e-3, 2e-3, -2e-3]), 2e-3, 1e-8 * np.eye(3), 1e-4)
        return lambda part, stamp: [_At(t.id, t.estimate.position) for t in follow.process(part, stamp)], [place], []
    method = name.removeprefix('taxels, ')
    estimator = hard_taxels.begun(method)
    return (lambda part, stamp: estimator.process(part, stamp).contacts, hard_taxels.bar() + hard_taxels.REST,
            np.full((44, 44), hard_taxels.REST))


class _At:
    def __init__(self, id, position):
        self.id, self.position, self.depth = id, position, -position[2]


@pytest.mark.parametrize('name', ['pad', 'touch filter', 'taxels, mechanics', 'taxels, paper'])
def test_all_gone_for_a_second_and_back(record, name):
    """Nothing is told meanwhile, then the same contact, under a number of its own: whether it is the same touch nobody knows."""
    follow, good, gone = _gone(name)
    before = max(follow(good, BEGUN), key=lambda contact: contact.depth)
    for k in range(1, 11):
        assert not follow(gone, BEGUN + 0.1 * k)
    after = max(follow(good, BEGUN + 1.1), key=lambda contact: contact.depth)
    error = float(np.nanmax(np.abs(after.position - before.position)))
    record.note(name, 'all gone for 1 s', 'the same contact, another number', 'told', error, 'm')
    assert error < 1e-4 and after.id > before.id


@pytest.mark.parametrize('away, kept', [(1.0, True), (3.0, False)])
def test_dots_gone_for_a_second_keep_their_numbers(away, kept):
    """Tracks wait for two seconds; then numbers are gone for good, and none is used twice."""
    link, uv = Linker(), random_pattern()
    first = link.update(uv, 0.0)
    for k in range(1, int(10 * away) + 1):
        assert not len(link.update(np.zeros((0, 2)), 0.1 * k))
    for k in range(3):
        again = link.update(uv, away + 0.1 * (k + 1))
    assert (again >= 0).all() and np.array_equal(again, first) == kept
    assert kept or not set(again.tolist()) & set(first.tolist())


def test_a_grid_gone_for_a_second_is_numbered_as_before():
    tracker, good = DotTracker(ROWS, COLUMNS, 'bright', 'blobs'), drawn(grid(), 13.0)
    first = tracker.process(good, 0.0)
    for k in range(1, 11):
        with pytest.raises(BadFrame):
            tracker.process(drawn(grid()[:0], 13.0, seed=k), 0.1 * k)
    again = tracker.process(good, 1.1)
    assert np.array_equal(again.id, first.id) and np.abs(again.duv).max() < 0.05
