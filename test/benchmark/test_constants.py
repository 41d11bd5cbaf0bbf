# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Halved and doubled constants: of every frozen dataclass of them (constants.py; pytest -s prints them); of the detection of dots and of
their ranges by colour, on images that are rendered once; of the touchpad's models of membrane and of stick and slip, on random scenes whose
dots are seen with the noise of images and whose ranges are smoothed by the membrane; of the array's slip, on two devices. Also other frame
rates, more noise, and whether the probabilities are right."""
from dataclasses import fields
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace

import dots
import fit_contact_score
import numpy as np
import pytest
from constants import ROOMS, effects, plain, table
from fit_contact_score import KINDS, random_scene
from judged import touchpad_parameters
from printed_dots import make_scene
from taxel_latency import DEVICES, TAXEL_SCENES, Score, TaxelScene, device, macro_f1

from tactile_driver.parameters.table import defaults
from tactile_driver.simulation.sensors.touchpad import PAD
from tactile_perception import _core
from tactile_perception.common.estimates import NONE, next_state
from tactile_perception.core.parameter_files import read_parameters
from tactile_perception.dots.appearance import measure_appearance
from tactile_perception.dots.detect import DotDetector, LikelihoodFinder
from tactile_perception.dots.tracker import make_tracker
from tactile_perception.taxel.estimator import TaxelEstimator
from tactile_perception.taxel.motion import LIMITS
from tactile_perception.taxel.parameters import TAXEL_PARAMETERS, taxel_estimator
from tactile_perception.touchpad import water
from tactile_perception.touchpad.contact import MembraneMethod
from tactile_perception.touchpad.membrane import Membrane, MembraneMaterial
from tactile_perception.touchpad.parameters import TOUCHPAD_PARAMETERS
from tactile_perception.touchpad.positions import DotPositions
from tactile_perception.touchpad.sensor import Touchpad
from tactile_perception.touchpad.slip import slip_confidence

PIXEL, SPREAD = 15e-6, 18e-6  # rad, m: noise of a dot's position in the image, and of its range
GAIN, SCALE = 0.03, 0.05  # relative error that the displacements along the rays share, and its standard deviation as known
COLOUR_RATE, RATE, TAXEL_RATE = 5.0, 20.0, 50.0  # frames/s
NEAR = 50e-6  # m: a free dot nearer to the tool is not judged
pytestmark = pytest.mark.full


def changed(kind, name, factor):
    """A model with that constant so many times as large."""
    return kind(**{name: factor * getattr(kind(), name)})


def halved_and_doubled(names, errors):
    """(name, factor) -> errors(name, factor)."""
    return {(name, factor): errors(name, factor) for name in names for factor in (0.5, 2.0)}


def constants(kind):
    return [name for name in dir(kind) if not name.startswith('_')]


@lru_cache(maxsize=1)
def printed():
    """Scenes of printed dots, a noisy image of each, its noise, and the look of its dots."""
    found = []
    for name, noise in (('plain', 2.0), ('compressed', 8.0), ('glare', 4.0), ('all at once', 2.0)):
        scene = make_scene(name, seed=31)
        image = scene.frame(noise, np.random.default_rng(31))
        found.append((scene, image, noise, measure_appearance(image, -1)))
    return found


def detected(limits):
    """1 - F1 of dots that neither overlap nor are under glare, and mean square of their errors over the least possible."""
    sums = [dots.score(scene, LikelihoodFinder(look, limits).detect(image), noise) for scene, image, noise, look in printed()]
    matched, true, false, error2, bound2 = (sum(one[name] for one in sums) for name in ('matched', 'true', 'false', 'error2', 'bound2'))
    return np.array([1 - 2 * matched / (matched + true + false), error2 / bound2])


def test_no_limit_of_dots_decides_alone():
    kind = _core.dots.DotLimits
    usual = detected(kind())
    found = halved_and_doubled(constants(kind), lambda *change: detected(changed(kind, *change)))
    assert {which: errors for which, errors in found.items() if (errors > 1.25 * usual + [0.005, 0]).any()} == {}, usual


@pytest.mark.parametrize('pitch', [9.0, 36.0])
def test_dots_at_half_and_at_double_the_pitch_are_found_as_well(pitch):
    scene = make_scene('uneven light', seed=32, size=(round(35.6 * pitch), round(26.7 * pitch)), pitch=pitch)
    found = dots.score(scene, DotDetector().detect(scene.frame(2.0, np.random.default_rng(32))), 2.0)
    assert found['matched'] > 0.99 * found['true'] and found['false'] < 5
    assert found['error2'] < 1.4 * found['bound2']  # dots of 14 px are fitted in a reduced image


@lru_cache(maxsize=1)
def coloured():
    """Scenes with glare and without: sensor, camera, images, tracks of their dots, and true positions."""
    found = []
    for kind, effect in (('disc', 1), ('ball', 4)):
        scene = random_scene(KINDS.index(kind) + effect * len(KINDS), 9300, COLOUR_RATE)
        values = {**defaults(TOUCHPAD_PARAMETERS), **touchpad_parameters(scene)}
        sensor = Touchpad.from_parameters(values)
        tracker, frames = make_tracker(values), [scene.render(k / COLOUR_RATE) for k in range(scene.frames)]
        tracks = [tracker.process(frame.image, 1 + k / COLOUR_RATE) for k, frame in enumerate(frames)]
        found.append((sensor, sensor.camera(scene.camera.matrix, scene.camera.distortion), frames, tracks))
    return found


def located():
    """Root mean square error of the positions of all dots, m, with glare and without."""
    found = []
    for sensor, camera, frames, tracks in coloured():
        positions = DotPositions(sensor, camera)
        off = [np.square(positions.locate(frame.image, seen) - frame.truth.dot_xyz[seen.id]).sum(axis=1)
               for frame, seen in zip(frames, tracks)]
        found.append(np.sqrt(np.nanmean(np.concatenate(off))))
    return np.array(found)


def test_no_limit_of_colour_decides_alone(monkeypatch):
    def errors(name, factor):
        value = getattr(water.LIMITS, name)
        with monkeypatch.context() as patch:  # of shares of a level, the distance from 1 is halved and doubled
            patch.setattr(water.LIMITS, name, 1 + factor * (value - 1) if name in ('ink', 'glare') else factor * value)
            return located()
    usual, found = located(), halved_and_doubled([field.name for field in fields(water.WaterLimits)], errors)
    assert {which: errors for which, errors in found.items() if (errors > 1.6 * usual).any()} == {}, usual


@lru_cache(maxsize=4)
def measured(rate, noise=1.0, seed=8800):
    """Scenes of five tools: what is seen of them, and the truth."""
    return [_measured(random_scene(KINDS.index(kind) + 24, seed, rate), np.random.default_rng(KINDS.index(kind) + 24), noise)
            for kind in ('block', 'disc', 'ball', 'edge', 'balls')]


def _measured(scene, rng, noise):
    skin, origin = scene.membrane, -scene.camera.rotation.T @ scene.camera.translation
    truths = [scene.observe(k).truth for k in range(scene.frames)]
    rest = truths[0].dot_xyz
    at_rest, frames = np.linalg.norm(rest - origin, axis=1), []
    for truth in truths:
        away = truth.dot_xyz - origin
        ranges = np.linalg.norm(away, axis=1)
        rays = away / ranges[:, None] + noise * PIXEL * rng.normal(size=away.shape)
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        ranges = ranges + GAIN * (ranges - at_rest) + noise * SPREAD * rng.normal(size=len(ranges))
        frames.append((rays, ranges, np.full(len(ranges), noise * SPREAD), np.arange(len(ranges))))
    return SimpleNamespace(origin=origin, rest=rest, material=MembraneMaterial(skin.tension, skin.pressure, skin.radius), frames=frames,
                           truths=truths)


@lru_cache(maxsize=4)
def seen(rate, noise=1.0, seed=8800):
    """Of each scene: what it is measured of, and of each frame the dots' positions, true states, and which are judged."""
    return [_solved(scene) for scene in measured(rate, noise, seed)]


def _solved(scene, model=None):
    membrane = Membrane(scene.rest, PAD.rows, PAD.columns, scene.origin, scene.material, model)
    membrane.core.reset(SCALE)
    frames = [(membrane.solve(*frame).xyz, truth.dot_state, (truth.dot_state > 0) | (truth.dot_gap > NEAR))
              for frame, truth in zip(scene.frames, scene.truths)]
    return scene, frames


def classifier(scene, model=None):
    method = MembraneMethod(PAD.rows, PAD.columns, scene.material, scene.origin, model)
    method.set_rest(scene.rest)
    return method


def classified(scenes, rate, every=1, model=None):
    """Counts (3, 3) of true by found states, and of each dot that touches: stated probability, and whether the state is right."""
    counts, reported = np.zeros((3, 3)), []
    for scene, frames in scenes:
        method = classifier(scene, model)
        for number, (xyz, true, judged) in enumerate(frames[::every]):
            found = method.classify(np.arange(len(true)), xyz, number * every / rate)
            np.add.at(counts, (true[judged], found.state[judged]), 1)
            near = judged & ((found.state > 0) | (true > 0))
            reported.append(np.column_stack([found.confidence, found.state == true])[near])
    return counts, np.concatenate(reported)


def f1(counts):
    """Mean F1 of sticking and of slipping dots among those that touch and are found to."""
    both = counts[1:, 1:]
    return float(np.mean(2 * np.diag(both) / (both.sum(axis=0) + both.sum(axis=1))))


def test_no_constant_of_stick_and_slip_decides_alone():
    scenes, kind = seen(RATE), _core.touchpad.StickSlipModel
    usual = f1(classified(scenes, RATE)[0])
    found = halved_and_doubled(constants(kind), lambda *change: f1(classified(scenes, RATE, model=changed(kind, *change))[0]))
    assert {which: value for which, value in found.items() if value < usual - 0.25 * (1 - usual)} == {}, usual


def placed(model):
    """Root mean square error of the positions of dots that touch, m; relative error of the force; and F1 of contact."""
    position, force, counts = [], [], np.zeros((2, 2))
    for scene in measured(RATE)[::2]:
        method, frames = classifier(scene), _solved(scene, model)[1]
        for number, ((xyz, true, judged), truth) in enumerate(zip(frames, scene.truths)):
            found = method.classify(np.arange(len(true)), xyz, number / RATE)
            position.append(np.square(xyz - truth.dot_xyz).sum(axis=1)[true > 0])
            np.add.at(counts, ((true > 0)[judged].astype(int), (found.state > 0)[judged].astype(int)), 1)
            if np.linalg.norm(truth.wrench[:3]) > 0.3:
                force.append(np.linalg.norm(found.wrench[:3] - truth.wrench[:3]) / np.linalg.norm(truth.wrench[:3]))
    wrong = 1 - 2 * counts[1, 1] / (counts[1].sum() + counts[:, 1].sum())
    return np.array([np.sqrt(np.mean(np.concatenate(position))), np.median(force), wrong])


def test_no_constant_of_the_membrane_decides_alone():
    kind = _core.touchpad.MembraneModel
    usual = placed(kind())
    found = halved_and_doubled(constants(kind), lambda *change: placed(changed(kind, *change)) / usual)
    assert {which: errors for which, errors in found.items() if (errors > 1.35).any()} == {}


def test_it_degrades_with_rate_and_noise_and_does_not_break():
    usual = f1(classified(seen(RATE), RATE)[0])
    assert f1(classified(seen(RATE), RATE, every=2)[0]) > usual - 0.08
    assert f1(classified(seen(2 * RATE), 2 * RATE)[0]) > usual - 0.05
    assert f1(classified(seen(RATE, 3.0), RATE)[0]) > usual - 0.1


def test_of_states_reported_with_nine_tenths_nine_in_ten_are_right():
    _, reported = classified(seen(RATE), RATE)
    about = (reported[:, 0] > 0.85) & (reported[:, 0] < 0.95)
    assert about.sum() > 500 and reported[about, 1].mean() == pytest.approx(0.9, abs=0.06)


def test_confidence_of_a_state_of_slip_is_right_on_scenes_by_which_it_was_not_measured():
    """Of the states reported with little and with much confidence as many are right as that says."""
    seed, reported = 7300, []
    for scene, frames in seen(RATE, seed=seed):
        method, state = classifier(scene), NONE
        for number, ((xyz, true, _), truth) in enumerate(zip(frames, scene.truths)):
            found = method.classify(np.arange(len(true)), xyz, number / RATE)
            touched = found.state > 0
            state = next_state(state, np.mean(found.state[touched] == 2)) if touched.any() else NONE
            if touched.any() and true.any():
                reported.append((slip_confidence(state, found.objects), state == truth.slip_state))
    stated, right = np.array([one for one in reported if np.isfinite(one[0])]).T
    for low, high in ((0.0, 0.5), (0.5, 0.7), (0.7, 1.0)):
        some = (stated >= low) & (stated < high)
        assert some.sum() < 30 or right[some].mean() == pytest.approx(stated[some].mean(), abs=0.15)
    assert right.mean() == pytest.approx(stated.mean(), abs=0.15)


def test_the_border_network_is_fitted_by_its_program(monkeypatch, tmp_path):
    monkeypatch.setattr('sys.argv', ['fit_contact_score', '--scenes', '2', '--out', str(tmp_path / 'network.npz')])
    fit_contact_score.main()
    with np.load(tmp_path / 'network.npz') as fitted:
        assert _core.touchpad.BorderNetwork(**fitted)


@lru_cache(maxsize=1)
def pressed():
    """Of devices A and B: an estimator, and the images and truths of each scene."""
    found = []
    for of in DEVICES.values():
        with TemporaryDirectory() as temporary:
            params, calibration = device(Path(temporary), *of, 0)
            values = read_parameters(params, 'taxel_contact_node', TAXEL_PARAMETERS)
            made = taxel_estimator({**values, 'calibration': str(calibration)})
        scenes = [TaxelScene(TAXEL_SCENES[name], TAXEL_RATE, 0, *of) for name in ('drag', 'turn', 'smooth', 'cycle', 'roll', 'slide')]
        found.append((made, [[scene.render(k / TAXEL_RATE) for k in range(scene.frames)] for scene in scenes]))
    return found


@lru_cache
def slips(name='edge', factor=1.0):
    """Macro F1 of the states of slip on each device with a limit so many times as large."""
    found = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr('tactile_perception.taxel.estimator.LIMITS', changed(type(LIMITS), name, factor))
        for made, scenes in pressed():
            score = Score()
            for frames in scenes:
                estimator = TaxelEstimator(made.array, made.pad, made.settings)
                states = [(true.slip_state if true.contacts else -1, estimator.process(image, 1 + k / TAXEL_RATE).slip.state)
                          for k, (image, true) in enumerate(frames)]
                score.add(*np.array(states).T)
            found.append(macro_f1(score.confusion))
    print(name, factor, *found)
    return np.array(found)


@pytest.mark.parametrize('factor', [0.5, 2.0])
@pytest.mark.parametrize('name', constants(LIMITS))
def test_no_limit_of_the_array_decides_alone(name, factor):
    usual = slips()
    assert (slips(name, factor) >= usual - 0.25 * (1 - usual)).all()


#: May change an error by more than the half: of what, and why.
DECISIVE = {}


@pytest.mark.parametrize('name', ROOMS)
def test_no_constant_of_a_struct_decides_alone(name):
    print(table(name))
    assert {key: growth for key, growth in effects(name).items() if not max(growth) < 0.5 and not np.isnan(growth).all()
            and key not in DECISIVE} == {}


def test_the_page_lists_every_constant():
    page = (Path(__file__).resolve().parents[2] / 'docs' / 'constants.md').read_text()
    every = {f'{type(struct).__name__}.{field.name}': (field.name, plain(getattr(struct, field.name)))
             for room in ROOMS.values() for struct in room.structs for field in fields(struct)}
    assert [full for full, (name, value) in every.items() if f'`{full}` | {value} |' not in page and (
        f'`{full}` |' in page or not (f'`{full}`' in page or f'`{name}`' in page))] == []
