# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""papers: makes the experiments of the papers on the simulated sensors: what each paper reports, its method as it is built here, and ours.

Each sensor is calibrated as its paper says. The published methods detect markers as published, too; ours use the calibration files that
ship. Where a figure of a published method misses the paper's, the table names the cause, and `--details` shows it. `docs/papers` explains
each experiment.
"""
from __future__ import annotations

import argparse
import contextlib
import os
import resource
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2

from tactile_driver.errors import reports_errors
from tactile_perception.common.progress import in_parallel

from . import dome, finger, sheet_causes, sheets, taxels, touchpad, wrench
from .bench import Bench, Detail, Table, lines_of

#: Paper -> its experiments, and what shows the causes of their figures.
EXPERIMENTS: dict[str, tuple[Callable[[Bench], Iterator[Table]], ...]] = {
    'areal_sensor_contact_position': (sheets.one_camera, sheets.two_cameras),
    'air_cushion_contact': (dome.near_zones, dome.zones),
    'psd_finger': (finger.static, finger.dynamic),
    'touchpad_contact_region': (touchpad.presses,),
    'taxel_array_image_processing': (taxels.localization, taxels.shapes, wrench.wrenches),
}
DETAILS: dict[str, tuple[Callable[[Bench], Iterator[Detail]], ...]] = {
    'areal_sensor_contact_position': (sheet_causes.one_camera_details, sheet_causes.two_cameras_details),
    'air_cushion_contact': (dome.details,),
    'psd_finger': (finger.false_contacts,),
    'touchpad_contact_region': (touchpad.true_positions,),
    'taxel_array_image_processing': (taxels.values, wrench.details),
}


def run(names: list[str], bench: Bench, details: bool = False) -> dict[str, list[Table | Detail]]:
    """Paper -> tables of its experiments, or of its details, made on all cores."""
    jobs, begin = [(name, one) for name in names for one in (DETAILS if details else EXPERIMENTS)[name]], time.monotonic()
    made = in_parallel(partial(_made, bench, begin), jobs, 'experiments')
    used = [resource.getrusage(whose) for whose in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    _tell(begin, f'all done, in {sum(one.ru_utime + one.ru_stime for one in used):.0f} s of processor time')
    return {name: [table for job, tables in zip(jobs, made) if job[0] == name for table in tables] for name in names}


def _made(bench: Bench, begin: float, job: tuple[str, Callable[[Bench], Iterator]]) -> list[Table | Detail]:
    """The tables of one experiment, in a process of its own; a line when it begins and when each table is made."""
    cv2.setNumThreads(1)
    (name, experiment), tables = job, []
    _tell(begin, f'{name}: {experiment.__doc__.splitlines()[0]}')
    with open(os.devnull, 'w') as nowhere, contextlib.redirect_stderr(nowhere):
        for table in experiment(bench):
            tables.append(table)
            _tell(begin, f'{name}: {table.title}{getattr(table, "condition", "") and f", {table.condition}"} is done')
    return tables


def _tell(begin: float, what: str) -> None:
    print(f'{time.monotonic() - begin:4.0f} s  {what}', file=sys.__stderr__, flush=True)


def report(tables: dict[str, list[Table | Detail]]) -> str:
    """All tables in Markdown."""
    lines = []
    for name, some in tables.items():
        lines += [f'## {name}', '']
        groups = [[one for one in some if one.title == title] for title in dict.fromkeys(one.title for one in some)]
        for group, following in zip(groups, [*groups[1:], None]):
            table = group[0]
            lines += lines_of(group) if isinstance(table, Table) else table.lines()
            if table.note and (following is None or following[0].note != table.note):  # consecutive tables share a note
                lines += [table.note, '']
    return '\n'.join(lines)


@reports_errors('papers')
def main(args: list[str] | None = None) -> int:
    """Run the command; exit code 1 and one error line on failure."""
    parser = argparse.ArgumentParser('papers', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--paper', action='append', choices=list(EXPERIMENTS), help='only this paper (may be repeated)')
    parser.add_argument('--details', action='store_true', help='instead of the experiments, what causes their figures, one thing '
                        'changed at a time')
    parser.add_argument('--report', type=Path, metavar='DIR', help='folder for papers.md and the figures, or details.md')
    parser.add_argument('--bags', type=Path, metavar='DIR', help='folder where bags are kept for the next time; else they are temporary')
    parser.add_argument('--quick', action='store_true', help='a part of each scene, to see that it runs')
    given = parser.parse_args(args)
    with contextlib.nullcontext(given.bags) if given.bags else TemporaryDirectory() as folder:
        Path(folder).mkdir(parents=True, exist_ok=True)
        tables = run(given.paper or list(EXPERIMENTS), Bench(Path(folder), given.quick), given.details)
    print(report(tables))
    if given.report:
        print(f'written to {given.report}: {", ".join(write(tables, given.report, "details.md" if given.details else "papers.md"))}')
    return 0


def write(tables: dict[str, list[Table | Detail]], folder: Path, name: str) -> list[str]:
    """Write the report and all pictures to a folder, which is made; names of the files."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(report(tables) + '\n')
    files = [name]
    for paper, some in tables.items():
        for picture in (picture for table in some if isinstance(table, Table) for picture in table.pictures):
            files.append(f'{paper}_{picture.name}.png')
            picture.write(folder / files[-1])
    return files
