# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Patterns that are no grid: the dots of one image are registered to a known pattern of any kind, random or regular, without the images
in between, and numbered as the dots of that pattern."""
from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay, QhullError, cKDTree
from scipy.spatial.distance import cdist

from tactile_perception.dots.index.linker import FARTHEST, assign
from tactile_perception.errors import BadArgument, BadFrame

FEWEST, MOST = 8, 3000  # dots of a pattern; of more, the warps take minutes and gigabytes
MODES = 40  # smooth warps besides the affine ones
REACH = 3.0  # spacings over which a warp is alike
STIFFNESS = 1.0  # of the modes, against dots that are met within a spacing
COARSE, MIDDLE, FINE, COOLING = 1.5, 0.7, 0.15, 0.82  # spacings within which dots are met: at first, or if that fails, and at last
OUTLIERS = 0.1  # density of dots that belong to nothing, against the pattern's own
GATE = 0.45  # spacings: a dot further from its warped place is not matched
NEIGHBOURS = 8  # that say where a dot should be
DISAGREE = 0.35  # spacings by which it may be elsewhere
LEAST_MATCHED = 0.75  # of the pattern: with fewer, nothing is certain
NEARLY_ALL = 0.985  # with fewer, the pattern may have moved by more than was thought
SLENDER = 0.15  # height over longest side: flatter triangles may turn over


class Pattern:
    """Places of a pattern's dots while nothing touches, uv (K, 2) px. Raises BadArgument for fewer than eight, more than
    MOST, or ones in a line."""

    def __init__(self, uv: np.ndarray):
        uv = np.array(uv, np.float64)
        if uv.ndim != 2 or uv.shape[1:] != (2,) or len(uv) < FEWEST or not (np.abs(uv) < FARTHEST).all():
            raise BadArgument(f'a pattern is at least {FEWEST} finite places (K, 2), not an array of shape {uv.shape}')
        if len(uv) > MOST:
            raise BadArgument(f'a pattern of {len(uv)} dots is too large to register, the most is {MOST}; give rows and columns of a grid')
        self.uv = uv
        distance = cKDTree(uv).query(uv, min(NEIGHBOURS, len(uv) - 1) + 1)
        self.spacing = np.mean(distance[0][:, 1:4], axis=1)
        self._near = distance[1][:, 1:]
        self._unit = float(np.median(self.spacing))
        self._middle = uv.mean(axis=0)
        try:
            self._triangles = _stout(Delaunay(uv).simplices, uv)
        except QhullError as error:
            raise BadArgument('the places of a pattern lie in a line') from error
        self._basis, self._cost = self._modes()

    def match(self, uv: np.ndarray) -> np.ndarray:
        """Which of the pattern's dots each dot at uv (N, 2) px is, (N,) int64, -1 where not certain; one to one."""
        uv = np.asarray(uv, np.float64).reshape(-1, 2)
        good = np.flatnonzero(np.abs(uv).max(axis=1, initial=0.0) < FARTHEST)
        id = np.full(len(uv), -1)
        if len(good) < LEAST_MATCHED * len(self.uv):
            return id
        place, dot = np.zeros((2, 0), np.int64)
        moved = self.uv + np.median(uv[good], axis=0) - np.median(self.uv, axis=0)
        for start, width in ((self.uv, MIDDLE), (self.uv, COARSE), (moved, COARSE)):
            place, dot = max((place, dot), self._from(start, width, uv[good]), key=lambda answer: len(answer[0]))
            if len(place) >= NEARLY_ALL * len(self.uv):
                break
        if len(place) >= LEAST_MATCHED * len(self.uv):
            id[good[dot]] = place
        return id

    def _modes(self):
        """(K, 3 + M) affine and smooth modes of places, in spacings, and what each costs (3 + M,)."""
        scaled = (self.uv - self._middle) / self._unit
        square = ((scaled[:, None] - scaled)**2).sum(axis=2)
        size, modes = np.linalg.eigh(np.exp(-square / (2 * REACH**2)))
        size, modes = size[::-1][:MODES], modes[:, ::-1][:, :MODES]
        kept = size > 1e-6 * size[0]
        affine = np.column_stack([np.ones(len(scaled)), scaled])
        return np.column_stack([affine, modes[:, kept] * np.sqrt(size[kept])]), np.r_[np.full(3, 1e-6), np.full(kept.sum(), STIFFNESS)]

    def _from(self, start, width, uv) -> tuple[np.ndarray, np.ndarray]:
        """Matched places of the pattern and dots, from a first guess of the places (K, 2), good to width spacings."""
        warped = start
        while width > FINE:
            warped = self._step(start, warped, uv, width * self._unit)
            width *= COOLING
        place, dot = assign(warped, uv, GATE * self._unit)
        agrees = self._agreeing(place, uv[dot])
        return place[agrees], dot[agrees]

    def _step(self, start, warped, uv, width):
        """Places after one step of expectation and maximisation."""
        near = cdist(warped, uv, 'sqeuclidean')
        near *= -0.5 / width**2
        np.exp(near, out=near)
        share = near / (near.sum(axis=0) + OUTLIERS * 2 * np.pi * (width / self._unit)**2)
        mass = share.sum(axis=1)
        pull = share @ uv - mass[:, None] * start
        weighted = self._basis.T * mass
        matrix = weighted @ self._basis
        matrix[np.diag_indices_from(matrix)] += self._cost * (width / self._unit)**2
        return start + self._basis @ np.linalg.solve(matrix, self._basis.T @ pull)

    def _agreeing(self, place, uv):
        """(M,) bool of matches that are where the affine motion of their neighbours, as matched, takes them, in no triangle turned over."""
        moved = np.full_like(self.uv, np.nan)
        moved[place] = uv
        turned = self._turned(moved)
        expected = _by_neighbours(self.uv, moved, self._near)
        off = np.hypot(*(moved - expected).T)
        agrees = (off < DISAGREE * self._unit) & ~turned
        return agrees[place]

    def _turned(self, moved):
        """(K,) bool: in a triangle turned over that the others around it are not."""
        a, b, c = moved[self._triangles.T]
        p, q = b - a, c - a
        over = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0] <= 0  # false where one is missing
        turned = np.zeros(len(moved), bool)
        turned[self._triangles[over]] = True
        return turned


def _stout(triangles, uv):
    """Those triangles (T, 3) that are no slivers, all turning the same way."""
    a, b, c = uv[triangles.T]
    p, q = b - a, c - a
    twice = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
    longest = np.max([(p**2).sum(1), (q**2).sum(1), ((p - q)**2).sum(1)], axis=0)
    triangles = np.where((twice < 0)[:, None], triangles[:, ::-1], triangles)
    return triangles[np.abs(twice) > SLENDER * longest]


def _by_neighbours(rest, moved, near):
    """(K, 2) where the affine motion of each place's neighbours near (K, n) takes it, NaN where fewer than four are known."""
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
    """Gives each dot the number that it has in the pattern: calibrated places uv (K, 2) px, or None for the first frame's dots.

    Unlike tracks, numbers do not depend on the frames in between, so independent presses and recordings share them. Raises
    BadArgument for a pattern of too few dots.
    """

    def __init__(self, uv: np.ndarray | None = None):
        self._pattern = None if uv is None else Pattern(uv)

    def update(self, uv: np.ndarray, stamp_s: float) -> np.ndarray:
        """Number (N,) int64 of each dot at uv (N, 2) px, -1 where not certain; stamp_s is not used. Raises BadFrame where the first
        frame's dots make no pattern."""
        if self._pattern is None:
            try:
                self._pattern = Pattern(uv)
            except BadArgument as error:
                raise BadFrame(f'no pattern to number dots by: {error}') from error
        return self._pattern.match(uv)
