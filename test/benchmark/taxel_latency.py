# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Taxel arrays: how soon slip is reported, and how often it is reported falsely, on two simulated devices.

python3 test/benchmark/taxel_latency.py [SEEDS] [SCENE ...]. Each device is calibrated by a plate that is pressed on and taken off in steps;
the parameters are the nominal data of its pad. Latency: from a change of the true state to the first frame that reports it, as a
distribution. The simulated pad and the estimator share no formula.
"""
from __future__ import annotations

import itertools
import sys
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from judged import Case, calibrated

from tactile_bringup import share
from tactile_bringup.simulate.bags import write_taxel_scene
from tactile_driver.simulation.taxel.pad import DEVICE_B, InkSpecimen, PadSpecimen
from tactile_driver.simulation.taxel.scene import TAXEL_SCENES, TaxelScene
from tactile_perception.core.parameter_files import write_parameters
from tactile_perception.evaluation.scores import macro_f1
from tactile_perception.tools.judged_bag import JudgedBag

DEVICES = {'A': (PadSpecimen(), InkSpecimen()), 'B': DEVICE_B}
SCENES = ('drag', 'turn', 'smooth', 'cycle', 'jerks', 'grip', 'roll', 'slide', 'rock', 'two_fingers', 'l')
RATE = 100.0
_WAIT = 40  # frames after a change in which it is looked for


@dataclass
class Score:
    """confusion: (3, 3), true by found; delays: s by what began, inf where it was not reported."""

    confusion: np.ndarray = field(default_factory=lambda: np.zeros((3, 3), int))
    delays: dict = field(default_factory=lambda: defaultdict(list))

    def add(self, true: np.ndarray, found: np.ndarray) -> None:
        """Take the states (N,) of one scene, -1 without contact."""
        touched = true >= 0
        np.add.at(self.confusion, (true[touched], np.maximum(found[touched], 0)), 1)
        for name, of in (('any slip', lambda s: s > 0), ('gross slip', lambda s: s == 2), ('end of slip', lambda s: s == 0),
                         ('release', lambda s: s < 0)):
            there, reported = of(true), of(found)
            for begin in np.flatnonzero(there[1:] & ~there[:-1] & (true[:-1] >= 0)) + 1:
                late = np.flatnonzero(reported[begin:begin + _WAIT])
                self.delays[name].append(late[0] / RATE if len(late) else np.inf)

    def lines(self) -> list[str]:
        """F1, false slip, and quantiles of the delays."""
        quiet = 1 - self.confusion[0, 0] / max(self.confusion[0].sum(), 1)
        lines = [f'macro F1 {macro_f1(self.confusion):.3f}, {quiet:.1%} of quiet frames called slip; true by found '
                 f'none/incipient/gross: {self.confusion.tolist()}']
        for name, delays in self.delays.items():
            some = np.percentile(delays, (50, 90, 100), method='inverted_cdf') * 1e3
            lines.append(f'{name}: {len(delays)} times, after {some[0]:.0f} ms (median), {some[1]:.0f} ms (90 %), {some[2]:.0f} ms (all)')
        return lines


def device(folder: Path, specimen: PadSpecimen, ink: InkSpecimen, seed: int) -> tuple[Path, Path]:
    """Parameter and calibration file of a device, calibrated by the plate."""
    pad = {'pad.thickness': specimen.thickness, 'pad.stiffness': specimen.press * specimen.thickness,
           'pad.shear_modulus': specimen.pull * specimen.thickness, 'pad.friction': specimen.grip}
    params = write_parameters(folder / 'device.yaml', pad, Path(share('params', 'taxel_array_sim.yaml')))
    write_taxel_scene(folder / 'plate', 'plate', 20.0, scene=TaxelScene(TAXEL_SCENES['plate'], 20.0, seed, specimen, ink))
    return params, calibrated(Case(folder / 'plate', params), 'taxel_array', folder / 'calibration.yaml')


def main() -> None:
    """Print a line a scene, then the sums of each device and method."""
    seeds, scenes = int(sys.argv[1]) if len(sys.argv) > 1 else 1, sys.argv[2:] or SCENES
    scores = defaultdict(Score)
    for (name, of), seed in itertools.product(DEVICES.items(), range(seeds)):
        with TemporaryDirectory() as temporary:
            folder = Path(temporary)
            params, calibration = device(folder, *of, seed)
            for scene in scenes:
                write_taxel_scene(folder / scene, scene, RATE, scene=TaxelScene(TAXEL_SCENES[scene], RATE, seed, *of))
                for method in ('mechanics', 'paper'):
                    changed = write_parameters(folder / 'method.yaml', {'method': method}, params)
                    instants = JudgedBag(folder / scene, params=changed, calibration=calibration).instants()
                    states = np.array([[at.slip.state if at.touched else -1 for at in (true, found)] for _, found, true in instants]).T
                    one = Score()
                    for score in (one, scores[f'device {name}, {method}']):
                        score.add(*states)
                    print(f'{name} {seed} {scene}, {method}: {one.lines()[0]}', flush=True)
    for name, score in scores.items():
        print('\n  '.join([f'{name}:', *score.lines()]))


if __name__ == '__main__':
    main()
