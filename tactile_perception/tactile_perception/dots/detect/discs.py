# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Detector of worn, speckled or textured markers from about 7 px, in any arrangement, as whole discs."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from .appearance import CHANNELS, select_channel
from ...common.dots import Dots
from .disc_correlation import Peaks, explained_energy, find_discs, measure_diameter
from .disc_fit import fit_discs
from ...errors import BadFrame

_TOO_WIDE = 1.15  # diameter of the filter with the best response over that of the disc, because of the blurred edge (measured)
_LOST_SHARE = 0.6  # of the discs at the last measurement of the appearance; with fewer, it is measured anew. Chosen
_NEIGHBOURS = 8  # discs whose median amplitude is the local reference, since light varies over the image. Chosen
_FAINT = 0.45  # of the neighbours' amplitude, least of a disc; less is dirt or a fold. Chosen
_UNLIKE = 0.68  # of the typical correlation, least of a disc. Chosen
_FEWEST = 4  # discs
_DOUBLE = 0.7  # diameters within which the weaker of two detections is a duplicate. Chosen


@dataclass
class _Appearance:
    """channel: in CHANNELS; diameter: px; count: of discs."""

    channel: str
    diameter: float
    count: int


class DiscDetector:
    """Discs by normalised correlation at their own scale; sign: 1 for bright ones, -1 for dark. Channel and scale are measured in the
    first frame, and again when many discs are lost."""

    def __init__(self, sign: int):
        self._sign = sign
        self._appearance: _Appearance | None = None

    def detect(self, image: np.ndarray) -> Dots:
        """Discs of one checked uint8 image. Raises BadFrame with fewer than four."""
        dots = None if self._appearance is None else self._find(image)
        if dots is None or len(dots) < _LOST_SHARE * self._appearance.count:
            self._appearance = self._measure_appearance(image)
            dots = self._find(image)
            self._appearance.count = len(dots)
        if len(dots) < _FEWEST:
            raise BadFrame('fewer than four discs found in the frame: check light, focus and the parameter polarity')
        return dots

    def _find(self, image) -> Dots:
        grey, diameter = select_channel(image, self._appearance.channel), self._appearance.diameter
        found = find_discs(grey, self._sign, diameter)
        kept = _strong(found)
        if not kept.any():
            return Dots(np.zeros((0, 2)), np.zeros(0), np.zeros(0))
        dots = fit_discs(grey, self._sign, found.uv[kept], diameter / _TOO_WIDE)
        single = _single(dots.uv, found.correlation[kept], _DOUBLE * diameter / _TOO_WIDE)
        return Dots(dots.uv[single], dots.area[single], dots.sigma[single])

    def _measure_appearance(self, image) -> _Appearance:
        """Scale from the grey image, or from the first channel that shows discs; then the channel with the clearest discs."""
        channels = CHANNELS if image.ndim == 3 else CHANNELS[-1:]
        planes = {channel: select_channel(image, channel) for channel in channels}
        for channel in reversed(channels):
            diameter = measure_diameter(planes[channel], self._sign)
            if np.isfinite(diameter):
                best = max(channels, key=lambda name: _clearness(find_discs(planes[name], self._sign, diameter), diameter))
                return _Appearance(best, diameter, 0)
        kind = 'bright' if self._sign > 0 else 'dark'
        raise BadFrame(f'no {kind} discs found in the frame: check light, focus and the parameter polarity')


def _clearness(found: Peaks, diameter: float) -> float:
    """Explained energy normalised by the contrast, independent of the channel's gain."""
    energy = explained_energy(found, diameter)
    return energy / np.median(found.amplitude)**2 if energy > 0 else 0.0


def _strong(found: Peaks) -> np.ndarray:
    """(N,) bool: amplitude near that of the neighbours, and correlation near the typical one."""
    if len(found) < 2:
        return np.ones(len(found), bool)
    near = scipy.spatial.cKDTree(found.uv).query(found.uv, min(_NEIGHBOURS + 1, len(found)))[1]
    strong = found.amplitude > _FAINT * np.median(found.amplitude[near], axis=1)
    return strong & (found.correlation > _UNLIKE * np.median(found.correlation[strong]))


def _single(uv: np.ndarray, score: np.ndarray, apart: float) -> np.ndarray:
    """(N,) bool: without the lower score (N,) of any two positions uv (N, 2) px closer than apart, px."""
    kept = np.ones(len(uv), bool)
    for a, b in scipy.spatial.cKDTree(uv).query_pairs(apart, output_type='ndarray'):
        if kept[a] and kept[b]:
            kept[a if score[a] < score[b] else b] = False
    return kept
