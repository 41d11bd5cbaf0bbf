# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers, position and depth on a real dome of 331 pins that others pressed against a plane at known tilts and depths.

python3 test/benchmark/pins.py FOLDER, with targets.csv and images/ of a TacTip: tactip-data/Bourne/tactip/real/surface_3d/tap/csv_val of
github.com/mattclifford1/tactip-posenet-pytorch. Two thirds of the presses calibrate, the others are judged. No image is untouched: the one
of least depth stands for it. The presses were at random; here each follows the one that is most like it, as in a motion.
"""
import csv
import sys
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial import cKDTree

from tactile_perception.core.errors import BadFrame
from tactile_perception.core.parameter_files import read_parameters
from tactile_perception.dots.tracker import make_tracker
from tactile_perception.gel.parameters import PINS_NODE, PINS_PARAMETERS
from tactile_perception.gel.pins import fit_pins, smoothed
from tactile_perception.layer.undeformed import spacing_of

PARAMS = Path(__file__).resolve().parents[2] / 'tactile_bringup' / 'params' / 'pin_dome.yaml'
RADIUS = 20e-3  # m, of the dome, by its makers
MASK = ','.join(f'{64 + 52 * np.cos(angle):.0f},{64 + 52 * np.sin(angle):.0f}' for angle in np.linspace(0, 2 * np.pi, 24, False))
COUNT = 600


def presses(folder):
    """(depth in m, position (N, 2) m, images) of the first presses, from the least depth on."""
    with (folder / 'targets.csv').open() as file:
        rows = list(csv.DictReader(file))[:COUNT]
    pose = np.array([[float(row[name]) for name in ('pose_3', 'pose_4', 'pose_5')] for row in rows])
    left, order = set(range(len(rows))), [int(np.argmin(pose[:, 0]))]
    while left := left - {order[-1]}:
        order.append(min(left, key=lambda k: np.linalg.norm((pose[k] - pose[order[-1]]) * (1.0, 0.3, 0.3))))
    pose, images = pose[order], [cv2.imread(str(folder / 'images' / rows[k]['sensor_image'])) for k in order]
    about_x, about_y = np.radians(pose[:, 1:]).T
    return 1e-3 * pose[:, 0], RADIUS * np.column_stack([np.sin(about_x), np.sin(about_y) * np.cos(about_x)]), images


def followed(images):
    """Yield (number of the image, tracks)."""
    values = {**read_parameters(PARAMS, PINS_NODE, PINS_PARAMETERS), 'mask': MASK}
    tracker = make_tracker(values, image_only=True)
    for k, image in enumerate(images):
        try:
            yield k, tracker.process(image, 0.1 * k)
        except BadFrame as error:
            print(f'image {k}: {error}')


def off_neighbours(tracks):
    """How far each displacement is from the median of its eight neighbours', px."""
    known = np.isfinite(tracks.duv).all(axis=1)
    near = cKDTree(tracks.rest_uv[known]).query(tracks.rest_uv[known], 9)[1][:, 1:]
    return np.linalg.norm(tracks.duv[known] - np.median(tracks.duv[known][near], axis=1), axis=1)


def main():
    depth, position, images = presses(Path(sys.argv[1]))
    found = list(followed(images))
    rest = found[0][1].rest_uv
    spacing = spacing_of(rest)
    off = np.concatenate([off_neighbours(tracks) for _, tracks in found])
    print(f'{len(rest)} pins; in an image {np.median([len(tracks) for _, tracks in found]):.0f}, at least '
          f'{min(len(tracks) for _, tracks in found)}; wrong numbers {np.sum(off > spacing / 2)} of {len(off)}')
    number, moved = np.array([k for k, _ in found[1:]]), np.array([smoothed(rest, spacing, tracks) for _, tracks in found[1:]])
    judged = np.random.default_rng(0).permutation(len(number)) % 3 == 0
    fitted = number[~judged]
    model, _ = fit_pins(rest, moved[~judged], np.pad(position[fitted], ((0, 0), (0, 1))), depth[fitted])
    results = [(*model.estimate(field), k) for field, k in zip(moved[judged], number[judged])]
    error = np.array([(*(at[:2] - position[k]), deep - depth[k]) for at, deep, _, within, k in results if within])
    away = 1e3 * np.linalg.norm(error[:, :2], axis=1)
    nse = np.mean([e @ np.linalg.solve(model.covariance, e) for e in error]) / 3
    print(f'{len(error)} of {len(results)} presses: position {away.mean():.2f} mm, 95 % {np.percentile(away, 95):.2f}; depth '
          f'{1e3 * np.sqrt(np.mean(error[:, 2]**2)):.3f} mm RMS; squared error over the stated one {nse:.2f}')


if __name__ == '__main__':
    main()
