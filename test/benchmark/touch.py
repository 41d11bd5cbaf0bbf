# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From image to contact and wrench with each method, published ones included, and two stitched views: a table of errors and times.

    python test/benchmark/touch.py [--out out/benchmark] [--frames 0] [source ...]

A source is as, ad or ac (recordings of a sheet under one camera, a sheet under two cameras, a cushion; found by TACTILE_RECORDINGS) or
areal_single, areal_dual or air_cushion (the simulated sensors, which ship: also other tips, drags and two contacts). Each is calibrated by
presses of one tip and tested on other scenes. The methods alternate on each frame, in changing order. Times are CPU times of one thread,
medians over frames; a method with its own marker detection has its own tracker. The first row of the table of stitching is the distance of
markers at rest from their true positions, after the best translation, rotation and scale.
"""
from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
from tactile_driver.stitching.calibration import Stitching
from tactile_driver.stitching.methods import STITCHERS
from tactile_perception.errors import BadFrame, TactileError
from tactile_perception.markers.methods import make_method, methods_for
from tactile_perception.markers.touches.region import region_of
from tactile_perception.markers.touches.tracker import TouchTracker
from tactile_perception.markers.view.camera_views import view_maker
from tactile_perception.markers.view.marker_field import RestMarkers
from tactile_perception.markers.view.sensor import MARKER_SENSORS, MarkerSensor
from tactile_perception.parameters.file import read_parameters
from tactile_perception.parameters.markers import MARKER_SENSOR_PARAMETERS
from tactile_perception.parameters.touchpad import DOT_PARAMETERS
from tactile_perception.dots.tracker import make_tracker
from tactile_perception.tools.calibrate.markers import PressReader, fit_wrench
from tactile_perception.tools.calibrate.stitching import find_stitching
from tactile_perception.touchpad.sensor import Touchpad, camera_pose

import touch_sources
from touch_scores import HEAD, TouchScore

PAPERS = {'paper': 'paper_areal', 'paper_cushion': 'paper_cushion'}  # contact method: marker detection of the same paper
STITCH_HEAD = ('pair', 'method', 'markers', 'off mean mm', 'off 95 % mm', 'stitching ms')
ROW_HEAD = ('source', 'method', *HEAD)
_STITCHED = 60  # repetitions per pair and method
_TIP = 0.008  # m, tip radius for the region's outline


@dataclass
class Calibrated:
    """What one way to find markers makes of the calibration presses. methods: name -> numbers; wrench: of fit_wrench."""

    parameters: Path
    sensor: MarkerSensor
    stitching: Stitching | None
    methods: dict
    wrench: tuple[float, dict] | None


def calibrate(source: touch_sources.Source, detection: str, names: list[str]) -> Calibrated:
    """Fit the methods named, with markers found as detection says ('': as the source's parameters say)."""
    parameters = source.with_detection(detection)
    reader = PressReader(parameters, '')
    fit = find_stitching([source.calibration], parameters, reader.sensor, '')
    reader.stitching = fit and fit.stitching
    reader.read(source.calibration)
    presses, table = reader.presses(), methods_for(reader.sensor)
    fitted = {name: table[name].fit(presses, reader.sensor) for name in names}
    return Calibrated(parameters, reader.sensor, reader.stitching, fitted, fit_wrench(presses, reader, fitted))


class Chain:
    """Markers by one detection, and what the methods that read them say of each frame; scores: by method, added to."""

    def __init__(self, known: Calibrated, frames: touch_sources.Frames, scores: dict[str, TouchScore]):
        values = read_parameters(known.parameters, 'dot_tracker_node', DOT_PARAMETERS)
        pose = camera_pose(read_parameters(known.parameters, 'contact_point_node', MARKER_SENSOR_PARAMETERS))
        stitching = known.stitching and known.stitching.to_dict()
        self._sensor, self._scores = known.sensor, scores
        self._tracker = make_tracker(Touchpad.from_parameters(values), values)
        self._rest = RestMarkers(known.sensor.rows * known.sensor.columns,
                                 lambda uv: view_maker(known.sensor, frames.matrices, stitching, pose)(uv))
        self._methods = {name: (make_method(name, numbers, known.sensor), TouchTracker()) for name, numbers in known.methods.items()}
        self._stiffness = known.wrench[0] if known.wrench else np.nan
        self._turn = 0

    def process(self, frame: touch_sources.Frame) -> None:
        """One frame by all methods, each first in its turn."""
        try:
            tracks, finding = _timed(lambda: self._tracker.process(frame.image, frame.stamp))
            field, placing = _timed(lambda: self._rest.field(tracks))
        except BadFrame:
            for score in self._scores.values():
                score.refused += 1
            return
        self._turn += 1
        for name in np.roll(list(self._methods), self._turn).tolist():
            method, tracker = self._methods[name]
            touches, telling = _timed(lambda: method.estimate(field))
            wrench = self._stiffness * touches[0].wrench if len(touches) == 1 else np.full(6, np.nan)
            _, following = _timed(lambda: self._follow(tracker, touches, field, frame.stamp))
            self._scores[name].add(touches, wrench, frame.contacts, frame.wrench, [finding, placing, telling, following])

    def _follow(self, tracker: TouchTracker, touches: list, field, stamp: float) -> None:
        """Numbers, filter and region: part of the time, but not judged."""
        region_of([touch.estimate for touch in tracker.process(touches, stamp)], field, self._sensor, _TIP)


def _timed(work: Callable):
    begin = time.thread_time()
    made = work()
    return made, time.thread_time() - begin


def calibrate_all(source: touch_sources.Source) -> dict[str, Calibrated]:
    """All methods of a source, by what is added to their names: nothing, or whose markers they read."""
    names = list(methods_for(MARKER_SENSORS[source.type]))
    ways = {'': ('', names)} | {", paper's markers": (PAPERS[name], [name]) for name in names if name in PAPERS}
    return {suffix: calibrate(source, detection, fitted) for suffix, (detection, fitted) in ways.items()}


def run(source: touch_sources.Source, ready: dict[str, Calibrated], most: int = 0) -> dict[str, TouchScore]:
    """Scores by method on the source's tests, on the first `most` frames of each where that is not 0; ready: of calibrate_all."""
    scores = {suffix: {name: TouchScore(known.sensor, source.moving) for name in known.methods} for suffix, known in ready.items()}
    for test in source.tests:
        frames = touch_sources.Frames(test, source.parameters, ready[''].stitching)
        chains = [Chain(known, frames, scores[suffix]) for suffix, known in ready.items()]
        for frame in islice(frames, most or None):
            for chain in chains:
                chain.process(frame)
    return {name + suffix: score for suffix, found in scores.items() for name, score in found.items()}


def stitch_rows(name: str) -> list[dict]:
    """Where markers at rest appear in a picture stitched by each method, and the time of a thread that stitching takes."""
    pair, sensor = touch_sources.untouched_pair(name), touch_sources.sensor_of(name)
    stitchers = {method: touch_sources.stitcher_of(pair, sensor, method) for method in STITCHERS}
    times = [[_timed(lambda: stitcher.stitch(*pair.images))[1] for stitcher in stitchers.values()] for _ in range(_STITCHED)]
    rows = []
    for (method, stitcher), middle in zip(stitchers.items(), 1e3 * np.median(times, axis=0)):
        off = 1e3 * touch_sources.stitch_errors(pair, sensor, stitcher)
        rows.append({'pair': name, 'method': method, **dict(zip(STITCH_HEAD[2:], (len(off), off.mean(), np.percentile(off, 95), middle)))})
    return rows


def table(rows: list[dict], head: tuple) -> str:
    """Rows as a Markdown table."""
    lines = ['| ' + ' | '.join(head) + ' |', '|' + '---|' * len(head)]
    return '\n'.join(lines + ['| ' + ' | '.join(_said(row[name]) for name in head) + ' |' for row in rows])


def _said(value) -> str:
    return value if isinstance(value, str) else '-' if np.isnan(value) else f'{value:.3g}'


def write(rows: list[dict], stitched: list[dict], out: Path) -> None:
    """touch.md and touch.json in the folder out."""
    out.mkdir(parents=True, exist_ok=True)
    parts = [table(rows, ROW_HEAD)] + ([table(stitched, STITCH_HEAD)] if stitched else [])
    (out / 'touch.md').write_text('\n\n'.join(parts) + '\n')
    plain = [[{name: None if _said(value) == '-' else value for name, value in row.items()} for row in part] for part in (rows, stitched)]
    (out / 'touch.json').write_text(json.dumps({'rows': plain[0], 'stitching': plain[1]}, indent=1) + '\n')


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('sources', nargs='*', default=list(MARKER_SENSORS))
    parser.add_argument('--out', type=Path, default=Path('out/benchmark'), help='folder for touch.md and touch.json')
    parser.add_argument('--bags', type=Path, help='folder where bags are kept for the next time; else they are made anew')
    parser.add_argument('--frames', type=int, default=0, help='take the first so many frames of each test; 0: all')
    given = parser.parse_args()
    cv2.setNumThreads(1)
    rows, stitched = [], []
    with TemporaryDirectory() as folder:
        for name in given.sources:
            source = touch_sources.open_source(name, given.bags or Path(folder))
            stitched += stitch_rows(name) if source.type == 'areal_dual' else []
            for method, score in run(source, calibrate_all(source), given.frames).items():
                rows.append({'source': name, 'method': method, **score.row()})
                print(table(rows[-1:], ROW_HEAD).splitlines()[-1], flush=True)
            write(rows, stitched, given.out)
    print('\n' + (given.out / 'touch.md').read_text())


if __name__ == '__main__':
    try:
        main()
    except TactileError as error:
        sys.exit(str(error))
