# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Depth, its stated error, contact area and time of a photometric gel, on simulated specimens that are calibrated as a user does.

    python3 test/benchmark/photometric_gel.py [GELS]
    python3 test/benchmark/photometric_gel.py --images FOLDER 'sample_*.jpg' ref.jpg --ball 3.8 --scale 0.10577 --index abe_corr.npz

The second reads real images of a ball: the gel is calibrated with every other one, and the others show the errors. The corners are those
of a rectangle that fills the image after an oblique view is corrected. The figures of docs/photometric_gel.md are of two public
repositories, with their authors' own corrections of the view, scales and radii: siyuandong16/gelsight_heightmap_reconstruction
(illumination_calib/Dots1 with python_version/abe_corr.npz, as above) and wyh5625/gelsight (data/calibration2, 'cal-*.jpg' bg-0.jpg
--ball 2.42 --scale 0.1 --corners 33 58 208 61 56 250 185 244, the radius as in 2_dataset.py until the commit 0b2946c, which was written
for these images; data/calibration, 'ball-*.jpg'; data/calibration5, which has no dots, with --every 12); and of
RuihanGao/16741-Proj-ShapeMap3D-GelSightMini (Taxim/data/Gel/11_19_2023/calib_ball, 'frame_*.jpg' median --ball 2 --scale 0.08, as in its
sensorParams.py; its image of the untouched gel shows another part of the gel, and the median of the presses is used instead).
"""
from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from tactile_driver.simulation.sensors.photometric_gel import SHADED, PhotometricScene, PressScript
from tactile_perception.photometric.calibration import BallFit, Press
from tactile_perception.photometric.circles import Circle, CircleSearch
from tactile_perception.photometric.estimator import PhotometricEstimator
from tactile_perception.photometric.model import DepthModel, Reconstruction
from tactile_perception.photometric.observation import Background, to_working_size

_CLIPPED = 20  # px at the border of an undistorted image that show what is beyond the image; as its authors do
RATE, CALIBRATED_WITH, PRESSES = 10.0, 2.5e-3, 20
OBJECTS = {'ball of 2 mm': ('ball', 0.002), 'ball of 3.5 mm': ('ball', 0.0035), 'ball of 5 mm': ('ball', 0.005),
           'ball of 12 mm': ('ball', 0.012), 'rod of 1.8 mm': ('rod', 0.0018), 'edge': ('edge', 0.003), 'ring of 1.6 mm': ('ring', 0.0016)}


def scene_of(radius: float, seed: int, dots: bool, count: int, shape: str = 'ball') -> PhotometricScene:
    """Presses of an object at positions and depths that are drawn at random."""
    rng = np.random.default_rng([seed, round(1e6 * radius), 71])
    drawn = [(rng.uniform(-0.006, 0.006), rng.uniform(-0.004, 0.004), rng.uniform(1.5e-4, 9e-4) * min(1.0, radius / 0.0025))
             for _ in range(count)]
    return PhotometricScene(PressScript(drawn, radius=radius, shape=shape, dots=dots), RATE, seed, 640)


def calibrated(seed: int, dots: bool) -> DepthModel:
    """The model of a specimen by twenty presses of one ball, each in the deepest frame."""
    scene = scene_of(CALIBRATED_WITH, seed, dots, PRESSES)
    shots = [scene.render(number / RATE) for number in range(scene.frames)]
    untouched = [to_working_size(shot.image) for shot in shots if not shot.truth.contacts][:10]
    background = Background(np.mean(untouched, axis=0, dtype=np.float32))
    search, presses, depths = CircleSearch(background.shape), [], [shot.truth.contacts[0].depth if shot.truth.contacts else 0.0
                                                                  for shot in shots]
    for k in range(1, len(shots) - 1):
        if depths[k] > max(depths[k - 1], 1e-4) and depths[k] >= depths[k + 1]:
            working = to_working_size(shots[k].image)
            change, hidden = background.change(working), background.hidden(working)
            presses.append(Press(str(k), working, change, hidden, search.find(change, hidden)))
    return BallFit(presses, CALIBRATED_WITH / (SHADED.scale * 640 / background.shape[1])).model([background.image])


def played(model: DepthModel, shape: str, radius: float, seed: int, dots: bool) -> Iterator[tuple]:
    """(result, truth, seconds) of each touched frame."""
    scene, estimator = scene_of(radius, seed + 5000, dots, 4, shape), PhotometricEstimator(model, SHADED.scale)
    scene._light = PhotometricScene(PressScript([(0, 0, 1e-4)], radius=radius, dots=dots), RATE, seed, 640)._light
    for number in range(scene.frames):
        shot = scene.render(number / RATE)
        begin = time.process_time()
        result = estimator.process(shot.image, number / RATE)
        taken = time.process_time() - begin
        if shot.truth.contacts and shot.truth.contacts[0].depth > 1e-4:
            yield result, shot.truth, taken


def row(name: str, frames: list[tuple]) -> str:
    """A row of the table; of several contacts of one object, the deepest counts."""
    seen = [(max(result.contacts, key=lambda one: one.depth), truth.contacts[0], result, truth) for result, truth, _ in frames
            if result.contacts]
    depth = np.array([found.depth - true.depth for found, true, *_ in seen])
    sigma = np.array([np.sqrt(found.position_covariance[2, 2]) for found, *_ in seen])
    away = np.array([found.position[:2] - true.position[:2] for found, true, *_ in seen])
    lateral = np.array([np.sqrt(found.position_covariance[0, 0]) for found, *_ in seen])
    area = np.array([result.region.area / truth.area for *_, result, truth in seen])
    ones = np.mean([len(result.contacts) == 1 for result, *_ in frames])
    return (f'| {name} | {len(frames)} | {100 * ones:.0f} | {1e3 * np.sqrt(np.mean(depth**2)):.3f} | {np.mean((depth / sigma)**2):.2f} | '
            f'{1e3 * np.sqrt(np.mean(away**2)):.3f} | {np.mean((away / lateral[:, None])**2):.2f} | {np.median(area):.2f} | '
            f'{np.quantile(area, 0.1):.2f} to {np.quantile(area, 0.9):.2f} | {1e3 * np.median([t for *_, t in frames]):.1f} |')


def read_images(folder: Path, pattern: str, untouched: str, corners: list[float] | None, index: Path | None,
                every: int) -> tuple[Background, list[Press], tuple[np.ndarray, dict[str, np.ndarray]]]:
    """The untouched gel and the presses in the images of a folder, see main; and the images, as they are before their size is reduced."""
    undistorted = np.load(index) if index else None

    def seen(path: Path) -> np.ndarray:
        image = cv2.imread(str(path))
        if undistorted is not None:
            image = image[undistorted['x'], undistorted['y']][_CLIPPED:-_CLIPPED, _CLIPPED:-_CLIPPED]
        if corners:
            size = image.shape[1::-1]
            ends = np.float32([(0, 0), (size[0], 0), (0, size[1]), size])
            image = cv2.warpPerspective(image, cv2.getPerspectiveTransform(np.float32(corners).reshape(4, 2), ends), size)
        return image

    images = {path.stem: seen(path) for path in sorted(folder.glob(pattern))[::every]}
    reference = np.median(list(images.values()), axis=0).astype(np.uint8) if untouched == 'median' else seen(folder / untouched)
    background, presses = Background(to_working_size(reference)), []
    search = CircleSearch(background.shape)
    for name, image in images.items():
        working = to_working_size(image)
        change, hidden = background.change(working), background.hidden(working)
        presses.append(Press(name, working, change, hidden, search.find(change, hidden)))
    return background, presses, (reference, images)


def cap_error(depth: np.ndarray, circle: Circle, radius: float) -> tuple[float, float]:
    """Error of the height of a ball's cap over the edge of a circle in a depth (H, W), and that height; all in px."""
    y, x = np.mgrid[:depth.shape[0], :depth.shape[1]]
    distance = np.hypot(x - circle.x, y - circle.y)
    cap = radius - np.sqrt(radius**2 - circle.radius**2)
    return float(depth[distance < 0.1 * circle.radius + 1].mean() - depth[np.abs(distance - circle.radius) < 1].mean() - cap), cap


def real(background: Background, presses: list[Press], radius: float, scale: float) -> str:
    """Errors of the heights of caps of a ball at every other press, of a gel that is calibrated with the presses between.

    radius: px; scale: mm a px, of working images."""
    model = BallFit(presses[::2], radius).model([background.image])
    others, reconstruction = BallFit(presses[1::2], radius), Reconstruction(model, background.shape)
    error, stated, caps, over = [], [], [], []
    for press, circle in zip(others.presses, others.circles):
        depth, slope, _ = reconstruction.process(press.change, press.hidden)
        away, cap = cap_error(depth, circle, radius)
        error.append(away)
        stated.append(np.hypot(model.depth_sigma * background.shape[1], model.slope_error * cap))
        caps.append(cap)
        over.append(np.sqrt(reconstruction.touching(depth, slope).sum() / np.pi))
    error, stated = scale * np.array(error), scale * np.array(stated)
    return (f'{len(others.presses)} presses, {len(others.left_out)} left out; caps of {scale * np.mean(caps):.2f} mm: error '
            f'{np.sqrt(np.mean(error**2)):.3f} mm RMS, its square over the stated one {np.mean((error / stated)**2):.2f}, '
            f'radius of the region {scale * np.median(over):.2f} mm')


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('gels', type=int, nargs='?', default=6, help='simulated specimens')
    parser.add_argument('--images', nargs=3, metavar=('FOLDER', 'PATTERN', 'UNTOUCHED'), help='real images of a ball instead')
    parser.add_argument('--ball', type=float, help='its radius in mm')
    parser.add_argument('--scale', type=float, help='mm a pixel of the images')
    parser.add_argument('--corners', type=float, nargs=8, help='px, left upper, right upper, left lower, right lower')
    parser.add_argument('--index', type=Path, help='npz, x and y: row and column of each pixel of the undistorted image')
    parser.add_argument('--every', type=int, default=1, help='of the images that are read')
    given = parser.parse_args()
    if given.images:
        background, presses, (untouched, _) = read_images(Path(given.images[0]), *given.images[1:], given.corners, given.index, given.every)
        scale = given.scale * untouched.shape[1] / background.shape[1]
        print(real(background, presses, given.ball / scale, scale))
        return
    print('| press | frames | one contact, % | depth, mm RMS | its squared error over the stated one | position, mm RMS | the same | '
          'area over the true one | 10 to 90 % | ms |\n|---|---|---|---|---|---|---|---|---|---|')
    for dots in (False, True):
        frames = {name: [] for name in OBJECTS}
        for seed in range(given.gels):
            model = calibrated(seed, dots)
            for name, (shape, radius) in OBJECTS.items():
                frames[name] += played(model, shape, radius, seed, dots)
        for name, found in frames.items():
            print(row(name + (', with dots' if dots else ''), found), flush=True)


if __name__ == '__main__':
    main()
