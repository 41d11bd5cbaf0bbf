# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the experiments share: scenes as bags, methods on them, tables of three columns, plots."""
from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from tactile_perception.bags.judged_bag import JudgedBag
from tactile_perception.evaluation.evaluation import Instant
from tactile_perception.parameters.file import write_parameters

from .. import share
from ..simulate.bags import write_psd_scene, write_scene, write_taxel_scene

TRUTH, PUBLISHED, OURS = 'truth', 'its method, as built here', 'ours'
_COLOURS = {TRUTH: 'grey', PUBLISHED: 'C1', OURS: 'C0'}


@dataclass(frozen=True)
class Curves:
    """What a paper plots. name: with unit, of the ordinate; of_what: the abscissa; lines: name -> (x (N,), y (N,)), of the truth, the
    published method and ours."""

    name: str
    of_what: str
    lines: Mapping[str, tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Table:
    """One experiment. rows: quantity, unit, and what the paper reports, '' where it reports no number; published, ours: a number for each
    row, NaN where there is none; note: what has to be known to read it; curves: what its paper plots."""

    title: str
    rows: Sequence[tuple[str, str, str]]
    published: Sequence[float]
    ours: Sequence[float]
    note: str = ''
    curves: tuple[Curves, ...] = ()

    def lines(self) -> list[str]:
        """In Markdown."""
        head = [f'### {self.title}', '', '| | unit | the paper reports | its method, as built here | ours |', '|---|---|---|---|---|']
        rows = [f'| {name} | {unit} | {reported or "-"} | ' + ' | '.join(f'{x:.3g}' if np.isfinite(x) else '-' for x in pair) + ' |'
                for (name, unit, reported), *pair in zip(self.rows, self.published, self.ours)]
        return [*head, *rows, '', *([self.note, ''] if self.note else [])]


def draw(tables: Sequence[Table], path: Path) -> None:
    """A row of panels for each table: the curves that its paper plots, else the numbers that it reports and how far the methods are off."""
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot
    columns = max(1, *(len(table.curves) for table in tables))
    figure, panels = pyplot.subplots(len(tables), columns, figsize=(4.2 * columns + 1, 0.5 + 2.6 * len(tables)), layout='constrained',
                                     squeeze=False)
    for row, table in zip(panels, tables):
        row[0].set_title(table.title, loc='left')
        for panel in row[max(len(table.curves), 1):]:
            panel.axis('off')
        for panel, curves in zip(row, table.curves):
            for name, (x, y) in curves.lines.items():
                panel.plot(x, y, color=_COLOURS[name], linewidth=1.0, label=name)
            panel.set(xlabel=curves.of_what, ylabel=curves.name)
        if not table.curves:
            for name, values in ((PUBLISHED, table.published), (OURS, table.ours)):
                row[0].plot(values, range(len(values)), 'o', color=_COLOURS[name], label=name)
            row[0].plot([float(reported or 'nan') for *_, reported in table.rows], range(len(table.rows)), 'k|', label='the paper reports')
            row[0].set(yticks=range(len(table.rows)), yticklabels=[f'{name}, {unit}' for name, unit, _ in table.rows])
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc='outside lower center', ncols=3)
    figure.savefig(path, dpi=90)
    pyplot.close(figure)


@dataclass(frozen=True)
class Bench:
    """folder: for bags and files; short: a part of each camera's scene, to try the experiments; seed: of the specimen, which is that of the
    calibration files that ship."""

    folder: Path
    short: bool = False
    seed: int = 0

    def bag(self, sensor: str, scene: str, rate: float, least: int = 24) -> Path:
        """The bag of a scene at rate Hz; one that is there is taken. least: frames of a camera that suffice to try an experiment."""
        bag = self.folder / scene
        if not bag.exists():
            write = {'psd_finger': write_psd_scene, 'taxel_array': write_taxel_scene}.get(sensor, write_scene)
            write(bag, scene, rate, self.seed, **({'frames': least} if self.short and write is write_scene else {}))
        return bag

    def params(self, sensor: str, changes: Mapping) -> Path:
        """The parameter file of a simulated sensor with changes for all its nodes."""
        path = self.folder / f'{sensor}_{"_".join(map(str, changes.values()))}.yaml'.replace('/', '_')
        return write_parameters(path, changes, Path(share('params', f'{sensor}_sim.yaml')))

    def instants(self, bag: Path, params: Path, calibration: Path | None) -> Iterator[tuple[float, Instant, Instant]]:
        """(stamp s, estimate, truth) of each frame."""
        yield from JudgedBag(bag, params=params, calibration=calibration).instants()


def shipped(sensor: str) -> Path:
    """The calibration file of the simulated specimen, for our methods."""
    return Path(share('calibration', f'{sensor}_sim.yaml'))


def mean(values) -> float:
    """Mean of those that are known; NaN of none."""
    known = np.asarray(values, float)
    known = known[np.isfinite(known)]
    return float(known.mean()) if len(known) else np.nan
