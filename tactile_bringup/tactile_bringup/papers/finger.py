# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The experiments of the paper psd_finger, section 6."""
from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_perception.evaluation.evaluation import Evaluation

from .bench import Bench, Detail, Method, Row, Table, mean, shipped
from .constants import PAPERS
from .figures import COLOURS, OURS, PUBLISHED, TRUTH, Picture, legend_of

_SHOWN = (0.0, 0.0), (180.0, 30.0), (180.0, 60.0)  # degrees, phi and theta of fig 9
FALSE_CONTACTS = 'false contacts'
_MARKERS = {PUBLISHED: 'o', OURS: 'x'}


@dataclass(frozen=True)
class PressedPosition:
    """The measurements of a method while one position is pressed.

    true : unit normal (3,) of the specified position.
    stated : unit normals (N, 3) that are measured, N at most 20.
    """

    true: np.ndarray
    stated: np.ndarray

    @property
    def middle(self) -> np.ndarray:
        """Unit normal (3,) of the mean (eq 11)."""
        mean = self.stated.mean(axis=0)
        return mean / np.linalg.norm(mean)

    @property
    def error(self) -> float:
        """Degrees (eq 12)."""
        return float(_angle(self.middle, self.true))

    @property
    def deviation(self) -> float:
        """Degrees (eqs 13 and 14)."""
        return float(_angle(self.stated, self.middle).mean())

    @property
    def polar(self) -> float:
        """Degrees from the pole."""
        return float(_angle(self.true, np.array([0.0, 0.0, 1.0])))


def _angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Degrees between unit vectors (..., 3)."""
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(-1)))


def _methods(bench: Bench) -> list[Method]:
    return [(bench.params('psd_finger', {'method': method}), shipped('psd_finger')) for method in ('paper', 'map')]


def static(bench: Bench) -> Iterator[Table]:
    """Figs 7 to 10: 25 positions, the error angle and the mean deviation."""
    methods = _positions(bench, bench.bag('psd_finger', 'grid', PAPERS.finger_rate))
    near = [[one for one in positions if one.polar < PAPERS.max_polar + 1] for positions in methods]
    worst = [[max((getattr(one, what) for one in positions), default=np.nan) for positions in some]
             for some, what in ((methods, 'error'), (near, 'error'), (near, 'deviation'))]
    within = f'within {PAPERS.max_polar:g} degrees of the pole, maximum'
    yield Table('25 positions: figs 7 to 10', [
        Row('error angle, maximum', 'degrees', '6', *worst[0]),
        Row('error angle at the pole', 'degrees', '', *(mean([one.error for one in positions if one.polar < 1]) for positions in methods)),
        Row(f'error angle {within}', 'degrees', '', *worst[1]),
        Row(f'mean deviation {within}', 'degrees', '1.5', *worst[2]), Row('positions reported', '', '25', *map(len, methods), ideal=25.0)],
        'Eqs 9 to 14, by 20 samples of each press without its first and last eighth, at times at which both methods report a contact.', (
            Picture('fig_7', 'Specified and mean measured contact positions: fig 7', partial(_draw_positions, methods), (9.0, 5.2)),
            Picture('fig_8', 'Error angle of the 25 positions: fig 8', partial(_draw_over_polar, 'error angle, degrees', 'error', methods)),
            Picture('fig_9', 'Samples of three positions: fig 9', partial(_draw_samples, methods), (10.0, 7.0)),
            Picture('fig_10', 'Mean deviation of the 25 positions: fig 10',
                    partial(_draw_over_polar, 'mean deviation, degrees', 'deviation', methods))))


def _positions(bench: Bench, bag: Path) -> list[list[PressedPosition]]:
    """The positions that each method measures."""
    presses: dict[int, list] = {}
    for _, true, estimates in bench.compare(bag, *_methods(bench)):
        if len(true.contacts or []) == 1 and all(len(estimate.contacts or []) == 1 for estimate in estimates):
            presses.setdefault(true.contacts[0].id, []).append([one.contacts[0].normal for one in (true, *estimates)])
    found: list[list[PressedPosition]] = [[], []]
    for samples in map(np.array, presses.values()):
        middle = samples[len(samples) // 8:len(samples) - len(samples) // 8]
        taken = middle[np.unique(np.linspace(0, len(middle) - 1, PAPERS.published_samples).round().astype(int))]
        for k, positions in enumerate(found, 1):
            positions.append(PressedPosition(taken[0, 0], taken[:, k]))
    return found


def _polar(normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Azimuth, rad, and polar angle, degrees, of unit normals (..., 3)."""
    return np.arctan2(normals[..., 1], normals[..., 0]), np.degrees(np.arctan2(np.hypot(normals[..., 0], normals[..., 1]), normals[..., 2]))


def _draw_positions(methods: list[list[PressedPosition]], figure) -> None:
    axes = figure.subplots(1, 2, subplot_kw={'projection': 'polar'})
    for axis, name, positions in zip(axes, (PUBLISHED, OURS), methods):
        axis.plot(*_polar(np.array([position.true for position in positions])), 'k+', markersize=9, markeredgewidth=0.8, label='specified')
        axis.plot(*_polar(np.array([position.middle for position in positions])), _MARKERS[name], color=COLOURS[name], markersize=4,
                  fillstyle='none', label=name)
        axis.set_rlim(0, 70)
    legend_of(figure, axes)


def _draw_over_polar(ordinate: str, what: str, methods: list[list[PressedPosition]], figure) -> None:
    """A line a meridian, as the paper draws them; the pole belongs to all."""
    axis = figure.subplots()
    for name, positions in zip((PUBLISHED, OURS), methods):
        meridians: dict[float, list[PressedPosition]] = {}
        for one in sorted(positions, key=lambda one: one.polar):
            meridians.setdefault(0.0 if one.polar < 1 else np.round(_polar(one.true)[0], 2), []).append(one)
        pole = meridians.pop(0.0, [])
        for some in [pole + some for some in meridians.values()] or [pole]:
            axis.plot([one.polar for one in some], [getattr(one, what) for one in some], f'{_MARKERS[name]}-', color=COLOURS[name],
                      fillstyle='none', linewidth=0.5, label=name)
    axis.set(xlabel='distance of the specified position from the pole, degrees', ylabel=ordinate)
    axis.set_ylim(bottom=0)
    legend_of(figure, [axis])


def _draw_samples(methods: list[list[PressedPosition]], figure) -> None:
    """A column a position, a row a method; degrees along the meridian and along the parallel from the specified position."""
    axes = figure.subplots(2, len(_SHOWN), sharex=True, sharey=True)
    for name, positions, row in zip((PUBLISHED, OURS), methods, axes):
        for axis, (phi, theta) in zip(row, _SHOWN):
            wanted = _direction(phi, theta)
            position = min(positions, key=lambda one: float(_angle(one.true, wanted)))
            axis.plot(*_offset(position.stated, position.true).T, '.', color=COLOURS[name], label=f'samples, {name}')
            axis.plot(*_offset(position.middle, position.true), 'k*', markersize=8, label='their mean')
            axis.plot(0, 0, 'k+', markersize=10, label='specified')
            around, polar = _polar(position.true)
            axis.set(title=f'phi {np.degrees(around) % 360:.0f}, theta {polar:.0f} degrees', aspect='equal', xlabel='along phi, degrees',
                     ylabel='along theta, degrees')
            axis.title.set_fontsize('small')
            axis.label_outer()
    legend_of(figure, axes.ravel())


def _direction(phi: float, theta: float) -> np.ndarray:
    around, polar = np.radians((phi, theta))
    return np.array([np.cos(around) * np.sin(polar), np.sin(around) * np.sin(polar), np.cos(polar)])


def _offset(normals: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """(..., 2) degrees along phi and theta of unit normals (..., 3) from an origin (3,)."""
    around, polar = _polar(origin)
    east = np.array([-np.sin(around), np.cos(around), 0.0])
    south = np.cross(east, origin)
    return np.degrees(np.stack([normals @ east, normals @ south], axis=-1))


_DYNAMIC = ('slow_taps', '0.25 s at 0.88 Hz', 'a'), ('taps', '0.078 s at 3.2 Hz', 'b')


def dynamic(bench: Bench) -> Iterator[Table]:
    """Fig 11: contacts of two durations."""
    for scene, what, letter in _DYNAMIC:
        bag = bench.bag('psd_finger', scene, PAPERS.finger_rate)
        evaluations, seen = zip(*(_tapped(bench, bag, method) for method in _methods(bench)))
        names = (('contacts reported', '%'), ('reported after the onset, median', 'ms'), ('reported after the onset, maximum', 'ms'),
                 ('contacts that are none', ''))
        rows = [Row(*name, '', *pair, cause=FALSE_CONTACTS if k == 3 else '')
                for k, (name, *pair) in enumerate(zip(names, *(_delays(evaluation) for evaluation in evaluations)))]
        yield Table('Contacts: fig 11', rows, 'The paper reports "without significant delay", and a plot.',
                    (Picture(f'fig_11{letter}', f'Sum of the outputs in contacts of {what}: fig 11 ({letter})',
                             partial(_draw_contacts, _light(bag), seen), (9.0, 5.0)),), what)


def _tapped(bench: Bench, bag: Path, method: Method) -> tuple[Evaluation, np.ndarray]:
    """The method's evaluation, and (N, 4): stamp, s, whether the object touches and whether the method reports it, and the number that the
    method gave to the contact, or -1."""
    evaluation, touching = Evaluation(), []
    for stamp, estimate, true in bench.instants(bag, *method):
        evaluation.add(stamp, estimate, true)
        number = estimate.contacts[0].id if estimate.contacts else -1
        touching.append((stamp, bool(true.contacts), bool(estimate.contacts), number))
    return evaluation, np.array(touching, float)


def false_contacts(bench: Bench) -> Iterator[Detail]:
    """When a method reports contacts that are none, and for how long."""
    found = []
    for scene, what, _ in _DYNAMIC:
        for name, method in zip((PUBLISHED, OURS), _methods(bench)):
            _, seen = _tapped(bench, bench.bag('psd_finger', scene, PAPERS.finger_rate), method)
            real = set(seen[(seen[:, 1] > 0) & (seen[:, 2] > 0), 3])
            false = [seen[seen[:, 3] == number, 0] for number in sorted(set(seen[:, 3]) - real - {-1.0})]
            near = [1e3 * np.abs(seen[seen[:, 1] > 0, 0] - stamps.mean()).min() for stamps in false]
            found.append((f'{what}, {name}', float(len(false)), mean(near), 1e3 * float(max(map(np.ptp, false), default=np.nan))))
    yield Detail(FALSE_CONTACTS, ('contacts of', 'contacts that are none', 'from a true contact, mean, ms', 'duration, maximum, ms'), found,
                 'Durations from the first to the last report: 0 is a single one.')


def _delays(evaluation: Evaluation) -> list[float]:
    """Contacts reported, %; their delay, ms, median and maximum; contacts that are none."""
    found = evaluation.summary()['touches']
    late = found['reported_after_ms']
    return [100.0 * (1 - found['never_reported'] / max(found['there'], 1)), late['median'], late['worst'], float(found['made_up'])]


def _light(bag: Path) -> np.ndarray:
    """(N, 2): stamp, s, and sum of the four outputs, V, above that of the first block, of each sample."""
    rows = []
    with BagReader(bag) as reader:
        for raw in reader.messages():
            if raw.topic.endswith('/voltages'):
                volts = np.array(decode(raw.data, raw.type_name).voltages).reshape(-1, 4).sum(axis=1)
                rows.append(np.column_stack([1e-9 * raw.stamp_ns + np.arange(len(volts)) / PAPERS.finger_rate, volts]))
    every = np.concatenate(rows)
    return every - [0.0, rows[0][:, 1].mean()]


def _draw_contacts(light: np.ndarray, methods: Sequence[np.ndarray], figure) -> None:
    """The sum of the outputs, and below it, in place of the photo-interrupter, when the object touches and what the methods report.
    methods: (N, 4) of each, as of _tapped."""
    papers, ours = methods
    onsets = ours[1:, 0][np.diff(ours[:, 1]) > 0][:2]
    if not len(onsets):
        return
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    above.plot(*light.T, 'k', linewidth=0.7)
    above.set(ylabel='sum of the four outputs, V', xlim=(onsets[0] - 0.15, onsets[-1] + 0.45))
    for level, (name, seen, column) in enumerate(((OURS, ours, 2), (PUBLISHED, papers, 2), (TRUTH, ours, 1))):
        below.fill_between(seen[:, 0], level, level + 0.8 * seen[:, column], step='post', color=COLOURS[name], linewidth=0)
    below.set(xlabel='time, s', yticks=(0.4, 1.4, 2.4), yticklabels=('ours', 'its method', 'truth'), ylabel='contact')
