# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Taxel arrays: how soon slip is told, and how often it is told falsely, on two simulated devices.

python test/benchmark/taxel_latency.py [SEEDS] [SCENE ...]. Each device is calibrated by a plate that is pressed on and taken off in steps;
the estimator gets the nominal data of the usual device's pad, of stiffness and friction that the device has. Latency: from a change of the
true state to the first frame that tells it, as a distribution. The simulated pad and the estimator share no formula.
"""
from __future__ import annotations

import sys
from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np
from tactile_driver.simulation.taxel.pad import DEVICE_B, InkSpecimen, PadSpecimen
from tactile_driver.simulation.taxel.scene import TAXEL_SCENES, TaxelScene
from tactile_perception.taxel.pressure import SoftPad, TaxelArray
from tactile_perception.taxel.estimator import TAXEL_METHODS, TaxelEstimator, TaxelSettings
from tactile_perception.taxel.response import Response, fit_gains
from tactile_perception.taxel.calibration import Loads, calibrated_response, find_loop

from taxel import STATES, macro_f1

DEVICES = {'A': (PadSpecimen(), InkSpecimen()), 'B': DEVICE_B}
SCENES = ('drag', 'turn', 'smooth', 'cycle', 'jerks', 'grip', 'roll', 'slide', 'rock', 'two_fingers', 'l')
RATE = 100.0
_WAIT = 40  # frames after a change in which it is looked for


@dataclass
class Score:
    """confusion: (3, 3), true by found; delays: s by what began, inf where it was not told; released: s from the end of a contact."""

    confusion: np.ndarray = field(default_factory=lambda: np.zeros((3, 3), int))
    delays: dict = field(default_factory=lambda: defaultdict(list))

    def add(self, true: np.ndarray, found: np.ndarray) -> None:
        """Take the states (N,) of one scene, -1 without contact."""
        touched = true >= 0
        np.add.at(self.confusion, (true[touched], np.maximum(found[touched], 0)), 1)
        for name, of in (('any slip', lambda s: s > 0), ('gross slip', lambda s: s == 2), ('end of slip', lambda s: s == 0),
                         ('release', lambda s: s < 0)):
            there, told = of(true), of(found)
            begins = np.flatnonzero(there[1:] & ~there[:-1] & (true[:-1] >= 0)) + 1
            for begin in begins:
                late = np.flatnonzero(told[begin:begin + _WAIT])
                self.delays[name].append(late[0] / RATE if len(late) else np.inf)

    def lines(self) -> list[str]:
        """F1, false slip, and quantiles of the delays."""
        quiet = 1 - self.confusion[0, 0] / max(self.confusion[0].sum(), 1)
        told = [f'macro F1 {macro_f1(self.confusion):.3f}, {quiet:.1%} of quiet frames called slip; true by found {"/".join(STATES)}: '
                f'{self.confusion.tolist()}']
        for name, delays in self.delays.items():
            some = np.percentile(delays, (50, 90, 100), method='inverted_cdf') * 1e3
            told.append(f'{name}: {len(delays)} times, told after {some[0]:.0f} ms (median), {some[1]:.0f} ms (90 %), '
                        f'{some[2]:.0f} ms (all)')
        return told


def calibrate(specimen: PadSpecimen, ink: InkSpecimen, seed: int) -> Response:
    """The response of a device, by the plate, as calibrate fits it."""
    scene = TaxelScene(TAXEL_SCENES['plate'], 20.0, seed, specimen, ink)
    frames = [scene.render(k / 20.0) for k in range(scene.frames)]
    values, forces = np.array([f for f, _ in frames], float), np.array([-truth.wrench[2] for _, truth in frames])
    zero, begin = values[:9].mean(axis=0), np.flatnonzero(forces > 1)[0]
    changes, forces = (values - zero)[begin:], np.where(forces > 1, forces, 0)[begin:]  # and what is left after the loads
    count = len(changes)
    loads = Loads(changes, forces, zero, [], [''] * count, np.arange(count) / 20.0, np.zeros(count, int), np.arange(count))
    array, gain = TaxelArray(specimen.rows, specimen.columns, specimen.pitch), fit_gains(changes)
    return calibrated_response(loads, array, gain, *find_loop(loads, array, gain))


def play(name: str, specimen: PadSpecimen, ink: InkSpecimen, seed: int, response: Response, methods=tuple(TAXEL_METHODS)):
    """True states (N,) of a scene, -1 without contact, and those of each method by its name."""
    scene = TaxelScene(TAXEL_SCENES[name], RATE, seed, specimen, ink)
    frames = [scene.render(k / RATE) for k in range(scene.frames - 1)]
    pad = SoftPad(specimen.thickness, specimen.press * specimen.thickness, specimen.pull * specimen.thickness, specimen.grip)
    array, found = TaxelArray(specimen.rows, specimen.columns, specimen.pitch), {}
    for method in methods:
        estimator = TaxelEstimator(array, pad, TaxelSettings(method, response=response))
        results = [estimator.process(values, 1 + k / RATE) for k, (values, _) in enumerate(frames)]
        found[method] = np.array([result.slip.state if result.contacts else -1 for result in results])
    return np.array([truth.slip_state if truth.area > 0 else -1 for _, truth in frames]), found


def main() -> int:
    """Print a line a scene, then the sums of each device and method."""
    seeds, scenes = int(sys.argv[1]) if len(sys.argv) > 1 else 1, sys.argv[2:] or SCENES
    scores = {(device, method): Score() for device in DEVICES for method in TAXEL_METHODS}
    for device, (specimen, ink) in DEVICES.items():
        for seed in range(seeds):
            response = calibrate(specimen, ink, seed)
            for name in scenes:
                true, found = play(name, specimen, ink, seed, response)
                for method, states in found.items():
                    one = Score()
                    one.add(true, states)
                    scores[device, method].add(true, states)
                    print(f'{device} {seed} {name}, {method}: {one.lines()[0]}', flush=True)
    for (device, method), score in scores.items():
        print('\n  '.join([f'device {device}, {method}:', *score.lines()]))
    return 0


if __name__ == '__main__':
    sys.exit(main())
