# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the experiments share: scenes as bags, methods on them, tables of three columns."""
from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from tactile_perception.bags.judged_bag import JudgedBag
from tactile_perception.evaluation.evaluation import Instant

from ..installed import share
from ..simulate.bags import write_psd_scene, write_scene, write_taxel_scene


@dataclass(frozen=True)
class Row:
    """A line of a table. reported: what the paper reports, '' where it reports no number; published, ours: NaN where there is none."""

    quantity: str
    unit: str
    reported: str
    published: float
    ours: float


@dataclass(frozen=True)
class Curves:
    """What a paper plots. name: with unit, of the ordinate; of_what: the abscissa; lines: name -> (x (N,), y (N,)), of the truth, the
    published method and ours."""

    name: str
    of_what: str
    lines: dict[str, tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Table:
    """One experiment: title, rows, what has to be known to read it, and what its paper plots."""

    title: str
    rows: list[Row]
    note: str = ''
    curves: tuple[Curves, ...] = ()

    def lines(self) -> list[str]:
        """In Markdown."""
        estimated = [f'### {self.title}', '', '| | unit | the paper reports | its method, as built here | ours |', '|---|---|---|---|---|']
        estimated += [f'| {row.quantity} | {row.unit} | {row.reported or "-"} | {_said(row.published)} | {_said(row.ours)} |'
                 for row in self.rows]
        return [*estimated, '', *([self.note, ''] if self.note else [])]


def _said(value: float) -> str:
    return '-' if not np.isfinite(value) else f'{value:.3g}'


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
            if sensor == 'psd_finger':
                write_psd_scene(bag, scene, rate, self.seed)
            elif sensor == 'taxel_array':
                write_taxel_scene(bag, scene, rate, self.seed)
            else:
                write_scene(bag, scene, rate, self.seed, frames=least if self.short else 0)
        return bag

    def params(self, sensor: str, changes: Mapping) -> Path:
        """The parameter file of a simulated sensor with changes for all its nodes."""
        page = yaml.safe_load(Path(share('params', f'{sensor}_sim.yaml')).read_text())
        for section in page.values():
            section['ros__parameters'] |= {name: value for name, value in changes.items() if name in section['ros__parameters']}
        page['/**']['ros__parameters'] |= changes
        path = self.folder / f'{sensor}_{"_".join(map(str, changes.values()))}.yaml'.replace('/', '_')
        path.write_text(yaml.safe_dump(page))
        return path

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
