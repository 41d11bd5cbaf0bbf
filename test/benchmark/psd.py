# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The PSD finger: error by polar angle, deviation, false and missed contacts, onsets and speed; the published method on the same signals.

    python test/benchmark/psd.py [--out out/benchmark] [SPECIMEN ...]

SPECIMEN: sim:0, sim:1 ... (the simulated finger with that seed), simB:0 ... (a finger of another design) or recorded (TACTILE_RECORDINGS).
Each is calibrated by its own presses,
and the published method by two of them, at the pole and at 30 degrees, as in the paper.
"""
from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path

import numpy as np

from psd_scenes import Signals, recorded, simulated

from tactile_driver.parameters.table import defaults
from tactile_driver.simulation.psd.finger import DESIGN_B, Design
from tactile_perception.finger.calibration import Presses, find_presses, fit_finger
from tactile_perception.finger.map import MIX, angles, error_angle, position
from tactile_perception.finger.model import FingerModel
from tactile_perception.finger.parameters import PSD_PARAMETERS, PsdFinger, make_finger
from tactile_perception.finger.published import fit_equidistant_map, paper_finger

SATURATION, THRESHOLD, FARTHEST = 4.9, 0.2, 61.0  # V, V, degrees
SECOND_PLACE = math.radians(30)
RINGS = (0, 15, 30, 45, 60)


def signals(specimen: str, name: str) -> Signals:
    """A scene of a specimen."""
    kind, _, seed = specimen.partition(':')
    return recorded(name) if kind == 'recorded' else simulated(name, int(seed), DESIGN_B if kind == 'simB' else Design())


def paper_model(presses: Presses) -> FingerModel:
    """Offset from the pole, factor from one contact at 30 degrees (eqs 2, 5)."""
    theta = angles(presses.segments.normal)[1]
    chosen = [int(np.argmin(theta)), int(np.argmin(np.abs(theta - SECOND_PLACE)))]
    return FingerModel(paper=fit_equidistant_map(position(presses.segments.sums[chosen]), presses.segments.normal[chosen])[0])


def fingers(specimen: str) -> tuple[dict[str, callable], dict[str, FingerModel]]:
    """Name -> makes the method's finger, calibrated; name -> its model."""
    presses = find_presses([signals(specimen, 'calibration').recording], SATURATION)
    model, paper = fit_finger(presses).model, paper_model(presses)
    return {'map': lambda: PsdFinger(model), 'paper': lambda: paper_finger(paper, THRESHOLD)}, {'map': model, 'paper': paper}


def accuracy(finger: PsdFinger, model: FingerModel, scene: Signals) -> list[dict]:
    """One row a held contact: theta, error of the mean place (eq 12), mean deviation (eq 14), what the noise allows, degrees."""
    samples = finger.detect(scene.volts, scene.period_s)
    normals, rows = finger.normals(samples), []
    for held in scene.held():
        row = {'theta': math.degrees(angles(scene.normal[held.start])[1]), 'error': math.nan, 'deviation': math.nan, 'bound': math.nan}
        rows.append(row)
        if not samples.contact[held].all():
            continue
        touch = finger.touch(samples, held.start, held.stop)
        row.update({'error': math.degrees(error_angle(touch.normal, scene.normal[held.start])),
                    'deviation': math.degrees(error_angle(normals[held], touch.normal).mean()),
                    'bound': math.degrees(bound(finger, model, samples.sums[held].mean(0)))})
    return rows


def bound(finger: PsdFinger, model: FingerModel, sums: np.ndarray) -> float:
    """Mean deviation, rad, that the outputs' noise at rest leaves to the best estimator (Cramer-Rao; a bilinear detector)."""
    total, (x, y) = sums[2], np.clip(position(sums[None])[0], -1, 1)
    sides = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float)
    a, b = 1 + sides[:, 0] * x, 1 + sides[:, 1] * y
    slopes = 0.25 * np.column_stack([total * sides[:, 0] * b, total * sides[:, 1] * a, a * b])
    unmixed = np.linalg.inv(MIX)
    noise = unmixed.T @ finger.noise @ unmixed
    place = np.linalg.inv(slopes.T @ np.linalg.inv(noise) @ slopes)[:2, :2]
    around = np.array([x, y]) + 1e-3 * np.array([(1, 0), (-1, 0), (0, 1), (0, -1)])
    normals = model.normals(around)
    led = np.column_stack([normals[0] - normals[1], normals[2] - normals[3]]) / 2e-3
    return math.sqrt(math.pi / 4 * np.trace(led @ place @ led.T))


def contacts(finger: PsdFinger, scene: Signals) -> dict:
    """False and missed contacts, and how many onsets and releases are within one sample of the truth."""
    contact = finger.detect(scene.volts, scene.period_s).contact
    events = [np.flatnonzero(np.diff(s.astype(np.int8)) == sign) for s in (scene.touching, contact) for sign in (1, -1)]
    pairs = (events[0], events[2]), (events[1], events[3])
    near = [np.abs(found - event).min(initial=10**9) <= 1 for true, found in pairs for event in true]
    runs = np.flatnonzero(np.diff(np.r_[False, scene.touching, False].astype(np.int8)))
    missed = sum(not contact[b:e].any() for b, e in zip(runs[::2], runs[1::2]))
    return {'touches': len(runs) // 2, 'missed': int(missed), 'false samples (%)': 100 * float((contact & ~scene.touching).mean()),
            'events within a sample (%)': 100 * float(np.mean(near)) if near else math.nan}


def touches(model: FingerModel, scene: Signals, block: int = 5) -> dict:
    """Touches as messages report them: mean and largest error, degrees, of a touch's mean; false results; normalised squared error."""
    finger, found, errors, squares = make_finger(model, defaults(PSD_PARAMETERS)), [], [], []
    for first in range(0, len(scene.volts), block):
        part = np.asarray(scene.volts[first:first + block], np.float32)
        found += [(first + one.at, one.touch) for one in finger.estimate(part, first * scene.period_s, scene.period_s).estimates]
    found = [(k, touch) for k, touch in found if touch is not None and np.isfinite(touch.normal).all()]
    edges = np.flatnonzero(np.diff(np.r_[False, scene.touching, False].astype(np.int8)))
    for begin, end in zip(edges[::2], edges[1::2]):
        inside = [(k, touch) for k, touch in found if begin <= k < end]
        mean, true = (np.mean(rows, axis=0) for rows in ([touch.normal for _, touch in inside], scene.normal[begin:end]))
        errors.append(math.degrees(error_angle(mean / np.linalg.norm(mean), true / np.linalg.norm(true))))
        for k, touch in inside:
            off = touch.position - np.linalg.norm(touch.position) * scene.normal[int(k)]
            squares.append(off @ np.linalg.pinv(touch.covariance, rcond=1e-5) @ off / 2)
    near = np.convolve(scene.touching, np.ones(4 * block + 1), 'same') > 0
    return {'mean': float(np.mean(errors)), 'largest': float(np.max(errors)), 'false': sum(not near[int(k)] for k, _ in found),
            'normalised squared error': float(np.mean(squares))}


def speed(made: dict, scene: Signals, repeats: int = 150) -> dict:
    """Median time, us, of batches of 1000 and 5 samples in contact with the contact that a message needs, methods in turn."""
    held = scene.held()[0]
    rest, touch = scene.volts[:held.start], np.tile(scene.volts[held], (1000, 1))[:1000]
    running = {(name, size): make() for name, make in made.items() for size in (1000, 5)}
    for finger in running.values():
        finger.detect(rest, scene.period_s)
    times, at = {key: [] for key in running}, dict.fromkeys(running, 1.0)
    for k in range(repeats):
        for (name, size), taken in times.items():
            part = touch[(5 * k) % (len(touch) - size + 1):][:size]
            begin = time.thread_time()
            running[name, size].estimate(part, at[name, size], scene.period_s)
            taken.append(time.thread_time() - begin)
            at[name, size] += size * scene.period_s
    return {f'{name}, {size}': 1e6 * float(np.median(taken)) for (name, size), taken in times.items()}


def run(specimen: str) -> dict:
    """All figures of one specimen."""
    made, models = fingers(specimen)
    scenes = {name: signals(specimen, name) for name in ('grid', 'taps', 'light')}
    shown = ('grid', 'bright', 'lamp', 'slide', *(['weak'] if specimen != 'recorded' else []))
    return {'touches': {name: touches(models['map'], signals(specimen, name)) for name in shown},
            'accuracy': {name: accuracy(make(), models[name], scenes['grid']) for name, make in made.items()},
            'contacts': {f'{name}, {scene}': contacts(make(), scenes[scene]) for name, make in made.items() for scene in ('taps', 'light')},
            'speed': speed(made, scenes['grid'])}


def text(specimen: str, result: dict) -> str:
    """The figures as tables."""
    rings = ' | '.join(map(str, RINGS))
    lines = [f'## {specimen}', '', f'| error angle by theta, degrees: mean / largest | {rings} | all to 60 |',
             '|---' * (len(RINGS) + 2) + '|']
    for name, rows in result['accuracy'].items():
        rings = [[r['error'] for r in rows if abs(r['theta'] - ring) < 7] for ring in RINGS]
        every = [r['error'] for r in rows if r['theta'] < FARTHEST]
        cells = [f'{np.mean(e):.2f} / {np.max(e):.2f}' if e else '' for e in [*rings, every]]
        lines.append(f'| {name} | ' + ' | '.join(cells) + ' |')
    rows = result['accuracy']['map']
    for label in ('deviation', 'bound'):
        parts = [np.mean([r[label] for r in rows if abs(r['theta'] - ring) < 7] or [math.nan]) for ring in RINGS]
        lines.append(f'| mean {label} of a sample | ' + ' | '.join(f'{part:.2f}' for part in parts) + ' | |')
    lines += ['', '| method, scene | touches | missed | false samples, % | events within a sample, % |', '|---|---|---|---|---|']
    lines += [f'| {name} | {c["touches"]} | {c["missed"]} | {c["false samples (%)"]:.2f} | {c["events within a sample (%)"]:.0f} |'
              for name, c in result['contacts'].items()]
    lines += ['', '| scene | mean of a touch, degrees | largest | false results | normalised squared error |', '|---|---|---|---|---|']
    lines += [f'| {name} | {t["mean"]:.2f} | {t["largest"]:.2f} | {t["false"]} | {t["normalised squared error"]:.2f} |'
              for name, t in result['touches'].items()]
    lines += ['', '| method, batch | with the contact for a message, us | million samples/s |', '|---|---|---|']
    lines += [f'| {name} | {taken:.0f} | {int(name.split(", ")[1]) / taken:.2f} |' for name, taken in result['speed'].items()]
    return '\n'.join(lines) + '\n'


def main() -> None:
    """Run, print, write psd.md and psd.json."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('specimens', nargs='*', default=['sim:0', 'sim:1'])
    parser.add_argument('--out', type=Path, default=Path('out/benchmark'), help='folder for psd.md and psd.json')
    given = parser.parse_args()
    results = {specimen: run(specimen) for specimen in given.specimens}
    pages = '\n'.join(text(specimen, result) for specimen, result in results.items())
    given.out.mkdir(parents=True, exist_ok=True)
    (given.out / 'psd.md').write_text(pages)
    (given.out / 'psd.json').write_text(json.dumps(results, indent=1) + '\n')
    print(pages)


if __name__ == '__main__':
    main()
