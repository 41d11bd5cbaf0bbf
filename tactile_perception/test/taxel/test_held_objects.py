# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Slip of boxes in a gripper, on synthetic frames: edges beyond the array, released objects, fast motion."""
from math import erf

import numpy as np
import pytest

from tactile_perception.common.estimates import NONE
from tactile_perception.taxel.estimator import TaxelEstimator, TaxelSettings
from tactile_perception.taxel.pressure import SoftPad, TaxelArray
from tactile_perception.taxel.response import Response

ARRAY = TaxelArray(44, 44, 1e-3)
SETTINGS = TaxelSettings(response=Response((500.0, 0.0, 0.0), known=True))
BLUR, NOISE, RATE = 0.9, 0.7, 100.0  # mm, counts, frames/s
QUIET = 60  # frames before an object is let go


def profile(low, high):
    """Share (44,) of a load between two borders, mm, along one axis."""
    at = np.arange(44) - 21.5
    return np.array([0.5 * (erf((x - low) / BLUR / 2**0.5) - erf((x - high) / BLUR / 2**0.5)) for x in at])


def seen(paths, top, bottom, loads, seed=0):
    """Estimates of slip of a box 24 mm wide from top to bottom (mm, along y) that is displaced by paths (x, y) mm."""
    rng, estimator = np.random.default_rng(seed), TaxelEstimator(ARRAY, SoftPad(), SETTINGS)
    images = [np.zeros((44, 44))] * 12 + [load * np.outer(profile(top + y, bottom + y), profile(x - 12, x + 12))
                                          for (x, y), load in zip(paths, loads)]
    frames = [np.clip(np.round(3 + image + rng.normal(0, NOISE, image.shape)), 0, 255).astype(np.uint8) for image in images]
    return [estimator.process(frame, 1 + k / RATE).slip for k, frame in enumerate(frames)][12:]


def let_go(acceleration, frames=12):
    """Displacement, mm, of an object that is at rest and then accelerates uniformly, m/s^2, for some frames."""
    fall = 0.5e3 * acceleration * (np.arange(1, frames + 1) / RATE)**2
    return np.concatenate([np.zeros(QUIET), fall])


@pytest.mark.parametrize('seed', range(3))
def test_slip_along_edges_beyond_the_array_is_unknown_and_never_certain(seed):
    falls = let_go(1.5)
    assert falls[-1] > 10.0
    found = seen([(0.0, -y) for y in falls], -60, 60, np.full(falls.size, 12.0), seed)
    settled = found[10:]
    assert np.mean([slip.state != NONE for slip in settled]) <= 0.05
    assert all(0.4 < slip.confidence < 0.6 and np.isnan(slip.linear[:2]).all() for slip in settled if slip.state == NONE)


@pytest.mark.parametrize('seed', range(3))
def test_slip_across_the_same_edges_is_detected(seed):
    falls = let_go(1.5)
    found = seen([(-x, 0.0) for x in falls], -60, 60, np.full(falls.size, 12.0), seed)
    assert any(slip.state != NONE and slip.confidence > 0.8 for slip in found[QUIET:QUIET + 6]), 'within 60 ms'
    assert np.mean([slip.state != NONE for slip in found[10:QUIET]]) <= 0.05


@pytest.mark.parametrize('acceleration', [1.0, 2.0, 5.0])
def test_slip_of_a_released_box_is_detected_within_60_ms_from_its_upper_edge(acceleration):
    falls = let_go(acceleration, 10)
    loads = np.where(np.arange(falls.size) < QUIET, 12.0, 8.5)  # slip begins as the grip relaxes
    true, called, late = [], [], []
    for seed in range(4):
        found = seen([(0.0, -y) for y in falls], -60, 12, loads, seed)
        slips = [slip.state != NONE and slip.confidence > 0.8 for slip in found]
        true += [False] * (QUIET - 10) + [True] * 10
        called += slips[10:]
        late.append(slips[QUIET:].index(True) + 1 if any(slips[QUIET:]) else 99)
    true, called = np.array(true), np.array(called)
    assert np.median(late) <= 6
    assert called[~true].mean() <= 0.05
    assert 2 * (called & true).sum() / (called.sum() + true.sum()) >= 0.8, 'F1'


def test_a_motion_of_two_taxels_per_frame_is_tracked():
    path = np.concatenate([np.zeros(30), 2.0 * np.arange(1, 9)])
    found = seen([(0.0, -y) for y in path], -6, 16, np.full(path.size, 30.0))
    assert found[-1].state != NONE
    assert found[-1].linear[1] == pytest.approx(-0.2, rel=0.1) and abs(found[-1].linear[0]) < 0.01
