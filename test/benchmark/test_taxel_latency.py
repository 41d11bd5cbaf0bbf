# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Delays of slip states are counted from the true change."""
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tactile_driver.simulation.taxel.scene import Key, TaxelScript

sys.path.insert(0, str(Path(__file__).parent))
import taxel_latency  # noqa: E402


def test_delays_are_counted_from_the_change_and_misses_are_endless():
    true = np.array([-1, 0, 0, 1, 1, 2, 2, 2, 0, 0, 0, -1, -1])
    found = np.array([-1, 0, 0, 0, 1, 1, 1, 2, 2, 2, 0, 0, 0])
    score = taxel_latency.Score()
    score.add(true, found)
    assert score.delays == {'any slip': [0.01], 'gross slip': [0.02], 'end of slip': [0.02], 'release': [np.inf]}
    assert score.confusion.sum() == 10 and score.confusion[0].tolist() == [3, 0, 2]
    assert 'any slip: 1 times, told after 10 ms (median), 10 ms (90 %), 10 ms (all)' in score.lines()[1]


@pytest.mark.full
def test_a_load_that_goes_back_and_forth_is_quiet_on_both_devices():
    for specimen, ink in taxel_latency.DEVICES.values():
        response = taxel_latency.calibrate(specimen, ink, 1)
        assert response.loop.width(5e4) > 1e3 * ink.loop / 0.08
        true, found = taxel_latency.play('cycle', specimen, ink, 1, response, ('mechanics',))
        assert (found['mechanics'][true >= 0] > 0).mean() < 0.1


@pytest.mark.full
def test_rolling_is_quiet_and_sliding_of_a_sphere_is_not():
    specimen, ink = taxel_latency.DEVICES['A']
    response = taxel_latency.calibrate(specimen, ink, 2)
    true, found = taxel_latency.play('roll', specimen, ink, 2, response, ('mechanics',))
    assert (found['mechanics'][true >= 0] > 0).mean() < 0.02
    true, found = taxel_latency.play('slide', specimen, ink, 2, response, ('mechanics',))
    assert (found['mechanics'][true > 0] > 0).mean() > 0.95 and (found['mechanics'][true == 2] == 2).mean() > 0.9


@pytest.mark.full
def test_a_smooth_bar_that_slides_is_told_soon_on_each_specimen():
    delays = []
    for specimen, ink in taxel_latency.DEVICES.values():
        for seed in range(5):
            true, found = taxel_latency.play('smooth', specimen, ink, seed, taxel_latency.calibrate(specimen, ink, seed), ('mechanics',))
            score = taxel_latency.Score()
            score.add(true, found['mechanics'])
            delays += score.delays['gross slip']
    assert len(delays) == 10 and max(delays) <= 0.06


def _slides(monkeypatch, device, face, smoothness, speed, depth):
    """Score of an object with a part of the pad's friction that suddenly slides at a speed, m/s."""
    keys = [Key(time, 0, 0, 0.3, down) for time, down in ((0.0, -1e-4), (0.5, -1e-4), (1.0, depth), (1.5, depth))]
    monkeypatch.setitem(taxel_latency.TAXEL_SCENES, 'sudden', TaxelScript(face, (*keys, Key(1.5 + 2e-3 / speed, 2e-3, 6e-4, 0.3, depth)),
                                                                          smoothness=smoothness))
    specimen, ink = taxel_latency.DEVICES[device]
    true, found = taxel_latency.play('sudden', specimen, ink, 0, taxel_latency.calibrate(specimen, ink, 0), ('mechanics',))
    score = taxel_latency.Score()
    score.add(true, found['mechanics'])
    return score


@pytest.mark.full
def test_a_smooth_curved_face_that_slides_does_not_roll(monkeypatch):
    for device, face, smoothness in (('A', 'sphere', 0.3), ('B', 'roller', 0.5)):
        score = _slides(monkeypatch, device, face, smoothness, 3e-3, 5e-4)
        assert score.confusion[1:, 0].sum() < 0.1 * score.confusion[1:].sum()
        assert score.confusion[2, 2] > 0.6 * score.confusion[2].sum(), (device, face, score.confusion)


@pytest.mark.full
def test_a_bar_of_little_friction_that_slides_is_told_within_50_ms(monkeypatch):
    for device, face, speed in (('A', 'bar', 2e-3), ('B', 'disc', 3e-3)):
        assert _slides(monkeypatch, device, face, 0.15, speed, 3e-4).delays['gross slip'][0] <= 0.05, (device, face)


@pytest.mark.full
def test_a_saturated_sphere_that_slides_is_followed():
    """It looks flat where taxels are saturated: a specimen in which a breakaway of flat faces was seen by mistake."""
    specimen, ink = taxel_latency.DEVICES['B']
    response = taxel_latency.calibrate(specimen, ink, 5)
    true, found = taxel_latency.play('slide', specimen, ink, 5, response, ('mechanics',))
    assert (found['mechanics'][true == 2] == 2).mean() > 0.7 and (found['mechanics'][true == 1] == 2).mean() < 0.25


@pytest.mark.full
def test_release_from_a_saturated_roller_is_told_within_50_ms():
    specimen, ink = taxel_latency.DEVICES['B']
    response = taxel_latency.calibrate(specimen, ink, 1)
    true, found = taxel_latency.play('roll', specimen, ink, 1, response, ('mechanics',))
    end = np.flatnonzero(true >= 0)[-1]
    assert (found['mechanics'][end + 5:] < 0).all() and (found['mechanics'][true >= 0] < 0).sum() <= 4  # frames that touch


def _noisy():
    """A soft and rough pad of thick rubber on noisy uneven ink, and its response."""
    specimen, ink = taxel_latency.DEVICES['A']
    specimen = replace(specimen, thickness=2.3e-3, press=1.34e8, pull=4.4e7, grip=0.8)
    ink = replace(ink, uneven=0.09, noise=1.1)
    return specimen, ink, taxel_latency.calibrate(specimen, ink, 0)


@pytest.mark.full
def test_on_noisy_ink_an_object_that_has_stopped_or_is_let_go_is_quiet():
    specimen, ink, response = _noisy()
    for name in ('jerks', 'drag'):
        true, found = taxel_latency.play(name, specimen, ink, 0, response, ('mechanics',))
        assert (found['mechanics'][true == 0] > 0).mean() < 0.045 and (found['mechanics'][true == 2] == 2).mean() > 0.9


@pytest.mark.full
def test_an_object_that_slows_down_to_turn_back_has_not_broken_away(monkeypatch):
    keys = [Key(time, 0, 0, 0.3, depth) for time, depth in ((0.0, -1e-4), (0.5, -1e-4), (1.0, 3e-4), (1.5, 3e-4))]
    keys += [Key(1.5 + 0.035 * k, 7e-5 * np.sin(0.25 * np.pi * k), 0, 0.3, 3e-4) for k in range(25)]
    monkeypatch.setitem(taxel_latency.TAXEL_SCENES, 'sine', TaxelScript('l', tuple(keys)))
    specimen, ink = taxel_latency.DEVICES['A']
    specimen = replace(specimen, grip=0.67)
    true, found = taxel_latency.play('sine', specimen, ink, 2, taxel_latency.calibrate(specimen, ink, 2), ('mechanics',))
    assert (true[true >= 0] == 0).all() and (found['mechanics'][true == 0] > 0).mean() < 0.05
