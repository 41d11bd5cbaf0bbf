# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a sheet is touched at all, and roughly where: the displacement field against bells all over the sheet (matched filter)."""
from __future__ import annotations

import numpy as np

from .green_function import SheetBell
from ..touches.presses import Presses
from ..view.marker_field import MarkerField

NODES, EDGE = (15, 11), 0.86     # bells along the sheet, the outermost at this part of the half side
DEPTH, WIDTH = 0.03, 0.07        # of the short side, of these bells
DEEPEST = 1.0                    # of the short side: no sheet is dented deeper
SPREAD = 0.03                    # of a bell's depth: what displacements sideways amount to; weighs places near the eye's foot
SEEN = 12                        # markers: with fewer nothing is told
SURE = 7.0                       # standard deviations of noise that a touch must stand out by
QUIETER = 1.5                    # times the greatest score of untouched frames in the calibration, the same
NOISE = 2e-5                     # m, of displacements where neither fields nor untouched frames tell


class BellStart:
    """rest_noise: m, of displacements per axis, where a field does not tell its own; quiet: the greatest score of untouched frames."""

    def __init__(self, bell: SheetBell, rest_noise: float, quiet: float):
        nodes = [np.linspace(-EDGE, EDGE, n) * side / 2 for n, side in zip(NODES, bell.size)]
        self.places = np.stack(np.meshgrid(*nodes), axis=-1).reshape(-1, 2)
        short = bell.size.min()
        shape = np.tile(np.log([DEPTH * short, WIDTH * short, 1.0]), (len(self.places), 1))
        told, _ = bell.predict(np.column_stack([self.places, shape]))
        self.templates = np.nan_to_num(told)
        self.depth, self.rest_noise, self.threshold = DEPTH * short, rest_noise, max(SURE, QUIETER * quiet)
        self._squares = self.templates**2

    def noise(self, field: MarkerField) -> np.ndarray:
        """(K,) m, standard deviation of each displacement per axis."""
        return np.where(np.isfinite(field.sigma), np.maximum(field.sigma, self.rest_noise / 2), self.rest_noise)

    def scores(self, field: MarkerField) -> tuple[np.ndarray, np.ndarray]:
        """For each bell, how many standard deviations of noise it stands out by, and its depth over that of the template."""
        known = np.repeat(field.seen, 2)
        shift = np.where(known, field.shift.ravel(), 0.0)
        match, size = self.templates @ shift, self._squares @ known
        size = np.maximum(size, 1e-3 * self._squares.sum(1))
        noise = np.median(self.noise(field)[field.seen]) if known.any() else self.rest_noise
        return match / (np.sqrt(size) * noise), match / size

    def find(self, field: MarkerField) -> np.ndarray | None:
        """(3,) place m and log depth of the bell that stands out most; None where none does, hardly any marker is seen, or no sheet
        could be so deep."""
        if field.seen.sum() < SEEN:
            return None
        score, depth = self.scores(field)
        best = int(score.argmax())
        if not score[best] > self.threshold or depth[best] > DEEPEST / DEPTH:
            return None
        return np.append(self.places[best], np.log(max(depth[best] * self.depth, 1e-5)))


def quiet_noise(presses: Presses) -> float:
    """m, standard deviation of displacements per axis: of untouched frames, or what the fields tell, whichever is more."""
    still = [field.shift for field, on in zip(presses.fields, presses.touching) if not on]
    told = np.concatenate([field.sigma for field in presses.fields])
    known = [np.sqrt(np.nanmean(np.square(still)))] if still else []
    known += [np.nanmedian(told)] if np.isfinite(told).any() else []
    return float(max(known, default=NOISE)) or NOISE
