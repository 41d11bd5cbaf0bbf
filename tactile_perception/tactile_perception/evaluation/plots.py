# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Plots of an evaluation."""
from __future__ import annotations

from pathlib import Path

import numpy as np

from .evaluation import DOT_STATES, QUANTITIES, SLIP_STATES, Evaluation, Quantity, spread

_TOUCHED, _POINT, _MIDDLE = '#e6e6e6', '#1f77b4', '#d62728'
_WINDOW = 41  # errors in the running median, chosen
_GAP = 10  # chosen: the line breaks at gaps longer than this multiple of the median interval
_TITLES = {
    'errors_over_time': f'errors over time\npoints: each frame; red: median of the nearest {_WINDOW}; grey: something touches',
    'errors_over_surface': 'size of errors over the sensor\neach point: where a touch truly was, the worst on top; y down, as in the image',
    'states': 'estimated states for each true one\nper cent of the row, and how many',
}


def draw(evaluation: Evaluation, name: str, folder: Path) -> list[Path]:
    """Write the plots that have data to the folder; their paths. name: of the recording."""
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot
    made = {'errors_over_time': over_time(pyplot, evaluation), 'errors_over_surface': over_surface(pyplot, evaluation),
            'states': states(pyplot, evaluation)}
    paths = []
    for file, figure in made.items():
        if figure is None:
            continue
        figure.suptitle(f'{name}: {_TITLES[file]}', fontsize=11)
        file += '.png'
        figure.savefig(folder / file, dpi=100)
        pyplot.close(figure)
        paths.append(folder / file)
    return paths


def _axis(name: str, quantity: Quantity) -> str:
    """Label of an axis or a colour bar."""
    if not quantity.low:
        return 'overlap (1: the same)'
    return f'{name.replace("_", " ").removesuffix(" relative")}, {quantity.unit}'


def over_time(pyplot, evaluation: Evaluation):
    """One panel per quantity: all errors and their running median over time; grey while something touches. None without errors."""
    errors = {name: e.table() for name, e in evaluation.all_errors().items() if e.rows}
    context = np.array(evaluation.context, float).reshape(-1, 3)
    depth = np.isfinite(context[:, 2]).any()
    if not errors:
        return None
    count = len(errors) + depth
    figure, panels = pyplot.subplots(count, 1, sharex=True, figsize=(10, 1.5 + 1.35 * count), layout='constrained', squeeze=False)
    panels = list(panels.ravel())
    begin = min([table[0, 0] for table in errors.values()] + context[:1, 0].tolist())
    for panel in panels:
        for from_s, to_s in _stretches(context):
            panel.axvspan(from_s - begin, to_s - begin, color=_TOUCHED, linewidth=0)
        panel.grid(alpha=0.3)
    if depth:
        panel = panels.pop(0)
        panel.plot(context[:, 0] - begin, 1e3 * context[:, 2], '.', color='black', markersize=3)
        panel.set_ylabel('true depth,\nmm')
    for panel, (name, table) in zip(panels, errors.items()):
        _error_panel(panel, name, table, begin)
    panels[-1].set_xlabel('time, s')
    return figure


def _error_panel(panel, name: str, table: np.ndarray, begin: float) -> None:
    quantity = QUANTITIES[name]
    values = quantity.factor * (table[:, 3] if quantity.signed else np.abs(table[:, 3]))
    panel.plot(table[:, 0] - begin, values, '.', color=_POINT, markersize=3)
    if len(values) > _WINDOW:
        middle = np.median(np.lib.stride_tricks.sliding_window_view(values, _WINDOW), axis=1)
        at = table[_WINDOW // 2:-(_WINDOW // 2), 0] - begin
        steps = np.diff(at, prepend=at[0])
        middle[steps > _GAP * np.median(np.diff(table[:, 0]))] = np.nan  # no line across gaps between contacts
        panel.plot(at, middle, color=_MIDDLE, linewidth=1)
    panel.axhline(0 if quantity.low else 1, color='black', linewidth=0.6)
    low, high = np.percentile(values, [0.5, 99.5])
    low, high = min(low, 0), max(high, 0, 1e-9)
    panel.set_ylim((low - 0.1 * (high - low), high + 0.15 * (high - low)) if quantity.low else (0, 1.05))
    panel.set_ylabel(_axis(name, quantity).replace(', ', ',\n').replace(' (', '\n('), fontsize='small')
    found = spread(table[:, 3], quantity)
    what = f'error of the {quantity.text}' if quantity.low else quantity.text
    panel.set_title(f'{what}: median {found["median"]:.3g}, 95 % within {found["within_95"]:.3g}, worst {found["worst"]:.3g}',
                    fontsize='small', loc='right', pad=2)


def _stretches(context: np.ndarray) -> list[tuple[float, float]]:
    """Intervals (begin, end), s, of uninterrupted contact."""
    if len(context) < 2:
        return []
    edges = np.flatnonzero(np.diff(np.r_[False, context[:, 1] > 0, False].astype(np.int8)))
    step = float(np.median(np.diff(context[:, 0])))
    return [(context[a, 0] - step / 2, context[b - 1, 0] + step / 2) for a, b in zip(edges[::2].tolist(), edges[1::2].tolist())]


def over_surface(pyplot, evaluation: Evaluation):
    """One map per quantity: true contact positions, coloured by the error. None without positions."""
    errors = {name: table[np.isfinite(table[:, 1:3]).all(axis=1)] for name, table in
              ((name, e.table()) for name, e in evaluation.all_errors().items())}
    errors = {name: table for name, table in errors.items() if len(table)}
    if not errors:
        return None
    columns = min(len(errors), 3)
    rows = -(-len(errors) // columns)
    figure, panels = pyplot.subplots(rows, columns, figsize=(4.2 * columns, 0.8 + 3.4 * rows), layout='constrained', squeeze=False)
    for panel in panels.ravel()[len(errors):]:
        panel.set_axis_off()
    for panel, (name, table) in zip(panels.ravel(), errors.items()):
        quantity = QUANTITIES[name]
        values = quantity.factor * np.abs(table[:, 3])
        order = np.argsort(values if quantity.low else -values)
        worst = float(np.percentile(values, 98)) if quantity.low else 1.0
        shown = panel.scatter(1e3 * table[order, 1], 1e3 * table[order, 2], c=values[order], s=14, vmin=0, vmax=worst or 1.0,
                              cmap='viridis' if quantity.low else 'viridis_r')
        figure.colorbar(shown, ax=panel, label=_axis(name, quantity), extend='max' if quantity.low else 'neither')
        panel.set(title=quantity.text, xlabel='x, mm', ylabel='y, mm')
        panel.title.set_fontsize('medium')
        panel.set_aspect('equal', adjustable='datalim')
        panel.invert_yaxis()  # y increases with the image row
        panel.grid(alpha=0.3)
    return figure


def states(pyplot, evaluation: Evaluation):
    """Confusion matrices of the dot states and of the slip state of the contact, in per cent of each true state. None without counts."""
    both = (('dots', evaluation.dots, DOT_STATES, (*DOT_STATES, 'not seen')),
            ('slip of the contact', evaluation.slip, SLIP_STATES, SLIP_STATES))
    tables = [table for table in both if table[1].any()]
    if not tables:
        return None
    figure, panels = pyplot.subplots(1, len(tables), figsize=(5.2 * len(tables), 4.2), layout='constrained', squeeze=False)
    for panel, (title, counts, names, columns) in zip(panels[0], tables):
        share = 100 * counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
        panel.imshow(share, cmap='Blues', vmin=0, vmax=100)
        for row, column in np.ndindex(*counts.shape):
            panel.text(column, row, f'{share[row, column]:.1f} %\n{counts[row, column]}', ha='center', va='center',
                       color='white' if share[row, column] > 60 else 'black', fontsize='small')
        panel.set(title=title, xlabel='estimated', ylabel='true', xticks=range(len(columns)), xticklabels=columns, yticks=range(len(names)))
        panel.set_yticklabels(names, rotation=90, va='center')
    return figure
