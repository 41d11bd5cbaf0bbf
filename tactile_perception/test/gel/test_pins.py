# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A dome of pins: what touches without a calibration, position and depth with one, against a simulated skin."""
from dataclasses import asdict

import numpy as np
import pytest

from tactile_driver.parameters.table import defaults
from tactile_driver.simulation.gel.contact import GelContact, Indenter
from tactile_driver.simulation.sensors.gel import MATERIAL, pin_tips, pins
from tactile_perception.common.dots import DotTracks
from tactile_perception.common.estimates import OUT_OF_RANGE
from tactile_perception.core.errors import BadCalibration, BadFrame
from tactile_perception.gel.parameters import PINS_PARAMETERS
from tactile_perception.gel.pins import PinEstimator, PinModel, fit_pins, smoothed

pytestmark = pytest.mark.full  # each takes seconds of a core

METRES = 3e-5  # a pixel
PINS = pins(np.random.default_rng(3))
REST = PINS[:, :2] / METRES + 320
SPACING = 1.35e-3 / METRES
VALUES = {**defaults(PINS_PARAMETERS), 'gel.pitch': 1.35e-3}
NOISE = 0.05  # px


class Pressed:
    """A ball on the skin; tracks of its pins in a state."""

    def __init__(self, seed, radius=5e-3):
        self.rng, self.contact = np.random.default_rng(seed), GelContact(MATERIAL, Indenter(radius), 0.5)

    def tracks(self, position=None, depth=0.0):
        uv = REST + self.rng.normal(0, NOISE, REST.shape)
        if position is not None:
            self.contact.reset()
            for part in np.linspace(0.25, 1, 4):
                state = self.contact.step(np.asarray(position), part * depth, np.asarray(position))
            uv += (pin_tips(self.contact.response, PINS, state) - PINS)[:, :2] / METRES
        return DotTracks(0, 0, np.arange(len(uv)), uv, np.full(len(uv), 40.0), np.full(len(uv), 0.05), uv - REST)


@pytest.fixture(scope='module')
def calibrated():
    """Model, and errors at left-out presses; 25 positions, three depths."""
    ball, rows = Pressed(1), []
    for position in 1.5e-3 * np.argwhere(np.ones((5, 5))) - 3e-3:
        rows += [(smoothed(REST, SPACING, ball.tracks(position, depth)), position, depth) for depth in (4e-4, 8e-4, 1.2e-3)]
    moved, position, depth = (np.array(values) for values in zip(*rows))
    return fit_pins(REST, moved, np.column_stack([position, -depth]), depth)


def test_position_and_depth_of_other_presses_than_the_calibrated_ones(calibrated):
    model, left_out = calibrated
    model = PinModel.from_dict(asdict(model))
    ball, estimator, off, normal = Pressed(2), PinEstimator(VALUES, model), [], []
    for _ in range(5):
        assert not estimator.process(ball.tracks(), 0.0).contacts
    for position in ball.rng.uniform(-2.6e-3, 2.6e-3, (12, 2)):
        depth = ball.rng.uniform(5e-4, 1.1e-3)
        contact, = estimator.process(ball.tracks(position, depth), 0.0).contacts
        off.append([*(contact.position[:2] - position), contact.depth - depth])
        normal.append(off[-1][:2] / np.sqrt(np.diag(contact.position_covariance)[:2]))
        assert contact.position[2] == pytest.approx(-contact.depth, abs=1e-4) and np.isnan(contact.force)
    off = np.array(off)
    assert np.hypot(*off[:, :2].T).mean() < 0.3e-3 and np.sqrt(np.mean(off[:, 2]**2)) < 0.13e-3
    assert np.hypot(*off[:, :2].T).mean() < 2 * np.hypot(*left_out[:, :2].T).mean() + 0.05e-3, 'what left-out presses promise'
    assert np.mean(np.square(normal)) < 4


def test_beyond_what_was_calibrated_nothing_is_reported(calibrated):
    ball, estimator = Pressed(3), PinEstimator(VALUES, calibrated[0])
    for position, depth in (((0.0, 0.0), 2.2e-3), ((6e-3, 0.0), 8e-4)):
        contact, = estimator.process(ball.tracks(position, depth), 0.0).contacts
        assert np.isnan(contact.position).all() and np.isnan(contact.depth) and contact.flags & OUT_OF_RANGE
    tracks = ball.tracks((0.0, 0.0), 8e-4)
    tracks.duv[:] = [8.0, 0.0]  # all pins go aside together: no press
    contact, = estimator.process(tracks, 0.0).contacts
    assert np.isnan(contact.depth) and contact.flags & OUT_OF_RANGE


def test_missing_pins_change_little_and_too_few_are_refused(calibrated):
    ball, estimator = Pressed(4), PinEstimator(VALUES, calibrated[0])
    tracks = ball.tracks((1e-3, -5e-4), 9e-4)
    contact, = estimator.process(tracks.take(ball.rng.uniform(size=len(REST)) > 0.15), 0.0).contacts
    assert np.hypot(*(contact.position[:2] - [1e-3, -5e-4])) < 0.5e-3 and contact.depth == pytest.approx(9e-4, abs=1.2e-4)
    with pytest.raises(BadFrame, match='6 are needed'):
        estimator.process(tracks.take(np.arange(5)), 0.0)


def test_without_a_calibration_the_region_surrounds_the_press():
    ball, estimator = Pressed(5), PinEstimator(VALUES)
    position = np.array([1.5e-3, -1e-3])
    result = estimator.process(ball.tracks(position, 1e-3), 0.0)
    contact, = result.contacts
    assert np.isnan(contact.depth) and np.isnan(contact.position).all() and not contact.flags and 'calibrate' in estimator.health()[0]
    middle = (REST.min(axis=0) + REST.max(axis=0)) / 2 * METRES - 320 * METRES
    assert np.hypot(*(result.region.centroid[:2] + middle - position)) < 0.5e-3 and 5e-6 < result.region.area < 60e-6
    assert not PinEstimator(VALUES).process(ball.tracks(), 0.0).region.dot_state.any()


def test_too_few_positions_are_refused():
    with pytest.raises(BadCalibration, match='positions were pressed'):
        fit_pins(REST, np.zeros((3, 2 * len(REST))), np.zeros((3, 3)), np.ones(3))
    with pytest.raises(BadCalibration, match='missing'):
        PinModel.from_dict({'rest': REST})
