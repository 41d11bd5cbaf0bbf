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
from tactile_perception.tools.evaluate import plain
from tactile_perception.sensor_type import SENSOR_TYPES

from parts import PARTS

_ROUNDS = {True: 2, False: 3}  # by quick
#: Changes that are none whatever the noise: of a time, as a part of it; of an error, as a part of it and in its own unit.
_TIME, _ERROR = 0.1, 0.02
_LEAST = {'1/1000 pitch': 0.02, 'per 1000': 0.5, '1 - IoU': 2e-3, '1 - F1': 2e-3, 'mm': 2e-3, '%': 0.1, 'degrees': 0.01, 'mm/s': 0.02}
#: Panels of the plot: title, part, error that is drawn, source (all for ''), and the error that the sensor's paper reports, in the same
#: unit: of sheets the mean distance in its tables 1 and 2.
PANELS = (('dots found in an image', 'dots', 'place', '', None),
          ('touchpad: contact region', 'touchpad', 'region overlap', '', None),
          ('sheet, one camera: touch', 'sheets and dome', 'place', 'areal_single', 2.64),
          ('sheet, two cameras: touch', 'sheets and dome', 'place', 'areal_dual', 0.93),
          ('dome: touch', 'sheets and dome', 'place', 'air_cushion', None),
          ('PSD finger, 10 samples a frame', 'finger', 'normal', '', 6.0),
          ('taxel array: none, incipient or gross slip', 'taxels', 'slip states', '', None))
_KEY = ('part', 'source', 'method', 'size')


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


def measure(names: list[str], quick: bool, from_recordings: bool, bags: Path) -> list[dict]:
    """An entry for each method: the keys of _KEY; in each round ms a frame, ms relative to the yardstick, and errors by name. Parts take
    turns."""
    entries, ready = {}, {}
    for name in names:
        print(f'{name}: making what it is measured on', file=sys.stderr, flush=True)
        ready[name] = PARTS[name].prepare(quick, from_recordings, bags)
    for number in range(_ROUNDS[quick]):
        for name, measured in ready.items():
            print(f'round {number + 1} of {_ROUNDS[quick]}: {name}', file=sys.stderr, flush=True)
            unit = yardstick()
            for *key, ms, errors in measured(number):
                key = (name, *key)
                entry = entries.setdefault(key, {**dict(zip(_KEY, key)), 'ms': [], 'relative': [], 'errors': {}})
                entry['ms'].append(ms)
                entry['relative'].append(ms / unit)
                for error, value in errors.items():
                    entry['errors'].setdefault(error, []).append(float(value))
    return list(entries.values())


def machine() -> dict:
    """What it was measured on."""
    about = Path('/proc/cpuinfo')
    lines = about.read_text().splitlines() if about.exists() else []
    processor = next((line.partition(':')[2].strip() for line in lines if line.startswith('model name')), platform.processor())
    return {'processor': processor, 'cores': os.cpu_count(), 'python': platform.python_version(), 'numpy': np.__version__,
            'opencv': cv2.__version__, 'date': time.strftime('%Y-%m-%d %H:%M'), 'load': os.getloadavg()[0]}


def middle(values: list[float | None]) -> float:
    """Median over the rounds; NaN where one is not known."""
    return float(np.median(np.array(values, float)))


def noise(values: list[float]) -> float:
    """Half of the range over the median; 0 for a median of 0."""
    return float(np.ptp(values)) / (2 * middle(values)) if middle(values) else 0.0


def _said(value: float) -> str:
    return f'{value:.3g}' if np.isfinite(value) else '-'


def tables(entries: list[dict]) -> str:
    """A Markdown table for each part: medians over rounds, and by how much the rounds' times differ from it."""
    pages = []
    for part in dict.fromkeys(entry['part'] for entry in entries):
        units = PARTS[part].units
        head = ['sensor', 'method', 'image', 'ms a frame', 'rounds within', *(f'{name}, {unit}' for name, unit in units.items())]
        rows = [[e['source'], e['method'], e['size'] or '-', _said(middle(e['ms'])), f'{100 * noise(e["ms"]):.0f} %',
                 *(_said(middle(e['errors'][name])) for name in units)] for e in entries if e['part'] == part]
        lines = [f'| {" | ".join(row)} |' for row in (head, *rows)]
        pages.append('\n'.join([f'## {part}', '', lines[0], '|' + '---|' * len(head), *lines[1:]]))
    return '\n\n'.join(pages) + '\n'


def summary(entries: list[dict]) -> str:
    """One Markdown table of the sensors: their methods on the largest images, times and errors, medians over rounds."""
    lines = ['|sensor|method|ms a frame|errors|', '|---|---|---|---|']
    for entry in entries:
        if entry['source'] in SENSOR_TYPES and entry['size'] == max(e['size'] for e in entries if e['source'] == entry['source']):
            errors = [f'{name} {_said(value)} {unit.replace(" - ", "-")}' for name, unit in PARTS[entry['part']].units.items()
                      if np.isfinite(value := middle(entry['errors'][name]))]
            lines.append(f'|{entry["source"]}|{entry["method"]}|{_said(middle(entry["ms"]))}|{"; ".join(errors)}|')
    return '\n'.join(lines) + '\n'


def compared(path: Path, entries: list[dict], about: dict, names: list[str]) -> list[str]:
    """What became slower, or less accurate, or is gone since an earlier benchmark.json, of the parts named: a line each. Times count over
    the yardstick's, so that a machine that is slower as a whole makes nothing slower; a change counts by more than the rounds of both
    differ among themselves. Exits with a line that says why it cannot be compared."""
    try:
        kept = json.loads(path.read_text())
        old = [entry for entry in kept['entries'] if entry['part'] in names]
        same = all(kept['about'][name] == about[name] for name in ('quick', 'recorded'))
    except (OSError, ValueError, KeyError, TypeError) as error:
        sys.exit(f'{path}: no result of this benchmark: {error!r}')
    if not same:
        sys.exit(f'{path}: measured with other options (--quick, --recorded); the same ones have to be given')
    known, lines = {tuple(entry[name] for name in _KEY): entry for entry in entries}, []
    for before in old:
        key = tuple(before[name] for name in _KEY)
        said, after = ', '.join(filter(None, key)), known.get(key)
        if after is None:
            lines.append(f'{said}: not measured any more')
            continue
        change = middle(after['relative']) / middle(before['relative']) - 1
        if change > _TIME + noise(after['relative']) + noise(before['relative']):
            lines.append(f'{said}: slower by {100 * change:.0f} % ({_said(middle(before["ms"]))} to {_said(middle(after["ms"]))} ms)')
        for name, unit in PARTS[before['part']].units.items():
            a, b = (np.array(entry['errors'].get(name, [np.nan]), float) for entry in (before, after))
            allowed = _ERROR * middle(a) + _LEAST[unit] + 0.5 * (np.ptp(a) + np.ptp(b))
            if np.isfinite(a).all() and not middle(b) - middle(a) <= allowed:
                lines.append(f'{said}: {name} {_said(middle(a))} to {_said(middle(b))} {unit}')
    return lines


def draw(entries: list[dict], path: Path, said: str) -> None:
    """A panel for each of PANELS: colours are methods, marks are images' sizes, bars reach over the rounds, the grey line is the front,
    the dashed one what the sensor's paper reports. said: of the run, under the title."""
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot
    shown = [(panel, [e for e in entries if e['part'] == panel[1] and panel[3] in ('', e['source'])]) for panel in PANELS]
    shown = [(panel, these) for panel, these in shown if these]
    columns = min(len(shown), 4)
    rows = -(-len(shown) // columns)
    figure, axes = pyplot.subplots(rows, columns, figsize=(4.6 * columns, 0.5 + 4.6 * rows), layout='constrained', squeeze=False)
    for empty in axes.ravel()[len(shown):]:
        empty.set_axis_off()
    for axis, (panel, these) in zip(axes.ravel(), shown):
        _panel(axis, *panel, these)
    figure.suptitle(f'Time of one thread against error: lower left is better (grey line: no method beats these)\n{said}')
    figure.savefig(path, dpi=80)
    pyplot.close(figure)


def _panel(axis, title: str, part: str, error: str, _source: str, reported: float | None, entries: list[dict]) -> None:
    from matplotlib.ticker import LogLocator, NullLocator
    methods, sizes = list(dict.fromkeys(e['method'] for e in entries)), sorted({e['size'] for e in entries})
    points = [(e, middle(e['ms']), middle(e['errors'][error])) for e in entries if np.isfinite(middle(e['errors'][error]))]
    for size in sizes:
        these = sorted((at, off) for e, at, off in points if e['size'] == size)
        front = [point for k, point in enumerate(these) if point[1] < min((off for _, off in these[:k]), default=np.inf)]
        axis.plot(*zip(*front), '-', color='lightgrey', linewidth=1.5, zorder=1) if front else None
    for e, at, off in points:
        bars = ([[value - min(values)], [max(values) - value]] for value, values in ((off, e['errors'][error]), (at, e['ms'])))
        axis.errorbar(at, off, *bars, 'os^Dv'[sizes.index(e['size'])], color=f'C{methods.index(e["method"]) % 10}', markersize=7, zorder=2)
    for k, method in enumerate(methods):
        axis.plot([], [], 'o', color=f'C{k % 10}', label=method)
    for mark, size in zip('os^Dv', sizes if len(sizes) > 1 else []):
        axis.plot([], [], mark, color='grey', label=size)
    if reported is not None:
        axis.axhline(reported, color='black', linestyle='--', linewidth=1, label='reported in the paper')
    axis.margins(0.12)
    axis.set(xscale='log', yscale='log', title=title, xlabel='ms a frame', ylabel=f'error of {error}, {PARTS[part].units[error]}')
    for ticks, (low, high) in ((axis.xaxis, axis.get_xlim()), (axis.yaxis, axis.get_ylim())):
        ticks.set_major_locator(LogLocator(subs=(1, 1.2, 1.4, 1.7, 2, 2.5, 3, 3.5, 4, 5, 6, 7, 8) if high / low < 5 else (1, 2, 5)))
        ticks.set_major_formatter('{x:g}')
        ticks.set_minor_locator(NullLocator())
    axis.grid(alpha=0.3)
    axis.legend(fontsize='x-small', loc='upper center', bbox_to_anchor=(0.5, -0.16), ncols=2)


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
        entries = measure(names, given.quick, given.recorded, Path(folder))
    given.out.mkdir(parents=True, exist_ok=True)
    page, stored, plot = (given.out / f'benchmark.{ending}' for ending in ('md', 'json', 'png'))
    page.write_text(f'{summary(entries)}\n{tables(entries)}\n' + '; '.join(f'{name} {value}' for name, value in about.items()) + '\n')
    stored.write_text(json.dumps(plain({'about': about, 'entries': entries}), indent=1) + '\n')
    kind = ('quick' if given.quick else 'full') + ' run' + (' on recordings' if given.recorded else '')
    draw(entries, plot, f"{kind}, {about['processor']}, {about['date']}")
    print(f'{page.read_text()}\n{page}\n{stored}\n{plot}')
    worse = compared(given.compare, entries, about, names) if given.compare else []
    if given.compare:
        print('\n'.join(['worse than before:', *worse]) if worse else 'nothing is slower or less accurate than before')
    return 1 if worse else 0


if __name__ == '__main__':
    try:
        sys.exit(main())
    except TactileError as error:
        sys.exit(str(error))
