# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Taxel arrays: slip in simulated runs of several faces, specimens and motions: detection before gross slip, velocity, centre of rotation.

python test/benchmark/taxel_runs.py [RUNS] [SEED]. Each run is another specimen with its own stiffness, friction, gains and offsets,
calibrated by even loads; the estimator gets the pad's nominal data. An object is pressed on, held, then moved at increasing speed along a
line, or rotated. The simulated pad and the estimator share no formula.
"""
from __future__ import annotations

import sys
from dataclasses import dataclass, replace

import numpy as np
from tactile_driver.simulation.taxel.pad import PadSpecimen
from tactile_driver.simulation.taxel.scene import TAXEL_SCENES, Key, TaxelScene, TaxelScript
from tactile_perception.taxel.pressure import SoftPad, TaxelArray
from tactile_perception.taxel.estimator import TAXEL_METHODS, TaxelEstimator, TaxelSettings
from tactile_perception.taxel.response import Response, fit_gains, fit_response

from taxel import STATES, macro_f1

FACES = ('bar', 'disc', 'ring', 'l', 'sphere', 'two_fingers')
ROUND = ('disc', 'ring', 'sphere')  # faces whose rotation is unobservable
RATE, WINDOW = 100.0, 6  # frames/s; frames over which the true motion is averaged, as in the estimate
_MOTION = ((0.0, 0.0), (1.5, 0.0), (2.3, 0.06), (3.1, 0.25), (3.9, 1.0))  # s, share of the path


@dataclass(frozen=True)
class Run:
    """states, true (N,): slip states, of frames in contact; errors: velocity (relative), turn (relative), centre (mm), while all slips."""

    name: str
    states: np.ndarray
    true: np.ndarray
    errors: dict[str, list[float]]

    @property
    def warned(self) -> bool:
        """Whether incipient slip was told while it was that, before all slipped; a false alarm before is no warning."""
        return bool(np.any((self.states == 1) & (self.true == 1)))


def script(rng: np.random.Generator, face: str, turns: bool) -> TaxelScript:
    """A face pressed on somewhere, held, then moved."""
    direction, way = rng.uniform(0, 2 * np.pi), 0.0 if turns else rng.uniform(2.5e-3, 5e-3)
    step = np.array([way * np.cos(direction), way * np.sin(direction), rng.uniform(0.4, 0.8) * rng.choice([-1, 1]) if turns else 0.0])
    start = np.array([*rng.uniform(-3e-3, 3e-3, 2), rng.uniform(0, 1.5)]) - 0.5 * step
    depth = rng.uniform(8e-4, 1.2e-3) if face == 'sphere' else rng.uniform(2.2e-4, 3.6e-4)
    pressed = [Key(0.0, *start, -1e-4), Key(0.5, *start, -1e-4), Key(1.0, *start, depth)]
    return TaxelScript(face, (*pressed, *(Key(time, *(start + part * step), depth) for time, part in _MOTION[1:])))


def calibrated(specimen: PadSpecimen, seed: int) -> Response:
    """The response of a specimen, by even loads."""
    scene = TaxelScene(TAXEL_SCENES['plate'], 20.0, seed, specimen)
    frames = [scene.render(k / 20.0) for k in range(int(20 * (scene.duration - 0.2)))]
    values, forces = np.array([f for f, _ in frames], float), np.array([-truth.wrench[2] for _, truth in frames])
    zero, loaded = values[:9].mean(axis=0), forces > 5
    gain = fit_gains((values - zero)[loaded])
    return replace(fit_response((values - zero)[loaded], forces[loaded], specimen.pitch**2, gain)[0], zero=zero.astype(np.float32))


def play(number: int, seed: int, methods=tuple(TAXEL_METHODS)) -> dict[str, Run]:
    """The methods on one run."""
    rng, face = np.random.default_rng([seed, number]), FACES[number % len(FACES)]
    turns = number // len(FACES) % 2 == 1 and face not in ROUND
    usual = PadSpecimen()
    specimen = replace(usual, pull=usual.pull * rng.uniform(0.9, 1.1), grip=usual.grip * rng.uniform(0.9, 1.1),
                       press=usual.press * rng.uniform(0.95, 1.05))
    scene = TaxelScene(script(rng, face, turns), RATE, 100 * seed + number, specimen)
    frames = [scene.render(k / RATE) for k in range(scene.frames - 1)]
    response, found = calibrated(specimen, 100 * seed + number), {}
    for method in methods:
        estimator = TaxelEstimator(TaxelArray(specimen.rows, specimen.columns, specimen.pitch), SoftPad(),
                                   TaxelSettings(method, response=response))
        slips = [estimator.process(values, 1 + k / RATE).slip for k, (values, _) in enumerate(frames)]
        found[method] = _judged(f'{face}{" turned" if turns else ""}', slips, [truth for _, truth in frames], turns)
    return found


def _judged(name: str, slips: list, truths: list, turns: bool) -> Run:
    errors = {'velocity': [], 'turn': [], 'centre': []}
    steps = np.array([truth.motion if truth.area > 0 else np.zeros(6) for truth in truths])
    for k in range(WINDOW, len(slips)):
        if truths[k].slip_state < 2 or slips[k].state < 2:
            continue
        true = steps[k - WINDOW + 1:k + 1].mean(axis=0) * RATE
        if turns:
            errors['turn'].append(abs(slips[k].angular[2] / true[5] - 1))
            errors['centre'].append(1e3 * np.hypot(*(slips[k].rotation_center[:2] - np.array([-true[1], true[0]]) / true[5])))
        else:
            at = truths[k].centroid[:2]
            velocity = slips[k].linear[:2] + np.nan_to_num(slips[k].angular[2]) * np.array([-at[1], at[0]])
            errors['velocity'].append(np.hypot(*(velocity - true[:2])) / np.hypot(*true[:2]))
    touched = np.array([truth.area > 0 for truth in truths])
    return Run(name, np.array([slip.state for slip in slips])[touched], np.array([t.slip_state for t in truths])[touched], errors)


def text(runs: list[Run], method: str) -> str:
    """All runs of a method in two lines."""
    confusion = np.zeros((3, 3), int)
    for run in runs:
        np.add.at(confusion, (run.true, run.states), 1)
    each = {name: np.array([value for run in runs for value in run.errors[name]]) for name in ('velocity', 'turn', 'centre')}
    told = ', '.join(f'{name} {np.nanmean(values):.3f} ({np.nanmedian(values):.3f})' if np.isfinite(values).any() else f'{name} untold'
                     for name, values in each.items())
    return (f'{method}: incipient slip before all slips in {sum(run.warned for run in runs)} of {len(runs)} runs; macro F1 '
            f'{macro_f1(confusion):.3f}, {1 - confusion[0, 0] / max(confusion[0].sum(), 1):.1%} of quiet frames called slip; mean (median) '
            f'errors: {told}\n  true by found {"/".join(STATES)}: {confusion.tolist()}')


def main() -> int:
    """Print a line a run, then the sums."""
    count, seed = (int(text) for text in (*sys.argv[1:], *('12', '7')[len(sys.argv) - 1:]))
    all_runs = [play(number, seed) for number in range(count)]
    for number, runs in enumerate(all_runs):
        print(number, {method: (run.name, 'warned' if run.warned else 'late') for method, run in runs.items()}, flush=True)
    for method in TAXEL_METHODS:
        print(text([runs[method] for runs in all_runs], method))
    return 0


if __name__ == '__main__':
    sys.exit(main())
