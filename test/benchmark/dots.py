# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Time and accuracy of finding dots in an image, methods interleaved: the part dots of run.py.

Error relative to the Cramer-Rao bound (2-D RMS of dots neither overlapping nor under glare), missed and false dots per thousand, standard
deviation of the errors relative to the stated sigma.
"""
from __future__ import annotations

import time
from collections import defaultdict

import cv2
import numpy as np
from printed_dots import NAMES, make_scene, position_bound

from tactile_perception.common.dots import Dots
from tactile_perception.core.errors import BadFrame
from tactile_perception.dots.detect import METHODS, DotDetector

NOISE, NOISES = 2.0, (1.0, 2.0, 4.0, 8.0)  # grey levels
MATCH = 3.0  # px: a dot farther than this from every true position is false


class BlobDetector:
    """cv2.SimpleBlobDetector with its own search over thresholds, given the size of the dots; scale: of the image against 640 x 480."""

    def __init__(self, scale: float):
        wanted = cv2.SimpleBlobDetector_Params()
        wanted.blobColor = 0
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

    def __init__(self, scale: float):
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
    found['SimpleBlobDetector'] = BlobDetector(scale)
    try:
        found['trackpy'] = TrackpyDetector(scale)
    except ImportError:
        pass
    return found


def score(scene, dots, noise: float) -> dict:
    """Sums that can be added over frames: squared errors and bounds (px^2), counts of dots true, matched and false, and squared errors over
    sigma."""
    distance = np.hypot(*(scene.uv[:, None] - dots.uv[None]).transpose(2, 0, 1)) if len(dots) else np.full((len(scene.uv), 1), np.inf)
    nearest = distance.argmin(1)
    clear = scene.clear & (distance[np.arange(len(nearest)), nearest] < MATCH)
    error = dots.uv[nearest[clear]] - scene.uv[clear] if len(dots) else np.zeros((0, 2))
    sigma = dots.sigma[nearest[clear]] if len(dots) else np.zeros(0)
    bound = position_bound(scene.diameter, scene.amplitude, noise)[clear]
    return {'error2': float((error**2).sum()), 'bound2': float((bound**2).sum()), 'matched': int(clear.sum()),
            'true': int(scene.clear.sum()), 'false': int((distance[scene.present].min(0) > MATCH).sum()) if len(dots) else 0,
            'normal2': float((error**2 / sigma[:, None] ** 2).sum() / 2)}


def find(seed: int, frames: int, names=NAMES, size: tuple[int, int] = (640, 480)) -> dict[str, tuple[dict, float]]:
    """Method -> sums of score() over scenes, and ms of a frame; size: of images, (width, height) px, 4 : 3."""
    cv2.setNumThreads(1)
    sums, times = defaultdict(lambda: defaultdict(float)), defaultdict(lambda: defaultdict(list))
    for name in names:
        scene = make_scene(name, seed, size=size, pitch=18 * size[0] / 640)
        rng, compared = np.random.default_rng([seed, int(NOISE)]), detectors(size[0] / 640)
        for turn in range(frames + 1):
            image = scene.frame(NOISE, rng)
            for method, detector in compared.items():
                begin = time.thread_time()
                try:
                    dots = detector.detect(image)
                except BadFrame:
                    dots = Dots(np.zeros((0, 2)), np.zeros(0), np.zeros(0))
                spent = time.thread_time() - begin
                if turn:  # the first frame measures the dots' appearance
                    times[method][name].append(spent)
                    for key, value in score(scene, dots, NOISE).items():
                        sums[method][key] += value
    return {method: (dict(found), 1e3 * float(np.median([np.median(spent) for spent in times[method].values()])))
            for method, found in sums.items()}
