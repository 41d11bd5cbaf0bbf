# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Whether dots that are taken for untouched are where a calibration saw them untouched.

A camera that has moved a little, or a lens that is warm, shifts, turns and swells the whole picture, and another print is off by what
neighbours do not share. What neighbours share and no affine motion explains is a press. The dots that a press moves least then tell whether
the camera still stands where it did, so that the calibrated places can take the place of those that are seen.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

FEWEST = 30        # dots: with fewer, nothing is said
NEIGHBOURS = 4
SHARED_PART = 0.4  # of the square of what no affine motion explains, that neighbours share
SHARED_SIZE = 0.1  # px of it: what a sheet or a dome sags in time is less
ROUNDS, KEPT = 3, 80  # fits of the affine motion, each to the best so many percent of dots
STILLEST = 10      # percent of dots that hardly move under a press
STILL = 0.2        # pitches that they have moved by at the most: a dome that is pressed leans as a whole


@dataclass(frozen=True)
class RestJudgement:
    """pressed: whether something pressed; known: whether the calibrated places can be taken instead; reason: in words, '' where all is
    well."""

    pressed: bool = False
    known: bool = True
    reason: str = ''


class KnownRest:
    """uv: (K, 2) px, calibrated untouched places of all dots by number, NaN where not known."""

    def __init__(self, uv: np.ndarray):
        self.uv = np.array(uv, float)

    def judge(self, id: np.ndarray, uv: np.ndarray) -> RestJudgement:
        """Whether dots id (N,) that are taken for untouched at uv (N, 2) px (NaN: not seen) are so."""
        both = np.flatnonzero((id < len(self.uv)) & np.isfinite(uv).all(axis=1))
        both = both[np.isfinite(self.uv[id[both]]).all(axis=1)]
        if len(both) < FEWEST:
            return RestJudgement()
        rest = self.uv[id[both]]
        off = uv[both] - rest
        distance, near = cKDTree(rest).query(rest, NEIGHBOURS + 1)
        left = _not_affine(rest, off)
        together, square = np.mean(left * np.mean(left[near[:, 1:]], axis=1)), np.mean(left**2)
        shared = float(np.sqrt(2 * max(together, 0.0)))
        if together <= SHARED_PART * square or shared <= SHARED_SIZE:
            return RestJudgement()
        known = np.percentile(np.hypot(*off.T), STILLEST) <= STILL * np.median(distance[:, 1])
        seen = f'the first dots are not where they were untouched when calibrated ({shared:.2f} px that neighbours share)'
        if known:
            return RestJudgement(True, True, f'{seen}: the sensor was touched when the reference was taken. The calibrated places are used '
                                 'until it is released')
        return RestJudgement(True, False, f'{seen}, and none are: was the sensor touched when the reference was taken, and has the camera '
                             'moved? Release it, then call set_reference; if that does not help, calibrate again')


def _not_affine(places: np.ndarray, off: np.ndarray) -> np.ndarray:
    """off (N, 2) px less the affine motion of most of the places (N, 2) px."""
    basis = np.column_stack([np.ones(len(places)), places - places.mean(axis=0)])
    kept = np.ones(len(places), bool)
    for _ in range(ROUNDS):
        left = off - basis @ np.linalg.lstsq(basis[kept], off[kept], rcond=None)[0]
        distance = np.hypot(*left.T)
        kept = distance <= np.percentile(distance, KEPT)
    return left
