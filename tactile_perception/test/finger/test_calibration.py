# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of a finger: presses in recordings, and what is fitted to them."""
import numpy as np
import played
import pytest
from tactile_perception.errors import BadCalibration
from tactile_perception.finger.calibration import Recording, find_presses, fit_creep, fit_finger, fit_load, fit_touch_level
from tactile_perception.finger.map import TOTAL, level_basis
from tactile_perception.finger.model import Creep, features


def fitted(chosen, seed=0):
    return fit_finger(find_presses([played.recording('calibration', seed, chosen)], 4.9))


def test_a_full_calibration(fit):
    assert fit.notes == [] and fit.places == 107
    assert np.degrees(fit.errors.mean()) < 0.6 < np.degrees(fit.paper_errors.mean())
    assert fit.span['theta'] == pytest.approx([0, np.radians(70)], abs=1e-6)
    assert fit.residuals['force_relative'] < 0.15 and fit.residuals['depth_relative'] < 0.08
    model = fit.model
    assert model.smooth is not None and model.level is not None and model.cross is not None
    assert 0.2 < model.levels(np.zeros((1, 2)))[0] < 1.0


@pytest.mark.parametrize(('chosen', 'smooth', 'note'), [
    (slice(0, 3), None, 'too few'), (slice(0, 9), None, 'too few'), (slice(0, 14), 3, 'affine'), (slice(0, None, 4), 5, None)])
def test_with_fewer_positions_it_falls_back_with_a_note(chosen, smooth, note):
    fit = fitted(chosen)
    terms = None if fit.model.smooth is None else len(fit.model.smooth.slopes)
    assert terms in (smooth, None)
    assert note is None or any(note in line or 'no better' in line for line in fit.notes)


def test_the_light_of_a_contact_moves_its_place(model):
    """A strong press looks nearer to the pole than it is; at the typical light nothing moves."""
    place = np.array([[0.4, 0.0], [0.0, -0.4]])
    light = model.shift.light(place)
    dim, typical, bright = (np.arccos(model.normals(place, part * light)[:, 2]) for part in (0.5, 1.0, 1.5))
    assert (np.degrees(bright - dim) > 0.3).all()
    assert typical == pytest.approx(np.arccos(model.normals(place)[:, 2]))


def test_presses_are_cut_into_stretches_with_their_loads():
    recording = played.recording('grid')
    presses = find_presses([recording], 4.9)
    segments = presses.segments
    assert len(presses.onsets.level) == 25 and presses.left_out == []
    assert segments.count.max() <= 50 and len(segments.count) > 100
    assert np.sqrt(presses.noise[TOTAL, TOTAL]) == pytest.approx(0.023, rel=0.1)
    assert presses.room == pytest.approx(recording.volts[:100].mean(0), abs=0.01)
    assert np.unique(segments.normal.round(6), axis=0).shape == (25, 3)
    assert (presses.onsets.level < 0.3 * presses.onsets.brightest).all()


def test_late_labels_of_contact_do_no_harm():
    recording = played.recording('grid')
    edges = np.flatnonzero(np.diff(recording.touching.astype(np.int8)))
    late = np.zeros_like(recording.touching)
    for begin, end in zip(edges[::2], edges[1::2]):
        late[begin + 80:end - 80] = True
    known = Recording(recording.volts, played.PERIOD, late, recording.normal, recording.force, recording.depth)
    exact, found = (find_presses([r], 4.9).segments.sums[:, TOTAL].max() for r in (recording, known))
    assert found == pytest.approx(exact, rel=0.01)


def test_unusable_recordings_are_refused():
    recording = played.recording('grid')
    touching = np.ones(len(recording.volts), bool)
    with pytest.raises(BadCalibration, match='untouched'):
        find_presses([Recording(recording.volts, played.PERIOD, touching, recording.normal, recording.force, recording.depth)], 4.9)
    unknown = np.full_like(recording.normal, np.nan)
    with pytest.raises(BadCalibration, match='no usable press'):
        find_presses([Recording(recording.volts, played.PERIOD, recording.touching, unknown, recording.force, recording.depth)], 4.9)


RNG = np.random.default_rng(2)
PLACE = RNG.uniform(-0.6, 0.6, (120, 2))
SQUARE = (PLACE**2).sum(1)
FORCE = RNG.uniform(0.5, 4.0, 120)
LIGHT = 2.5 * FORCE**0.7 * (1 - 0.8 * SQUARE) * RNG.normal(1, 0.01, 120)


def test_force_from_light_and_position():
    fitted, error = fit_load(PLACE, LIGHT, FORCE)
    found = np.exp(features(PLACE, LIGHT) @ fitted)
    assert np.median(np.abs(found / FORCE - 1)) < 0.03 and error < 0.03


@pytest.mark.parametrize('chosen', [slice(0, 5), FORCE < 0.6])
def test_too_few_or_equal_loads_are_refused(chosen):
    with pytest.raises(BadCalibration, match='12 are needed'):
        fit_load(PLACE[chosen], LIGHT[chosen], FORCE[chosen])


def test_light_at_first_contact_by_position():
    level = 0.3 * (1 - 0.7 * SQUARE)
    fitted, span = fit_touch_level(PLACE, level + RNG.normal(0, 0.01, 120), 8 * level, 0.02)
    assert level_basis(PLACE, len(fitted)) @ fitted == pytest.approx(level, abs=0.015)
    assert 0.1 < span[0] < span[1] < 0.33 and 0.7 < span[2] < 0.9
    few, _ = fit_touch_level(PLACE[:3], level[:3], 8 * level[:3], 0.02)
    assert len(few) == 1


@pytest.mark.parametrize('level', [np.full(20, 1.5), np.full(20, 0.0), np.tile([0.05, 0.6], 10)])
def test_onsets_labelled_late_or_at_random_are_refused(level):
    with pytest.raises(BadCalibration, match='onset'):
        fit_touch_level(PLACE[:20], level, np.full(20, 2.0), 0.02)


COVER = Creep(0.06, 0.03)


def lights(creep, count=40, noise=0.01, wobble=0.0, seconds=0.25, period=1e-3, seed=0):
    """Lights of presses that rise within 20 ms and rest."""
    rng, times = np.random.default_rng(seed), np.arange(0, seconds, period)
    found = []
    for _ in range(count):
        level = rng.uniform(1, 5)
        load = level * np.clip(times / 0.02, 0, 1) * (1 + wobble * np.sin(2 * np.pi * (rng.uniform(2, 6) * times + rng.uniform())))
        late = np.zeros_like(load)
        for k in range(1, len(load)):
            late[k] = late[k - 1] + (load[k] - late[k - 1]) * period / creep.seconds
        found.append((period, (1 - creep.share) * load + creep.share * late + noise * level * rng.standard_normal(len(load))))
    return found


@pytest.mark.parametrize('creep', [COVER, Creep(0.03, 0.06), Creep(0.04, 0.012)])
def test_presses_that_rest_tell_the_creep(creep):
    found = fit_creep(lights(creep))
    assert found.share == pytest.approx(0.8 * creep.share, rel=0.15) and found.seconds == pytest.approx(creep.seconds, rel=0.2)


@pytest.mark.parametrize('shown', [
    lights(Creep(0.0, 0.03)), lights(COVER, count=5), lights(COVER, seconds=0.06), lights(COVER, wobble=0.1), [],
    [(1e-3, np.full(300, np.nan))] * 9, [(1e-3, np.zeros(300))] * 9, [(1e-3, -np.ones(300))] * 9],
    ids=['none', 'few', 'short', 'by hand', 'nothing', 'unknown', 'dark', 'negative'])
def test_what_does_not_show_it_tells_none(shown):
    assert fit_creep(shown) is None
