# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The default dot detector: candidates, a maximum-likelihood fit of each, and rejection of fits that are not dots."""
from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from .appearance import Look, measure_look, select_channel, shrink
from .background import GroundSlopes
from .candidates import find_candidates
from ...common.dots import Dots
from .deblend import Separator
from ...errors import BadFrame
from .subpixel import LikelihoodFitter

_FEWEST = 4  # dots; with fewer, the appearance is measured again. Chosen
_OFF_CENTRE = 0.9  # px from its patch's centre beyond which a dot is fitted in a new patch. Chosen; the nodes end at 1 px
_MOST_GROWTH = 2.2  # times the typical diameter: the largest diameter searched. Chosen
_UNLIKE = 1.6  # residual over contrast after the first fit; no neighbour causes more, so larger means no dot. Chosen
_UNUSUAL = 2.5  # times the median ratio of residual to contrast: larger means no dot. Chosen
_SAME_KIND = 1.2  # times the median ratio when the appearance was measured: bounds the median. Chosen
_UNLIKEST = 0.3  # largest ratio of residual to contrast of a dot. Chosen
_NONE = Dots(np.empty((0, 2)), np.empty(0), np.empty(0)), np.empty(0, np.int64)


class LikelihoodDetector:
    """Detects dots: peaks of a reduced image, then a maximum-likelihood fit of each (candidates.py, subpixel.py, background.py)."""

    def __init__(self, sign: int):
        self._sign = sign
        self._look: Look | None = None
        self._fitter: LikelihoodFitter | None = None
        self._separator: Separator | None = None
        self._slopes: GroundSlopes | None = None  # of the last frame
        self._outgrown = False
        self._usual: float | None = None  # median ratio of residual to contrast when the appearance was measured

    def detect(self, image: np.ndarray) -> Dots:
        """Dots of one checked uint8 image. Raises BadFrame if there are none."""
        if self._look is not None:
            dots = self._detect_all_sizes(image)
            if len(dots) >= _FEWEST:
                return dots
        before = self._look, self._fitter, self._separator, self._usual
        try:
            return self._detect_anew(image)
        except BadFrame:  # this frame alone may be bad; measuring the appearance again is costly
            self._look, self._fitter, self._separator, self._usual = before
            raise

    def _detect_anew(self, image):
        """Measure the appearance of dots in this image and detect them. Raises BadFrame for fewer than _FEWEST."""
        self._take(measure_look(image, self._sign))
        self._usual = None
        dots = self._detect_all_sizes(image)
        if len(dots) < _FEWEST:
            raise BadFrame(f'only {len(dots)} dots found in the frame: check light, focus and the parameter polarity')
        return dots

    def _take(self, look):
        self._fitter = LikelihoodFitter(look.smallest, look.largest, look.blur)
        self._separator = Separator(look, self._fitter)
        self._look = look

    def _detect_all_sizes(self, image):
        """Detect, and repeat with a larger range of diameters if some dots exceed it."""
        self._outgrown = False
        dots = self._detect(image)
        if self._outgrown and self._look.largest < _MOST_GROWTH * self._look.typical:
            self._take(replace(self._look, largest=1.15 * self._look.largest))
            dots = self._detect(image)
        return dots

    def _detect(self, image):
        grey = self._grey(image)
        places = find_candidates(grey, self._look)
        return self._measure(grey, places, np.full(len(places), self._look.typical))[0]

    def refind(self, image: np.ndarray, uv: np.ndarray, area: np.ndarray) -> tuple[Dots, np.ndarray] | None:
        """See DotDetector.refind."""
        if self._look is None:
            return None
        self._outgrown = False
        step = self._look.step
        found = self._measure(self._grey(image), (uv + 0.5) / step - 0.5, np.sqrt(4 / np.pi * area) / step, True)
        return None if self._outgrown else found

    def _grey(self, image):
        return shrink(select_channel(image, self._look.channel), self._look.step)

    def _measure(self, grey, places, diameter, stay=False):
        """Dots near positions (N, 2) px with initial diameters (N,) px, and the index (M,) of each dot's position.

        stay: whether the positions are those of the last frame's dots.
        """
        look, fitter = self._look, self._fitter
        if not len(places):
            return _NONE
        padded = cv2.copyMakeBorder(grey, *[fitter.half] * 4, cv2.BORDER_REPLICATE)
        places, last = np.ascontiguousarray(places.T), np.array([[grey.shape[1] - 1], [grey.shape[0] - 1]])
        centre = np.minimum(np.maximum(np.rint(places), 0), last).astype(np.int64)
        compressed = fitter.compress(fitter.patches(padded, *centre), look.ground)
        fit = fitter.fit(compressed, *(places - centre), diameter, 2)
        off = fit.away() > _OFF_CENTRE
        pairs, some = self._separator.pairs(places, stay), None
        if off.any():
            some = self._hopeful(fit, compressed, off)
            if not len(some):
                return _NONE
            if len(some) < len(off):
                pairs = pairs.among(some, len(off))
                places, centre, diameter = places[:, some], centre[:, some], diameter[some]
                compressed, fit = compressed[some], fit.take(some)
            self._recentre(fit, compressed, padded, centre, pairs)
        single = self._separator.separate(fit, compressed, places, diameter, centre, pairs)
        dots, good = self._judge(fit, fitter.variances(compressed, fit), centre, single, last, stay)
        return dots, good if some is None else some[good]

    def _hopeful(self, fit, compressed, off):
        """Indices of the fits, without those that are off-centre, off (N,) bool, and leave a residual no dot leaves."""
        off = np.flatnonzero(off)
        unlike = self._fitter.variances(compressed[off], fit.take(off)) > (_UNLIKE * np.maximum(fit.amplitude[off] * self._sign, 0)) ** 2
        return np.delete(np.arange(len(compressed)), off[unlike])

    def _judge(self, fit, variance, centre, single, last, stay):
        """The accepted dots and their indices; single: (N,) bool, not duplicate; last: (2, 1), last column and row; stay: see _measure."""
        look, fitter = self._look, self._fitter
        fit.values[4] += look.ground
        uv = centre + fit.values[:2]
        good = self._plausible(fit, variance, uv, last) & single
        if not (stay and self._slopes.hold_for(fit.ground)):
            self._slopes = GroundSlopes(*uv, fit.ground, good, 2.5 * look.typical)
        fitter.correct_slope(fit, self._slopes.at(*uv))
        index = np.flatnonzero(good)
        uv = (centre + fit.values[:2]).take(index, axis=1)
        sigma = np.sqrt(variance * fitter.gains(fit)).take(index) * look.step
        area = np.pi / 4 * (fit.diameter.take(index) * look.step) ** 2
        return Dots(((uv + 0.5) * look.step - 0.5).T, area, sigma), index

    def _recentre(self, fit, compressed, padded, centre, pairs):
        """Fit off-centre dots again, in place, in patches around their fitted positions."""
        off = (fit.away() > _OFF_CENTRE) & (fit.amplitude * self._sign > 0)
        # the fit of an overlapping dot may have moved to its neighbour; deblend.py starts these at their peaks again
        off[pairs.i[pairs.distance < self._look.typical + 2]] = False
        off = np.flatnonzero(off)
        if not len(off):
            return
        step = np.rint(fit.values[:2, off]).astype(np.int64)
        limit = [[padded.shape[1] - 2 * self._fitter.half - 1], [padded.shape[0] - 2 * self._fitter.half - 1]]
        centre[:, off] = np.clip(centre[:, off] + step, 0, limit)
        compressed[off] = self._fitter.compress(self._fitter.patches(padded, *centre[:, off]), self._look.ground)
        fit.put(off, self._fitter.fit(compressed[off], *(fit.values[:2, off] - step), fit.diameter[off], 2))

    def _plausible(self, fit, variance, uv, last):
        """(N,) bool: contrast and size of a dot, shape of a disc, wholly inside the image; uv: (2, N) px; last: see _judge."""
        look = self._look
        contrast = fit.amplitude * self._sign
        good = (contrast > 0.2 * abs(look.contrast)) & (fit.diameter > look.smallest)
        good &= self._like_disc(contrast, np.sqrt(variance), good)
        good &= fit.away() < 1.4
        inside = np.minimum(uv, last - uv)
        good &= np.minimum(inside[0], inside[1]) >= fit.diameter / 2 + (look.blur - 0.5)
        small = fit.diameter < look.largest
        self._outgrown = bool((good & ~small).any())
        return good & small

    def _like_disc(self, contrast, rest, good):
        """(N,) bool: the residual is small. The limit rises where all dots differ from discs, as after lossy compression, and further if
        they did when the appearance was measured, as irregularly printed dots do. rest: (N,) grey levels, RMS residual."""
        look = self._look
        most = np.maximum(max(4 * look.noise, 0.1 * abs(look.contrast)), 0.12 * contrast)
        like = rest < most
        if self._usual is None and good.any():
            self._usual = float(np.median(rest[good] / contrast[good]))
        if (good & ~like).any():
            usual = np.median(rest[good] / contrast[good])
            like |= rest < contrast * max(min(1.7 * usual, 0.2), min(_UNUSUAL * min(usual, _SAME_KIND * self._usual), _UNLIKEST))
        return like
