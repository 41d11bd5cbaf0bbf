# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The results of batches of voltages: when they come, for which samples, and how well they follow a contact that moves."""
from dataclasses import replace

import numpy as np
import pytest
from tactile_driver.parameters.table import defaults
from tactile_driver.simulation.psd.scene import Act, Ambient, PsdScene, PsdScript, open_psd_scene

from tactile_perception.errors import BadArgument
from tactile_perception.finger.model import FingerModel
from tactile_perception.finger.parameters import PSD_METHODS, PSD_PARAMETERS, make_finger

VALUES = defaults(PSD_PARAMETERS)


@pytest.fixture(scope='module')
def taps():
    scene = open_psd_scene('taps', 1000.0)
    counts, truth = scene.play(0, 1500)
    return counts * (5 / 4096), truth


def results(finger, *batch):
    """[(mean index of the samples, contacts)] of a batch."""
    return [(one.at, [] if one.touch is None else [one.touch]) for one in finger.estimate(*batch).estimates]


def run(finger, volts, batch):
    return [(first + k, touches) for first in range(0, len(volts), batch)
            for k, touches in results(finger, volts[first:first + batch], 1 + 1e-3 * first, 1e-3)]


def test_one_result_a_block_and_one_on_either_side_of_an_edge_each_at_the_mean_of_its_samples(taps):
    found = run(make_finger(FingerModel(), VALUES), taps[0], 50)
    middles = np.array([k for k, _ in found])
    assert (np.diff(middles) > 0).all()
    whole = [k for k in middles if k % 50 == 24.5]
    assert len(whole) == 26 - 7  # three taps, and the beginning of a fourth
    blocks = middles // 50
    for block in np.unique(blocks):
        inside = middles[blocks == block] % 50
        edges = [0.0]
        for k in inside:  # runs of samples that follow each other: a run's middle and its begin tell its end
            edges.append(2 * k - edges[-1] + 1)
        assert edges[-1] == 50
    assert {len(touches) for _, touches in found} == {0, 1}
    assert sorted({t.id for _, touches in found for t in touches}) == [1, 2, 3, 4]


def test_a_moving_contact_is_stamped_with_the_time_at_which_it_is_there():
    way = Act(0.4, 0.6, (0.3, -0.9), (0.3, 0.9), 3.2e-4, 0.02)  # 520 degrees a second: 2.6 in a block
    scene = PsdScene(PsdScript([way], 0.7), 5000.0)
    volts = scene.play(0, scene.samples)[0] * (5 / 4096)
    found = {}
    for kind in ('batch', 'sample'):
        finger, found[kind] = make_finger(FingerModel(), VALUES | {'results': kind}), []
        for first in range(0, len(volts), 25):
            found[kind] += [(first + k, np.arctan2(*touches[0].normal[[0, 2]]))
                            for k, touches in results(finger, volts[first:first + 25], first / 5000, 1 / 5000) if touches]
    blocks, singles = (np.array(rows).T for rows in found.values())
    inside = (blocks[0] > 2200) & (blocks[0] < 2800)
    smooth = np.convolve(singles[1], np.full(25, 1 / 25), 'same')
    late = blocks[1][inside] - np.interp(blocks[0][inside], singles[0], smooth)
    assert inside.sum() > 20 and abs(np.mean(late)) < np.radians(0.1) and np.abs(late).max() < np.radians(0.6)


def circling(model, values=VALUES, seed=0):
    """Of a contact that circles twice at 45 degrees, 900 degrees a second: errors (N,), degrees, of the normal; their squares over the
    covariance; and the part of the covariance that does not lie along the surface."""
    way = Act(0.4, 1.4, (0.0, np.radians(45)), (4 * np.pi, np.radians(45)), 3.2e-4, 0.02)
    scene, finger = PsdScene(PsdScript([way], 1.5), 5000.0, seed), make_finger(model, values)
    counts, truth = scene.play(0, scene.samples)
    found = []
    for first in range(0, len(counts), 25):
        for k, touches in results(finger, counts[first:first + 25] * (5 / 4096), first / 5000, 1 / 5000):
            if touches and 2200 < first + k < 6800:
                off = touches[0].position - 0.016 * truth.normal[int(first + k)]
                normal, spread = touches[0].normal, touches[0].position_covariance
                found.append((np.degrees(np.linalg.norm(off) / 0.016), off @ np.linalg.pinv(spread, rcond=1e-5) @ off / 2,
                              np.linalg.norm(spread @ normal) / np.trace(spread)))
    return np.array(found).T


def test_the_creep_of_the_cover_is_taken_off_a_contact_that_slides(model):
    with_creep, without = circling(model), circling(replace(model, creep=None))
    assert without[0].mean() > 0.5 and with_creep[0].mean() < 0.3
    assert 0.2 < with_creep[1].mean() < 2, 'normalised squared error'
    assert 0.1 < without[1].mean() < 2, 'the covariance holds the creep of a typical cover'


@pytest.mark.full
def test_the_covariance_of_single_samples_in_motion_is_honest_and_lies_along_the_surface(model):
    creeps = replace(model, creep=replace(model.creep, share=0.06))  # takes some 2 degrees off
    assert 0.5 < circling(model, VALUES | {'results': 'sample'})[1].mean() < 2, 'normalised squared error'
    assert circling(creeps, VALUES | {'results': 'sample'})[2].max() < 1e-9


def lamps(seed):
    """A scene in which a lamp is switched while each of ten objects rests."""
    rng, acts, steps = np.random.default_rng(seed), [], []
    for k in range(10):
        place, size = (rng.uniform(0, 2 * np.pi), np.radians(rng.uniform(5, 60))), rng.uniform(0.2, 0.9)
        acts.append(Act(1 + 1.3 * k, 1.9 + 1.3 * k, place, place, rng.uniform(2.3e-4, 3.4e-4), 0.02))
        steps.append((acts[-1].start + rng.uniform(0.3, 0.5), -steps[-1][1] if k % 2 else size))
    return PsdScene(PsdScript(acts, 14.0, Ambient(0.4, steps=tuple(steps), rise=0.02, shade=0.04)), 1000.0, 0)


@pytest.mark.parametrize('seed', [0, 1, 2])
def test_places_under_a_lamp_that_is_switched_are_right_or_uncertain_and_contacts_end(model, seed):
    scene = lamps(seed)
    counts, truth = scene.play(0, scene.samples)
    ended = np.flatnonzero(np.diff((truth.touching > 0).astype(int)) < 0)
    errors, stated, late = [], [], []
    for at, touches in run(make_finger(model, VALUES), counts * (5 / 4096), 5):
        if touches and not truth.touching[int(at)]:
            late.append((at - ended).clip(0).min())
        elif touches and np.abs(at - ended).min() > 10:
            errors.append(np.linalg.norm(touches[0].position / 0.016 - truth.normal[int(at)]))
            stated.append(np.sqrt(np.trace(touches[0].position_covariance)) / 0.016)
    errors, stated = np.array(errors), np.array(stated)
    assert np.mean(errors > np.maximum(3 * stated, np.radians(1))) < 0.003
    assert 0.3 < np.mean((errors / stated) ** 2) < 2 and max(late, default=0) < 300


@pytest.mark.parametrize('name', sorted(PSD_METHODS))
def test_every_method_is_made_of_the_parameters(taps, name):
    finger = make_finger(FingerModel(), VALUES | {'method': name, 'radius': 0.02})
    touch = next(touches[0] for _, touches in run(finger, taps[0], 10) if touches)
    assert np.linalg.norm(touch.position) == pytest.approx(0.02)


def test_an_unknown_method():
    with pytest.raises(BadArgument, match='map, paper'):
        make_finger(FingerModel(), VALUES | {'method': 'magic'})
