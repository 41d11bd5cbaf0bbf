# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Results of the whole benchmark over rounds: storage, tables, comparison with earlier results, and the plot of time against error."""
from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import median

import numpy as np
from parts import PARTS, Row
from tactile_perception.sensors import SENSOR_TYPES

#: Changes that are none whatever the noise: of a time, as a part of it; of an error, as a part of it and in its own unit.
_TIME, _ERROR = 0.1, 0.02
_LEAST = {'1/1000 pitch': 0.02, 'per 1000': 0.5, '1 - IoU': 2e-3, '1 - F1': 2e-3, 'mm': 2e-3, '%': 0.1, 'degrees': 0.01, 'mm/s': 0.02}


@dataclass(frozen=True)
class Shown:
    """A panel of the plot. part, source: of what it shows, all sources for ''; error: that is drawn; reported: the error that the sensor's
    paper reports, in the same unit, None where it reports none: of sheets the mean distance in its tables 1 and 2."""

    title: str
    part: str
    error: str
    source: str = ''
    reported: float | None = None


PANELS = (Shown('dots found in an image', 'dots', 'place'),
          Shown('touchpad: contact region', 'touchpad', 'region overlap'),
          Shown('sheet, one camera: touch', 'sheets and dome', 'place', 'areal_single', 2.64),
          Shown('sheet, two cameras: touch', 'sheets and dome', 'place', 'areal_dual', 0.93),
          Shown('dome: touch', 'sheets and dome', 'place', 'air_cushion'),
          Shown('PSD finger, 10 samples a frame', 'finger', 'normal', reported=6.0),
          Shown('taxel array: none, incipient or gross slip', 'taxels', 'slip states'))
_MARKS = 'os^Dv'
_TICKS = {False: (1, 2, 5), True: (1, 1.2, 1.4, 1.7, 2, 2.5, 3, 3.5, 4, 5, 6, 7, 8)}  # of a decade, by whether the range is narrow


@dataclass
class Entry:
    """One method in all rounds. ms: of a frame; relative: the same over the time that the yardstick took just before; errors: by name."""

    part: str
    source: str
    method: str
    size: str
    ms: list[float] = field(default_factory=list)
    relative: list[float] = field(default_factory=list)
    errors: dict[str, list[float]] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """By which it is found again."""
        return ', '.join(text for text in (self.part, self.source, self.method, self.size) if text)


def collect(rounds: list[tuple[float, list[Row]]]) -> list[Entry]:
    """Entries of all rounds; each with what the yardstick took, ms."""
    entries: dict[tuple, Entry] = {}
    for yardstick, rows in rounds:
        for row in rows:
            key = row.part, row.source, row.method, row.size
            entry = entries.setdefault(key, Entry(*key))
            entry.ms.append(row.ms)
            entry.relative.append(row.ms / yardstick)
            for name, error in row.errors.items():
                entry.errors.setdefault(name, []).append(float(error))
    return list(entries.values())


def to_plain(entries: list[Entry]) -> list[dict]:
    """As JSON can hold them: None for what is not known."""
    return [{**asdict(e), 'errors': {name: [None if math.isnan(v) or math.isinf(v) else v for v in values]
                                     for name, values in e.errors.items()}} for e in entries]


def from_plain(rows: list[dict]) -> list[Entry]:
    """Back from to_plain. Raises KeyError or TypeError for what is none."""
    return [Entry(**{**row, 'errors': {name: [math.nan if v is None else v for v in values] for name, values in row['errors'].items()}})
            for row in rows]


def tables(entries: list[Entry]) -> str:
    """A Markdown table for each part: medians over rounds, and by how much the rounds' times differ from it."""
    pages = []
    for part in dict.fromkeys(entry.part for entry in entries):
        units = PARTS[part].errors
        head = ['sensor', 'method', 'image', 'ms a frame', 'rounds within', *(f'{name}, {unit}' for name, unit in units.items())]
        lines = [f'## {part}', '', '| ' + ' | '.join(head) + ' |', '|' + '---|' * len(head)]
        for entry in (e for e in entries if e.part == part):
            numbers = [_said(median(entry.errors[name])) for name in units]
            lines.append('| ' + ' | '.join([entry.source, entry.method, entry.size or '-', _said(median(entry.ms)),
                                            f'{100 * noise(entry.ms):.0f} %', *numbers]) + ' |')
        pages.append('\n'.join(lines))
    return '\n\n'.join(pages) + '\n'


def _said(value: float) -> str:
    return '-' if not math.isfinite(value) else f'{value:.3g}'


def summary(entries: list[Entry]) -> str:
    """One Markdown table of the sensors: their methods on the largest images, times and errors, medians over rounds."""
    lines = ['|sensor|method|ms a frame|errors|', '|---|---|---|---|']
    for entry in entries:
        largest = max((e.size for e in entries if (e.part, e.source) == (entry.part, entry.source)), default='')
        if entry.source in SENSOR_TYPES and entry.size == largest:
            middles = {name: median(entry.errors[name]) for name in PARTS[entry.part].errors}
            errors = [f'{name} {_said(middles[name])} {unit.replace(" - ", "-")}' for name, unit in PARTS[entry.part].errors.items()
                      if math.isfinite(middles[name])]
            lines.append(f'|{entry.source}|{entry.method}|{_said(median(entry.ms))}|{"; ".join(errors)}|')
    return '\n'.join(lines) + '\n'


def noise(values: list[float]) -> float:
    """Half of the range over the median; 0 for a median of 0."""
    middle = median(values)
    return (max(values) - min(values)) / (2 * middle) if middle else 0.0


def compare(old: list[Entry], new: list[Entry]) -> list[str]:
    """What became slower, or less accurate, or is gone: a line each. Times count over the yardstick's, so that a machine that is slower
    as a whole makes nothing slower; a change counts by more than the rounds of both differ among themselves."""
    known, lines = {entry.name: entry for entry in new}, []
    for before in old:
        after = known.get(before.name)
        if after is None:
            lines.append(f'{before.name}: not measured any more')
            continue
        change = median(after.relative) / median(before.relative) - 1
        if change > _TIME + noise(after.relative) + noise(before.relative):
            lines.append(f'{before.name}: slower by {100 * change:.0f} % ({median(before.ms):.3g} to {median(after.ms):.3g} ms)')
        lines += [f'{before.name}: {said}' for name, unit in PARTS[before.part].errors.items()
                  if (said := _worse(name, unit, before.errors.get(name, [math.nan]), after.errors.get(name, [math.nan])))]
    return lines


def _worse(name: str, unit: str, before: list[float], after: list[float]) -> str:
    """What to say of an error that grew; '' where it did not."""
    a, b = (np.array(values, float) for values in (before, after))
    if not np.isfinite(a).all():
        return ''
    if not np.isfinite(b).all():
        return f'{name} is not reported any more'
    change, middle = median(after) - median(before), median(before)
    allowed = _ERROR * middle + _LEAST[unit] + 0.5 * (np.ptp(a) + np.ptp(b))
    return f'{name} {middle:.3g} to {median(after):.3g} {unit}' if change > allowed else ''


def front(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Those of (time, error) that no other one beats in both, by time."""
    best, kept = math.inf, []
    for time, error in sorted(points):
        if error < best:
            kept.append((time, error))
            best = error
    return kept


def draw(entries: list[Entry], path: Path, said: str) -> None:
    """A panel for each of PANELS: colours are methods, marks are images' sizes, bars reach over the rounds, the grey line is the front,
    the dashed one what the sensor's paper reports. said: of the run, under the title."""
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot
    shown = [(panel, these) for panel in PANELS
             if (these := [e for e in entries if e.part == panel.part and panel.source in ('', e.source)])]
    columns = min(len(shown), 4)
    rows = -(-len(shown) // columns)
    figure, axes = pyplot.subplots(rows, columns, figsize=(4.6 * columns, 0.5 + 4.6 * rows), layout='constrained', squeeze=False)
    for empty in axes.ravel()[len(shown):]:
        empty.set_axis_off()
    for axis, (panel, these) in zip(axes.ravel(), shown):
        _panel(axis, panel, these)
    figure.suptitle(f'Time of one thread against error: lower left is better (grey line: no method beats these)\n{said}')
    figure.savefig(path, dpi=80)
    pyplot.close(figure)


def _panel(panel, shown: Shown, entries: list[Entry]) -> None:
    from matplotlib.ticker import LogLocator, NullLocator
    estimated = [(e, median(e.ms), median(e.errors[shown.error])) for e in entries]
    estimated = [(e, time, off) for e, time, off in estimated if math.isfinite(off)]
    methods, kinds = list(dict.fromkeys(e.method for e in entries)), sorted({e.size for e in entries})
    for kind in kinds:
        these = [(time, off) for e, time, off in estimated if e.size == kind]
        panel.plot(*zip(*front(these)), '-', color='lightgrey', linewidth=1.5, zorder=1) if these else None
    for e, time, off in estimated:
        panel.errorbar(time, off, _reach(off, e.errors[shown.error]), _reach(time, e.ms), _MARKS[kinds.index(e.size) % len(_MARKS)],
                       color=f'C{methods.index(e.method) % 10}', markersize=7, zorder=2)
    for k, method in enumerate(methods):
        panel.plot([], [], 'o', color=f'C{k % 10}', label=method)
    for k, kind in enumerate(kinds if len(kinds) > 1 else []):
        panel.plot([], [], _MARKS[k % len(_MARKS)], color='grey', label=kind)
    if shown.reported is not None:
        panel.axhline(shown.reported, color='black', linestyle='--', linewidth=1, label='reported in the paper')
    panel.margins(0.12)
    unit = PARTS[shown.part].errors[shown.error]
    panel.set(xscale='log', yscale='log', title=shown.title, xlabel='ms a frame', ylabel=f'error of {shown.error}, {unit}')
    for axis, (low, high) in ((panel.xaxis, panel.get_xlim()), (panel.yaxis, panel.get_ylim())):
        axis.set_major_locator(LogLocator(subs=_TICKS[high / low < 5]))
        axis.set_major_formatter('{x:g}')
        axis.set_minor_locator(NullLocator())
    panel.grid(alpha=0.3)
    panel.legend(fontsize='x-small', loc='upper center', bbox_to_anchor=(0.5, -0.16), ncols=2)


def _reach(middle: float, values: list[float]) -> list[list[float]]:
    """From the middle down and up to the farthest of the values."""
    return [[middle - min(values)], [max(values) - middle]]
