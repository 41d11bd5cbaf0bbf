# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Plots of an evaluation."""
from __future__ import annotations

from pathlib import Path

import numpy as np

from .evaluation import DOT_STATES, QUANTITIES, SLIP_STATES, Evaluation, Quantity, spread

_TITLES = {
    'errors_over_time': 'errors over time\ngrey: something touches',
    'errors_over_surface': 'size of errors over the sensor\neach point: where a touch truly was, the worst on top; y down, as in the image',
    'states': 'estimated states for each true one\nper cent of the row, and how many',
}


def draw(evaluation: Evaluation, name: str, folder: Path) -> list[Path]:
    """Write the plots that have data to the folder; their paths. name: of the recording."""
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot
    errors = {quantity: rows[np.isfinite(rows[:, 3])] for quantity, rows in evaluation.errors().items()}
    made = {'errors_over_time': over_time(pyplot, errors, evaluation.context), 'errors_over_surface': over_surface(pyplot, errors),
            'states': states(pyplot, evaluation)}
    paths = []
    for file, figure in made.items():
        if figure is not None:
            figure.suptitle(f'{name}: {_TITLES[file]}', fontsize=11)
            paths.append(folder / f'{file}.png')
            figure.savefig(paths[-1], dpi=100)
            pyplot.close(figure)
    return paths


def _axis(name: str, quantity: Quantity) -> str:
    """Label of an axis or a colour bar."""
    if not quantity.low:
        return 'overlap (1: the same)'
    return f'{name.replace("_", " ").removesuffix(" relative")}, {quantity.unit}'


def over_time(pyplot, errors: dict[str, np.ndarray], context: list[tuple[float, float, float]]):
    """One panel for the true depth and for each quantity with errors over time; grey while something touches. None without errors."""
    errors = {name: rows for name, rows in errors.items() if len(rows)}
    if not errors:
        return None
    time, touched, depth = np.array(context, float).reshape(-1, 3).T
    count = len(errors) + 1
    figure, panels = pyplot.subplots(count, 1, sharex=True, figsize=(10, 1.5 + 1.35 * count), layout='constrained', squeeze=False)
    begin = min([rows[0, 0] for rows in errors.values()] + time[:1].tolist())
    panels[0, 0].plot(time - begin, 1e3 * depth, '.', color='black', markersize=3)
    panels[0, 0].set_ylabel('true depth,\nmm')
    for panel, (name, rows) in zip(panels[1:, 0], errors.items()):
        quantity, found = QUANTITIES[name], spread(rows[:, 3], QUANTITIES[name])
        values = quantity.factor * (rows[:, 3] if quantity.signed else np.abs(rows[:, 3]))
        panel.plot(rows[:, 0] - begin, values, '.', markersize=3)
        panel.axhline(0 if quantity.low else 1, color='black', linewidth=0.6)
        panel.set_ylabel(_axis(name, quantity).replace(', ', ',\n').replace(' (', '\n('), fontsize='small')
        what = f'error of the {quantity.text}' if quantity.low else quantity.text
        panel.set_title(f'{what}: median {found["median"]:.3g}, 95 % within {found["within_95"]:.3g}, worst {found["worst"]:.3g}',
                        fontsize='small', loc='right', pad=2)
    for panel in panels[:, 0]:
        panel.fill_between(time - begin, 0, 1, where=touched > 0, step='mid', transform=panel.get_xaxis_transform(), color='#e6e6e6',
                           linewidth=0)
        panel.grid(alpha=0.3)
    panels[-1, 0].set_xlabel('time, s')
    return figure


def over_surface(pyplot, errors: dict[str, np.ndarray]):
    """One map per quantity: true contact positions, coloured by the error. None without positions."""
    errors = {name: rows[np.isfinite(rows).all(axis=1)] for name, rows in errors.items() if np.isfinite(rows).all(axis=1).any()}
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
