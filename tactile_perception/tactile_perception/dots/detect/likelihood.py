# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The default dot detector: candidates, a maximum-likelihood fit of each, and rejection of fits that are not dots."""
from __future__ import annotations

from dataclasses import replace

import numpy as np
from tactile_perception._core import measure_dots

from .appearance import Look, measure_look, select_channel, shrink
from .candidates import find_candidates
from ...common.dots import Dots
from .disc_model import DiscModel
from ...errors import BadFrame

_FEWEST = 4  # dots; with fewer, the appearance is measured again. Chosen
_MOST_GROWTH = 2.2  # times the typical diameter: the largest diameter searched. Chosen


class LikelihoodDetector:
    """Detects dots: peaks of a reduced image (candidates.py), then a maximum-likelihood fit of each, without the images of overlapping
    neighbours, and its judgement (kernel measure_dots: src/dots/detect/dot_fits.cpp, dot_judge.cpp)."""

    def __init__(self, sign: int):
        self._sign = sign
        self._look: Look | None = None
        self._model: DiscModel | None = None
        self._usual = np.nan  # median ratio of residual to contrast when the appearance was measured

    def detect(self, image: np.ndarray) -> Dots:
        """Dots of one checked uint8 image. Raises BadFrame if there are none."""
        if self._look is not None:
            dots = self._detect_all_sizes(image)
            if len(dots) >= _FEWEST:
                return dots
        before = self._look, self._model, self._usual
        try:
            return self._detect_anew(image)
        except BadFrame:  # this frame alone may be bad; measuring the appearance again is costly
            self._look, self._model, self._usual = before
            raise

    def _detect_anew(self, image):
        """Measure the appearance of dots in this image and detect them. Raises BadFrame for fewer than _FEWEST."""
        self._take(measure_look(image, self._sign))
        self._usual = np.nan
        dots = self._detect_all_sizes(image)
        if len(dots) < _FEWEST:
            raise BadFrame(f'only {len(dots)} dots found in the frame: check light, focus and the parameter polarity')
        return dots

    def _take(self, look):
        self._model = DiscModel(look.smallest, look.largest, look.blur)
        self._look = look

    def _detect_all_sizes(self, image):
        """Detect, and repeat with a larger range of diameters if some dots exceed it."""
        dots, outgrown = self._detect(image)
        if outgrown and self._look.largest < _MOST_GROWTH * self._look.typical:
            self._take(replace(self._look, largest=1.15 * self._look.largest))
            dots, _ = self._detect(image)
        return dots

    def _detect(self, image) -> tuple[Dots, bool]:
        """Dots, and whether some exceed the model's largest diameter."""
        look = self._look
        grey = np.ascontiguousarray(shrink(select_channel(image, look.channel), look.step))
        found, outgrown, self._usual = measure_dots(
            grey, find_candidates(grey, look), **self._model.tables, typical=look.typical, contrast=look.contrast,
            ground=round(look.ground), noise=look.noise, usual=self._usual)
        return Dots((found[:, :2] + 0.5) * look.step - 0.5, found[:, 2] * look.step**2, found[:, 3] * look.step), outgrown
