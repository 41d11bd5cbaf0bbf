# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Other programs' depth of a gel under coloured light, by their own code, on the images of photometric_gel.py --images.

    python3 test/benchmark/photometric_peers.py lookup PYTHON_VERSION FOLDER 'sample_*.jpg' ref.jpg --ball 3.8 --scale 0.10577
    python3 test/benchmark/photometric_peers.py gs_sdk COPY FOLDER 'frame_*.jpg' median --ball 2 --scale 0.08
    python3 test/benchmark/photometric_peers.py gsrobotics COPY FOLDER 'frame_*.jpg' median --ball 2 --scale 0.08

COPY: of the repository siyuandong16/gelsight_heightmap_reconstruction (its folder python_version), joehjhuang/gs_sdk or
gelsightinc/gsrobotics. Every other press calibrates, as in photometric_gel.py; a person draws a circle over each ball there, and here the
circles that BallFit finds, or those that it uses, are used instead. gsrobotics has a network trained for every GelSight Mini, and takes no
calibration. gs_sdk and gsrobotics need torch.

Not run: py3DCal, whose weights and images are on Zenodo alone, and whose network takes 300 billion multiplications an image of 320 x 240,
too many to train it here; 9DTact, which measures depth by the grey level of a translucent gel, of which no gel under coloured light has
any, and whose repository has one press of a ball for each of two gels.
"""
from __future__ import annotations

import argparse
import csv
import subprocess
import sys
import tempfile
from contextlib import chdir
from importlib import import_module
from pathlib import Path
from types import ModuleType

import cv2
import numpy as np
import yaml
from photometric_gel import cap_error, read_images

from tactile_perception.photometric.calibration import BallFit
from tactile_perception.photometric.circles import Circle


class LookupTable:
    """siyuandong16/gelsight_heightmap_reconstruction. calibrate: presses are image and circle; depth: (H, W) px of the image."""

    def __init__(self, folder: Path, scale: float):
        sys.path.insert(0, str(folder))
        for name in ('skimage', 'skimage.restoration', 'skimage.restoration.inpaint'):  # imported there, not used
            sys.modules.setdefault(name, ModuleType(name))
        sys.modules['skimage.restoration'].inpaint = sys.modules['skimage.restoration.inpaint']
        self._steps, self._table = import_module('test_poisson'), None
        with chdir(folder):  # it reads its files from there
            self._method = import_module('calibration').calibration()
        self._scale = scale

    def _markers(self, image: np.ndarray) -> np.ndarray:
        return self._method.make_mask(image, self._method.find_dots(self._method.mask_marker(image)))

    def calibrate(self, untouched: np.ndarray, presses: list[tuple[np.ndarray, Circle]], radius: float) -> None:
        """Fill the table; radius of the ball is in its source."""
        method = self._method
        self._reference = cv2.inpaint(untouched, self._markers(untouched), 3, cv2.INPAINT_TELEA)
        table = np.zeros((method.blue_bin, method.green_bin, method.red_bin, 2))
        count = np.zeros(table.shape[:3])
        for image, circle in presses:
            disc = np.zeros(image.shape[:2], np.uint8)
            cv2.circle(disc, (int(circle.x), int(circle.y)), int(circle.radius), 1, -1)
            table, count = method.get_gradient_v2(image, self._reference, (int(circle.x), int(circle.y)), int(circle.radius),
                                                  disc * (1 - self._markers(image)), table, count)
        self._table = method.smooth_table(table, count)

    def depth(self, image: np.ndarray) -> np.ndarray:
        """As in its test_poisson.py."""
        steps, blurred = self._steps, cv2.GaussianBlur(self._reference.astype(np.float32), (3, 3), 0) + 1
        lit = (self._reference[:, :, 2] > 12).astype(np.uint8)
        inverse = 1 + ((np.mean(blurred) / blurred) - 1) * 2
        image = cv2.GaussianBlur(image.astype(np.float32), (3, 3), 0)
        markers = cv2.dilate(steps.marker_detection(image), steps.make_kernal(3, 'circle'), iterations=1)
        slope = steps.matching_v2(image, blurred, self._method, self._table, inverse) * ((1 - markers) * lit)[..., None]
        return steps.fast_poisson(slope[:, :, 0], slope[:, :, 1]) / self._scale


class GsSdk:
    """joehjhuang/gs_sdk: its programs prepare the labelled images and train its network, its Reconstructor gives the depth."""

    def __init__(self, folder: Path, scale: float):
        self._folder, self._scale = folder, scale
        sys.path.insert(0, str(folder))

    def calibrate(self, untouched: np.ndarray, presses: list[tuple[np.ndarray, Circle]], radius: float) -> None:
        """Train the network with the programs of the repository and their default options."""
        with tempfile.TemporaryDirectory() as name:
            home = Path(name)
            cv2.imwrite(str(home / 'background.png'), untouched)
            (home / 'gel.yaml').write_text(yaml.safe_dump({'ppmm': self._scale}))
            with open(home / 'catalog.csv', 'w', newline='') as file:
                rows = csv.writer(file)
                rows.writerow(['experiment_reldir', 'diameter(mm)'])
                for number, (image, circle) in enumerate(presses):
                    (home / str(number)).mkdir()
                    cv2.imwrite(str(home / str(number) / 'gelsight.png'), image)
                    np.savez(home / str(number) / 'label.npz', center=np.array(circle[:2]), radius=circle.radius)
                    rows.writerow([str(number), 2 * radius * self._scale])
            for program, options in (('prepare_data', ['-c', str(home / 'gel.yaml')]), ('train_model', [])):
                subprocess.run([sys.executable, '-c', f'from calibration.{program} import {program} as run; run()', '-b', name, *options],
                               cwd=self._folder, check=True, stdout=subprocess.DEVNULL)
            self._method = import_module('gs_sdk.gs_reconstruct').Reconstructor(str(home / 'model' / 'nnmodel.pth'))
            self._method.load_bg(untouched)

    def depth(self, image: np.ndarray) -> np.ndarray:
        """Its height map is negative where the gel is pressed."""
        return -self._method.get_surface_info(image, self._scale)[1]


class Gsrobotics:
    """gelsightinc/gsrobotics: the network of its repository, on images that are cropped and enlarged as by its programs, and whose order of
    colours is BGR: its demo_view3D.py swaps it twice."""

    _BORDER, _ZEROED = 0.15, 50  # as in its default_config.json and reconstruction.py

    def __init__(self, folder: Path, scale: float):
        sys.path.insert(0, str(folder))
        sys.modules['utilities.logger'] = ModuleType('utilities.logger')
        sys.modules['utilities.logger'].log_message = lambda *_: None
        self._crop = import_module('utilities.image_processing').crop_and_resize
        self._make, self._network = import_module('utilities.reconstruction').Reconstruction3D, str(folder / 'models' / 'nnmini.pt')

    def calibrate(self, untouched: np.ndarray, presses: list[tuple[np.ndarray, Circle]], radius: float) -> None:
        """Take the zero of depth; it has no calibration."""
        self._size = untouched.shape[1::-1]
        self._method = self._make(*self._size)
        self._method.load_nn(self._network)
        for _ in range(self._ZEROED):
            self._seen(untouched)

    def _seen(self, image: np.ndarray) -> np.ndarray:
        return self._method.get_depthmap(self._crop(image, self._size, self._BORDER))[0]

    def depth(self, image: np.ndarray) -> np.ndarray:
        """NaN in the border that it does not see."""
        rows, columns = image.shape[:2]
        top, left = int(rows * self._BORDER), int(columns * self._BORDER)
        found = np.full((rows, columns), np.nan, np.float32)
        inner = columns - 2 * left, rows - 2 * top
        found[top:rows - top, left:columns - left] = cv2.resize(self._seen(image).astype(np.float32), inner) * (inner[0] / columns)
        return found


PEERS = {'lookup': LookupTable, 'gs_sdk': GsSdk, 'gsrobotics': Gsrobotics}


def main() -> None:
    """Print errors of the heights of caps at every other press."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('peer', choices=PEERS)
    parser.add_argument('code', type=Path)
    parser.add_argument('images', nargs=3, metavar=('FOLDER', 'PATTERN', 'UNTOUCHED'))
    parser.add_argument('--ball', type=float, required=True, help='its radius in mm')
    parser.add_argument('--scale', type=float, required=True, help='mm a pixel of the images')
    given = parser.parse_args()
    index = given.code / 'abe_corr.npz' if given.peer == 'lookup' else None
    background, presses, (untouched, images) = read_images(Path(given.images[0]), *given.images[1:], None, index, 1)
    larger = untouched.shape[1] / background.shape[1]
    radius = given.ball / given.scale / larger  # px of the working images, in which circles are
    known, others = (BallFit(part, radius) for part in (presses[::2], presses[1::2]))

    def full(circle: Circle) -> Circle:
        """The circle in the image."""
        return circle._replace(x=larger * circle.x, y=larger * circle.y, radius=larger * circle.radius)

    def drawn(circle: Circle) -> Circle:
        """As a person draws it: no larger than the ball."""
        return circle._replace(radius=min(circle.radius, radius))

    for name in ('found', 'used') if given.peer != 'gsrobotics' else ('found',):
        method = PEERS[given.peer](given.code, given.scale)
        method.calibrate(untouched, [(images[press.name], full(drawn(press.circle) if name == 'found' else circle))
                                     for press, circle in zip(known.presses, known.circles)], larger * radius)
        errors = given.scale * np.array([cap_error(method.depth(images[press.name]), full(circle), larger * radius)[0]
                                         for press, circle in zip(others.presses, others.circles)])
        seen = errors[np.isfinite(errors)]
        print(f'circles as {name}: {len(seen)} of {len(errors)} presses, error {np.sqrt(np.mean(seen**2)):.3f} mm RMS, '
              f'mean {np.mean(seen):.3f}')


if __name__ == '__main__':
    main()
