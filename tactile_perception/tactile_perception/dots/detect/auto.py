# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Automatic choice of the detector: likelihood or blobs for intact markers, discs for worn ones."""
from __future__ import annotations

import numpy as np
import scipy

from .blobs import BlobDetector
from ...common.dots import Dots
from .discs import DiscDetector
from ...errors import BadFrame
from .likelihood import LikelihoodDetector

_EXACT = (LikelihoodDetector, BlobDetector)  # in order of accuracy
_ALL = 0.95  # least recall and precision of a detector, against the discs. Chosen
_NEAR = 0.35  # diameters within which two positions are one marker. Chosen
_LOST_SHARE, _MORE = 0.6, 1.3  # of the dots when the choice was made; with fewer, or more (fragments), it is made anew. Chosen


class AutoDetector:
    """The first of likelihood and blobs that agrees with discs, else discs.

    Chosen in the first frame, and again when the number of dots changes much. sign: 1 for bright dots, -1 for dark ones.
    """

    def __init__(self, sign: int):
        self._sign, self._count = sign, 0
        self._chosen = None

    @property
    def chosen(self) -> str:
        """Name of the chosen class, '' before the first frame."""
        return '' if self._chosen is None else type(self._chosen).__name__

    def detect(self, image: np.ndarray) -> Dots:
        """Dots of one checked uint8 image. Raises BadFrame where no method finds any."""
        dots = None if self._chosen is None else _tried(self._chosen, image)
        if dots is None or not _LOST_SHARE * self._count <= len(dots) <= _MORE * self._count:
            dots = self._choose(image)
            self._count = len(dots)
        return dots

    def _choose(self, image) -> Dots:
        discs = DiscDetector(self._sign)
        seen = _tried(discs, image)
        for kind in _EXACT:
            detector = kind(self._sign)
            dots = _tried(detector, image)
            if dots is not None and (seen is None or _agree(dots, seen)):
                self._chosen = detector
                return dots
        if seen is None:
            raise BadFrame('no method finds dots in the frame: check light, focus and the parameter polarity')
        self._chosen = discs
        return seen


def _tried(detector, image) -> Dots | None:
    try:
        return detector.detect(image)
    except BadFrame:
        return None


def _agree(dots: Dots, discs: Dots) -> bool:
    """Whether dots match discs with recall and precision of at least _ALL."""
    if not len(dots):
        return False
    reach = _NEAR * 2 * np.sqrt(np.median(discs.area) / np.pi)
    found = scipy.spatial.cKDTree(dots.uv).query(discs.uv)[0] < reach
    true = scipy.spatial.cKDTree(discs.uv).query(dots.uv)[0] < reach
    return bool(found.mean() >= _ALL and true.mean() >= _ALL)
