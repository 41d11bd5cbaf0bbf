# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Plots time against error of all methods in one picture."""
from __future__ import annotations

import math
from pathlib import Path
from statistics import median

from parts import PARTS
from results import Entry

#: part: title, the error that is drawn
SHOWN = {'dots': ('dots found in an image', 'place'), 'numbers': ('dots found and numbered', 'place'),
         'touchpad': ('touchpad: contact region', 'region overlap'), 'sheets and dome': ('sheets and dome: touch', 'place'),
         'finger': ('PSD finger, 5 samples a frame', 'normal'), 'taxels': ('taxel array: none, incipient or gross slip', 'slip states')}
_MARKS = 'os^Dv'
_TICKS = {False: (1, 2, 5), True: (1, 1.2, 1.4, 1.7, 2, 2.5, 3, 3.5, 4, 5, 6, 7, 8)}  # of a decade, by whether the range is narrow


def front(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Those of (time, error) that no other one beats in both, by time."""
    best, kept = math.inf, []
    for time, error in sorted(points):
        if error < best:
            kept.append((time, error))
            best = error
    return kept


def draw(entries: list[Entry], path: Path) -> None:
    """A panel for each part: colours are methods, marks are images' sizes or sensors, the line is the front."""
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot
    parts = [part for part in SHOWN if any(entry.part == part for entry in entries)]
    columns = min(len(parts), 3)
    rows = -(-len(parts) // columns)
    figure, panels = pyplot.subplots(rows, columns, figsize=(5.2 * columns, 0.5 + 4.6 * rows), layout='constrained', squeeze=False)
    for panel in panels.ravel()[len(parts):]:
        panel.set_axis_off()
    for panel, part in zip(panels.ravel(), parts):
        _panel(panel, part, [entry for entry in entries if entry.part == part])
    figure.suptitle('Time of one thread against error: lower left is better (line: no method beats these)')
    figure.savefig(path, dpi=80)
    pyplot.close(figure)


def _panel(panel, part: str, entries: list[Entry]) -> None:
    from matplotlib.ticker import LogLocator, NullLocator
    title, error = SHOWN[part]
    told = [(e, median(e.ms), median(e.errors[error])) for e in entries]
    told = [(e, time, off) for e, time, off in told if math.isfinite(off)]
    methods, kinds = list(dict.fromkeys(e.method for e in entries)), sorted({e.size or e.source for e in entries})
    for kind in kinds:
        these = [(time, off) for e, time, off in told if (e.size or e.source) == kind]
        panel.plot(*zip(*front(these)), '-', color='lightgrey', linewidth=1.5, zorder=1) if these else None
    for entry, time, off in told:
        panel.plot(time, off, _MARKS[kinds.index(entry.size or entry.source) % len(_MARKS)], color=f'C{methods.index(entry.method) % 10}',
                   markersize=8, zorder=2)
    for k, method in enumerate(methods):
        panel.plot([], [], 'o', color=f'C{k % 10}', label=method)
    for k, kind in enumerate(kinds if len(kinds) > 1 else []):
        panel.plot([], [], _MARKS[k % len(_MARKS)], color='grey', label=kind)
    panel.margins(0.12)
    panel.set(xscale='log', yscale='log', title=title, xlabel='ms a frame', ylabel=f'error of {error}, {PARTS[part].errors[error]}')
    for axis, (low, high) in ((panel.xaxis, panel.get_xlim()), (panel.yaxis, panel.get_ylim())):
        axis.set_major_locator(LogLocator(subs=_TICKS[high / low < 5]))
        axis.set_major_formatter('{x:g}')
        axis.set_minor_locator(NullLocator())
    panel.grid(alpha=0.3)
    panel.legend(fontsize='x-small', loc='upper center', bbox_to_anchor=(0.5, -0.16), ncols=3)
