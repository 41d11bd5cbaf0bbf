# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The experiments of the paper areal_sensor_contact_position: tables 1 to 4, figs 8, 14, 16 and 17, and the Kalman filter of its abstract.

The published method is the whole chain: markers found and numbered as published, cubics, weights, Gaussians; two views are cut and joined
as published.
"""
from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType

import numpy as np

from tactile_perception.core.calibration_file import read_calibration, write_calibration
from tactile_perception.press.calibration import REST
from tactile_perception.press.presses import Presses
from tactile_perception.press.tools import PressReader, fit_markers, read_plate
from tactile_perception.published.areal_sensor_contact_position import Cubics, area_and_shift

from .bench import Bench, Method, Row, Table, common, mean, reported, shipped
from .constants import PAPERS
from .figures import COLOURS, OURS, PUBLISHED, TRUTH, Picture, legend_of

MODEL = MappingProxyType({'touch': 'model'})
PAPER = MappingProxyType({'touch': 'paper', 'detection': 'paper_areal', 'numbering': 'paper', 'stitching': 'middle'})
#: Causes, which details show.
VIEWS, DENT, STRETCHED = 'joint and tilt', 'shape of the dent', 'model of a stretched skin'


@dataclass(frozen=True)
class Press:
    """A frame with contact. true, found: position and depth (4,), m, of the stage and of each method, NaN where it reports none."""

    stamp_s: float
    true: np.ndarray
    found: tuple[np.ndarray, ...]


def presses(bench: Bench, bag: Path, *methods: Method) -> list[Press]:
    """All frames of a bag in which a tip presses."""
    return [Press(stamp, location(true.contacts), tuple(location(estimate.contacts) for estimate in estimates))
            for stamp, true, estimates in bench.compare(bag, *methods) if is_pressed(true)]


def estimated(method, seen: Presses) -> list[Press]:
    """What a method finds in the frames with contact of presses that are read already."""
    return [Press(float(k), np.append(seen.position[k], seen.depth[k]), (location(method.estimate(seen.fields[k])),))
            for k in np.flatnonzero(seen.touching)]


def is_pressed(truth) -> bool:
    """Whether a tip is at least PAPERS.min_depth deep in the truth of a frame."""
    return bool(truth.contacts) and truth.contacts[0].depth >= PAPERS.min_depth


def location(contacts) -> np.ndarray:
    """Position and depth (4,), m, of the first contact."""
    return np.append(contacts[0].position, contacts[0].depth) if contacts else np.full(4, np.nan)


def errors(found: Sequence[Press]) -> list[np.ndarray]:
    """Errors (N, 3) of x, y and depth, mm, of each method; NaN where it reports nothing."""
    return [1e3 * np.array([press.found[k] - press.true for press in found]).reshape(-1, 4)[:, [0, 1, 3]]
            for k in range(len(found[0].found) if found else 0)]


def fit_published(sensor: str, bags: list[Path], params: Path, output: Path, method: str, plate: Path | None = None) -> None:
    """Write a calibration file, output, that holds a published method as the paper has it; arguments as of fit_markers, whose errors
    it raises."""
    fit_markers(PressReader(params), bags, output, plate=plate, only=method)
    # The guard against a start under a contact is ours; the published method has none.
    file = read_calibration(output, sensor)
    file.fitted.pop(REST, None)
    write_calibration(output, file)


def published(bench: Bench, sensor: str, prefix: str, changes: Mapping = PAPER) -> Method:
    """The published method, calibrated by the scenes whose names begin with the prefix."""
    params = bench.params(sensor, changes)
    output = params.with_name(f'{prefix}_{params.stem}_calibration.yaml')
    if not output.exists():
        fit_published(sensor, [bench.bag(sensor, f'{prefix}_markers', PAPERS.sheet_rate, 60)], params, output, changes['touch'],
                      bench.bag(sensor, f'{prefix}_plate', PAPERS.sheet_rate))
    return params, output


def ours(bench: Bench, sensor: str, prefix: str) -> Method:
    """Ours: of the usual specimen the calibration that ships, of another one by the presses that weigh the cubics of the paper's."""
    params, output = bench.params(sensor, MODEL), bench.folder / f'{prefix}_model_calibration.yaml'
    if prefix == sensor:
        return params, shipped(sensor)
    if not output.exists():
        fit_markers(PressReader(params), [bench.bag(sensor, f'{prefix}_markers', PAPERS.sheet_rate, 60)], output, only='model')
    return params, output


def _rows(found: Sequence[Press], reported_by_paper: tuple[str, str], causes: tuple[str, str] = ('', '')) -> list[Row]:
    """Mean errors, mm, of x and y together, as the paper takes the mean of its tables, and of depth; the share of the presses that are
    reported, %. Errors are those at presses that both methods report."""
    each = errors(found)
    numbers = [means(rows) for rows in common(*each)]
    return [Row('x and y, mean error', 'mm', reported_by_paper[0], *(one[0] for one in numbers), cause=causes[0]),
            Row('depth, mean error', 'mm', reported_by_paper[1], *(one[1] for one in numbers), cause=causes[1]),
            Row('presses reported', '%', '', *(reported(rows) for rows in each))]


def means(error: np.ndarray) -> tuple[float, float]:
    """Mean errors of x and y together, and of depth, mm, of errors (N, 3)."""
    return mean(np.abs(error[:, :2])), mean(np.abs(error[:, 2]))


#: The specimens of each sensor: prefix of the scenes' names -> what it is.
SINGLE = {'areal_single_paper': 'the paper\'s box', 'areal_single': 'near camera, uneven light'}
DUAL = {'areal_dual_paper': 'thick skin', 'areal_dual': 'stretching skin'}


def one_camera(bench: Bench) -> Iterator[Table]:
    """Table 1: three positions, each pressed three times; the Kalman filter."""
    sensor = 'areal_single'
    size = _sheet_size(bench, sensor)
    for prefix, what in SINGLE.items():
        methods = published(bench, sensor, prefix), ours(bench, sensor, prefix)
        found = presses(bench, bench.bag(sensor, f'{prefix}_table_1', PAPERS.sheet_rate), *methods)
        pictures = [Picture(f'fig_14_{prefix}', f'Contact positions, one camera, {what} (fig 14)', partial(_draw_positions, found, size))]
        if prefix != sensor:
            pictures.append(_polynomials(bench, sensor, prefix))
        yield Table('One camera: table 1', _rows(found, ('1.675', '0.84')),
                    'Three positions and depths (10, 7, 13 mm), three times each.', tuple(pictures), what)
    yield _filtered(bench)


def _filtered(bench: Bench) -> Table:
    """The Kalman filter: presses and drags of one camera at video rate, with and without it."""
    sensor = 'areal_single'
    params, calibration = published(bench, sensor, 'areal_single_paper')
    smooth = bench.params(sensor, {**PAPER, 'paper.kalman': True})
    bag = bench.bag(sensor, 'areal_single_paper_motion', PAPERS.hold_rate, 90)
    found = presses(bench, bag, (params, calibration), (smooth, calibration))
    stands = (np.abs(np.diff([press.true for press in found], axis=0)) < 1e-6).all(axis=1)
    numbers = [(*means(error), mean(np.hypot(*np.diff(error[:, :2], axis=0).T)[stands])) for error in errors(found)]
    names = ('x and y, mean error', 'depth, mean error', 'change of x and y per frame while the tip stands, mean')
    return Table('One camera: the Kalman filter', [Row(name, 'mm', '', *pair) for name, *pair in zip(names, *numbers)],
                 'Both columns are the paper\'s method, on presses and a drag at 30 frames/s; "ours" has the Kalman filter that its '
                 'abstract names, too (parameter `paper.kalman`). The paper gives no variances of it.')


def two_cameras(bench: Bench) -> Iterator[Table]:
    """Tables 2 and 3: nine positions at 1, 2, 3 mm; table 4: paths of known length."""
    sensor = 'areal_dual'
    size = _sheet_size(bench, sensor)
    for prefix, what in DUAL.items():
        methods = published(bench, sensor, prefix), ours(bench, sensor, prefix)
        is_thin = prefix == sensor
        found = presses(bench, bench.bag(sensor, f'{prefix}_table_2', PAPERS.sheet_rate), *methods)
        yield Table('Two cameras: tables 2 and 3',
                    _rows(found, ('0.63', '0.06'), (DENT if is_thin else VIEWS, DENT)),
                    f'Nine positions at depths of 1, 2 and 3 mm. The paper reports 6.3 px, at {PAPERS.px_per_mm:g} px a mm.',
                    (Picture(f'fig_16_{prefix}', f'Contact positions, two cameras, {what} (fig 16)',
                             partial(_draw_positions, found, size)),), what)
        found = presses(bench, bench.bag(sensor, f'{prefix}_table_4', PAPERS.sheet_rate), *methods)
        over = [ratios(found, k) for k in (0, 1)]
        yield Table('Two cameras: table 4', [
            Row('reported over true displacement, mean', '', '1.03', *map(mean, over), ideal=1.0, cause=DENT if is_thin else ''),
            Row('its standard deviation', '', '0.053', *(float(np.nanstd(one)) if np.isfinite(one).any() else np.nan for one in over),
                cause=VIEWS if is_thin else '')],
            f'Four paths, by x and y. The paper reports 10.28 px a mm, standard deviation 0.53, at {PAPERS.px_per_mm:g} px a mm.',
            (Picture(f'fig_17_{prefix}', f'Paths, two cameras, {what} (fig 17)', partial(_draw_paths, found, size), (9.0, 6.5)),), what)


PATHS = ((0, 1), (2, 3), (4, 5), (6, 7, 8))  # numbers of the presses on each path of table 4


def ratios(found: Sequence[Press], method: int) -> np.ndarray:
    """Displacement that a method reports over the true one, of each leg of the paths, along x and y."""
    legs = [leg for path in PATHS for leg in zip(path, path[1:]) if leg[1] < len(found)]
    return np.abs([(found[b].found[method] - found[a].found[method])[:2] / (found[b].true - found[a].true)[:2] for a, b in legs]).ravel()


def _draw_positions(found: Sequence[Press], size: tuple[float, float], figure) -> None:
    """The sheet of a size, m, seen from above: where the tip is, and where each method reports it."""
    axis = figure.subplots()
    for name, positions, marker in ((TRUTH, [press.true for press in found], 'o'), (PUBLISHED, [press.found[0] for press in found], 'x'),
                                 (OURS, [press.found[1] for press in found], '+')):
        x, y = 1e3 * np.array(positions).reshape(-1, 4).T[:2]
        axis.plot(x, y, marker, color=COLOURS[name], fillstyle='none', markersize=9 if name == TRUTH else 7, label=name)
    axis.grid(linewidth=0.3)
    _show_sheet(axis, size)
    legend_of(figure, [axis])


def _sheet_size(bench: Bench, sensor: str) -> tuple[float, float]:
    """Width and height, m."""
    return PressReader(bench.params(sensor, MODEL), '').sensor.size


def _show_sheet(axis, size: tuple[float, float]) -> None:
    """Axes as large as the sheet, mm; size: m."""
    x, y = 500 * size[0], 500 * size[1]
    axis.set(xlabel='x, mm', ylabel='y, mm', xlim=(-x, x), ylim=(-y, y), aspect='equal')


def _draw_paths(found: Sequence[Press], size: tuple[float, float], figure) -> None:
    """A panel a path, from press to press, with the order of the presses and the true distances along x and y, mm."""
    axes = figure.subplots(2, 2).ravel()
    for axis, path, letter in zip(axes, PATHS, 'abcd'):
        some = [found[k] for k in path if k < len(found)]
        for name, positions in ((TRUTH, [press.true for press in some]), (PUBLISHED, [press.found[0] for press in some]),
                             (OURS, [press.found[1] for press in some])):
            x, y = 1e3 * np.array(positions).reshape(-1, 4).T[:2]
            axis.plot(x, y, 'o--', color=COLOURS[name], fillstyle='none', linewidth=3.0 if name == TRUTH else 1.0,
                      markersize=10 if name == TRUTH else 6, label=name)
        for number, press in enumerate(some, 1):
            axis.annotate(f'{number}', 1e3 * press.true[:2], (7, 7), textcoords='offset points')
        legs = (1e3 * (b.true - a.true) for a, b in pairwise(some))
        axis.set_title(f'({letter}) {", then ".join(f"x {x:+.0f}, y {y:+.0f} mm" for x, y, *_ in legs)}', fontsize='small')
        _show_sheet(axis, size)
    legend_of(figure, axes)


def _plate_of(bench: Bench, sensor: str, prefix: str):
    """Presses of the plate, in the published method's chain."""
    params = published(bench, sensor, prefix)[0]
    reader = PressReader(params, '')
    return read_plate(bench.bag(sensor, f'{prefix}_plate', PAPERS.sheet_rate), reader)


def _polynomials(bench: Bench, sensor: str, prefix: str) -> Picture:
    """Fig 8: area and displacement of a marker over the plate's depth, and the cubics through them."""
    plate = _plate_of(bench, sensor, prefix)
    area, shift = (np.stack(values) for values in zip(*map(area_and_shift, plate.fields)))
    rest = np.hypot(*np.nanmedian([field.rest for field in plate.fields], axis=0).T)
    markers = int(np.nanargmin(rest)), int(np.nanargmin(np.abs(rest - 0.5 * np.nanmax(rest)))), int(np.nanargmax(rest))
    curves = [(name, [(rest[k], values[:, k]) for k in markers]) for name, values in (
        ('area over untouched area', area), ('displacement, mm', 1e3 * shift))]
    return Picture('fig_8', 'Area and displacement of three markers over the depth of the plate, and their cubics (fig 8)',
                   partial(_draw_polynomials, plate.depth, curves), (9.0, 4.5))


def _draw_polynomials(depth: np.ndarray, curves: Sequence, figure) -> None:
    axes = figure.subplots(1, 2)
    for axis, (name, markers) in zip(axes, curves):
        for k, (distance, values) in enumerate(markers):
            axis.plot(values, 1e3 * depth, 'o', color=f'C{k}', markersize=4, label=f'marker {1e3 * distance:.0f} mm from the centre')
            cubic, seen = Cubics.fit(values[:, None], depth), np.linspace(np.nanmin(values), np.nanmax(values), 50)
            axis.plot(seen, 1e3 * np.array([cubic(np.array([x]))[0][0] for x in seen]), color=f'C{k}', linewidth=1.0)
        axis.set(xlabel=name, ylabel='depth of the plate, mm')
    legend_of(figure, axes)
