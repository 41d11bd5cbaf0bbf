# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The look-up table of siyuandong16/gelsight_heightmap_reconstruction, by its own code, on the images of photometric_gel.py --index.

    python3 test/benchmark/photometric_peers.py PYTHON_VERSION FOLDER

PYTHON_VERSION: that folder of a copy of the repository; FOLDER: illumination_calib/Dots1 in it. Its calibration and depth run as in its
programs. A person drags a circle over each ball there; here the circles of BallFit, which the errors are measured with, take its place.

Not run: gsrobotics, whose network is trained for GelSight Mini, of which no public set of ball presses was found; py3DCal, whose weights
and images are on Zenodo alone; 9DTact, which measures depth by grey levels of another kind of gel.
"""
from __future__ import annotations

import argparse
import sys
from contextlib import chdir
from importlib import import_module
from pathlib import Path
from types import ModuleType

import cv2
import numpy as np
from photometric_gel import cap_error, read_images

from tactile_perception.photometric.calibration import BallFit

BALL, SCALE = 3.8, 0.10577  # mm, and mm a px, as in its calibration.py


class LookupTable:
    """The method of the repository in a folder."""

    def __init__(self, folder: Path):
        sys.path.insert(0, str(folder))
        for name in ('skimage', 'skimage.restoration', 'skimage.restoration.inpaint'):  # imported there, not used
            sys.modules.setdefault(name, ModuleType(name))
        sys.modules['skimage.restoration'].inpaint = sys.modules['skimage.restoration.inpaint']
        self._steps, self._table = import_module('test_poisson'), None
        with chdir(folder):  # it reads its files from there
            self._method = import_module('calibration').calibration()

    def _undistorted(self, path: Path) -> np.ndarray:
        image = cv2.imread(str(path))[self._method.x_index, self._method.y_index, :]
        return self._method.crop_image(image, 20)

    def _markers(self, image: np.ndarray) -> np.ndarray:
        return self._method.make_mask(image, self._method.find_dots(self._method.mask_marker(image)))

    def calibrate(self, untouched: Path, presses: list[tuple[Path, float, float, float]]) -> None:
        """Fill the table; presses: image, and x, y and radius of the circle in px."""
        method, reference = self._method, self._undistorted(untouched)
        self._reference = cv2.inpaint(reference, self._markers(reference), 3, cv2.INPAINT_TELEA)
        table = np.zeros((method.blue_bin, method.green_bin, method.red_bin, 2))
        count = np.zeros(table.shape[:3])
        for path, x, y, radius in presses:
            image = self._undistorted(path)
            circle = np.zeros(image.shape[:2], np.uint8)
            cv2.circle(circle, (int(x), int(y)), int(radius), 1, -1)
            valid = circle * (1 - self._markers(image))
            table, count = method.get_gradient_v2(image, self._reference, (int(x), int(y)), int(radius), valid, table, count)
        self._table = method.smooth_table(table, count)

    def depth(self, path: Path) -> np.ndarray:
        """Depth (H, W) in mm, as in its test_poisson.py."""
        steps, blurred = self._steps, cv2.GaussianBlur(self._reference.astype(np.float32), (3, 3), 0) + 1
        lit = (self._reference[:, :, 2] > 12).astype(np.uint8)
        inverse = 1 + ((np.mean(blurred) / blurred) - 1) * 2
        image = cv2.GaussianBlur(self._undistorted(path).astype(np.float32), (3, 3), 0)
        markers = cv2.dilate(steps.marker_detection(image), steps.make_kernal(3, 'circle'), iterations=1)
        slope = steps.matching_v2(image, blurred, self._method, self._table, inverse) * ((1 - markers) * lit)[..., None]
        return steps.fast_poisson(slope[:, :, 0], slope[:, :, 1])


def main() -> None:
    """Print errors of the heights of caps at every other press."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('code', type=Path)
    parser.add_argument('images', type=Path)
    given = parser.parse_args()
    background, presses = read_images(given.images, 'sample_*.jpg', 'ref.jpg', None, given.code / 'abe_corr.npz', 1)
    scale = SCALE * (427 - 40) / background.shape[1]  # mm a px of the working images, in which circles are
    known, others = (BallFit(part, BALL / scale) for part in (presses[::2], presses[1::2]))
    larger = scale / SCALE
    for name in ('found', 'used'):
        method = LookupTable(given.code)
        circles = [(given.images / f'{press.name}.jpg', larger * circle.x, larger * circle.y,
                    larger * (press.circle if name == 'found' else circle).radius) for press, circle in zip(known.presses, known.circles)]
        method.calibrate(given.images / 'ref.jpg', circles)
        errors = [SCALE * cap_error(method.depth(given.images / f'{press.name}.jpg') / SCALE, circle._replace(
            x=larger * circle.x, y=larger * circle.y, radius=larger * circle.radius), BALL / SCALE)[0]
            for press, circle in zip(others.presses, others.circles)]
        rms = np.sqrt(np.mean(np.square(errors)))
        print(f'circles as {name}: {len(errors)} presses, error {rms:.3f} mm RMS, mean {np.mean(errors):.3f}')


if __name__ == '__main__':
    main()
