# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""All sensors, methods and image sizes on this machine: tables, numbers and the plot of time against error.

    python3 test/benchmark/run.py [--quick] [--recorded] [--part NAME ...] [--out out/benchmark] [--compare OLD.json]

Methods take turns, and the whole runs in rounds, so that other load on the machine affects all alike. Times are CPU times of one thread, of
sensors from the raw message to the messages of the results, without drawing or reading files. A yardstick, a fixed amount of work, is
timed as well, so that results of machines of different speed can be compared. Errors are relative to the ground truth of the simulated
sensors, which ship, or with --recorded of recordings of another simulation (TACTILE_RECORDINGS); `evaluate` computes them. Baselines:
OpenCV's SimpleBlobDetector and trackpy (if installed: pip install trackpy).
With --compare the exit code is 1 if anything is slower or less accurate than in OLD.json (the benchmark.json of an earlier run) by more
than the spread of the rounds.
"""
from __future__ import annotations

import argparse
import importlib.util
import json
import os
import platform
import sys
import time
from contextlib import nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory

import tactile_driver.nodes  # noqa: F401  (one thread of linear algebra; said before NumPy is there)

import cv2
import numpy as np
from tactile_perception.errors import TactileError

import results
from parts import PARTS, Plan, Row

_ROUNDS = {True: 2, False: 3}  # by quick


def yardstick() -> float:
    """ms of one thread that a fixed piece of work takes: a filter, a sort, a small solve, a loop; the median of some."""
    rng = np.random.default_rng(0)
    image, many = rng.integers(0, 255, (480, 640)).astype(np.float32), rng.normal(size=20_000)
    matrix, taken = rng.normal(size=(60, 60)) + 60 * np.eye(60), []
    for _ in range(15):
        begin = time.thread_time()
        cv2.GaussianBlur(image, (0, 0), 2.0)
        np.sort(many)
        np.linalg.solve(matrix, matrix)
        sum(k * k for k in range(10_000))
        taken.append(time.thread_time() - begin)
    return 1e3 * float(np.median(taken))


def measure(names: list[str], plan: Plan, rounds: int) -> list[tuple[float, list[Row]]]:
    """(yardstick, rows) of each part in each round; parts take turns."""
    ready, found = {}, []
    for name in names:
        print(f'{name}: making what it is measured on', file=sys.stderr, flush=True)
        ready[name] = PARTS[name](plan)
    for number in range(rounds):
        for name, part in ready.items():
            print(f'round {number + 1} of {rounds}: {name}', file=sys.stderr, flush=True)
            found.append((yardstick(), part.measure(number)))
    return found


def machine() -> dict:
    """What it was measured on."""
    return {'processor': _processor(), 'cores': os.cpu_count(), 'python': platform.python_version(), 'numpy': np.__version__,
            'opencv': cv2.__version__, 'date': time.strftime('%Y-%m-%d %H:%M'), 'load': os.getloadavg()[0]}


def _processor() -> str:
    about = Path('/proc/cpuinfo')
    lines = about.read_text().splitlines() if about.exists() else []
    return next((line.partition(':')[2].strip() for line in lines if line.startswith('model name')), platform.processor())


def write(entries: list[results.Entry], about: dict, out: Path) -> list[Path]:
    """benchmark.md, benchmark.json, benchmark.png in the folder out; their paths."""
    out.mkdir(parents=True, exist_ok=True)
    paths = [out / f'benchmark.{ending}' for ending in ('md', 'json', 'png')]
    said = '; '.join(f'{name} {value}' for name, value in about.items())
    paths[0].write_text(f'{results.summary(entries)}\n{results.tables(entries)}\n{said}\n')
    paths[1].write_text(json.dumps({'about': about, 'entries': results.to_plain(entries)}, indent=1) + '\n')
    run = ('quick' if about['quick'] else 'full') + ' run' + (' on recordings' if about['recorded'] else '')
    results.draw(entries, paths[2], f"{run}, {about['processor']}, {about['date']}")
    return paths


def compared(old: Path, entries: list[results.Entry], about: dict, names: list[str]) -> list[str]:
    """What became worse than in an earlier benchmark.json, of the parts named. Exits with a line that says why it cannot be compared."""
    try:
        kept = json.loads(old.read_text())
        before = [entry for entry in results.from_plain(kept['entries']) if entry.part in names]
        same = all(kept['about'][name] == about[name] for name in ('quick', 'recorded'))
    except (OSError, ValueError, KeyError, TypeError) as error:
        sys.exit(f'{old}: no result of this benchmark: {error!r}')
    if not same:
        sys.exit(f'{old}: measured with other options (--quick, --recorded); the same ones have to be given')
    return results.compare(before, entries)


def main(arguments: list[str] | None = None) -> int:
    """Measure, print, write, compare; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--quick', action='store_true', help='less of all: about three minutes')
    parser.add_argument('--recorded', action='store_true', help='recordings in place of the simulated sensors')
    parser.add_argument('--part', action='append', choices=PARTS, help='only this part (may be repeated)')
    parser.add_argument('--out', type=Path, default=Path('out/benchmark'), help='folder for benchmark.md, .json and .png')
    parser.add_argument('--bags', type=Path, help='folder where bags are kept for the next time; else they are made anew')
    parser.add_argument('--compare', type=Path, metavar='OLD.json', help='benchmark.json of an earlier run')
    given = parser.parse_args(arguments)
    cv2.setNumThreads(1)
    if importlib.util.find_spec('trackpy') is None:
        print('trackpy is not installed, and left out; pip install trackpy adds it', file=sys.stderr)
    names, about = given.part or list(PARTS), {'quick': given.quick, 'recorded': given.recorded, **machine()}
    with nullcontext(given.bags) if given.bags else TemporaryDirectory() as folder:
        entries = results.collect(measure(names, Plan(given.quick, given.recorded, Path(folder)), _ROUNDS[given.quick]))
    paths = write(entries, about, given.out)
    print(paths[0].read_text() + '\n' + '\n'.join(map(str, paths)))
    worse = compared(given.compare, entries, about, names) if given.compare else []
    if given.compare:
        print('\n'.join(['worse than before:', *worse]) if worse else 'nothing is slower or less accurate than before')
    return 1 if worse else 0


if __name__ == '__main__':
    try:
        sys.exit(main())
    except TactileError as error:
        sys.exit(str(error))
