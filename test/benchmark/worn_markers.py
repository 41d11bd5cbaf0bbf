# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Worn, speckled and dirty markers on simulated sheets of all kinds: detected and false markers, position errors, and stated sigmas.

    python3 test/benchmark/worn_markers.py [--sheets 36] [--seed 0] [--methods discs blobs likelihood]

Each sheet has 50 to 350 markers of 8 to 40 px, in a grid, hexagonal or random, bright on dark or dark on bright, with illumination ratios
up to 3 to 1, and wear from none to heavy; every third sheet has the heaviest wear. A marker is found if a dot lies within 0.35 of its
diameter.
"""
from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np

from tactile_driver.simulation.sensors.worn_sheet import LAYOUTS, Print, worn_sheet
from tactile_perception.dots.detect import DotDetector
from tactile_perception.errors import BadFrame

FOUND = 0.35  # of a marker's diameter
METHODS = ('discs', 'blobs', 'likelihood')


@dataclass(frozen=True)
class Sheet:
    """One picture (H, W, 3) of a sheet; uv (K, 2) px, where its markers are."""

    look: Print
    image: np.ndarray
    uv: np.ndarray


@dataclass
class Score:
    """Of one sheet, or several: true, found and false markers; errors (N,): squared, px^2 per axis; sigma (N,) px; ms a frame."""

    true: int
    found: int
    false: int
    errors: np.ndarray
    sigma: np.ndarray
    ms: float

    def row(self) -> dict[str, float]:
        """Shares of markers found and of dots that are none, RMS px per axis, RMS of the errors over the stated ones, ms."""
        some = len(self.errors) > 0
        return {'recall': self.found / self.true, 'false': self.false / max(self.found + self.false, 1),
                'rms px': float(np.sqrt(self.errors.mean())) if some else np.nan,
                'error over sigma': float(np.sqrt(self.errors.mean() / (self.sigma**2).mean())) if some else np.nan, 'ms': self.ms}


def any_look(seed: int, number: int) -> Print:
    """Any sheet of the range; every third is worn heavily."""
    rng = np.random.default_rng([seed, number])
    diameter = float(np.exp(rng.uniform(np.log(8), np.log(40))))
    count = int(np.clip(520 * 390 / (rng.uniform(1.35, 2.4) * diameter)**2, 50, 350))
    wear = 1.0 if number % 3 == 0 else rng.uniform(0, 1)
    return Print(diameter, count, str(rng.choice(list(LAYOUTS))), bool(rng.random() < 0.6), rng.uniform(2.2, 6), rng.uniform(0.03, 0.15),
                 rng.uniform(1, 3), rng.uniform(0.6, 1.6), wear)


def photograph(look: Print, seed: int) -> Sheet:
    """The sheet at rest."""
    specimen = worn_sheet(seed, 640, look)
    skin, pattern, camera, renderer = specimen.skin, specimen.pattern, specimen.cameras[0], specimen.renderers[0]
    _, uv, spread = pattern.seen(skin.rest, camera)
    return Sheet(look, renderer.draw(skin.coarse(skin.rest), uv, spread.astype(np.float32), pattern.radius, seed).copy(), uv)


def sheets(count: int, seed: int) -> Iterator[Sheet]:
    """So many sheets, other ones for each seed."""
    for number in range(count):
        yield photograph(any_look(seed, number), 1000 * seed + number)


def score(sheet: Sheet, method: str) -> Score:
    """A fresh detector's second look at the sheet: the first one measures what markers look like."""
    detector = DotDetector('bright' if sheet.look.bright else 'dark', method)
    try:
        detector.detect(sheet.image)
        start = time.thread_time()
        dots = detector.detect(sheet.image)
        ms = 1e3 * (time.thread_time() - start)
    except BadFrame:
        return Score(len(sheet.uv), 0, 0, np.zeros(0), np.zeros(0), np.nan)
    away = np.hypot(*(dots.uv[:, None] - sheet.uv).transpose(2, 0, 1))
    near = away.min(axis=1) < FOUND * sheet.look.diameter
    found = len(np.unique(away.argmin(axis=1)[near]))
    return Score(len(sheet.uv), found, len(dots) - found, away.min(axis=1)[near]**2 / 2, dots.sigma[near], ms)


def together(scores: list[Score]) -> Score:
    """All sheets as one; the median of the times."""
    return Score(*(sum(getattr(s, name) for s in scores) for name in ('true', 'found', 'false')),
                 *(np.concatenate([getattr(s, name) for s in scores]) for name in ('errors', 'sigma')),
                 float(np.nanmedian([s.ms for s in scores])))


def run(count: int, seed: int, methods: tuple[str, ...] = METHODS) -> dict[str, list[tuple[Print, Score]]]:
    """By method, what it scored on each of so many sheets."""
    cv2.setNumThreads(1)
    results: dict[str, list] = {method: [] for method in methods}
    for sheet in sheets(count, seed):
        for method in methods:
            results[method].append((replace(sheet.look), score(sheet, method)))
    return results


def line(name: str, result: Score) -> str:
    """A line of the table."""
    row = result.row()
    return (f'| {name} | {100 * row["recall"]:.1f} | {100 * row["false"]:.1f} | {row["rms px"]:.2f} | {row["error over sigma"]:.1f} | '
            f'{row["ms"]:.0f} |')


def main() -> None:
    """Print a table: all sheets, and those of little and of much wear."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--sheets', type=int, default=36)
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--methods', nargs='+', default=list(METHODS))
    wanted = parser.parse_args()
    print('| method, wear | found, % | false, % | RMS, px | error over stated | ms |\n|---|---|---|---|---|---|')
    for method, results in run(wanted.sheets, wanted.seed, tuple(wanted.methods)).items():
        for name, least, most in (('all', 0, 1), ('under a half', 0, 0.5), ('a half and more', 0.5, 1)):
            some = [result for look, result in results if least <= look.wear <= most]
            if some:
                print(line(f'{method}, {name}', together(some)))


if __name__ == '__main__':
    main()
