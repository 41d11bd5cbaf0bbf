# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The experiments of the paper touchpad_contact_region: figs 8 to 10."""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_perception.common.estimates import ContactRegionEstimate
from tactile_perception.common.geometry import matrix_of_quaternion
from tactile_perception.published.touchpad_contact_region import PaperRegion

from .bench import Bench, Detail, Row, Table, at_maximum, common, mean, reported
from .constants import PAPERS
from .figures import OURS, PUBLISHED, Curves, Picture, draw_curves, legend_of

_PUBLISHED = {'contact': 'paper', 'detection': 'paper', 'numbering': 'paper'}
_OURS = {'contact': 'membrane'}
TOOLS = ('rectangle', 8), ('disc', 9), ('ring', 10)  # pressed along the normal, and the figure that shows it
BESIDE = 'moving skin'
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
    for tool, fig in TOOLS:
        frames: tuple[list[Dots | None], ...] = [], []
        counts: tuple[list, ...] = [], []
        truth, deepest = {}, 0.0
        for stamp, true, estimates in bench.compare(bench.bag('touchpad', f'normal_{tool}', PAPERS.touchpad_rate, 40), *methods):
            if not true.contacts or true.region is None:
                continue
            if true.contacts[0].depth < deepest - PAPERS.depth_tolerance:
                break
            deepest, truth[round(stamp * PAPERS.touchpad_rate)] = true.contacts[0].depth, true.region
            for k, estimate in enumerate(estimates):
                frames[k].append(None if estimate.region is None else Dots(_touching(true.region), _touching(estimate.region)))
                counts[k].append((*_count(frames[k][-1]), *_motion(estimate.region, truth, stamp)))
        rows = [np.array(some).reshape(-1, 6) for some in counts]
        yield Table('Contact region: figs 8 to 10', _rows(rows, BESIDE),
                    'Mean numbers of dots over the frames until the release that both methods report. Deepest: mean of the frames in which '
                    'a method has the most true positives.', _pictures(tool, fig, frames, rows), tool)


def _touching(region: ContactRegionEstimate) -> frozenset[int]:
    return frozenset(np.asarray(region.dot_id)[np.asarray(region.dot_state) > 0].tolist())


def _count(dots: Dots | None) -> tuple[float, ...]:
    """Dots in contact, true positives, false positives, false negatives; NaN of no report."""
    return (np.nan,) * 4 if dots is None else (len(dots.true), *(float(len(kind)) for kind in dots.kinds))


def _motion(estimate: ContactRegionEstimate | None, truth: dict[int, ContactRegionEstimate], stamp: float) -> tuple[float, float]:
    """Error of the object's motion over the method's interval (eq 3), at the middle of the face, and the true motion, mm; NaN where the
    method does not report it, or the object did not touch yet. truth: by the number of the frame."""
    if estimate is None or not np.isfinite(estimate.motion_interval):
        return np.nan, np.nan
    now, before = truth[round(stamp * PAPERS.touchpad_rate)], truth.get(round((stamp - estimate.motion_interval) * PAPERS.touchpad_rate))
    if before is None:
        return np.nan, np.nan
    middle = before.centroid
    on_object = matrix_of_quaternion(before.pose_rotation).T @ (middle - before.pose_translation)
    true = matrix_of_quaternion(now.pose_rotation) @ on_object + now.pose_translation
    stated = matrix_of_quaternion(estimate.motion_rotation) @ middle + estimate.motion_translation
    return 1e3 * float(np.linalg.norm(stated - true)), 1e3 * float(np.linalg.norm(true - middle))


def _rows(methods: list[np.ndarray], cause: str) -> list[Row]:
    """The rows of a table; methods: (N, 6) of each, as of _count and _motion; cause: of the false positives."""
    dots, motions = common(*(rows[:, :4] for rows in methods)), common(*(rows[:, 4:] for rows in methods))
    names = [kind for kind, *_ in _KINDS]
    found = [Row(name, 'dots', '', *(float(rows[:, k].mean()) if len(rows) else np.nan for rows in dots), cause=cause if k == 2 else '')
             for k, name in enumerate(names, 1)]
    best = [at_maximum(rows, 1) for rows in dots]
    found += [Row(f'{name}, deepest', 'dots', '', *(float(row[k]) for row in best)) for k, name in enumerate(names, 1)]
    return [*found, Row('frames reported', '%', '', *(reported(rows[:, :4]) for rows in methods)),
            Row('motion of the object, mean error', 'mm', '', *(mean(rows[:, 0]) for rows in motions)),
            Row('true motion, mean', 'mm', '', *(mean(rows[:, 1]) for rows in motions)),
            Row('frames with that motion', '%', '', *(reported(rows) for rows in (some[:, 4:] for some in methods)))]


def true_positions(bench: Bench) -> Iterator[Detail]:
    """The published tests of the true positions of the dots."""
    found = []
    for tool, _ in TOOLS:
        scene = open_scene(f'normal_{tool}', PAPERS.touchpad_rate, bench.seed)
        published = PaperRegion(PAPERS.touchpad_columns, PAPERS.touchpad_columns)
        untouched, counts, deepest = None, [], 0.0
        for number in range(scene.frames):
            true = scene.render(number / PAPERS.touchpad_rate).truth
            untouched = true.dot_xyz if untouched is None else untouched
            stated = published.process(true.dot_id, true.dot_xyz, untouched, number / PAPERS.touchpad_rate).state
            if true.contacts:
                if true.contacts[0].depth < deepest - PAPERS.depth_tolerance:
                    break
                deepest = true.contacts[0].depth
                touching, stated_dots = (frozenset(true.dot_id[state > 0].tolist()) for state in (true.dot_state, stated))
                kinds = Dots(touching, stated_dots).kinds
                counts.append((*map(len, kinds), len(_enclosed(kinds[1], touching))))
        found.append((tool, *np.mean(counts, axis=0).tolist()))
    yield Detail(BESIDE, ('tool', *(f'{kind}, dots' for kind, *_ in _KINDS), 'false positive with contact on all four sides, dots'), found,
                 'The published tests, of the true positions of the dots: these false positives are no errors of positions. Around a face, '
                 'and inside the ring, the skin moves with the object to within the threshold of eqs 12 and 14.')


def _enclosed(dots: frozenset[int], touching: frozenset[int]) -> list[int]:
    """Those of the dots that have a touching dot to the left, to the right, above and below."""
    at = [(one // PAPERS.touchpad_columns, one % PAPERS.touchpad_columns) for one in touching]
    found = []
    for one in dots:
        row, column = divmod(one, PAPERS.touchpad_columns)
        along, across = [c - column for r, c in at if r == row], [r - row for r, c in at if c == column]
        if all(side and min(side) < 0 < max(side) for side in (along, across)):
            found.append(one)
    return found


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
            axis.scatter(*_printed(range(PAPERS.touchpad_columns**2)), s=2, color='lightgrey')
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
    return [one % PAPERS.touchpad_columns for one in ids], [one // PAPERS.touchpad_columns for one in ids]
