# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From a recording to figures, for all sensors: a bag with ground truth is judged with each method as `evaluate` judges it.

    python3 test/benchmark/judged.py touchpad tp_rect_drag tp_ring_press --set contact=paper
    python3 test/benchmark/judged.py areal_single as_test --presses as_calib_small

Bags are made of simulated scenes, which ship, or of recordings (TACTILE_RECORDINGS), as `convert_recording` makes them.
"""
from __future__ import annotations

import argparse
import contextlib
import io
import os
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
import yaml

from tactile_bringup import share
from tactile_bringup.simulate.bags import write_opened, writer_of
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_perception.common.estimates import ContactEstimate
from tactile_perception.core.errors import BadArgument, TactileError
from tactile_perception.core.parameter_files import write_parameters
from tactile_perception.evaluation.evaluation import Evaluation, Instant
from tactile_perception.evaluation.scores import label_f1
from tactile_perception.tools.calibrate import calibrator
from tactile_perception.tools.convert.command import convert, open_recording
from tactile_perception.tools.evaluate import text
from tactile_perception.tools.judged_bag import JudgedBag

_NEAR = 50e-6  # m: a free dot nearer to the tool is in neither class, as the description of the recordings asks
_TOLERANCE = 10e-6  # m, of the touchpad: a slip of half to three times this value is in neither class


@dataclass(frozen=True)
class Case:
    """A bag with ground truth, and the parameter file of its sensor. unclear: stamp, ns -> numbers of the dots that are in no class;
    calibration: file of this very specimen."""

    bag: Path
    params: Path
    unclear: Mapping[int, np.ndarray] = field(default_factory=dict)
    calibration: Path | None = None


def recording_folder(name: str) -> Path:
    """Folder of a simulated recording. Raises BadArgument where TACTILE_RECORDINGS does not lead to it."""
    folder = Path(os.environ.get('TACTILE_RECORDINGS', '')) / 'simulated' / name
    if not os.environ.get('TACTILE_RECORDINGS') or not (folder / 'truth.npz').exists():
        raise BadArgument(f'no recording {name}: set TACTILE_RECORDINGS to the folder that holds simulated/{name}')
    return folder


def recorded(folder: Path, name: str, sensor: str) -> Case:
    """A recording of that name, as a bag in the folder; one that is there is taken."""
    source = recording_folder(name)
    recording, unclear = open_recording(source), _unclear(source) if sensor == 'touchpad' else {}
    case = Case(folder / name, folder / f'{name}.yaml', unclear)
    if not case.bag.exists():
        convert(recording, case.bag, sensor)
    write_parameters(case.params, recording.parameters())
    return case


def _unclear(folder: Path) -> dict[int, np.ndarray]:
    with np.load(folder / 'truth.npz') as truth:
        stamps, state, slip = truth['timestamps'], truth['dot_state'], np.linalg.norm(np.nan_to_num(truth['dot_slip']), axis=2)
        doubtful = np.where(state == 0, truth['dot_gap'] < _NEAR, (slip >= 0.5 * _TOLERANCE) & (slip <= 3 * _TOLERANCE))
        row, column = (truth['dot_rc'] - truth['dot_rc'].min(axis=0)).T
    shift, numbers = (1.0 if stamps[0] < 1 else 0.0), row * (column.max() + 1) + column
    return {round((stamp + shift) * 1e9): numbers[these] for stamp, these in zip(stamps.tolist(), doubtful)}


def simulated(folder: Path, name: str, sensor: str, rate: float = 0.0, seed: int = 0) -> Case:
    """A scene of a simulated sensor at rate Hz (0: the usual one), as a bag in the folder; one that is there is taken."""
    case = Case(folder / f'{name}_{seed}', Path(share('params', f'{sensor}_sim.yaml')))
    write, usual, _ = writer_of(sensor)
    if not case.bag.exists():
        write(case.bag, name, rate or usual, seed)
    return case


def touchpad_scene(folder: Path, name: str, rate: float, size: tuple[int, int] = (640, 480), seed: int = 3) -> Case:
    """The same of a touchpad seen by a camera of another size, (width, height) px, with the parameters of that very specimen."""
    name_of_bag = f'{name}_{size[0]}'
    scene, bag = open_scene(name, rate, seed, width=size[0], height=size[1]), folder / name_of_bag
    truths = [scene.observe(number).truth for number in range(scene.frames)]
    unclear = {10**9 + round(number / rate * 1e9): truth.dot_id[(truth.dot_state == 0) & (truth.dot_gap < _NEAR)]
               for number, truth in enumerate(truths)}
    if not bag.exists():
        write_opened(bag, open_scene(name, rate, seed, width=size[0], height=size[1]))
    return Case(bag, write_parameters(folder / f'{name_of_bag}.yaml', touchpad_parameters(scene)), unclear)


def touchpad_parameters(scene) -> dict[str, object]:
    """Name -> value of the sensor's parameters of a simulated touchpad."""
    camera, skin = scene.camera, scene.membrane
    return {'sensor_type': 'touchpad', 'rows': scene.rows, 'columns': scene.columns, 'cap.curvature_radius': float(skin.radius),
            'cap.height': float(skin.height), 'membrane.shear_stiffness': float(skin.tension),
            'membrane.rest_pressure': float(skin.pressure),
            'camera.rotation': cv2.Rodrigues(camera.rotation)[0].ravel().tolist(), 'camera.translation': camera.translation.tolist()}


def calibrated(case: Case, sensor: str, output: Path, more: Iterable[Path] = (), **how) -> Path:
    """The calibration file output, fitted to the presses of a bag, and of more bags, as `calibrate` fits it."""
    with contextlib.redirect_stderr(io.StringIO()):
        calibrator(sensor, **how)([case.bag, *more], case.params, output)
    return output


@dataclass
class Judged:
    """One method on some bags. ms: of each frame, one thread, from the raw message to the messages of the results; refused: frames;
    single: (estimated, true) contact of the instants with one each."""

    evaluation: Evaluation = field(default_factory=Evaluation)
    ms: list[float] = field(default_factory=list)
    refused: int = 0
    instants: int = 0
    single: list[tuple[ContactEstimate, ContactEstimate]] = field(default_factory=list)

    def medians(self) -> dict[str, float]:
        """Median errors by name of QUANTITIES, in their units; NaN for what was not compared or not estimated."""
        return {name: found['median'] for name, found in self.evaluation.summary()['errors'].items()}

    def mean(self, quantity: str, factor: float = 1.0) -> float:
        """Mean of the absolute errors of a quantity times factor; NaN without one."""
        errors = np.abs(self.evaluation.errors().get(quantity, np.zeros((0, 4)))[:, 3])
        return factor * float(np.nanmean(errors)) if np.isfinite(errors).any() else np.nan

    def dots_f1(self) -> dict[str, float]:
        """F1 of 'contact', 'sticking' and 'slipping' dots among those seen; of the last two among those that touch and are found to."""
        counts = self.evaluation.dots[:, :3]
        found = {'contact': label_f1(np.array([[0, counts[0, 1:].sum()], [counts[1:, 0].sum(), counts[1:, 1:].sum()]]))[1]}
        for state, name in ((1, 'sticking'), (2, 'slipping')):
            true = counts[state, 1:].sum()
            found[name] = label_f1(counts[1:, 1:])[state - 1] if true else np.nan
        return found


Counts = Callable[[Instant, Instant], bool]


def judge(cases: Iterable[Case], calibration: Path | None = None, changes: Mapping = {},
          counts: Counts = lambda estimated, true: True) -> Judged:
    """A method, by the changes that it needs to the parameters, on some bags, with a calibration in place of the specimens' own; counts:
    which instants (estimated, true) are judged."""
    judged = Judged()
    for case in cases:
        path = case.bag.with_name(f'{case.bag.name}_changed.yaml')
        params = write_parameters(path, changes, case.params) if changes else case.params
        with contextlib.redirect_stderr(io.StringIO()):
            bag = JudgedBag(case.bag, params=params, calibration=calibration or case.calibration)
            for stamp, estimated, true in bag.instants():
                clear(true, case.unclear.get(round(stamp * 1e9)))
                if counts(estimated, true):
                    judged.instants += 1
                    judged.evaluation.add(stamp, estimated, true)
                    judged.single += zip(estimated.contacts, true.contacts) if _one_each(estimated, true) else ()
        stages = bag.stages
        judged.ms += (1e3 * (np.array(stages['all']) - stages['decoding'])).tolist()
        judged.refused += bag.left_out.total
    return judged


def _one_each(estimated: Instant, true: Instant) -> bool:
    return len(estimated.contacts or ()) == len(true.contacts or ()) == 1


def clear(true: Instant, unclear: np.ndarray | None) -> None:
    """Take out of the truth the dots that are in no class."""
    if unclear is not None and true.region is not None:
        kept = ~np.isin(true.region.dot_id, unclear)
        true.region.dot_id, true.region.dot_state = true.region.dot_id[kept], true.region.dot_state[kept]


def report(judged: Judged) -> str:
    """The report of `evaluate`, and F1 of the dots."""
    ms = {name: float(np.percentile(judged.ms, part)) for name, part in (('median', 50), ('within_95', 95), ('worst', 100))}
    left_out = [f'{judged.refused} frames'] if judged.refused else []
    times = {'latency_ms': {}, 'stages_ms': {'all': ms}, 'memory_mb': np.nan, 'left_out': left_out}
    instants = {'judged': judged.instants, 'without an estimate': 0, 'without truth': 0}
    lines = [text({'instants': instants, **judged.evaluation.summary(), 'times': times})]
    if judged.evaluation.dots.any():
        lines.append('F1 of dots that are ' + ', '.join(f'{name} {value:.3f}' for name, value in judged.dots_f1().items()) +
                     f"; mean overlap of the regions {judged.mean('region_overlap'):.3f}")
    return '\n'.join(lines)


def main() -> None:
    """Print the figures of some recordings, or scenes, together."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('sensor', help='type of the sensor')
    parser.add_argument('names', nargs='+', help='recordings (tp_rect_drag), or scene:NAME of the simulated sensor')
    parser.add_argument('--presses', nargs='*', default=[], metavar='NAME', help='what to calibrate with first')
    parser.add_argument('--set', nargs='*', default=[], metavar='NAME=VALUE', help='changes of the parameters, such as contact=paper')
    given = parser.parse_args()
    cv2.setNumThreads(1)
    with TemporaryDirectory() as temporary:
        folder = Path(temporary)
        cases, presses = ([simulated(folder, name[6:], given.sensor) if name.startswith('scene:') else recorded(folder, name, given.sensor)
                           for name in names] for names in (given.names, given.presses))
        file = calibrated(presses[0], given.sensor, folder / 'calibration.yaml', [case.bag for case in presses[1:]]) if presses else None
        print(report(judge(cases, file, yaml.safe_load('\n'.join(one.replace('=', ': ', 1) for one in given.set)) or {})))


if __name__ == '__main__':
    try:
        main()
    except TactileError as error:
        sys.exit(str(error))
