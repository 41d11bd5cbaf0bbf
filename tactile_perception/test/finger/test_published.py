# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The published method: the equidistant map, and a finger that runs it."""
import numpy as np
import played
import pytest

from tactile_perception.errors import BadArgument, BadCalibration
from tactile_perception.finger.map import NOMINAL_BETA, EquidistantMap, direction, error_angle
from tactile_perception.finger.parameters import PsdFinger
from tactile_perception.finger.published import fit_equidistant_map, paper_finger

TRUE = EquidistantMap(np.array([0.04, -0.02]), 1.7)


def places(phi, theta):
    """Where the paper's own sensor has its light."""
    phi, theta = np.asarray(phi, float), np.asarray(theta, float)
    return TRUE.offset + theta[:, None] / TRUE.beta * np.stack([np.cos(phi), np.sin(phi)], axis=1)


def test_the_pole_and_one_more_contact_give_offset_and_factor():
    phi, theta = [0.0, 2.0], [0.0, 0.5]
    found, notes = fit_equidistant_map(places(phi, theta), direction(np.array(phi), np.array(theta)))
    assert found.offset == pytest.approx(TRUE.offset) and found.beta == pytest.approx(TRUE.beta) and notes == []
    everywhere = np.array([3.1, -3.1, 0.1]), np.array([1.0, 0.2, 1.5])
    assert error_angle(found.normals(places(*everywhere)), direction(*everywhere)).max() < 1e-6


def test_assumptions_are_noted():
    found, notes = fit_equidistant_map(places([0.0], [0.0]), direction(np.zeros(1), np.zeros(1)))
    assert found.beta == NOMINAL_BETA and 'nominal' in notes[0]
    found, notes = fit_equidistant_map(places([1.0], [0.5]), direction(np.ones(1), np.full(1, 0.5)))
    assert found.offset.tolist() == [0, 0] and 'assumed' in notes[0]
    phi, theta = np.array([0.1, 2.2, 4.1]), np.array([0.5, 0.6, 0.4])
    found, notes = fit_equidistant_map(places(phi, theta), direction(phi, theta))
    assert found.offset == pytest.approx(TRUE.offset, abs=1e-6) and 'extrapolated' in notes[0]


def test_without_a_contact():
    with pytest.raises(BadCalibration, match='no contact'):
        fit_equidistant_map(np.zeros((0, 2)), np.zeros((0, 3)))


def test_the_published_method_is_less_accurate_than_the_map(model):
    volts, truth = played.scene('grid')
    errors = {}
    for name, finger in (('paper', paper_finger(model, 0.2)), ('map', PsdFinger(model))):
        samples = finger.detect(volts, played.PERIOD)
        runs = [r for r in played.runs(samples) if samples.contact[r].sum() > 100]
        errors[name] = [np.degrees(error_angle(played.touch(finger, samples, r).normal, truth.normal[r.start + 100])) for r in runs]
    assert len(errors['paper']) == len(errors['map']) == 25
    assert np.mean(errors['paper']) > 2 * np.mean(errors['map'])


def test_its_offset_is_constant_so_drift_becomes_contact(model):
    finger = paper_finger(model, 0.2)
    samples = finger.detect(played.scene('light')[0], played.PERIOD)
    assert samples.contact.mean() > 0.2


def test_bad_threshold(model):
    with pytest.raises(BadArgument, match='threshold'):
        paper_finger(model, 0.0)
