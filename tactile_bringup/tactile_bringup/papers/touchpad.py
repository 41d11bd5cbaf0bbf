# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The experiments of the paper touchpad_contact_region: figs 8 to 10."""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from tactile_perception.common.estimates import ContactRegionEstimate
from tactile_perception.common.geometry import matrix_of_quaternion

from .bench import Bench, Row, Table, at_maximum, common, mean, reported
from .figures import OURS, PUBLISHED, Curves, Picture, draw_curves, legend_of

_FRAMES = 10.0  # Hz
_PUBLISHED = {'contact': 'paper', 'detection': 'paper', 'numbering': 'paper'}
_OURS = {'contact': 'membrane'}
_COLUMNS = 23  # dots in a row of the simulated touchpad
_KINDS = ('true positive', 'C2', 'o'), ('false positive', 'C3', 'x'), ('false negative', 'C1', '^')


@dataclass(frozen=True)
class Dots:
    """The dots of one frame: ids of those that touch by the truth, and of those that a method reports."""

    true: frozenset[int]
    stated: frozenset[int]

    @property
    def kinds(self) -> tuple[frozenset[int], frozenset[int], frozenset[int]]:
        """True positives, false positives, false negatives."""
        return self.true & self.stated, self.stated - self.true, self.true - self.stated


def presses(bench: Bench) -> Iterator[Table]:
    """Figs 8 to 10: a rectangle, the end of a cylinder and a ring pressed along the normal, without slip."""
    methods = [(bench.params('touchpad', changes), None) for changes in (_PUBLISHED, _OURS)]
    for tool, fig in (('rectangle', 8), ('disc', 9), ('ring', 10)):
        frames: tuple[list[Dots | None], ...] = [], []
        counts: tuple[list, ...] = [], []
        for _, true, estimates in bench.compare(bench.bag('touchpad', f'normal_{tool}', _FRAMES), *methods):
            if true.contacts and true.region is not None:
                for k, estimate in enumerate(estimates):
                    frames[k].append(None if estimate.region is None else Dots(_touching(true.region), _touching(estimate.region)))
                    counts[k].append(_count(frames[k][-1], true.region, estimate.region))
        rows = [np.array(some).reshape(-1, 5) for some in counts]
        yield Table(f'{tool}: fig {fig}', _rows(rows),
                    'Dots that touch by the truth or by the method, mean over the touched frames that both methods report; deepest: mean '
                    'of the frames in which a method has most true positives.', _pictures(tool, fig, frames, rows))


def _touching(region: ContactRegionEstimate) -> frozenset[int]:
    return frozenset(np.asarray(region.dot_id)[np.asarray(region.dot_state) > 0].tolist())


def _count(dots: Dots | None, true: ContactRegionEstimate, estimate: ContactRegionEstimate | None) -> tuple[float, ...]:
    """Dots in contact, true positives, false positives, false negatives, and the error of the pose (eq 4), mm; NaN of no report."""
    if dots is None or estimate is None:
        return (np.nan,) * 5
    ends = [matrix_of_quaternion(region.pose_rotation) @ true.centroid + region.pose_translation for region in (estimate, true)]
    return len(dots.true), *(float(len(kind)) for kind in dots.kinds), 1e3 * float(np.linalg.norm(ends[0] - ends[1]))


def _rows(methods: list[np.ndarray]) -> list[Row]:
    """The rows of a table; methods: (N, 5) of each, as of _count."""
    dots = common(*(rows[:, :4] for rows in methods))
    poses = common(*(rows[:, 4:] for rows in methods))
    names = 'dots in contact', *(kind for kind, *_ in _KINDS)
    found = [Row(name, 'dots', '', *(float(rows[:, k].mean()) if len(rows) else np.nan for rows in dots)) for k, name in enumerate(names)]
    best = [at_maximum(rows, 1) for rows in dots]
    found += [Row(f'{name}, deepest', 'dots', '', *(float(row[k]) for row in best)) for k, name in enumerate(names[1:], 1)]
    return [*found, Row('pose of the object, mean error', 'mm', '', *(mean(rows) for rows in poses)),
            Row('touched frames reported', '%', '', *(reported(rows[:, :4]) for rows in methods))]


def _pictures(tool: str, fig: int, frames: tuple[list[Dots | None], ...], methods: list[np.ndarray]) -> tuple[Picture, ...]:
    """Dot maps of a worse and a better frame of the published method (a, b), and the numbers of dots over the frames (c)."""
    wrong = methods[0][:, 2:4].sum(axis=1)
    if not np.isfinite(wrong).any():
        return ()
    deep = np.where(methods[0][:, 0] > 0.5 * np.nanmax(methods[0][:, 0]), wrong, np.nan)
    cases = [(f'({letter}) a {word} case, frame {number}', [some[number] for some in frames])
             for letter, word, number in (('a', 'worse', int(np.nanargmax(deep))), ('b', 'better', int(np.nanargmin(deep))))]
    index = np.arange(len(wrong))
    panels = tuple(Curves(f'{name}, dots', 'sampling index', {PUBLISHED: (index, methods[0][:, k]), OURS: (index, methods[1][:, k])})
                   for k, (name, *_) in enumerate(_KINDS, 1))
    return (Picture(f'fig_{fig}ab', f'Contact region of a {tool}: fig {fig} (a, b), the dots where they are printed',
                    partial(_map, cases), (7.5, 8.0)),
            Picture(f'fig_{fig}c', f'The dots of a {tool} as it is pressed deeper: fig {fig} (c)',
                    partial(draw_curves, panels), (10.0, 3.6)))


def _map(cases: list[tuple[str, list[Dots | None]]], figure) -> None:
    """A column a case, a row a method."""
    axes = figure.subplots(2, len(cases), squeeze=False, sharex=True, sharey=True)
    for column, (name, frames) in enumerate(cases):
        for axis, method, dots in zip(axes[:, column], (PUBLISHED, OURS), frames):
            axis.scatter(*_printed(range(_COLUMNS**2)), s=2, color='lightgrey')
            for kind, (label, colour, marker) in zip(() if dots is None else dots.kinds, _KINDS):
                axis.scatter(*_printed(kind), s=22, color=colour, marker=marker, label=label)
            axis.set(title=f'{name}\n{method}', aspect='equal', xlabel='column of dots', ylabel='row of dots')
            axis.title.set_fontsize('small')
            axis.label_outer()
    axes[0, 0].invert_yaxis()
    legend_of(figure, axes.ravel())


def _printed(dots) -> tuple[list[int], list[int]]:
    """Columns and rows of dots by their ids."""
    ids = sorted(dots)
    return [one % _COLUMNS for one in ids], [one // _COLUMNS for one in ids]
