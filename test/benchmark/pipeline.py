# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From image to contact region and contacts with each method: a table and a plot of error against time.

    python test/benchmark/pipeline.py [--calibrated | --calibration FILE] [--out out/benchmark] [--frames 0] [source ...]

A source is a recording with ground truth (tp_rect_drag, ...; found by TACTILE_RECORDINGS) or a scene of the simulated touchpad
(scene:ring_press). The methods alternate on each frame. Times are CPU times of one thread, medians over frames; memory is the peak of the
process, all methods together. The recordings' README describes the ground truth and what scores exclude.
"""
from __future__ import annotations

import argparse
import json
import resource
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from tactile_driver.parameters.table import defaults
from tactile_perception.calibration.files.touchpad import read_touchpad
from tactile_perception.errors import BadFrame, TactileError
from tactile_perception.evaluation.scores import f1, region_iou
from tactile_perception.parameters.touchpad import DOT_PARAMETERS, REGION_PARAMETERS
from tactile_perception.pipeline.contact_stage import ContactEstimator
from tactile_perception.dots.tracker import make_tracker
from tactile_perception.touchpad.places import DotPlaces
from tactile_perception.touchpad.sensor import Touchpad

import sources
from region_scores import contact_counts, slip_counts, true_loops

#: name: parameters that differ from the defaults. Methods with the same detection share the tracker, so that it runs once a frame.
METHODS = {
    'membrane': {},
    'paper': {'contact': 'paper'},
    "paper's dots and contact": {'contact': 'paper', 'detection': 'paper', 'numbering': 'paper'},
}
STAGES = ('dots', 'places', 'contact')
HEAD = ('source', 'method', 'contact F1', 'stick F1', 'slip F1', 'IoU', 'false frames', 'xyz mm', 'depth mm', 'force %', 'missed',
        'refused', *(f'{stage} ms' for stage in STAGES), 'total ms')
SETTLED = 0.03  # of the force: frames whose true force has converged less are excluded from force scores


@dataclass
class Score:
    """What one method has made of one source so far."""

    counts: dict = field(default_factory=lambda: {name: np.zeros(3, int) for name in ('contact', 'sticking', 'slipping')})
    overlaps: list = field(default_factory=list)
    squares: list = field(default_factory=list)
    depths: list = field(default_factory=list)
    forces: list = field(default_factory=list)
    times: list = field(default_factory=list)
    false_frames: int = 0
    missed: list = field(default_factory=list)
    refused: int = 0

    def add(self, tracks, result, truth: dict, frame: int) -> None:
        """Judge the result of one frame."""
        ids, state, there = result.region.dot_id, result.region.dot_state, truth['dot_contact'][frame]
        self.counts['contact'] += contact_counts(state > 0, truth, frame, ids)
        for name, part in zip(('sticking', 'slipping'), slip_counts(state, truth, frame, ids)):
            self.counts[name] += part
        self.false_frames += bool(not there.any() and (state > 0).any())
        self.overlaps.append(region_iou(result.region.outlines + result.region.holes, true_loops(truth, frame)))
        self.squares.append(((tracks.xyz - truth['dot_xyz'][frame][tracks.id])**2).sum(axis=1))
        self.missed.append(len(there) - len(tracks))
        if len(truth['touches'][frame]) == len(result.contacts) == 1:
            self.depths.append(result.contacts[0].depth - truth['touches'][frame][0].depth)
        if abs(truth['force'][frame][2]) > 0.1 and truth['residual'][frame] < SETTLED * abs(truth['force'][frame][2]):
            self.forces.append(100 * np.linalg.norm(result.wrench[:3] - truth['force'][frame]) / np.linalg.norm(truth['force'][frame]))

    def row(self) -> dict[str, float]:
        """The table's numbers; NaN where there was nothing to judge."""
        middle = 1e3 * np.median(self.times, axis=0) if self.times else np.full(3, np.nan)
        return dict(zip(HEAD[2:], [
            f1(*self.counts['contact']), _f1_of_true(*self.counts['sticking']), _f1_of_true(*self.counts['slipping']),
            known_mean(self.overlaps), float(self.false_frames),
            1e3 * np.sqrt(known_mean(np.concatenate(self.squares or [[]]))), 1e3 * _median(np.abs(self.depths)), _median(self.forces),
            known_mean(self.missed), float(self.refused), *middle, middle.sum()]))


def _f1_of_true(true_positive: int, false_positive: int, false_negative: int) -> float:
    """F1 score; NaN where no dot truly is of the kind: a single false one would make it 0. They count against the other kind."""
    return f1(true_positive, false_positive, false_negative) if true_positive + false_negative else np.nan


def known_mean(values) -> float:
    """Mean of those that are known; NaN of none."""
    known = np.asarray(values, float)[np.isfinite(np.asarray(values, float))]
    return float(known.mean()) if len(known) else np.nan


def _median(values) -> float:
    known = np.asarray(values, float)[np.isfinite(np.asarray(values, float))]
    return float(np.median(known)) if len(known) else np.nan


class Method:
    """The stages behind the dots of one method, and its score."""

    def __init__(self, sensor: Touchpad, camera, values: dict, water):
        self.places, self.contact = DotPlaces(sensor, camera, water), ContactEstimator(sensor, camera, values)
        self.score = Score()

    def process(self, image: np.ndarray, tracks, seconds: float, stamp: float, truth: dict, frame: int) -> None:
        """One frame from its dots on, which took seconds."""
        begin = time.thread_time()
        tracks.xyz = self.places.locate(image, tracks)
        placed = time.thread_time()
        result = self.contact.process(tracks, stamp)
        self.score.times.append([seconds, placed - begin, time.thread_time() - placed])
        self.score.add(tracks, result, truth, frame)


def run(source: sources.Source, methods: dict[str, dict] = METHODS, calibration: Path | None = None, most: int = 0) -> dict[str, Score]:
    """Scores of methods on one source, its first `most` frames where that is not 0."""
    made, trackers = {}, {}
    for name, changes in methods.items():
        values = {**defaults(REGION_PARAMETERS), **defaults(DOT_PARAMETERS), **source.parameters, **changes}
        sensor = Touchpad.from_parameters(values)
        camera = sensor.camera(source.matrix, source.distortion)
        made[name] = Method(sensor, camera, values, read_touchpad(calibration, camera) if calibration else None)
        tracker = trackers.setdefault((values['detection'], values['numbering']), (make_tracker(sensor, values), []))
        tracker[1].append(made[name])
    for frame, (stamp, image) in enumerate(source.frames(most)):
        for tracker, users in trackers.values():
            _process(tracker, users, image, stamp, source.truth, frame)
    return {name: method.score for name, method in made.items()}


def _process(tracker, users: list[Method], image: np.ndarray, stamp: float, truth: dict, frame: int) -> None:
    begin = time.thread_time()
    try:
        tracks = tracker.process(image, stamp)
    except BadFrame:
        for method in users:
            method.score.refused += 1
        return
    seconds = time.thread_time() - begin
    for method in users:
        try:
            method.process(image, tracks, seconds, stamp, truth, frame)
        except BadFrame:
            method.score.refused += 1


def table(rows: list[dict]) -> str:
    """Rows as a Markdown table."""
    lines = ['| ' + ' | '.join(HEAD) + ' |', '|' + '---|' * len(HEAD)]
    for row in rows:
        numbers = ['-' if np.isnan(row[k]) else f'{row[k]:.3g}' for k in HEAD[2:]]
        lines.append('| ' + ' | '.join([row['source'], row['method'], *numbers]) + ' |')
    return '\n'.join(lines)


def means(rows: list[dict]) -> list[dict]:
    """A row a method: the mean over sources, of those where there was something to judge."""
    return [{'source': 'mean', 'method': name, **{k: known_mean([r[k] for r in rows if r['method'] == name]) for k in HEAD[2:]}}
            for name in dict.fromkeys(r['method'] for r in rows)]


def plot(rows: list[dict], path: Path) -> None:
    """Contact F1 and region IoU of the means against time a frame, as PNG."""
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(1, 2, figsize=(9, 4), sharex=True)
    for axis, name in zip(axes, ('contact F1', 'IoU')):
        for row in rows:
            axis.plot(row['total ms'], row[name], 'o', label=row['method'])
        axis.set(xlabel='time a frame, ms', ylabel=name, ylim=(0, 1))
        axis.grid(alpha=0.3)
    axes[0].legend(fontsize='small')
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    pyplot.close(figure)


def write(rows: list[dict], out: Path) -> None:
    """pipeline.md, pipeline.json and pipeline.png in the folder out."""
    out.mkdir(parents=True, exist_ok=True)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    (out / 'pipeline.md').write_text(f'{table(rows)}\n\nLargest memory of the process: {memory:.0f} MB\n')
    numbers = [{k: None if isinstance(v, float) and np.isnan(v) else v for k, v in row.items()} for row in rows]
    (out / 'pipeline.json').write_text(json.dumps({'rows': numbers, 'memory_mb': memory}, indent=1) + '\n')
    plot([row for row in rows if row['source'] == 'mean'], out / 'pipeline.png')


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('sources', nargs='*', default=['scene:rectangle_drag', 'scene:disc_twist', 'scene:ring_press', 'scene:two_spheres'])
    parser.add_argument('--calibration', type=Path, help='calibration file; without it the known rest shape alone')
    parser.add_argument('--calibrated', action='store_true', help='fit the calibration first, to presses of a sphere on the same touchpad')
    parser.add_argument('--out', type=Path, default=Path('out/benchmark'), help='folder for pipeline.md, .json and .png')
    parser.add_argument('--frames', type=int, default=0, help='take the first so many frames of each source; 0: all')
    parser.add_argument('--method', action='append', choices=METHODS, help='only this method (may be repeated)')
    given = parser.parse_args()
    cv2.setNumThreads(1)
    rows, fitted = [], {}
    for name in given.sources:
        source = sources.open_source(name)
        if given.calibrated and source.calibration not in fitted:
            fitted[source.calibration] = sources.calibrate(source.calibration, given.out)
        calibration = fitted.get(source.calibration, given.calibration)
        for method, score in run(source, {m: METHODS[m] for m in given.method or METHODS}, calibration, given.frames).items():
            rows.append({'source': name, 'method': method, **score.row()})
            print(table(rows[-1:]).splitlines()[-1], flush=True)
    rows += means(rows)
    write(rows, given.out)
    print('\n' + (given.out / 'pipeline.md').read_text())


if __name__ == '__main__':
    try:
        main()
    except TactileError as error:
        sys.exit(str(error))
