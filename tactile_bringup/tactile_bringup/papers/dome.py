# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The experiments of the paper air_cushion_contact: tables I and II, figs 4, 5 and 7."""
from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType

import numpy as np
from scipy.spatial import cKDTree

from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_perception.core.errors import BadRecording
from tactile_perception.core.messages import stamp_seconds
from tactile_perception.press.calibration import read_touch
from tactile_perception.press.methods import make_method
from tactile_perception.press.presses import Presses
from tactile_perception.press.tools import PressReader
from tactile_perception.published.air_cushion_contact import PaperCushion, PaperCushionDetector

from .bench import Bench, Detail, Method, Row, Table, common, mean, reported, shipped
from .constants import PAPERS
from .figures import COLOURS, OURS, PUBLISHED, TRUTH, Picture, legend_of
from .sheets import MODEL, Press, estimated, fit_published, presses

PAPER = MappingProxyType({'touch': 'paper_cushion', 'detection': 'paper_cushion', 'numbering': 'sort', 'rows': 0, 'columns': 0})
#: Conditions that the paper does not give: name in the scenes' names -> width of the tip, and distance of the zones from the top.
CONDITIONS = {'near_zones': '16 mm tip', 'zones': '60 mm tip'}
FLANK, RELIEF, THRESHOLD = 'inner flank', 'change by zone', 'detection threshold'
NOTE = ('Ten zones within 70 mm of the top at 12, 20 and 28 mm; by the 16 mm tip within 35 mm at 7.5, 12.5 and 17.5 mm. The published '
        'method is calibrated there, by the same tip, at 8, 16, 24 and 32 mm, by the 16 mm tip at 5, 10, 15 and 20 mm. Ours has the '
        'calibration that ships, of the tip 60 mm wide. Errors are those at the presses that both methods report. The paper does not '
        'define accuracy, error rate and precision. Here the error rate is the mean of error over true value, as in the tables of the '
        'paper of the sheets; accuracy is what it leaves of 100 %; precision is the standard deviation of the errors.')
AXES = ('x', 'px'), ('y', 'px'), ('depth', 'mm')
#: Errors that the paper reports of its regular print, by axis.
MEAN, MAXIMUM = ('4.84', '4.04', '0.08'), ('10', '7', '0.3')


@dataclass(frozen=True)
class Stop:
    """A press at which the stage stands.

    true : x and y in the image, px, and depth, mm (3,).
    found : the same of each method; NaN where it reports none.
    """

    stamp_s: float
    true: np.ndarray
    found: tuple[np.ndarray, ...]


def near_zones(bench: Bench) -> Iterator[Table]:
    """Tables I and II: ten zones near the top pressed by a small tip, of a regular and a random print."""
    return _zones(bench, 'near_zones')


def zones(bench: Bench) -> Iterator[Table]:
    """Tables I and II: ten zones pressed by a large tip, of a regular and a random print."""
    return _zones(bench, 'zones')


def _zones(bench: Bench, condition: str) -> Iterator[Table]:
    """Ten zones pressed by the tip of the calibration, of both prints."""
    for print_ in ('regular', 'random'):
        prefix = 'air_cushion_' + ('' if print_ == 'regular' else 'random_') + condition
        yield from _tables(bench, prefix, condition, f'{CONDITIONS[condition]}, {print_} print', print_ == 'regular')


def published(bench: Bench, prefix: str, changes: Mapping = PAPER) -> Method:
    """The published method, calibrated at the zones while the tip descends."""
    params = bench.params('air_cushion', changes)
    output = params.with_name(f'{prefix}_{params.stem}_calibration.yaml')
    if not output.exists():
        bag = bench.bag('air_cushion', f'{prefix}_calibration', PAPERS.dome_rate, 180)
        fit_published('air_cushion', [bag], params, output, changes['touch'])
    return params, output


def _tables(bench: Bench, prefix: str, condition: str, what: str, regular: bool) -> Iterator[Table]:
    """Tables I and II. No calibration file of ours ships for the random print, and the paper reports no numbers of it."""
    bag, papers = bench.bag('air_cushion', prefix, PAPERS.dome_rate, 90), published(bench, prefix)
    methods = (papers, (bench.params('air_cushion', MODEL), shipped('air_cushion'))) if regular else (papers,)
    stops = _stops(_still(presses(bench, bag, *methods)), open_scene(prefix, PAPERS.dome_rate, bench.seed).camera)
    pictures = _pictures(bench, prefix, papers, stops) if regular and condition == 'near_zones' else ()
    errors = [_errors(found, true) for found, true in _judged(stops)]
    shares = [reported(np.array([stop.found[k] for stop in stops]).reshape(-1, 3)) for k in range(len(methods))]
    table_1 = []
    for name, said, lateral in (('mean error', MEAN, FLANK if condition == 'zones' else ''), ('maximum error', MAXIMUM, FLANK)):
        known = (said, (lateral, lateral, RELIEF)) if regular else ()
        table_1 += _rows(name, [one[name] for one in errors], *known)
    table_1.append(Row('presses reported', '%', '', *_pair(shares), cause=THRESHOLD if regular else ''))
    table_2 = [row for name in ('accuracy', 'error rate', 'precision') for row in _rows(name, [one[name] for one in errors])]
    yield Table('Dome: tables I and II', [*table_1, *table_2], NOTE, pictures, what)


def _rows(name: str, methods: Sequence[np.ndarray], said: Sequence[str] = ('',) * 3, causes: Sequence[str] = ('',) * 3) -> list[Row]:
    """A row an axis. methods: (3,) of each method."""
    return [Row(f'{axis}, {name}', '%' if name in ('accuracy', 'error rate') else unit, said[k], *_pair([some[k] for some in methods]),
                cause=causes[k]) for k, (axis, unit) in enumerate(AXES)]


def _pair(methods: Sequence[float]) -> tuple[float, float]:
    """Figures of the published method and of ours; NaN without ours."""
    return methods[0], methods[1] if len(methods) > 1 else np.nan


def _stops(found: Sequence[Press], camera) -> list[Stop]:
    """Presses in the image."""
    return [Stop(press.stamp_s, _in_image(press.true, camera), tuple(_in_image(one, camera) for one in press.found)) for press in found]


def _still(found: Sequence[Press]) -> list[Press]:
    """The presses at which the stage stands."""
    return [now for before, now in pairwise(found) if abs(now.true[3] - before.true[3]) < PAPERS.max_standstill]


def _in_image(press: np.ndarray, camera) -> np.ndarray:
    """Column and row, px, of the contact point, and depth, mm (3,), of position and depth (4,), m."""
    return np.append(camera.project(press[:3]), 1e3 * press[3])


def _judged(stops: Sequence[Stop]) -> list[tuple[np.ndarray, np.ndarray]]:
    """(found, true) (N, 3) of each method, of the stops that all methods report."""
    true = np.array([stop.true for stop in stops]).reshape(-1, 3)
    *found, true = common(*(np.array([stop.found[k] for stop in stops]).reshape(-1, 3) for k in range(len(stops[0].found))), true)
    return [(rows, true) for rows in found]


def _errors(found: np.ndarray, true: np.ndarray) -> dict[str, np.ndarray]:
    """Figures (3,) of x, y and depth by name, of what is found (N, 3) of the true ones (N, 3); NaN of none."""
    if not len(true):
        return dict.fromkeys(('mean error', 'maximum error', 'accuracy', 'error rate', 'precision'), np.full(3, np.nan))
    error = found - true
    rate = 100 * np.abs(error / true).mean(axis=0)
    return {'mean error': np.abs(error).mean(axis=0), 'maximum error': np.abs(error).max(axis=0), 'accuracy': 100 - rate,
            'error rate': rate, 'precision': error.std(axis=0)}


def _pictures(bench: Bench, prefix: str, method: Method, stops: Sequence[Stop]) -> tuple[Picture, ...]:
    """Figs 4 and 5, of the presses of the calibration; fig 7, of a press near the top and one far from it."""
    paper, presses_ = _read(bench.bag('air_cushion', f'{prefix}_calibration', PAPERS.dome_rate), method)
    change = 1e3 * _changes(paper, presses_)
    zone, depth = presses_.position_labels(), 1e3 * presses_.depth
    stands = np.r_[False, np.abs(np.diff(presses_.depth)) < PAPERS.max_standstill]
    curves = [_means_at_stops(depth[stands & (zone == k)], change[stands & (zone == k)]) for k in range(zone.max() + 1)]
    seen = np.linspace(change[zone >= 0].min(), change[zone >= 0].max(), 60)
    cubic = 1e3 * np.array([paper.calibration.cubic(np.array([1e-3 * x]))[0][0] for x in seen])
    deep = [stop for stop in stops if np.isclose(stop.true[2], stops[-1].true[2], atol=0.1)]
    shown = [_frame(bench.folder / prefix, stop) for stop in (deep[0], deep[len(deep) // 2])]
    return (Picture('fig_4', 'Mean change of the four largest, over the depth, of each zone (fig 4)', partial(_draw_zones, curves)),
            Picture('fig_5', 'The cubic through the changes of all zones (fig 5)',
                    partial(_draw_cubic, change[zone >= 0], depth[zone >= 0], seen, cubic)),
            Picture('fig_7', 'Images of the camera, and the contact estimated on the mesh of circles (fig 7)', partial(_draw_meshes, shown),
                    (9.0, 7.0)))


def _means_at_stops(depth: np.ndarray, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The depths, mm, at which the stage stops at a zone, and the mean change, mm, at each; depth, change: (N,) of frames."""
    stop = np.round(depth, 1)
    return np.unique(stop), np.array([change[stop == one].mean() for one in np.unique(stop)])


def _read(bag: Path, method: Method) -> tuple[PaperCushion, Presses]:
    """The published method, and the presses of a bag as it sees them."""
    reader = PressReader(method[0], '')
    reader.read(bag)
    return make_method('paper_cushion', read_touch(method[1], 'air_cushion').fitted('paper_cushion'), reader.sensor), reader.presses()


def _changes(paper: PaperCushion, seen: Presses) -> np.ndarray:
    """Mean changes (N,), m, by which the published method measures the depth; 0 where nothing changed."""
    return np.array([0.0 if one is None else one[1] for one in map(paper.measure, seen.fields)])


def _frame(bag: Path, stop: Stop) -> tuple[np.ndarray, np.ndarray, Stop]:
    """The image of a press, and the circles in it, px."""
    with BagReader(bag) as reader:
        for raw in reader.messages({next(topic for topic in reader.topics if topic.endswith('image_raw'))}):
            message = decode(raw.data, raw.type_name)
            if abs(stamp_seconds(message.header) - stop.stamp_s) < 0.5 / PAPERS.dome_rate:
                image = image_to_array(message)
                return image, PaperCushionDetector(1).detect(image).uv, stop
    raise BadRecording(f'{bag}: no image at {stop.stamp_s} s')


def _draw_zones(curves: Sequence, figure) -> None:
    axis = figure.subplots()
    for number, (depth, change) in enumerate(curves, 1):
        axis.plot(depth, change, '.-', linewidth=0.8, label=f'zone {number}')
    axis.set(xlabel='depth, mm', ylabel='mean change, mm')
    axis.legend(fontsize='small', ncols=2)


def _draw_cubic(change: np.ndarray, depth: np.ndarray, seen: np.ndarray, cubic: np.ndarray, figure) -> None:
    axis = figure.subplots()
    axis.plot(change, depth, '.', color='grey', label='presses of the calibration')
    axis.plot(seen, cubic, color=COLOURS[PUBLISHED], label='cubic, eq 5')
    axis.set(xlabel='mean change, mm', ylabel='depth, mm')
    axis.legend()


def _draw_meshes(shown: Sequence, figure) -> None:
    axes = figure.subplots(len(shown), 2)
    for (left, right), (image, circles, stop) in zip(axes, shown):
        left.imshow(image[..., ::-1])
        near = cKDTree(circles).query(circles, 6)[1][:, 1:]
        for k, others in enumerate(near):
            for other in others:
                right.plot(*circles[[k, other]].T, color='0.8', linewidth=0.6, zorder=0)
        right.plot(*circles.T, '.', color='0.5', markersize=3)
        right.plot(*stop.true[:2], 'ko', fillstyle='none', markersize=10, label=TRUTH)
        for name, found, marker in zip((PUBLISHED, OURS), stop.found, 'x+'):
            right.plot(*found[:2], marker, color=COLOURS[name], markersize=10, label=name)
        right.set(xlim=left.get_xlim(), ylim=left.get_ylim(), aspect='equal')
        for axis in (left, right):
            axis.set(xticks=[], yticks=[])
    legend_of(figure, axes.ravel())


def details(bench: Bench) -> Iterator[Detail]:
    """Where the published method's error lies; circles numbered otherwise; other thresholds; what a change says of the depth."""
    top = open_scene('air_cushion_zones', PAPERS.dome_rate, bench.seed).camera
    rows, chains, thresholds, untouched = [], [], [], []
    for condition, what in CONDITIONS.items():
        prefix = f'air_cushion_{condition}'
        bag = bench.bag('air_cushion', prefix, PAPERS.dome_rate, 90)
        for name, change in (('SORT', {}), ('the print', {'numbering': 'lattice', 'rows': 17, 'columns': 17})):
            paper, seen = _read(bag, published(bench, prefix, {**PAPER, **change}))
            found = _still(estimated(paper, seen))
            chains.append((what, name, *_mean_errors(found, top)))
            if not change:
                rows += _towards_top([press for press in found if np.isfinite(press.found[0]).all()], what)
                thresholds += [(what, *row) for row in _thresholds(paper, seen, top)]
                untouched += list(_changes(paper, seen)[~seen.touching])
    yield Detail(FLANK, ('tip', 'distance from the top, mm', 'error towards the top, mm', 'error across, mm'), rows,
                 'The camera looks up from the middle: it sees the inner flank of the dent opened, whose circles move apart, and the outer '
                 'one foreshortened. The four largest changes lie on one side of the tip, more so farther from the top.')
    yield Detail('numbers of the circles', ('tip', 'numbered by', 'x, px', 'y, px', 'depth, mm'), chains,
                 'Mean errors. The print gives the circles the numbers that SORT gives them: they are not the cause.')
    yield Detail(THRESHOLD, ('tip', 'threshold, mm', 'presses reported, %', 'x, px', 'y, px', 'depth, mm'), thresholds,
                 'Mean errors of the presses that are reported. The paper names no threshold of the mean change. In untouched frames it '
                 f'reaches {1e3 * max(untouched):.2f} mm, nearly as much as under the 16 mm tip at 5 mm.')
    yield _relief(bench)


def _mean_errors(found: Sequence[Press], camera) -> list[float]:
    """Of x and y, px, and depth, mm, of presses that are reported."""
    return _errors(*_judged(_stops(found, camera))[0])['mean error'].tolist()


def _thresholds(paper: PaperCushion, seen: Presses, camera) -> Iterator[tuple[float, ...]]:
    """Threshold, mm, presses reported, %, and mean errors of the published method: its own threshold, half of it, and none."""
    for quiet in (paper.calibration.quiet, 0.5 * paper.calibration.quiet, 0.0):
        found = _still(estimated(PaperCushion(replace(paper.calibration, quiet=quiet), paper.sensor), seen))
        yield 1e3 * quiet, reported(np.array([press.found[0] for press in found])), *_mean_errors(found, camera)


def _towards_top(found: Sequence[Press], what: str) -> list[tuple]:
    """Of zones at three distances from the top: mean distance, and mean errors towards it and across, mm."""
    position, error = (1e3 * np.array([one(press)[:2] for press in found]).reshape(-1, 2) for one in (
        lambda press: press.true, lambda press: press.found[0] - press.true))
    distance = np.hypot(*position.T)
    inwards = -(error * position).sum(1) / distance
    across = (error[:, 0] * position[:, 1] - error[:, 1] * position[:, 0]) / distance
    return [(what, mean(distance[part]), mean(inwards[part]), mean(np.abs(across[part])))
            for part in np.array_split(np.argsort(distance), 3)]


def _relief(bench: Bench) -> Detail:
    """How far the zones' changes at one depth lie apart, and what depth this is by the cubic."""
    rows = []
    for condition, what in CONDITIONS.items():
        prefix = f'air_cushion_{condition}'
        paper, presses_ = _read(bench.bag('air_cushion', f'{prefix}_calibration', PAPERS.dome_rate), published(bench, prefix))
        depth = np.round(presses_.depth, 4)
        for deep in np.unique(depth[1:][np.diff(depth) == 0]):
            fields = [field for field, at in zip(presses_.fields, depth) if at == deep > 0]
            change = np.array([one[1] for one in map(paper.measure, fields) if one is not None])
            if len(change):
                by_cubic = 1e3 * np.array([paper.calibration.cubic(np.array([x]))[0][0] for x in change])
                rows.append((what, 1e3 * deep, 1e3 * change.mean(), 1e3 * change.std(), mean(np.abs(by_cubic - 1e3 * deep))))
    return Detail(RELIEF, ('tip', 'depth, mm', 'mean change, mm', 'its standard deviation over the zones, mm',
                           'error of the cubic at its own calibration, mm'), rows,
                  'A change belongs to depths that differ from zone to zone: not even on its own calibration does one cubic reach 0.08 mm.')
