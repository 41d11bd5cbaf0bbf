# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From an image to indexed dots, methods interleaved in one run: `python test/benchmark/tracking.py [--quick] [--out out]`.

Writes tracking.md, tracking.json and tracking.png: median milliseconds of CPU time of one thread, error (2-D RMS, px of the frame), missing
and wrong indices per thousand dots. The pattern moves back and forth by a pixel per frame; noise is 2 grey levels.
"""
from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import cv2
import numpy as np
from dots import BlobDetector
from scenes import NAMES, make_scene
from scipy.spatial import cKDTree

from tactile_perception.dots.detect import DotDetector
from tactile_perception.dots.number import grid_numbering
from tactile_perception.dots.tracker import DotTracker
from tactile_perception.errors import BadFrame

NOISE, MATCH = 2.0, 3.0
IN_A_ROW = 6  # consecutive frames per method, so that code and tables are cached as in use. Chosen


class FromNothing:
    """Detection and numbering that know no frame before; nearest: each number is that of the nearest dot of the last frame."""

    def __init__(self, detector, numbering: str = 'lattice', nearest: bool = False):
        self._detector, self._numbering, self._nearest = detector, numbering, nearest
        self._previous = None

    def find(self, image, stamp_s):
        """(dots, id (N,)) of an image."""
        dots = self._detector.detect(image)
        if self._nearest and self._previous is not None and len(dots):
            id = self._of_nearest(dots.uv)
        else:
            id = grid_numbering(self._numbering, 23, 23).number(dots.uv, *image.shape[1::-1]).id
        if self._nearest and (id >= 0).any():
            self._previous = dots.uv[id >= 0], id[id >= 0]
        return dots, id

    def _of_nearest(self, uv):
        """One to one: of several dots with the same nearest one, the nearest has its number."""
        before, number = self._previous
        distance, place = cKDTree(before).query(uv)
        id = np.full(len(uv), -1)
        for dot in np.argsort(-distance):
            id[id == number[place[dot]]] = -1
            id[dot] = number[place[dot]]
        return id


def ways() -> dict:
    """Name -> (a fresh finder, size of its frames against 640 x 480)."""
    return {'from nothing': (FromNothing(DotDetector('dark'), 'lattice'), 1), 'with a previous frame': (DotTracker(23, 23), 1),
            'from nothing, 320 x 240': (FromNothing(DotDetector('dark'), 'lattice'), 2),
            'with a previous frame, 320 x 240': (DotTracker(23, 23), 2),
            "the paper's steps": (FromNothing(DotDetector('dark', 'paper'), 'paper'), 1),
            'SimpleBlobDetector, nearest': (FromNothing(BlobDetector(), nearest=True), 1)}


def measure(scenes: int, turns: int) -> list[dict]:
    """A row for each scene and way."""
    cv2.setNumThreads(1)
    rows = []
    for name in NAMES[:scenes]:
        scene, rng = make_scene(name, 1), np.random.default_rng(0)
        compared = ways()
        sums, times = {way: np.zeros(5) for way in compared}, {way: [] for way in compared}
        for turn in range(turns + 1):
            shifts = range(IN_A_ROW) if turn % 2 else range(IN_A_ROW)[::-1]
            images = [np.roll(scene.frame(NOISE, rng), shift, 1) for shift in shifts]
            for way, (finder, scale) in compared.items():
                frames_seen = images if scale == 1 else [cv2.resize(i, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA) for i in images]
                found, spent = _run(finder, frames_seen, turn * IN_A_ROW)
                if turn:  # the first frames measure the dots' appearance
                    times[way] += spent
                    for shift, one in zip(shifts, found):
                        sums[way] += _score(scene, (scene.uv + [shift, 0] + 0.5) / scale - 0.5, *one, MATCH / scale)
        rows += [_row(name, way, sums[way], times[way]) for way in compared]
    return rows


def _run(finder, images, first):
    """What was found in frames one after the other, and the seconds that each took."""
    found, spent = [], []
    for k, image in enumerate(images):
        start = time.thread_time()
        try:
            dots, id = finder.find(image, (first + k) / 60)
            found.append((dots.uv[id >= 0], id[id >= 0]))
        except BadFrame:
            found.append((np.zeros((0, 2)), np.zeros(0, np.int64)))
        spent.append(time.thread_time() - start)
    return found, spent


def _score(scene, uv, found, id, reach):
    """(squared error, dots it is of, wrong, without a number, dots) of dots that neither touch nor lie under glare."""
    clear = np.flatnonzero(scene.clear)
    if not len(found):
        return 0, 0, 0, len(clear), len(clear)
    distance = np.hypot(*(uv[clear, None] - found).transpose(2, 0, 1))
    nearest, near = distance.argmin(1), distance.min(1)
    right = id[nearest] == (scene.row * scene.columns + scene.column)[clear]
    seen = near < reach
    return (near[seen & right] ** 2).sum(), (seen & right).sum(), (seen & ~right).sum(), (~seen).sum(), len(clear)


def _row(scene, way, sums, times):
    return {'scene': scene, 'way': way, 'ms': 1e3 * float(np.median(times)), 'error_px': float(np.sqrt(sums[0] / max(sums[1], 1))),
            'none_per_1000': 1e3 * sums[3] / sums[4], 'wrong_per_1000': 1e3 * sums[2] / sums[4]}


def table(rows: list[dict]) -> str:
    """The rows as Markdown."""
    lines = ['| scene | way | ms | error, px | none per 1000 | wrong per 1000 |', '|---|---|---|---|---|---|']
    lines += [f"| {r['scene']} | {r['way']} | {r['ms']:.2f} | {r['error_px']:.4f} | {r['none_per_1000']:.1f} | {r['wrong_per_1000']:.1f} |"
              for r in rows]
    return '\n'.join(lines) + '\n'


def plot(rows: list[dict], path: Path) -> None:
    """Speed against error, a point for each way and scene."""
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(figsize=(7, 5))
    for way in dict.fromkeys(r['way'] for r in rows):
        these = [r for r in rows if r['way'] == way and r['error_px'] > 0]
        axes.scatter([r['ms'] for r in these], [r['error_px'] for r in these], s=18, label=way)
    axes.set(xscale='log', yscale='log', xlabel='ms a frame, found and numbered (529 dots, one thread)', ylabel='error, px of the frame')
    axes.legend(fontsize='small')
    figure.savefig(path, dpi=120)


def main() -> None:
    """Measure, and write table, numbers and picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--quick', action='store_true', help='two scenes and two turns of six frames each')
    parser.add_argument('--out', type=Path, default=Path('out'))
    wanted = parser.parse_args()
    rows = measure(2, 2) if wanted.quick else measure(len(NAMES), 6)
    wanted.out.mkdir(parents=True, exist_ok=True)
    (wanted.out / 'tracking.json').write_text(json.dumps(rows, indent=1))
    (wanted.out / 'tracking.md').write_text(table(rows))
    plot(rows, wanted.out / 'tracking.png')


if __name__ == '__main__':
    main()
