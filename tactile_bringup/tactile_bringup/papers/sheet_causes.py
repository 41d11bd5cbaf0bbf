# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What causes the errors of the published method of sheets: one part of its chain is changed at a time."""
from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np

from tactile_driver.simulation.sensors.scenes import open_dual_scene
from tactile_driver.simulation.truth import TruthFrame
from tactile_perception.bags.stitched_bag import stitching_in
from tactile_perception.common.marker_sensor import MarkerSensor
from tactile_perception.core.calibration_file import read_calibration
from tactile_perception.press.field import MarkerField
from tactile_perception.press.presses import Presses
from tactile_perception.press.tools import PressReader
from tactile_perception.published.areal_sensor_contact_position import PaperTouch, calibrate_paper, grid_point

from .bench import Bench, Detail, mean, reported
from .constants import PAPERS
from .sheets import (
    DENT,
    DUAL,
    PAPER,
    SINGLE,
    STRETCHED,
    VIEWS,
    Press,
    errors,
    estimated,
    is_pressed,
    location,
    means,
    ours,
    presses,
    published,
    ratios,
)

#: Links of the published method's chain, one of which is exchanged for ours at a time.
_LINKS = {'as published': {}, 'markers numbered as ours': {'numbering': 'lattice'}, 'markers found as ours': {'detection': 'blobs'}}
_ERRORS = 'x and y, mean error, mm', 'depth, mean error, mm'
_PATHS = 'table 4: reported over true displacement', 'its standard deviation'
_SCENES = 'plate', 'markers', 'table_2', 'table_4'


def one_camera_details(bench: Bench) -> Iterator[Detail]:
    """One camera: the published method with one part of its chain exchanged."""
    yield _links(bench, 'areal_single', SINGLE, _LINKS, 'table_1', 'links of the chain, one camera')


def two_cameras_details(bench: Bench) -> Iterator[Detail]:
    """Two cameras: one part of the chain exchanged, or given the truth; the equations on true depths of all markers."""
    yield _links(bench, 'areal_dual', DUAL, _LINKS | {'views stitched as ours': {'stitching': 'plane'}}, 'table_2',
                 'links of the chain, two cameras')
    seen = {what: _recordings(bench, prefix) for prefix, what in DUAL.items()}
    sensor = PressReader(bench.params('areal_dual', PAPER), '').sensor
    given = [(what, *row) for what, recordings in seen.items() for row in _with_truth(recordings, sensor)]
    lost = [int(np.isnan([field.shift[:, 0] for field in recordings[2].presses.fields]).all(axis=0).sum()) for recordings in seen.values()]
    head = 'specimen', 'chain', 'x and y away from the joint, mm', 'x and y at the joint, mm', *_ERRORS[1:], *_PATHS
    yield Detail(VIEWS, head, given,
                 'Mean errors. Six of the nine positions of table 2 lie away from the joint of the two views, three at it. There the cut '
                 f'divides markers: {" and ".join(map(str, lost))} of the {sensor.rows * sensor.columns} of the two skins are found in no '
                 'frame, and the Gaussians have fewer depths. Beside the tip the skin is tilted, and a camera that looks at it obliquely '
                 'sees a tilted marker larger or smaller at the same depth. The weights of equation 5 come from the marker under the tip, '
                 'which is not tilted.')
    rows = [(f'true, {what}', *_of_depths(bench, prefix, _true_dent)) for prefix, what in DUAL.items()]
    width = rows[0][3] * sensor.pitch[0]
    rows.append(('a Gaussian dent', *_of_depths(bench, next(iter(DUAL)), partial(_gaussian_dent, width))))
    head = ('depths of all markers', *_ERRORS, 'width of the dent at half its depth, pitches', *_PATHS)
    yield Detail(DENT, head, rows,
                 'No camera is in this run: equations 8 to 13 get the depths of all markers. The last row has Gaussian dents, as wide as '
                 'the bells of the thick skin.')
    yield _misfit(bench)


def _misfit(bench: Bench) -> Detail:
    """How well the model of ours fits the presses of its own calibration."""
    rows = []
    for prefix, what in DUAL.items():
        held_out = read_calibration(ours(bench, 'areal_dual', prefix)[1], 'areal_dual').residuals['model']
        missed = 100 * held_out['missed'] / held_out['presses']
        rows.append((what, missed, 1e3 * held_out['place_mean'], 1e3 * held_out['depth_mean']))
    return Detail(STRETCHED, ('specimen', 'presses not found, %', 'position, mean error, mm', 'depth, mean error, mm'), rows,
                  'Ours at positions that are held out of its own calibration. Its model is a stretched membrane; the thick skin bends, on '
                  'a layer that holds it.')


def _links(bench: Bench, sensor: str, specimens: Mapping, changes: Mapping, scene: str, title: str) -> Detail:
    """The published method with each of the changes of its parameters, on each specimen."""
    rows = []
    for prefix, what in specimens.items():
        bag = bench.bag(sensor, f'{prefix}_{scene}', PAPERS.sheet_rate)
        for name, change in changes.items():
            found, = errors(presses(bench, bag, published(bench, sensor, prefix, {**PAPER, **change})))
            rows.append((what, name, *means(found), reported(found)))
    return Detail(title, ('specimen', 'chain', *_ERRORS, 'presses reported, %'), rows)


@dataclass(frozen=True)
class _Recording:
    """Presses of a bag as the published chain sees them, and the true positions of the markers in each of them.

    markers : (K, 3), m, of each press.
    rest : (K, 3), m, untouched.
    """

    presses: Presses
    markers: Sequence[np.ndarray]
    rest: np.ndarray

    def changed(self, change: Callable[[MarkerField, np.ndarray, np.ndarray], MarkerField]) -> Presses:
        """The presses with changed fields."""
        fields = tuple(change(field, now, self.rest) for field, now in zip(self.presses.fields, self.markers))
        return replace(self.presses, fields=fields)


def _as_seen(field: MarkerField, _now: np.ndarray, _rest: np.ndarray) -> MarkerField:
    return field


def _flat_areas(field: MarkerField, now: np.ndarray, _rest: np.ndarray) -> MarkerField:
    """The areas that the markers have at their true depths if they are not tilted."""
    height = -field.camera_centre[:, 2]
    return replace(field, growth=2 * np.log(height / (height + now[:, 2])))


def _true_rest(field: MarkerField, _now: np.ndarray, rest: np.ndarray) -> MarkerField:
    """The true untouched positions, in place of those by one scale and one origin of the joined picture."""
    return replace(field, rest=rest[:, :2])


def _both(field: MarkerField, now: np.ndarray, rest: np.ndarray) -> MarkerField:
    return _true_rest(_flat_areas(field, now, rest), now, rest)


#: What is true in the published method's chain, at its calibration and at the presses.
_TRUE = {'as published': _as_seen, 'true untouched positions of the markers': _true_rest,
         'areas of markers that are not tilted': _flat_areas, 'both': _both}


def _recordings(bench: Bench, prefix: str) -> list[_Recording]:
    """The scenes of a specimen as the published chain sees them."""
    params, calibration = published(bench, 'areal_dual', prefix)
    return [_recorded(bench, f'{prefix}_{scene}', params, calibration) for scene in _SCENES]


def _with_truth(recordings: Sequence[_Recording], sensor: MarkerSensor) -> Iterator[tuple]:
    """Of the chain with parts that are true: its name; mean errors, mm, of x and y away from the joint and at it, and of depth; mean and
    standard deviation of table 4."""
    for name, change in _TRUE.items():
        plate, markers, *judged = (recording.changed(change) for recording in recordings)
        method = PaperTouch(calibrate_paper(replace(markers, plate=plate), sensor), sensor)
        table_2, table_4 = (estimated(method, some) for some in judged)
        error, ratio = *errors(table_2), ratios(table_4, 0)
        at_joint = np.array([abs(press.true[0]) < sensor.pitch[0] for press in table_2])
        yield (name, *(means(error[part])[0] for part in (~at_joint, at_joint)), means(error)[1], mean(ratio), float(np.nanstd(ratio)))


def _recorded(bench: Bench, scene: str, params, calibration) -> _Recording:
    """A scene as the published chain sees it, frame by frame."""
    reader = PressReader(params, '')
    reader.stitching = stitching_in(calibration, 'areal_dual')
    reader.read(bench.bag('areal_dual', scene, PAPERS.sheet_rate))
    seen, truth = reader.presses(), _played(scene, bench.seed)[1]
    known = np.array([[*true.contacts[0].position, true.contacts[0].depth] if true.contacts else np.zeros(4) for true in truth])
    frames = [int(np.abs(known - np.nan_to_num([*position, depth])).sum(axis=1).argmin())
              for position, depth in zip(seen.position, seen.depth)]
    return _Recording(seen, [truth[frame].dot_xyz for frame in frames], truth[0].dot_xyz)


@lru_cache(maxsize=len(DUAL) * len(_SCENES))
def _played(name: str, seed: int) -> tuple[tuple[int, int], list[TruthFrame]]:
    """Rows and columns of the markers, and the truth of each frame of a scene."""
    scene = open_dual_scene(name, PAPERS.sheet_rate, seed)
    return (scene.rows, scene.columns), [scene.observe(number).truth for number in range(scene.frames)]


def _of_depths(bench: Bench, prefix: str, dent: Callable[[TruthFrame], np.ndarray]) -> tuple[float, ...]:
    """By eqs 8 to 13 from depths of all markers: mean errors, mm, of x and y and of depth, and the width of the dents, pitches, of table 2;
    mean and standard deviation of reported over true displacement of table 4.

    dent : from the truth of a frame to the depths (K,), m, of the markers.
    """
    (found, widths), (paths, _) = (_by_depths(bench, f'{prefix}_{scene}', dent) for scene in ('table_2', 'table_4'))
    ratio = ratios(paths, 0)
    return *means(*errors(found)), mean(widths), mean(ratio), float(np.nanstd(ratio))


def _by_depths(bench: Bench, name: str, dent: Callable[[TruthFrame], np.ndarray]) -> tuple[list[Press], list[float]]:
    """Presses of a scene by eqs 8 to 13 from depths of all markers, and the width of each dent, pitches."""
    shape, frames = _played(name, bench.seed)
    found, widths = [], []
    rest = frames[0].dot_xyz[:, :2].reshape(*shape, 2)
    for number, truth in enumerate(frames):
        if is_pressed(truth):
            depth = dent(truth).reshape(shape)
            point = grid_point(depth, rest)
            seen = np.array([*point.position, -point.depth, point.depth])
            found.append(Press(number / PAPERS.sheet_rate, location(truth.contacts), (seen,)))
            widths.append(_width(depth))
    return found, widths


def _true_dent(truth: TruthFrame) -> np.ndarray:
    return -truth.dot_xyz[:, 2]


def _gaussian_dent(width: float, truth: TruthFrame) -> np.ndarray:
    """A Gaussian as deep as the contact; width: m, at half its depth."""
    contact = truth.contacts[0]
    distance = np.hypot(*(truth.dot_xyz - contact.position)[:, :2].T)
    return contact.depth * 0.5 ** np.square(2 * distance / width)


def _width(depth: np.ndarray) -> float:
    """Width, pitches, of a dent at half its depth, on the row of the deepest marker; NaN where it reaches the border."""
    row, column = np.unravel_index(depth.argmax(), depth.shape)
    line, half = depth[row], depth[row, column] / 2
    ends = []
    for side in (line[column:], line[column::-1]):
        below = np.flatnonzero(side < half)
        if not len(below):
            return np.nan
        k = below[0]
        ends.append(k - (half - side[k]) / (side[k - 1] - side[k]))
    return float(sum(ends))
