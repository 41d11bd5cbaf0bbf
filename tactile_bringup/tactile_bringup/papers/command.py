# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""papers: makes the experiments of the papers on the simulated sensors: what each paper reports, its method as it is built here, and ours.

Each sensor is calibrated as its paper says. The published methods detect markers as published, too; ours use the calibration files that
ship. `docs/papers` explains each experiment.
"""
from __future__ import annotations

import argparse
import contextlib
import os
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
from tactile_driver.command import tells_errors
from tactile_perception.common.progress import in_parallel

from . import others, sheets
from .bench import Bench, Table
from .others import OURS, PUBLISHED, TRUTH

EXPERIMENTS: dict[str, tuple[Callable[[Bench], Iterator[Table]], ...]] = {
    'areal_sensor_contact_position': (sheets.one_camera, sheets.two_cameras),
    'air_cushion_contact': (sheets.zones,),
    'psd_finger': (others.finger,),
    'touchpad_contact_region': (others.touchpad,),
    'taxel_array_image_processing': (others.taxels,),
}


def run(names: list[str], bench: Bench) -> dict[str, list[Table]]:
    """Paper -> tables, made on all cores."""
    jobs = [(name, k) for name in names for k in range(len(EXPERIMENTS[name]))]
    made = in_parallel(partial(_made, bench, time.monotonic()), jobs, 'experiments')
    return {name: [table for job, tables in zip(jobs, made) if job[0] == name for table in tables] for name in names}


def _made(bench: Bench, begin: float, job: tuple[str, int]) -> list[Table]:
    """The tables of one experiment, in a process of its own; a line when it begins and when each table is made."""
    cv2.setNumThreads(1)
    name, number = job
    experiment, tables = EXPERIMENTS[name][number], []
    _tell(begin, f'{name}: {experiment.__doc__.splitlines()[0]}')
    with open(os.devnull, 'w') as nowhere, contextlib.redirect_stderr(nowhere):
        for table in experiment(bench):
            tables.append(table)
            _tell(begin, f'{name}: {table.title} is done')
    return tables


def _tell(begin: float, what: str) -> None:
    print(f'{time.monotonic() - begin:4.0f} s  {what}', file=sys.__stderr__, flush=True)


def report(tables: dict[str, list[Table]]) -> str:
    """All tables in Markdown."""
    lines = []
    for name, some in tables.items():
        lines += [f'## {name}', '', *(line for table in some for line in table.lines())]
    return '\n'.join(lines)


def draw(tables: dict[str, list[Table]], path: Path) -> None:
    """A plot of all rows that the paper has a number for: the published method and ours over that number."""
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot
    rows = [(f'{table.title}: {row.quantity}', float(row.reported), row) for some in tables.values() for table in some for row in table.rows
            if row.reported]
    figure, panel = pyplot.subplots(figsize=(9, 1.2 + 0.32 * len(rows)), layout='constrained')
    for k, (_, reported, row) in enumerate(rows):
        panel.plot([row.published / reported], [k], 'o', color='C1', label='its method, as built here' if k == 0 else None)
        panel.plot([row.ours / reported], [k], 's', color='C0', label='ours' if k == 0 else None)
    panel.axvline(1.0, color='grey', label='the paper reports')
    panel.set(xscale='log', yticks=range(len(rows)), yticklabels=[name for name, *_ in rows], xlabel='over what the paper reports',
              title=f'The papers\' experiments, {time.strftime("%Y-%m-%d")}')
    panel.invert_yaxis()
    figure.legend(loc='outside lower center', ncols=3)
    figure.savefig(path, dpi=90)
    pyplot.close(figure)


def draw_curves(tables: list[Table], path: Path) -> None:
    """What a paper plots: a row for each table, a panel for each of its curves."""
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot
    columns = max(len(table.curves) for table in tables)
    figure, panels = pyplot.subplots(len(tables), columns, figsize=(4.2 * columns, 0.5 + 2.6 * len(tables)), layout='constrained',
                                     squeeze=False)
    colours = {TRUTH: 'grey', PUBLISHED: 'C1', OURS: 'C0'}
    for row, table in zip(panels, tables):
        row[0].set_title(table.title, loc='left')
        for panel in row[len(table.curves):]:
            panel.axis('off')
        for panel, curves in zip(row, table.curves):
            for name, (x, y) in curves.lines.items():
                panel.plot(x, y, color=colours[name], linewidth=1.0, label=name)
            panel.set(xlabel=curves.of_what, ylabel=curves.name)
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc='outside lower center', ncols=3)
    figure.savefig(path, dpi=90)
    pyplot.close(figure)


@tells_errors('papers')
def main(args: list[str] | None = None) -> int:
    """Run the command; exit code 1 and one error line on failure."""
    parser = argparse.ArgumentParser('papers', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--paper', action='append', choices=list(EXPERIMENTS), help='only this paper (may be repeated)')
    parser.add_argument('--report', type=Path, metavar='DIR', help='folder for papers.md, papers.png and the plots of the papers')
    parser.add_argument('--bags', type=Path, metavar='DIR', help='folder where bags are kept for the next time; else they are made anew')
    given = parser.parse_args(args)
    with contextlib.nullcontext(given.bags) if given.bags else TemporaryDirectory() as folder:
        Path(folder).mkdir(parents=True, exist_ok=True)
        tables = run(given.paper or list(EXPERIMENTS), Bench(Path(folder)))
    print(report(tables))
    if given.report:
        given.report.mkdir(parents=True, exist_ok=True)
        (given.report / 'papers.md').write_text(report(tables) + '\n')
        draw(tables, given.report / 'papers.png')
        written = ['papers.md', 'papers.png']
        for name, some in tables.items():
            if plotted := [table for table in some if table.curves]:
                draw_curves(plotted, given.report / f'{name}.png')
                written.append(f'{name}.png')
        print(f'written to {given.report}: {", ".join(written)}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
