# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Real presses of a hexagonal array of 127 pins, one image each: detected and matched pins, and prediction errors from their displacements.

python test/benchmark/pins.py FOLDER, with the images frame_*.png and targets.csv. Depth (pose_2, mm), tilt (pose_6, deg), slide (move_1,
mm) and rotation (move_6, deg) of each half of the images are predicted by a quadratic ridge regression fitted to the other half.
"""
from __future__ import annotations

import csv
import sys
from pathlib import Path

import cv2
import numpy as np

from tactile_perception.dots.detect import DotDetector
from tactile_perception.dots.pattern import Pattern

TARGETS = {'depth, mm': 'pose_2', 'tilt, deg': 'pose_6', 'slide, mm': 'move_1', 'turn, deg': 'move_6'}
PINS = 127
COMPONENTS, PRODUCTS = 12, 5  # principal components of the displacements; of these, components with squares and products
STRENGTHS = 10.0 ** np.arange(-5, 5)  # of the ridge


def read(folder: Path) -> tuple[list[np.ndarray], np.ndarray]:
    """Dots (N, 2) px of each image that is there, ordered by name, and targets (M, 4)."""
    with open(folder / 'targets.csv', newline='') as file:
        rows = sorted((row for row in csv.DictReader(file) if (folder / row['image_name']).exists()), key=lambda row: row['image_name'])
    dots = [DotDetector('bright', 'blobs').detect(cv2.imread(str(folder / row['image_name']), cv2.IMREAD_GRAYSCALE)).uv for row in rows]
    return dots, np.array([[float(row[name]) for name in TARGETS.values()] for row in rows])


def match(dots: list[np.ndarray], depth: np.ndarray) -> np.ndarray:
    """(M, 127, 2) px places of each pin, NaN where not matched to those of the shallowest press in which just as many dots are."""
    rest = max((k for k in range(len(dots)) if len(dots[k]) == PINS), key=lambda k: depth[k])
    pattern, places = Pattern(dots[rest]), np.full((len(dots), PINS, 2), np.nan)
    for place, uv in zip(places, dots):
        id = pattern.match(uv)
        place[id[id >= 0]] = uv[id >= 0]
    return places


def features(places: np.ndarray, half: np.ndarray) -> np.ndarray:
    """(M, F) leading components of flat places (M, 254), as found in those of half, and some of their products, each about one in size."""
    middle = places[half].mean(axis=0)
    _, size, axes = np.linalg.svd(places[half] - middle, full_matrices=False)
    parts = (places - middle) @ axes[:COMPONENTS].T * np.sqrt(len(half)) / size[0]
    i, j = np.triu_indices(PRODUCTS)
    return np.column_stack([np.ones(len(parts)), parts, parts[:, i] * parts[:, j]])


def ridge(x: np.ndarray, strength: float) -> np.ndarray:
    """(F, M) matrix that makes coefficients of targets; the first, of the constant, is free."""
    penalty = np.full(x.shape[1], strength)
    penalty[0] = 0
    return np.linalg.solve(x.T @ x + np.diag(penalty), x.T)


def predict(x: np.ndarray, y: np.ndarray, half: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Of rest, fitted to half: as strongly held as leaving one out says, with its standard error in doubt."""
    seen, left_out = x[half], []
    for strength in STRENGTHS:
        hat = seen @ ridge(seen, strength)
        left_out.append(((y[half] - hat @ y[half]) / (1 - np.diag(hat)))**2)
    left_out = np.array(left_out)
    best = left_out.mean(axis=1).argmin()
    doubt = left_out[best].std() / np.sqrt(len(half))
    chosen = STRENGTHS[left_out.mean(axis=1) <= left_out[best].mean() + doubt].max()
    return x[rest] @ (ridge(seen, chosen) @ y[half])


def run(folder: Path) -> dict:
    """'matched': pins in each image (M,); and for each target (mean error, 95 % error, mean error of the mean)."""
    dots, targets = read(folder)
    places = match(dots, targets[:, 0])
    found = {'matched': np.isfinite(places[:, :, 0]).sum(axis=1)}
    flat = np.where(np.isfinite(places), places, np.nanmean(places, axis=0)).reshape(len(places), -1)
    halves = np.arange(0, len(flat), 2), np.arange(1, len(flat), 2)
    for column, name in enumerate(TARGETS):
        y, error = targets[:, column], np.empty(len(flat))
        for half, rest in (halves, halves[::-1]):
            error[rest] = np.abs(predict(features(flat, half), y, half, rest) - y[rest])
        found[name] = float(error.mean()), float(np.percentile(error, 95)), float(np.abs(y - y.mean()).mean())
    return found


def main():
    found = run(Path(sys.argv[1]))
    matched = found.pop('matched')
    print(f'{len(matched)} images, pins matched: {matched.min()} to {matched.max()}, all {PINS} in {np.count_nonzero(matched == PINS)}')
    for name, (mean, most, blind) in found.items():
        print(f'{name}: mean error {mean:.3f}, 95 % {most:.3f}; of the mean of all {blind:.3f}')


if __name__ == '__main__':
    main()
