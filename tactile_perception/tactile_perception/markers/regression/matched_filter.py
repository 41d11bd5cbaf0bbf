# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Detection of a touch and its coarse place: matched filter of the displacement field with bells all over the sheet."""
from __future__ import annotations

import numpy as np

from .green_function import SheetBell
from ..touches.presses import Presses
from ..view.marker_field import MarkerField

NODES, EDGE = (15, 11), 0.86     # template bells along x and y; place of the outermost over the half side. Chosen
DEPTH, WIDTH = 0.03, 0.07        # depth and width of the templates over the short side. Chosen
DEEPEST = 1.0                    # of the short side: a deeper match is rejected. Chosen
SEEN = 12                        # markers needed. Chosen
SURE = 7.0                       # detection threshold, standard deviations of noise. Chosen
QUIETER = 1.5                    # detection threshold over the greatest score of untouched calibration frames. Chosen
NOISE = 2e-5                     # m, of displacements, where neither fields nor untouched frames give it. Chosen


class BellStart:
    """rest_noise: m, of displacements per axis, where a field has no sigma; quiet: the greatest score of untouched frames."""

    def __init__(self, bell: SheetBell, rest_noise: float, quiet: float):
        nodes = [np.linspace(-EDGE, EDGE, n) * side / 2 for n, side in zip(NODES, bell.size)]
        self.places = np.stack(np.meshgrid(*nodes), axis=-1).reshape(-1, 2)
        short = bell.size.min()
        shape = np.tile(np.log([DEPTH * short, WIDTH * short, 1.0]), (len(self.places), 1))
        predicted, _ = bell.predict(np.column_stack([self.places, shape]))
        self.templates = np.nan_to_num(predicted)
        self.depth, self.rest_noise, self.threshold = DEPTH * short, rest_noise, max(SURE, QUIETER * quiet)
        self._squares = self.templates**2

    def noise(self, field: MarkerField) -> np.ndarray:
        """(K,) m, standard deviation of each displacement per axis."""
        return np.where(np.isfinite(field.sigma), np.maximum(field.sigma, self.rest_noise / 2), self.rest_noise)

    def scores(self, field: MarkerField) -> tuple[np.ndarray, np.ndarray]:
        """For each template, the match in standard deviations of noise, and the depth over the template's."""
        known = np.repeat(field.seen, 2)
        shift = np.where(known, field.shift.ravel(), 0.0)
        match, size = self.templates @ shift, self._squares @ known
        size = np.maximum(size, 1e-3 * self._squares.sum(1))
        noise = np.median(self.noise(field)[field.seen]) if known.any() else self.rest_noise
        return match / (np.sqrt(size) * noise), match / size

    def find(self, field: MarkerField) -> np.ndarray | None:
        """(3,) place, m, and log depth of the best match; None below the threshold, for too few markers, or deeper than DEEPEST."""
        if field.seen.sum() < SEEN:
            return None
        score, depth = self.scores(field)
        best = int(score.argmax())
        if not score[best] > self.threshold or depth[best] > DEEPEST / DEPTH:
            return None
        return np.append(self.places[best], np.log(max(depth[best] * self.depth, 1e-5)))


def quiet_noise(presses: Presses) -> float:
    """m, standard deviation of displacements per axis: the larger of that of untouched frames and the fields' own sigma."""
    still = [field.shift for field, on in zip(presses.fields, presses.touching) if not on]
    sigma = np.concatenate([field.sigma for field in presses.fields])
    known = [np.sqrt(np.nanmean(np.square(still)))] if still else []
    known += [np.nanmedian(sigma)] if np.isfinite(sigma).any() else []
    return float(max(known, default=NOISE)) or NOISE
