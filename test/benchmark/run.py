# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""All sensors, methods and image sizes on this machine: tables, numbers and the plot of time against error.

    python3 test/benchmark/run.py [--quick] [--recorded] [--part NAME ...] [--out out/benchmark] [--compare OLD.json] [--stored JSON]

Methods take turns, and the whole runs in rounds, so that other load on the machine affects all alike. Times are CPU times of one thread, of
sensors from the raw message to the messages of the results, without drawing or reading files. A yardstick, a fixed amount of work, is
timed as well, so that results of machines of different speed can be compared. Errors are relative to the ground truth of the simulated
sensors, which ship, or with --recorded of recordings of another simulation (TACTILE_RECORDINGS); `evaluate` computes them. Baselines:
OpenCV's SimpleBlobDetector and trackpy (if installed: pip install trackpy).
An arrow marks what is better: up, higher values, of F1 and IoU (0 to 1); down, lower values, of errors in mm, degrees, N.
With --stored nothing is measured: page and figure are made again of an earlier benchmark.json.
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

import tactile_driver.nodes  # noqa: F401  sets the number of linear algebra threads, before NumPy is imported

# isort: split
import cv2
import numpy as np
from parts import PARTS, Measure

from tactile_perception.core.errors import TactileError
from tactile_perception.core.sensor_type import SENSOR_TYPES
from tactile_perception.tools.evaluate import plain

_ROUNDS = {True: 1, False: 3}  # by quick
_LONG = 'sheets and dome'  # its calibrations take longer than a quick run
#: Changes that are none whatever the noise, as a part of it: of a time, of a measure of accuracy.
_TIME, _ERROR = 0.1, 0.02
#: Rows of the figure: each has one scale of time, and one of accuracy where its panels have the same unit. A panel: title, part, measure,
#: source ('' for all).
PANELS = ((('touchpad: contact region', 'touchpad', 'region IoU', ''), ('touchpad: dots in contact', 'touchpad', 'contact F1', ''),
           ('taxel array: none, incipient or gross slip', 'taxels', 'slip state F1', '')),
          (('sheet, one camera: contact', 'sheets and dome', 'position', 'areal_single'),
           ('sheet, two cameras: contact', 'sheets and dome', 'position', 'areal_dual'),
           ('dome: contact', 'sheets and dome', 'position', 'air_cushion')),
          (('dots found in an image', 'dots', 'position', ''), ('PSD finger, ten samples a frame', 'finger', 'normal', '')))
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


def _arrow(measure: Measure) -> str:
    return '\N{UPWARDS ARROW}' if measure.is_higher_better else '\N{DOWNWARDS ARROW}'


def _label(name: str, measure: Measure) -> str:
    return f'{name}, {measure.unit} {_arrow(measure)}'.replace(',  ', ' ')


TITLE = '# Speed and accuracy of all methods'


def tables(entries: list[dict]) -> str:
    """A Markdown table for each part: medians over rounds. A method that is measured on several image sizes has a cell for each of them."""
    pages = []
    for part in dict.fromkeys(entry['part'] for entry in entries):
        shown = [entry for entry in entries if entry['part'] == part]
        sizes, figures = list(dict.fromkeys(e['size'] for e in shown)), ['ms a frame', *(_label(*m) for m in PARTS[part].measures.items())]
        table = [['sensor', 'method', *(figures if sizes == [''] else sizes)]]
        for sensor, method in dict.fromkeys((e['source'], e['method']) for e in shown):
            cells = {e['size']: [_said(middle(v)) for v in (e['ms'], *(e['errors'][name] for name in PARTS[part].measures))]
                     for e in shown if (e['source'], e['method']) == (sensor, method)}
            table.append([sensor, method, *(cells[''] if sizes == [''] else ('; '.join(cells.get(size, '-')) for size in sizes))])
        lines = [f'| {" | ".join(row)} |' for row in table]
        pages.append('\n'.join([f'## {part}', '', *([] if sizes == [''] else [f'In each cell: {"; ".join(figures)}.', '']),
                                lines[0], '|' + '---|' * len(table[0]), *lines[1:]]))
    return '\n\n'.join([*pages, f'Rounds differ by at most {100 * max(noise(e["ms"]) for e in entries):.0f} % in time.']) + '\n'


def summary(entries: list[dict]) -> str:
    """One Markdown table of the sensors: their methods on the largest images, times and accuracy, medians over rounds, and beside a
    published method what its paper reports."""
    lines = ['|sensor|method|ms a frame|accuracy|the paper reports|', '|---|---|---|---|---|']
    for entry in entries:
        source, measures = entry['source'], PARTS[entry['part']].measures
        if source in SENSOR_TYPES and entry['size'] == max(e['size'] for e in entries if e['source'] == source):
            found = [f'{name} {_said(value)} {measure.unit}'.rstrip() + _arrow(measure) for name, measure in measures.items()
                     if np.isfinite(value := middle(entry['errors'][name]))]
            reported = [f'{name} {measure.reported[source]}' for name, measure in measures.items()
                        if source in measure.reported and entry['method'].startswith('paper')]
            lines.append(f'|{source}|{entry["method"]}|{_said(middle(entry["ms"]))}|{"; ".join(found)}|{"; ".join(reported)}|')
    return '\n'.join(lines) + '\n'


def compared(path: Path, entries: list[dict], about: dict, names: list[str]) -> list[str]:
    """What became slower, or less accurate, or is gone since an earlier benchmark.json, of the parts named: a line each. Times count over
    the yardstick's, so that a machine that is slower as a whole makes nothing slower; a change counts by more than the rounds of both
    differ among themselves. Exits with a line that says why it cannot be compared."""
    old, old_about = stored_run(path)
    old = [entry for entry in old if entry['part'] in names]
    if any(old_about.get(name) != about[name] for name in ('quick', 'recorded')):
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
        for name, measure in PARTS[before['part']].measures.items():
            a, b = (np.array(entry['errors'].get(name, [np.nan]), float) for entry in (before, after))
            error = 1 - middle(a) if measure.is_higher_better else middle(a)
            allowed = _ERROR * error + measure.unnoticed + 0.5 * (np.ptp(a) + np.ptp(b))
            worse = middle(a) - middle(b) if measure.is_higher_better else middle(b) - middle(a)
            if np.isfinite(a).all() and not worse <= allowed:
                lines.append(f'{said}: {name} {_said(middle(a))} to {_said(middle(b))} {measure.unit}'.rstrip())
    return lines


def draw(entries: list[dict], path: Path, said: str) -> None:
    """A panel for each of PANELS: colours are methods, marks are images' sizes, bars reach over the rounds, the grey line is the front.
    said: of the run, under the title."""
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot
    shown = [[(panel, [e for e in entries if e['part'] == panel[1] and panel[3] in ('', e['source'])]) for panel in row] for row in PANELS]
    shown = [row for row in ([(panel, these) for panel, these in row if these] for row in shown) if row]
    columns = max(len(row) for row in shown)
    figure, axes = pyplot.subplots(len(shown), columns, figsize=(5 * columns, 1 + 4.6 * len(shown)), layout='constrained', squeeze=False,
                                   sharex='row')
    for row, panels in zip(axes, shown):
        for empty in row[len(panels):]:
            empty.set_axis_off()
        units = {PARTS[part].measures[name].unit for (_, part, name, _), _ in panels}
        for axis, (panel, these) in zip(row, panels):
            if len(units) == 1 and axis is not row[0]:
                axis.sharey(row[0])
            _panel(axis, *panel[:3], these)
        _set_ticks(row[0].xaxis, *row[0].get_xlim())
    figure.suptitle('Time of one thread against accuracy, one scale a row\n'
                    f'(grey line: no method beats these; dashed: what the paper reports)\n{said}')
    figure.savefig(path, dpi=80)
    pyplot.close(figure)


def _panel(axis, title: str, part: str, name: str, entries: list[dict]) -> None:
    measure = PARTS[part].measures[name]
    methods, sizes = list(dict.fromkeys(e['method'] for e in entries)), sorted({e['size'] for e in entries})
    points = [(e, middle(e['ms']), middle(e['errors'][name])) for e in entries if np.isfinite(middle(e['errors'][name]))]
    sign = -1 if measure.is_higher_better else 1
    for size in sizes:
        these = sorted((at, sign * value) for e, at, value in points if e['size'] == size)
        front = [(at, sign * error) for k, (at, error) in enumerate(these) if error < min((one for _, one in these[:k]), default=np.inf)]
        axis.plot(*zip(*front), '-', color='lightgrey', linewidth=1.5, zorder=1) if front else None
    for e, at, value in points:
        bars = ([[middle_one - min(values)], [max(values) - middle_one]]
                for middle_one, values in ((value, e['errors'][name]), (at, e['ms'])))
        mark, colour = 'os^Dv'[sizes.index(e['size'])], f'C{methods.index(e["method"]) % 10}'
        axis.errorbar(at, value, *bars, mark, color=colour, markersize=7, zorder=2)
    for k, method in enumerate(methods):
        axis.plot([], [], 'o', color=f'C{k % 10}', label=method)
    for mark, size in zip('os^Dv', sizes if len(sizes) > 1 else []):
        axis.plot([], [], mark, color='grey', label=size)
    for source in {e['source'] for e in entries} & set(measure.reported):
        number, unit, *_ = measure.reported[source].split()
        if unit == measure.unit:
            axis.axhline(float(number), color='black', linestyle='--', linewidth=1, label='reported in the paper')
    better = 'higher is better' if measure.is_higher_better else 'lower is better'
    axis.set(xscale='log', title=title, xlabel='ms a frame', ylabel=f'{name}{measure.unit and ", "}{measure.unit} ({better})')
    if measure.is_higher_better:
        axis.set_ylim(0, 1.02)
    else:
        axis.set_yscale('log')
        axis.margins(0.12)
        _set_ticks(axis.yaxis, *axis.get_ylim())
    axis.tick_params(labelbottom=True, labelleft=True)
    axis.grid(alpha=0.3)
    axis.legend(fontsize='x-small', loc='upper center', bbox_to_anchor=(0.5, -0.16), ncols=2)


def _set_ticks(ticks, low: float, high: float) -> None:
    """Plain numbers along a logarithmic axis: few over decades, more over less than one."""
    from matplotlib.ticker import LogLocator, NullLocator
    ticks.set_major_locator(LogLocator(subs=(1, 1.5, 2, 3, 4, 5, 7) if high / low < 10 else (1, 3) if high / low > 300 else (1, 2, 5)))
    ticks.set_major_formatter('{x:g}')
    ticks.set_minor_locator(NullLocator())


def stored_run(path: Path) -> tuple[list[dict], dict]:
    """(entries, about) of a benchmark.json. Exits with a line that says why it cannot be read."""
    try:
        kept = json.loads(path.read_text())
        return kept['entries'], kept['about']
    except (OSError, ValueError, KeyError, TypeError) as error:
        sys.exit(f'{path}: no result of this benchmark: {error!r}')


def main(arguments: list[str] | None = None) -> int:
    """Measure, print, write, compare; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--quick', action='store_true', help='a minute: one round of a part of all; sheets and dome only by --part')
    parser.add_argument('--recorded', action='store_true', help='recordings in place of the simulated sensors')
    parser.add_argument('--part', action='append', choices=PARTS, help='only this part (may be repeated)')
    parser.add_argument('--out', type=Path, default=Path('out/benchmark'), help='folder for benchmark.md, .json and .png')
    parser.add_argument('--bags', type=Path, help='folder that keeps the bags for the next run; default: a temporary one')
    parser.add_argument('--stored', type=Path, metavar='JSON', help='page and figure of this benchmark.json; nothing is measured')
    parser.add_argument('--compare', type=Path, metavar='OLD.json', help='benchmark.json of an earlier run')
    given = parser.parse_args(arguments)
    cv2.setNumThreads(1)
    if importlib.util.find_spec('trackpy') is None and not given.stored:
        print('trackpy is not installed, and left out; pip install trackpy adds it', file=sys.stderr)
    names = given.part or [name for name in PARTS if not (given.quick and name == _LONG)]
    about = {'quick': given.quick, 'recorded': given.recorded, **machine()}
    if given.stored:
        entries, about = stored_run(given.stored)
    else:
        with nullcontext(given.bags) if given.bags else TemporaryDirectory() as folder:
            entries = measure(names, given.quick, given.recorded, Path(folder))
    given.out.mkdir(parents=True, exist_ok=True)
    page, stored, plot = (given.out / f'benchmark.{ending}' for ending in ('md', 'json', 'png'))
    page.write_text(f'{TITLE}\n\n{tables(entries)}\n' + '; '.join(f'{name} {value}' for name, value in about.items()) + '\n')
    stored.write_text(json.dumps(plain({'about': about, 'entries': entries}), indent=1) + '\n')
    kind = ('quick' if about['quick'] else 'full') + ' run' + (' on recordings' if about['recorded'] else '')
    draw(entries, plot, f"{kind}, {about['processor']}, {about['date']}")
    print(f'{summary(entries)}\n{page.read_text()}\n{page}\n{stored}\n{plot}')
    worse = compared(given.compare, entries, about, names) if given.compare else []
    if given.compare:
        print('\n'.join(['worse than before:', *worse]) if worse else 'nothing is slower or less accurate than before')
    return 1 if worse else 0


if __name__ == '__main__':
    try:
        sys.exit(main())
    except TactileError as error:
        sys.exit(str(error))
