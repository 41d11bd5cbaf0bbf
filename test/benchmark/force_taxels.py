# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Force taxels on specimens, objects, friction and motions drawn at random: errors of wrench, position and slip, and time a frame.

    python3 test/benchmark/force_taxels.py [SCENES] [--first SEED]
"""
from __future__ import annotations

import argparse
import time
from dataclasses import replace

import numpy as np

from tactile_driver.force_taxels.sources import simulated_frame
from tactile_driver.simulation.force_taxels.device import DEVICES
from tactile_driver.simulation.force_taxels.scene import VectorScene, random_script
from tactile_perception.force_taxels.estimator import ForceTaxelsEstimator, Response

RATE = 100.0
AFTER_S = 1.1  # the untouched second


def played(device: str, seed: int, dead: int) -> list[tuple]:
    """(result, truth, seconds) of each frame of a scene after the first second; the response is what the maker says."""
    specimen = replace(DEVICES[device][1], dead=dead)
    scene = VectorScene(random_script(device, seed), RATE, seed, specimen)
    across, along = specimen.units
    estimator, found = ForceTaxelsEstimator(Response(np.diag(1 / np.array([across, across, along])))), []
    for number in range(scene.frames):
        numbers, truth = scene.render(number / RATE)
        frame = simulated_frame(scene.shape, numbers, 0)
        begin = time.perf_counter()
        result = estimator.process(frame.positions, frame.forces, frame.normals, 1 + number / RATE)
        found.append((result, truth, time.perf_counter() - begin))
    return found[round(AFTER_S * RATE):]


def f1(found: np.ndarray, true: np.ndarray) -> float:
    """F1 of booleans."""
    return 2 * np.count_nonzero(found & true) / max(np.count_nonzero(found) + np.count_nonzero(true), 1)


def row(device: str, frames: list[tuple]) -> str:
    """A row of the table."""
    touching = [(result, truth) for result, truth, _ in frames if truth.contacts]
    error = np.array([(result.wrench - truth.wrench)[:3] for result, truth in touching])
    scaled = [e @ np.linalg.solve(result.wrench_covariance[:3, :3], e) / 3 for e, (result, _) in zip(error, touching)]
    force = np.array([truth.wrench[:3] for _, truth in touching])
    seen = [(result.contacts[0], truth.contacts[0]) for result, truth in touching if result.contacts]
    away = [np.linalg.norm(found.position - true.position) for found, true in seen]
    slips = np.array([[result.slip.slipping_fraction > 0.5, truth.slipping_fraction > 0.5] for result, truth in touching])
    held = slips[:, 0][~slips[:, 1]].mean()
    touched = np.array([[bool(result.contacts), bool(truth.contacts)] for result, truth, _ in frames])
    relative = 100 * np.sqrt(np.sum(error**2) / np.sum(force**2))
    return (f'| {device} | {relative:.1f} | {np.mean(scaled):.2f} | {1e3 * np.median(away):.2f} | '
            f'{f1(*touched.T):.3f} | {f1(*slips.T):.2f} | {100 * held:.1f} | {1e3 * np.median([taken for *_, taken in frames]):.2f} |')


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('scenes', type=int, nargs='?', default=6, help='of each device')
    parser.add_argument('--first', type=int, default=1000, help='seed of the first scene')
    given = parser.parse_args()
    print('| device | force, % RMS | its squared error over the stated one | position, mm | F1 of touch | F1 of slip | '
          'of frames without slip called slip, % | ms a frame |\n|---|---|---|---|---|---|---|---|')
    for device, dead in ((device, dead) for device in DEVICES for dead in (0, 1)):
        frames = [frame for seed in range(given.first, given.first + given.scenes) for frame in played(device, seed, dead)]
        print(row(f'{device}, {dead} dead', frames), flush=True)


if __name__ == '__main__':
    main()
