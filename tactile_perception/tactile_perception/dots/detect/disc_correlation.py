# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Detection of worn, speckled or textured discs by normalised correlation with a disc on a ring of ground (kernel find_disc_peaks).

A threshold fragments a speckled disc; a filter of its size averages the speckles. Correlation: Lewis, Fast normalized cross-correlation,
1995. Scale: the one at which the discs explain most of the image's variance, in the spirit of Lindeberg's scale selection (1998).
"""
from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from tactile_perception._core import find_disc_peaks

SIZE = 13.0  # px, diameter of a disc in the filtered image. Chosen: averages speckles, keeps positions within a pixel
RING = 1.4  # outer diameter of the ring over that of the disc. Derived: excludes neighbours down to a pitch of 1.2 diameters
LEAST = 0.45  # correlation: twice that of pixel noise, two thirds of that of a disc with half of its ink
_SCANNED = 9.0  # px, diameter of a disc in the images of the scale search. Chosen
_DIAMETERS = 6.0 * 1.12 ** np.arange(20)  # px, from the smallest disc that is no dot to 52
_APART = 0.8  # diameters, least distance of two peaks. Chosen
_LINE = 0.6  # of a peak's correlation, a radius off on both sides: streaks of light keep more, 99 of 100 worn discs less (measured)
_SUBPIXEL = 8  # samples along a pixel's side where templates are made
_FEWEST = 4


@dataclass
class Peaks:
    """Discs: uv (N, 2) px; correlation (N,), 0 to 1; amplitude (N,): grey levels of disc over ring."""

    uv: np.ndarray
    correlation: np.ndarray
    amplitude: np.ndarray

    def __len__(self) -> int:
        return len(self.uv)


def shrunk(grey: np.ndarray, factor: float) -> tuple[np.ndarray, np.ndarray]:
    """Image (H, W) uint8 reduced by a factor up to 1 to (h, w) float32, and the exact factors (2,) along u and v after rounding of the
    size."""
    size = max(round(grey.shape[1] * factor), 1), max(round(grey.shape[0] * factor), 1)
    small = cv2.resize(grey, size, interpolation=cv2.INTER_AREA) if factor < 1 else grey
    return small.astype(np.float32), np.array([small.shape[1] / grey.shape[1], small.shape[0] / grey.shape[0]])


def find_discs(grey: np.ndarray, sign: int, diameter: float, size: float = SIZE, least: float = LEAST) -> Peaks:
    """Peaks of the correlation of an image (H, W) uint8 with a disc of this diameter, px.

    sign: 1 for bright discs, -1 for dark ones; size: px across a disc in the image that is filtered, at most as in grey.
    """
    small, scale = shrunk(grey, min(1.0, size / diameter))
    across = diameter * float(scale.mean())
    inside, support = _template(round(across, 2))
    u, v, correlation, amplitude = find_disc_peaks(small * np.float32(sign), inside, support, least=least, apart=int(_APART * across / 2),
                                                   margin=across / 2 - 0.5, radius=across / 2, line=_LINE).T
    return Peaks((np.stack([u, v], axis=1) + 0.5) / scale - 0.5, np.minimum(correlation, 0.999), amplitude)


def measure_diameter(grey: np.ndarray, sign: int) -> float:
    """Diameter, px, of the discs that explain most of an image (H, W) uint8; NaN where there are no four alike."""
    explained = np.zeros(len(_DIAMETERS))
    for k, diameter in enumerate(_DIAMETERS):
        if RING * diameter < min(grey.shape):
            explained[k] = explained_energy(find_discs(grey, sign, diameter, _SCANNED), diameter)
    best = int(explained.argmax())
    return float(_DIAMETERS[best]) if explained[best] > 0 else np.nan


def explained_energy(found: Peaks, diameter: float) -> float:
    """Squared grey levels times px^2 of an image that discs of this diameter, px, explain; of a brighter one no more than of most: a lamp's
    reflection is no disc."""
    if len(found) < _FEWEST:
        return 0.0
    amplitude = np.clip(found.amplitude, 0, np.median(found.amplitude))
    return float((amplitude**2 * found.correlation**2).sum() * diameter**2)


@lru_cache(maxsize=64)
def _template(across: float) -> tuple[np.ndarray, np.ndarray]:
    """(n, n) float32 share of each pixel inside a disc, px across, and inside disc and ring: one quadrant, from the centre outwards."""
    half = int(np.ceil(RING * across / 2 + 0.5))
    at = (np.arange((half + 1) * _SUBPIXEL) + 0.5) / _SUBPIXEL - 0.5
    away = np.hypot(at[:, None], at)
    fine = half + 1, _SUBPIXEL, half + 1, _SUBPIXEL
    return tuple((away < radius).reshape(fine).mean(axis=(1, 3)).astype(np.float32) for radius in (across / 2, RING * across / 2))
