# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Time and error of the dot detectors, interleaved in one run: the part dots of run.py.

Error relative to the Cramer-Rao bound (2-D RMS of dots neither overlapping nor under glare), missed and false dots per thousand, standard
deviation of the errors relative to the stated sigma, and median milliseconds per frame on one thread.
"""
from __future__ import annotations

import time
from collections import defaultdict

import cv2
import numpy as np
from scenes import NAMES, make_scene, position_bound

from tactile_perception.common.dots import Dots
from tactile_perception.dots.detect import METHODS, DotDetector
from tactile_perception.errors import BadFrame

NOISES = (1.0, 2.0, 4.0, 8.0)
MATCH = 3.0  # px: a dot farther than this from every true position is false. Chosen


class BlobDetector:
    """cv2.SimpleBlobDetector with its own search over thresholds, told the size of the dots; scale: of the image against 640 x 480."""

    def __init__(self, dark: bool = True, scale: float = 1.0):
        wanted = cv2.SimpleBlobDetector_Params()
        wanted.blobColor = 0 if dark else 255
        wanted.minArea, wanted.maxArea, wanted.minDistBetweenBlobs = 8 * scale**2, 120 * scale**2, 4 * scale
        wanted.filterByConvexity = wanted.filterByInertia = False
        self._detector = cv2.SimpleBlobDetector_create(wanted)

    def detect(self, image: np.ndarray) -> Dots:
        """Dots of one image; the detector states no sigma."""
        points = self._detector.detect(image)
        uv = np.array([p.pt for p in points]).reshape(-1, 2)
        return Dots(uv, np.array([np.pi / 4 * p.size**2 for p in points]), np.full(len(uv), np.nan))


class TrackpyDetector:
    """trackpy.locate at a diameter of 9 px in 640 x 480. Raises ImportError where it is not installed."""

    def __init__(self, scale: float = 1.0):
        import trackpy
        trackpy.quiet()
        self._locate, self._diameter, self._mass = trackpy.locate, 2 * round(4 * scale) + 1, 300 * scale**2

    def detect(self, image: np.ndarray) -> Dots:
        """Dots of one image."""
        found = self._locate(image, self._diameter, minmass=self._mass, invert=True)
        return Dots(found[['x', 'y']].to_numpy(), np.full(len(found), np.nan), np.full(len(found), np.nan))


def detectors(scale: float = 1.0) -> dict:
    """Name -> fresh detector of every method to compare, for images of that size against 640 x 480; trackpy only where it is installed."""
    found = {name: DotDetector('dark', name) for name in METHODS if name != 'paper_cushion'}  # its non-local means take 0.2 s per frame
    found['SimpleBlobDetector'] = BlobDetector(scale=scale)
    try:
        found['trackpy'] = TrackpyDetector(scale)
    except ImportError:
        pass
    return found


def score(scene, dots, noise: float) -> dict:
    """Sums that can be added over frames: squared errors and bounds (px^2), counts of dots true, matched, missed, false, and squared
    errors over sigma."""
    distance = np.hypot(*(scene.uv[:, None] - dots.uv[None]).transpose(2, 0, 1)) if len(dots) else np.full((len(scene.uv), 1), np.inf)
    nearest = distance.argmin(1)
    matched = distance[np.arange(len(nearest)), nearest] < MATCH
    clear = scene.clear & matched
    error = dots.uv[nearest[clear]] - scene.uv[clear] if len(dots) else np.zeros((0, 2))
    bound = _bounds(scene, noise)[clear]
    false = int((distance[scene.present].min(0) > MATCH).sum()) if len(dots) else 0
    sigma = dots.sigma[nearest[clear]] if len(dots) else np.zeros(0)
    touching = scene.merged & scene.present & ~scene.covered
    return {'error2': float((error**2).sum()), 'bound2': float((bound**2).sum()), 'matched': int(clear.sum()),
        'true': int(scene.clear.sum()),
            'false': false, 'normal2': float((error**2 / sigma[:, None] ** 2).sum() / 2), 'touching': int(touching.sum()),
            'touching_missed': int((touching & ~matched).sum())}


def _bounds(scene, noise: float) -> np.ndarray:
    """Of all dots, px; kept in the scene."""
    kept = scene.extra.setdefault('bounds', {})
    if noise not in kept:
        kept[noise] = position_bound(scene.diameter, scene.amplitude, scene.psf, noise)
    return kept[noise]


def run(seeds, frames: int, noises=NOISES, names=NAMES, size: tuple[int, int] = (640, 480)) -> dict:
    """Scores[method][scene][noise]: sums of score() and 'ms', the times of single frames; size: of images, (width, height) px, 4 : 3."""
    cv2.setNumThreads(1)
    results = defaultdict(lambda: defaultdict(lambda: defaultdict(lambda: defaultdict(float))))
    times = defaultdict(list)
    for name in names:
        for seed in seeds:
            scene = make_scene(name, seed, size=size, pitch=18 * size[0] / 640)
            for noise in noises:
                rng = np.random.default_rng([seed, int(noise)])
                compared = detectors(size[0] / 640)
                for turn in range(frames + 1):
                    image = scene.frame(noise, rng)
                    for method, detector in compared.items():
                        dots, spent = _timed(detector, image)
                        if turn == 0:
                            continue  # the first frame measures the dots' appearance
                        times[method, name, noise].append(spent)
                        for key, value in score(scene, dots, noise).items():
                            results[method][name][noise][key] += value
    return {m: {s: {n: dict(sums, ms=1e3 * float(np.median(times[m, s, n]))) for n, sums in by.items()} for s, by in scenes.items()}
            for m, scenes in results.items()}


def _timed(detector, image):
    start = time.thread_time()
    try:
        dots = detector.detect(image)
    except BadFrame:
        dots = Dots(np.zeros((0, 2)), np.zeros(0), np.zeros(0))
    return dots, time.thread_time() - start


def summary(sums: dict) -> dict:
    """Ratios of one cell's sums."""
    return {'error_over_bound': (sums['error2'] / max(sums['bound2'], 1e-12)) ** 0.5,
        'missed_per_1000': 1e3 * (1 - sums['matched'] / sums['true']),
            'false_per_1000': 1e3 * sums['false'] / sums['true'], 'normalised_variance': sums['normal2'] / max(sums['matched'], 1),
            'touching_missed': int(sums['touching_missed']), 'touching': int(sums['touching']), 'ms': sums['ms']}
