# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Wrong and missing indices, and time, of every indexing method: `python test/benchmark/numbering.py [--quick] [--out out]`.

Dots move between two frames. Methods are interleaved on the same dots: true positions of the scenes with 0.05 px of noise, 1 % false dots,
and 2 % missing dots in addition to the scene's. Writes numbering.md and numbering.json: wrong and missing indices per 1000 dots, median
milliseconds on one thread.
"""
from __future__ import annotations

import argparse
import json
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
from scenes import NAMES, make_scene

from tactile_perception.dots.index.grid import Numbered
from tactile_perception.dots.index.methods import METHODS

SHIFTS = (0.0, 0.5, 1.0, 3.0)  # pitches, along the image's rows
PITCH, SIZE = 18.0, (640, 480)


def spoiled(scene, rng, shift: float) -> tuple[np.ndarray, np.ndarray]:
    """(uv (N, 2) px, numbers (N,), -2 for false dots) of a scene's dots, moved by shift pitches, with noise, missing and false ones."""
    seen = scene.present & (rng.uniform(size=len(scene.uv)) > 0.02)
    uv = scene.uv[seen] + rng.normal(0, 0.05, (seen.sum(), 2)) + [shift * PITCH, 0]
    false = rng.uniform(0, 1, (rng.poisson(0.01 * len(uv)), 2)) * SIZE
    number = (scene.row * scene.columns + scene.column)[seen]
    order = rng.permutation(len(uv) + len(false))
    return np.vstack([uv, false])[order], np.r_[number, np.full(len(false), -2)][order]


def measure(frames: int) -> list[dict]:
    """A row for each method and shift: wrong and none per 1000 dots, ms."""
    rng = np.random.default_rng(0)
    scenes = [make_scene(name, seed) for seed, name in enumerate(NAMES)]
    counts, times = defaultdict(lambda: np.zeros(3)), defaultdict(list)
    for frame in range(frames):
        scene = scenes[frame % len(scenes)]
        still = Numbered(scene.uv[scene.present], (scene.row * scene.columns + scene.column)[scene.present])
        for shift in SHIFTS:
            uv, number = spoiled(scene, rng, shift)
            true = number >= 0
            for name, method in [*METHODS.items(), ('lattice, from nothing', METHODS['lattice'])]:
                start = time.perf_counter()
                id = method(uv, scene.rows, scene.columns, None if 'nothing' in name else still, SIZE).id
                times[name, shift].append(time.perf_counter() - start)
                counts[name, shift] += np.sum(true & (id >= 0) & (id != number)), np.sum(true & (id < 0)), true.sum()
    return [{'method': name, 'shift': shift, 'wrong': 1000 * c[0] / c[2], 'none': 1000 * c[1] / c[2],
             'ms': 1e3 * float(np.median(times[name, shift]))} for (name, shift), c in counts.items()]


def table(rows: list[dict]) -> str:
    """The rows as Markdown."""
    lines = ['| method | shift, pitches | wrong per 1000 | none per 1000 | ms |', '|---|---|---|---|---|']
    lines += [f"| {r['method']} | {r['shift']} | {r['wrong']:.1f} | {r['none']:.1f} | {r['ms']:.2f} |" for r in rows]
    return '\n'.join(lines) + '\n'


def main() -> None:
    """Measure, and write table and numbers."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--quick', action='store_true', help='two frames of each scene instead of twenty')
    parser.add_argument('--out', type=Path, default=Path('out'))
    arguments = parser.parse_args()
    rows = measure(len(NAMES) * (2 if arguments.quick else 20))
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / 'numbering.json').write_text(json.dumps(rows, indent=1))
    (arguments.out / 'numbering.md').write_text(table(rows))


if __name__ == '__main__':
    main()
