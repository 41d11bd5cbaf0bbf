# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the experiments share: scenes as bags, methods that are compared frame by frame on them, tables, and causes of their figures."""
from __future__ import annotations

import math
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactile_perception.core.parameter_files import write_parameters
from tactile_perception.evaluation.evaluation import Instant
from tactile_perception.tools.judged_bag import JudgedBag

from .. import share
from ..simulate.bags import write_psd_scene, write_scene, write_taxel_scene
from .constants import PAPERS
from .figures import OURS, PUBLISHED, Picture

CAUSES = '; '  # between the causes of one row

Method = tuple[Path, Path | None]  # parameter file, calibration file


@dataclass(frozen=True)
class Row:
    """One figure of an experiment.

    name, unit : what the figure is.
    reported : what the paper reports, as it writes it; '' where it reports no number.
    published, ours : figures of the published method and of ours; NaN where there is none.
    ideal : the figure of a method without error, from which a ratio of errors counts.
    cause : title of the Detail that shows why the published method misses the paper's figure.
    """

    name: str
    unit: str
    reported: str = ''
    published: float = np.nan
    ours: float = np.nan
    ideal: float = 0.0
    cause: str = ''

    @property
    def needs_cause(self) -> bool:
        """Whether the published method's error is more than PAPERS.max_ratio times the error that the paper reports."""
        if not self.reported:
            return False
        return not abs(self.published - self.ideal) <= PAPERS.max_ratio * abs(float(self.reported) - self.ideal)


@dataclass(frozen=True)
class Table:
    """One experiment, under one condition.

    title : of the experiment, with the paper's figures or tables.
    rows : its figures.
    note : what a reader has to know.
    pictures : the experiment's figures, as the paper draws them.
    condition : of those in which the experiment is made; tables of one title have the same rows, and are printed as one.
    """

    title: str
    rows: Sequence[Row]
    note: str = ''
    pictures: tuple[Picture, ...] = ()
    condition: str = ''

    def lines(self) -> list[str]:
        """The table in Markdown."""
        return lines_of([self])


def lines_of(tables: Sequence[Table]) -> list[str]:
    """One table in Markdown of those of one title, without the columns in which no row has anything. Of each row it has what any of them
    has: what the paper reports, and causes."""
    rows, each = tables[0].rows, list(zip(*(table.rows for table in tables)))
    columns = [['', *(f'{row.name}, {row.unit}' if row.unit else row.name for row in rows)],
               ['paper', *(next(filter(None, (row.reported for row in same)), '-') for same in each)]]
    for table in tables:
        names = (f'{method}, {table.condition}' if table.condition else method for method in (PUBLISHED, OURS))
        columns += ([name, *map(_number, numbers)] for name, *numbers in zip(names, *((row.published, row.ours) for row in table.rows)))
    columns.append(['cause', *(CAUSES.join(dict.fromkeys(row.cause for row in same if row.cause)) for same in each)])
    shown = [columns[0], *(column for column in columns[1:] if any(cell not in ('', '-') for cell in column[1:]))]
    return _markdown(tables[0].title, list(zip(*shown)))


@dataclass(frozen=True)
class Detail:
    """What causes a figure, shown by a run that changes one thing at a time.

    title : of the cause, which rows of tables name.
    head : names of the columns.
    rows : cells of each row, text or numbers.
    note : the conclusion.
    """

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[str | float]]
    note: str = ''

    def lines(self) -> list[str]:
        """The table in Markdown."""
        rows = [[cell if isinstance(cell, str) else _number(cell) for cell in row] for row in self.rows]
        return _markdown(self.title, [list(self.head), *rows])


def _number(value: float) -> str:
    return f'{value:.3g}' if math.isfinite(value) else '-'


def _markdown(title: str, cells: Sequence[Sequence[str]]) -> list[str]:
    head, *rows = (f'| {" | ".join(row)} |'.replace('|  |', '| |') for row in cells)
    return [f'### {title}', '', head, '|---' * len(cells[0]) + '|', *rows, '']


def unexplained(tables: Sequence[Table], causes: Sequence[str]) -> list[str]:
    """A line for each figure of the published method that misses the paper's by more than PAPERS.max_ratio and names none of the causes,
    and for each named cause that is not among them."""
    found = []
    for table in tables:
        for row in table.rows:
            found += [f'{table.title}: {row.name}: nothing shows the cause {cause!r}' for cause in row.cause.split(CAUSES)
                      if row.cause and cause not in causes]
            if row.needs_cause and not row.cause:
                found.append(f'{table.title}: {row.name}: {_number(row.published)} {row.unit} where the paper reports {row.reported}, '
                             'and no cause is named')
    return found


@dataclass(frozen=True)
class Bench:
    """Where the experiments are made.

    folder : for bags and files.
    short : only a part of each camera's scene is made, to try the experiments.
    seed : of the specimen, which is that of the calibration files that ship.
    """

    folder: Path
    short: bool = False
    seed: int = 0

    def bag(self, sensor: str, scene: str, rate: float, frames: int = 24) -> Path:
        """The bag of a scene at rate Hz. frames: of a camera, that suffice to try an experiment."""
        write = {'psd_finger': write_psd_scene, 'taxel_array': write_taxel_scene}.get(sensor, write_scene)
        part = {'frames': frames} if self.short and write is write_scene else {}
        return self.written(scene, lambda bag: write(bag, scene, rate, self.seed, **part))

    def written(self, name: str, write: Callable[[Path], object]) -> Path:
        """The bag of that name, which write writes unless it is there; a run that is interrupted leaves none."""
        bag, begun = self.folder / name, self.folder / 'begun' / name
        if not bag.exists():
            shutil.rmtree(begun, ignore_errors=True)
            begun.parent.mkdir(exist_ok=True)
            write(begun)
            begun.rename(bag)
        return bag

    def params(self, sensor: str, changes: Mapping) -> Path:
        """The parameter file of a simulated sensor with changes for all its nodes."""
        path = self.folder / f'{sensor}_{"_".join(map(str, changes.values()))}.yaml'.replace('/', '_')
        return write_parameters(path, changes, Path(share('params', f'{sensor}_sim.yaml')))

    def instants(self, bag: Path, params: Path, calibration: Path | None) -> Iterator[tuple[float, Instant, Instant]]:
        """(stamp s, estimate, truth) of each frame."""
        yield from JudgedBag(bag, params=params, calibration=calibration).instants()

    def compare(self, bag: Path, *methods: Method) -> Iterator[tuple[float, Instant, tuple[Instant, ...]]]:
        """(stamp s, truth, estimate of each method) of each frame that a method takes; an empty estimate where another one does not."""
        runs = [{stamp: (estimate, true) for stamp, estimate, true in self.instants(bag, *method)} for method in methods]
        truth = {stamp: true for run in runs for stamp, (_, true) in run.items()}
        for stamp in sorted(truth):
            yield stamp, truth[stamp], tuple(run[stamp][0] if stamp in run else Instant() for run in runs)


def shipped(sensor: str) -> Path:
    """The calibration file of the simulated specimen, for our methods."""
    return Path(share('calibration', f'{sensor}_sim.yaml'))


def mean(values) -> float:
    """Mean of those that are known; NaN of none."""
    known = np.asarray(values, float)
    known = known[np.isfinite(known)]
    return float(known.mean()) if len(known) else np.nan


def common(*methods: np.ndarray) -> list[np.ndarray]:
    """Rows (N, K) of each method, a row a frame, without the frames that any of them does not report (a NaN in its row)."""
    known = np.all([np.isfinite(rows).all(axis=1) for rows in methods], axis=0)
    return [rows[known] for rows in methods]


def reported(rows: np.ndarray) -> float:
    """Percentage of the frames, rows (N, K), that a method reports; NaN of none."""
    return 100.0 * float(np.isfinite(rows).all(axis=1).mean()) if len(rows) else np.nan


def at_maximum(rows: np.ndarray, column: int) -> np.ndarray:
    """Mean (K,) of the rows (N, K) in which a column has its maximum; NaN of no rows."""
    return rows[rows[:, column] == rows[:, column].max()].mean(axis=0) if len(rows) else np.full(rows.shape[1], np.nan)
