# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Comparison of a reference with calibrated untouched positions.

A moved camera or a warm lens gives an affine motion of the image, another print independent errors. Non-affine displacements that
neighbours share are a press. If the dots that move least are at their calibrated positions, those can replace the reference.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from tactile_perception._core import nearest_others, reference_places

FEWEST = 30  # dots. Chosen
NEIGHBOURS = 4
SHARED_PART = 0.4  # correlation of neighbours' residuals, beyond which a press is suspected. Chosen
SHARED_SIZE = 0.1  # px, and its least size: slow sagging is less. Chosen
ROUNDS, KEPT = 3, 80  # affine fits, and percent of the dots with the least residuals that each uses. Chosen
STILLEST = 10  # percent of the dots, those that a press moves least. Chosen
STILL = 0.2  # pitches, their largest motion: a pressed dome leans as a whole. Chosen
STAYED = 0.05  # px, median distance from the calibrated positions of a camera that has not moved: the noise is less. Chosen


@dataclass(frozen=True)
class RestJudgement:
    """pressed: whether something pressed; known: whether the calibrated positions can replace the reference; reason: '' without a press;
    stayed: whether the dots are where they were calibrated, so that both show the same."""

    pressed: bool = False
    known: bool = True
    reason: str = ''
    stayed: bool = False


class CalibratedRest:
    """uv: (K, 2) px, calibrated untouched positions of all dots by index, NaN where unknown."""

    def __init__(self, uv: np.ndarray):
        self.uv = np.array(uv, float)

    def places(self, id: np.ndarray) -> np.ndarray:
        """Calibrated positions (N, 2) px of dots id (N,), NaN where unknown."""
        return reference_places(id, np.arange(len(self.uv)), self.uv)

    def judge(self, id: np.ndarray, uv: np.ndarray) -> RestJudgement:
        """Whether reference positions uv (N, 2) px (NaN: not seen) of dots id (N,) are untouched."""
        both = np.flatnonzero((id < len(self.uv)) & np.isfinite(uv).all(axis=1))
        both = both[np.isfinite(self.uv[id[both]]).all(axis=1)]
        if len(both) < FEWEST:
            return RestJudgement()
        rest = self.uv[id[both]]
        off = uv[both] - rest
        near, distance = nearest_others(rest, count=NEIGHBOURS)
        left = _affine_residual(rest, off)
        together, square = np.mean(left * np.mean(left[near], axis=1)), np.mean(left**2)
        shared = float(np.sqrt(2 * max(together, 0.0)))
        if together <= SHARED_PART * square or shared <= SHARED_SIZE:
            return RestJudgement(stayed=bool(np.median(np.hypot(*off.T)) <= STAYED))
        known = np.percentile(np.hypot(*off.T), STILLEST) <= STILL * np.median(distance[:, 0])
        seen = f'the first dots are off their calibrated untouched positions ({shared:.2f} px shared by neighbours)'
        if known:
            return RestJudgement(True, True, f'{seen}: the sensor was touched when the reference was taken. The calibrated positions are '
                                 'used until it is released')
        return RestJudgement(True, False, f'{seen}, all of them: the sensor was touched when the reference was taken, and the camera may '
                             'have moved. Release it, then call set_reference; if that does not help, calibrate again')


def _affine_residual(places: np.ndarray, off: np.ndarray) -> np.ndarray:
    """Residuals (N, 2) px of off (N, 2) px after a robust affine fit at places (N, 2) px."""
    basis = np.column_stack([np.ones(len(places)), places - places.mean(axis=0)])
    kept = np.ones(len(places), bool)
    for _ in range(ROUNDS):
        left = off - basis @ np.linalg.lstsq(basis[kept], off[kept], rcond=None)[0]
        distance = np.hypot(*left.T)
        kept = distance <= np.percentile(distance, KEPT)
    return left
