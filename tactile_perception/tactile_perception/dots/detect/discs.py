# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Worn, speckled or textured markers, bright or dark, from about 7 px across, in any arrangement: found and fitted as whole discs."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .appearance import CHANNELS, select_channel
from ...common.dots import Dots
from .disc_correlation import Peaks, explained_energy, find_discs, measure_diameter
from .disc_fit import fit_discs
from ...errors import BadFrame

_TOO_WIDE = 1.15  # the filter answers best to a disc this much smaller than itself, whose blurred edge it holds as well (measured)
_LOST_SHARE = 0.6  # of the discs seen at the last look: with fewer, what they look like is measured anew
_NEIGHBOURS = 8  # discs about one, by whose amplitude it is judged: light may be three times as strong elsewhere
_FAINT = 0.45  # of its neighbours' amplitude: no disc, but dirt or a fold
_UNLIKE = 0.68  # of the typical correlation: what is less like a disc than its fellows is none
_FEWEST = 4
_DOUBLE = 0.7  # of the diameter: of two discs nearer to each other one is none


@dataclass
class _Look:
    """channel: in CHANNELS; diameter: px; count: of discs."""

    channel: str
    diameter: float
    count: int


class DiscDetector:
    """Discs by normalised correlation at their own scale; sign: 1 for bright ones, -1 for dark. Channel and scale are measured in the first
    frame, and again when fewer are found."""

    def __init__(self, sign: int):
        self._sign = sign
        self._look: _Look | None = None

    def detect(self, image: np.ndarray) -> Dots:
        """Discs of one checked uint8 image. Raises BadFrame where there are no four."""
        dots = None if self._look is None else self._find(image)
        if dots is None or len(dots) < _LOST_SHARE * self._look.count:
            self._look = self._first_look(image)
            dots = self._find(image)
            self._look.count = len(dots)
        if len(dots) < _FEWEST:
            raise BadFrame('no four discs stand out in the frame: check light, focus and the parameter polarity')
        return dots

    def _find(self, image) -> Dots:
        grey, diameter = select_channel(image, self._look.channel), self._look.diameter
        found = find_discs(grey, self._sign, diameter)
        kept = _strong(found)
        if not kept.any():
            return Dots(np.zeros((0, 2)), np.zeros(0), np.zeros(0))
        dots = fit_discs(grey, self._sign, found.uv[kept], diameter / _TOO_WIDE)
        single = _single(dots.uv, found.correlation[kept], _DOUBLE * diameter / _TOO_WIDE)
        return Dots(dots.uv[single], dots.area[single], dots.sigma[single])

    def _first_look(self, image) -> _Look:
        """The grey image tells the scale, where it shows discs at all; then the channel is taken in which they are clearest."""
        channels = CHANNELS if image.ndim == 3 else CHANNELS[-1:]
        planes = {channel: select_channel(image, channel) for channel in channels}
        for channel in reversed(channels):
            diameter = measure_diameter(planes[channel], self._sign)
            if np.isfinite(diameter):
                best = max(channels, key=lambda name: _clearness(find_discs(planes[name], self._sign, diameter), diameter))
                return _Look(best, diameter, 0)
        kind = 'bright' if self._sign > 0 else 'dark'
        raise BadFrame(f'no {kind} discs stand out in the frame: check light, focus and the parameter polarity')


def _clearness(found: Peaks, diameter: float) -> float:
    """How clearly discs stand out, whatever the gain of the channel."""
    energy = explained_energy(found, diameter)
    return energy / np.median(found.amplitude)**2 if energy > 0 else 0.0


def _strong(found: Peaks) -> np.ndarray:
    """(N,) bool: about as bright over the ground as the neighbours, and as like a disc as most."""
    if len(found) < 2:
        return np.ones(len(found), bool)
    near = cKDTree(found.uv).query(found.uv, min(_NEIGHBOURS + 1, len(found)))[1]
    strong = found.amplitude > _FAINT * np.median(found.amplitude[near], axis=1)
    return strong & (found.correlation > _UNLIKE * np.median(found.correlation[strong]))


def _single(uv: np.ndarray, score: np.ndarray, apart: float) -> np.ndarray:
    """(N,) bool: of two places uv (N, 2) nearer than apart, px, that with the better score (N,)."""
    kept = np.ones(len(uv), bool)
    for a, b in cKDTree(uv).query_pairs(apart, output_type='ndarray'):
        if kept[a] and kept[b]:
            kept[a if score[a] < score[b] else b] = False
    return kept
