# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact regions and states with each method on recordings with ground truth: a table of error against time.

    python test/benchmark/regions.py [--noise 20e-6] [--output table.md] [recording ...]

Recordings are found by TACTILE_RECORDINGS. Positions are measured along the camera's rays with noise of the given standard deviation (as
from colour or area), so that the table evaluates the contact stage alone; the methods alternate on each frame and are timed separately.
Positions are filtered by the membrane model, except for `paper, measured`. `labels` draws the region of the true labels.
"""
from __future__ import annotations

import argparse
import json
import os
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from tactile_perception.common.contour import label_score
from tactile_perception.common.dot_grid import to_grid
from tactile_perception.common.spherical_cap import Cap
from tactile_perception.errors import TactileError
from tactile_perception.evaluation.scores import f1, region_iou
from tactile_perception.touchpad.contact.methods import DotClassification, make_method
from tactile_perception.touchpad.contact.region import ContactDots, describe, find_regions
from tactile_perception.touchpad.contact.tracker import ContactTracker
from tactile_perception.touchpad.membrane.forces import MembraneMaterial
from tactile_perception.touchpad.membrane.solver import Membrane

sys.path.insert(0, str(Path(__file__).parent))
from region_scores import contact_counts, place_errors, slip_counts, true_loops  # noqa: E402

ROWS = COLUMNS = 23
PAPER = {'paper.d_max': 0.91e-3, 'paper.delta_d': 0.19e-3}
HEAD = ('recording', 'method', 'contact F1', 'sticking F1', 'slipping F1', 'IoU', 'centroid mm', 'depth mm', 'area ratio', 'places ms',
        'states ms', 'region ms')


@dataclass
class Score:
    """What one method has made of one recording so far."""

    contact: np.ndarray = field(default_factory=lambda: np.zeros(3, int))
    sticking: np.ndarray = field(default_factory=lambda: np.zeros(3, int))
    slipping: np.ndarray = field(default_factory=lambda: np.zeros(3, int))
    overlaps: list = field(default_factory=list)
    places: list = field(default_factory=list)
    times: list = field(default_factory=list)

    def add(self, found: DotClassification, ids, xyz, truth, frame: int, cap: Cap) -> None:
        """Judge one frame and the region drawn from it; the drawing is timed."""
        start = time.perf_counter()
        dots = ContactDots(ROWS, COLUMNS, ids, xyz, truth['dot_rest_xyz'][ids].astype(float), found.score, found.state)
        regions = find_regions(dots)
        estimate = describe(dots, regions)
        contacts = ContactTracker(cap).process(dots, regions)
        self.times[-1].append(time.perf_counter() - start)
        self.contact += contact_counts(found.state > 0, truth, frame, ids)
        sticking, slipping = slip_counts(found.state, truth, frame, ids)
        self.sticking, self.slipping = self.sticking + sticking, self.slipping + slipping
        overlap = region_iou(estimate.outlines + estimate.holes, true_loops(truth, frame))
        if np.isfinite(overlap):
            self.overlaps.append(overlap)
        if contacts and truth['contact_area'][frame] > 0:
            self.places.append(place_errors(estimate.centroid, contacts[0].depth, estimate.area, truth, frame))

    def row(self) -> list[float]:
        """Numbers of a table row, in the order of HEAD."""
        places = np.median(np.abs(self.places), axis=0) * [1e3, 1e3, 1] if self.places else np.full(3, np.nan)
        overlap = np.mean(self.overlaps) if self.overlaps else np.nan
        return [f1(*self.contact), f1(*self.sticking), f1(*self.slipping), overlap, *places, *(1e3 * np.median(self.times, axis=0))]


class Labels:
    """The true labels in place of a method."""

    def __init__(self, truth):
        self.truth, self.frame = truth, -1

    def judge(self, ids, xyz, stamp_s) -> DotClassification:
        """States as they are."""
        self.frame += 1
        state = self.truth['dot_state'][self.frame][ids].astype(np.uint8)
        contact = self.truth['dot_contact'][self.frame].astype(float)
        score = label_score(to_grid(np.arange(len(contact)), contact, ROWS, COLUMNS)).ravel()[ids]
        return DotClassification(np.where(contact[ids] > 0, np.maximum(state, 1), 0), score, None, np.full(6, np.nan))


def load(name: str) -> tuple[dict, dict]:
    """Truth and sensor description of a recording."""
    folder = Path(os.environ.get('TACTILE_RECORDINGS', '')) / 'simulated' / name
    if not (folder / 'truth.npz').exists():
        sys.exit(f'{folder}/truth.npz is not there: set TACTILE_RECORDINGS to the folder of recordings')
    with np.load(folder / 'truth.npz') as truth:
        return {key: truth[key] for key in truth.files}, json.loads((folder / 'sensor.json').read_text())


def material_of(info: dict) -> MembraneMaterial:
    """The membrane that a sensor's description names."""
    return MembraneMaterial(info['shear_modulus_times_thickness'], info['rest_gauge_pressure'], info['curvature_radius'])


def origin_of(sensor: dict) -> np.ndarray:
    """(3,) m: the camera's centre in the sensor frame."""
    camera = sensor['cameras'][0]
    return -np.array(camera['R_cam_from_sensor']).T @ np.array(camera['t_cam_from_sensor'])


def methods_for(truth: dict, sensor: dict) -> dict:
    """Name: (whose places it gets, method)."""
    def made(name):
        method = make_method(ROWS, COLUMNS, material_of(sensor['info']), origin_of(sensor), PAPER | {'contact': name})
        method.set_rest(truth['dot_rest_xyz'].astype(float))
        return method

    return {'membrane': ('membrane', made('membrane')), 'paper': ('membrane', made('paper')),
            'paper, measured': ('measured', made('paper')), 'labels': ('measured', Labels(truth))}


def run(name: str, noise: float, seed: int = 0) -> dict[str, Score]:
    """Scores of all methods on one recording."""
    truth, sensor = load(name)
    info, origin = sensor['info'], origin_of(sensor)
    rest = truth['dot_rest_xyz'].astype(float)
    membrane = Membrane(rest, ROWS, COLUMNS, material_of(info))
    table, rng, previous = methods_for(truth, sensor), np.random.default_rng(seed), None
    scores = {key: Score() for key in table}
    for frame, stamp in enumerate(truth['timestamps']):
        ids = np.flatnonzero(truth['visible'][frame])
        rays = truth['dot_xyz'][frame][ids] - origin
        ranges = np.linalg.norm(rays, axis=1)
        rays = rays / ranges[:, None]
        ranges = ranges + rng.normal(0, noise, len(ids))
        start = time.perf_counter()
        previous = membrane.solve(origin, rays, ranges, np.full(len(ids), max(noise, 1e-6)), ids, previous)
        solved = time.perf_counter() - start
        for key, (places, method) in table.items():
            xyz = previous.xyz[ids] if places == 'membrane' else origin + ranges[:, None] * rays
            start = time.perf_counter()
            found = method.classify(ids, xyz, float(stamp))
            scores[key].times.append([solved if places == 'membrane' else 0.0, time.perf_counter() - start])
            scores[key].add(found, ids, xyz, truth, frame, Cap(info['curvature_radius'], info['cap_height']))
    return scores


def table(rows: list[tuple]) -> str:
    """Rows as a Markdown table."""
    lines = ['| ' + ' | '.join(HEAD) + ' |', '|' + '---|' * len(HEAD)]
    lines += ['| ' + ' | '.join([*row[:2], *('-' if np.isnan(value) else f'{value:.2f}' for value in row[2:])]) + ' |' for row in rows]
    return '\n'.join(lines)


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('recordings', nargs='*', default=['tp_rect_drag', 'tp_disc_twist', 'tp_ring_press'])
    parser.add_argument('--noise', type=float, default=20e-6, help='standard deviation of a measured range, m')
    parser.add_argument('--output', type=Path, help='Markdown file to write')
    arguments = parser.parse_args()
    rows = [(name, key, *score.row()) for name in arguments.recordings for key, score in run(name, arguments.noise).items()]
    for key in dict.fromkeys(row[1] for row in rows):
        rows.append(('mean', key, *np.nanmean([row[2:] for row in rows if row[1] == key], axis=0)))
    text = table(rows)
    print(text)
    if arguments.output:
        arguments.output.write_text(text + '\n')


if __name__ == '__main__':
    try:
        main()
    except TactileError as error:
        sys.exit(str(error))
