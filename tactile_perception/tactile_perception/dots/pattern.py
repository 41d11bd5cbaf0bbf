# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Non-rigid registration of dots to a known pattern, random or regular, from a single image, in the spirit of Myronenko and Song (Point set
registration: coherent point drift, 2010: Gaussian mixture, smooth displacement)."""
from __future__ import annotations

import numpy as np

from ..common.dots import Dots
from ..common.neighbours import Neighbours
from ..core.errors import BadArgument, BadFrame
from .constants import DOT
from .links import FARTHEST, link_positions


class Pattern:
    """Untouched positions uv (K, 2) px of a pattern's dots. Raises BadArgument for too few, too many, or collinear ones."""

    def __init__(self, uv: np.ndarray):
        uv = np.array(uv, np.float64)
        if uv.ndim != 2 or uv.shape[1:] != (2,) or len(uv) < DOT.min_pattern or not (np.abs(uv) < FARTHEST).all():
            raise BadArgument(f'a pattern needs at least {DOT.min_pattern} finite positions (K, 2), got shape {uv.shape}')
        if len(uv) > DOT.max_pattern:
            raise BadArgument(f'a pattern of {len(uv)} dots is too large to register, at most {DOT.max_pattern}; give rows and columns of '
                              'a grid')
        self.uv = uv
        distance = Neighbours(uv).query(uv, min(DOT.pattern_neighbours, len(uv) - 1) + 1)
        self.spacing = np.mean(distance[0][:, 1:4], axis=1)
        self._near = distance[1][:, 1:]
        self._unit = float(np.median(self.spacing))
        self._middle = uv.mean(axis=0)
        if np.linalg.matrix_rank(uv - self._middle, 1e-6 * self._unit) < 2:
            raise BadArgument('the positions of a pattern are collinear')
        self._basis, self._cost = self._modes()

    def match(self, uv: np.ndarray) -> np.ndarray:
        """Index in the pattern of each dot at uv (N, 2) px, (N,) int64, one to one; -1 where not certain."""
        uv = np.asarray(uv, np.float64).reshape(-1, 2)
        good = np.flatnonzero(np.abs(uv).max(axis=1, initial=0.0) < FARTHEST)
        id = np.full(len(uv), -1)
        if len(good) < DOT.min_matched * len(self.uv):
            return id
        printed, dot = np.zeros((2, 0), np.int64)
        moved = self.uv + np.median(uv[good], axis=0) - np.median(self.uv, axis=0)
        for start, width in ((self.uv, DOT.middle_width), (self.uv, DOT.coarse_width), (moved, DOT.coarse_width)):
            printed, dot = max((printed, dot), self._from(start, width, uv[good]), key=lambda answer: len(answer[0]))
            if len(printed) >= DOT.nearly_all_matched * len(self.uv):
                break
        if len(printed) >= DOT.min_matched * len(self.uv):
            id[good[dot]] = printed
        return id

    def _modes(self):
        """Affine and smooth modes of displacement (K, 3 + M), and their regularisation (3 + M,)."""
        scaled = (self.uv - self._middle) / self._unit
        square = ((scaled[:, None] - scaled)**2).sum(axis=2)
        size, modes = np.linalg.eigh(np.exp(-square / (2 * DOT.kernel_width**2)))
        size, modes = size[::-1][:DOT.modes], modes[:, ::-1][:, :DOT.modes]
        kept = size > 1e-6 * size[0]
        affine = np.column_stack([np.ones(len(scaled)), scaled])
        return np.column_stack([affine, modes[:, kept] * np.sqrt(size[kept])]), np.r_[np.full(3, 1e-6), np.full(kept.sum(), DOT.stiffness)]

    def _from(self, start, width, uv) -> tuple[np.ndarray, np.ndarray]:
        """Matched indices of the pattern and of dots, from start (K, 2) px; width: spacings, of the first mixture."""
        warped = start
        while width > DOT.fine_width:
            warped = self._step(start, warped, uv, width * self._unit)
            width *= DOT.cooling
        printed, dot = link_positions(warped, uv, DOT.match_gate * self._unit).T
        agrees = self._agreeing(printed, uv[dot])
        return printed[agrees], dot[agrees]

    def _step(self, start, warped, uv, width):
        """Positions (K, 2) px after one step of expectation and maximisation."""
        near = ((warped[:, None] - uv)**2).sum(axis=2)
        near *= -0.5 / width**2
        np.exp(near, out=near)
        share = near / (near.sum(axis=0) + DOT.outlier_density * 2 * np.pi * (width / self._unit)**2)
        mass = share.sum(axis=1)
        pull = share @ uv - mass[:, None] * start
        weighted = self._basis.T * mass
        matrix = weighted @ self._basis
        matrix[np.diag_indices_from(matrix)] += self._cost * (width / self._unit)**2
        return start + self._basis @ np.linalg.solve(matrix, self._basis.T @ pull)

    def _agreeing(self, printed, uv):
        """(M,) bool: matches near the affine prediction of their neighbours."""
        moved = np.full_like(self.uv, np.nan)
        moved[printed] = uv
        return (np.hypot(*(moved - _by_neighbours(self.uv, moved, self._near)).T) < DOT.max_disagreement * self._unit)[printed]


def _by_neighbours(rest, moved, near):
    """Predictions (K, 2) by the affine motion of neighbours near (K, n); NaN with fewer than four."""
    known = np.isfinite(moved[near][:, :, :1])
    count = known.sum(axis=1)
    from_rest, to = np.where(known, rest[near], 0), np.where(known, moved[near], 0)
    some = np.maximum(count, 1)
    middle, middle_to = from_rest.sum(axis=1) / some, to.sum(axis=1) / some
    x, y = (from_rest - middle[:, None]) * known, (to - middle_to[:, None]) * known
    square = x.transpose(0, 2, 1) @ x
    square += 1e-3 * (np.trace(square, axis1=1, axis2=2)[:, None, None] + 1e-9) * np.eye(2)
    affine = np.linalg.solve(square, x.transpose(0, 2, 1) @ y)
    expected = middle_to + ((rest - middle)[:, None] @ affine)[:, 0]
    return np.where(count >= 4, expected, np.nan)


class PatternNumbers:
    """Index of each dot in a pattern: calibrated positions uv (K, 2) px, or None to use the first frame's dots.

    Unlike tracks, indices do not depend on earlier frames, so independent recordings share them. Raises BadArgument as Pattern does.
    """

    def __init__(self, uv: np.ndarray | None = None):
        self._pattern = None if uv is None else Pattern(uv)

    def update(self, dots: Dots, stamp_s: float, size: tuple | None = None) -> np.ndarray:
        """Index (N,) int64 of each dot, -1 where not certain; stamp_s and size are ignored. Raises BadFrame if the first frame has no valid
        pattern."""
        if self._pattern is None:
            try:
                self._pattern = Pattern(dots.uv)
            except BadArgument as error:
                raise BadFrame(f'the first frame gives no pattern: {error}') from error
        return self._pattern.match(dots.uv)
