# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Coarse place of a press, or of two: matched filter of the field with those of presses all over the sheet."""
from __future__ import annotations

from dataclasses import replace

import numpy as np

from .projection import Press
from .reduced_model import SheetLibrary
from .solver import show
from ..field import MarkerField

GRID = (13, 11)          # template places along x and y. Chosen
DEPTHS = (0.1, 0.4, 0.8)  # template depths over the library's largest. Chosen
PAIR_DEPTH = 1           # of DEPTHS: templates of two presses at once. Chosen
_MOVED = 1e-4            # m: an eye or untouched marker that changed by more renews the templates. Chosen


class SheetStart:
    """Matches fields of one marker pattern with templates. shift, m, growth: standard deviations of an untouched field."""

    def __init__(self, library: SheetLibrary, shift: float, growth: float):
        self._library, self._sigma = library, np.array([shift, shift, growth])
        x, y = (np.linspace(-0.95, 0.95, count) * reach for count, reach in zip(GRID, library.plan.reach))
        self._step = np.array([x[1] - x[0], y[1] - y[0]])
        places = np.stack(np.meshgrid(x, y, indexing='ij'), axis=-1).reshape(-1, 2)
        self._presses = [Press(place, depth * library.plan.depth) for place in places for depth in DEPTHS]
        self._rest = self._eye = np.zeros((0, 2))

    def best(self, field: MarkerField) -> tuple[Press, float]:
        """The best matching press, with depth scaled to the match, and the match in standard deviations of the noise or of the residual,
        whichever is larger."""
        self._renew(field)
        value = self._values(field)
        known = np.isfinite(value) & self._known
        value = np.where(known, value, 0.0)
        match, length = self._fields @ value.astype(np.float32), self._lengths(known)
        score = match / length
        k = int(np.argmax(score))
        press, best = self._presses[k], float(score[k])
        depth = min(max(press.depth * best / float(length[k]), 1e-5), self._library.plan.depth)
        left = (float(value @ value) - best**2) / max(np.count_nonzero(known), 1)
        return Press(self._between(score, k), depth), best / np.sqrt(max(left, 1.0))

    def best_pair(self, field: MarkerField) -> list[Press]:
        """The two presses whose fields, each scaled, add up to the field best; of the templates of PAIR_DEPTH, as best for the rest."""
        self._renew(field)
        value = self._values(field)
        known = np.isfinite(value) & self._known
        fields = np.where(known, self._fields[PAIR_DEPTH::len(DEPTHS)], 0.0)
        match, both = fields @ np.where(known, value, 0.0), fields @ fields.T + 1e-9 * np.eye(len(fields))
        own = np.diag(both)
        free = np.maximum(own[:, None] * own - both**2, 1e-3 * own[:, None] * own)  # alike ones tell nothing apart
        share = (match[:, None] * own - both * match) / free  # of the first of each pair
        told = np.where((share > 0) & (share.T > 0), share * match[:, None] + share.T * match, 0.0)
        first, second = np.unravel_index(np.argmax(told), told.shape)
        presses = self._presses[PAIR_DEPTH::len(DEPTHS)]
        return [replace(presses[k], depth=float(np.clip(presses[k].depth * share[k, other], 1e-5, self._library.plan.depth)))
                for k, other in ((first, second), (second, first))]

    def _values(self, field: MarkerField) -> np.ndarray:
        """(3 K,) shift and growth of all markers over their noise."""
        return (np.column_stack([field.shift, field.growth]) / self._sigma).ravel()

    def _lengths(self, known: np.ndarray) -> np.ndarray:
        """(P,) norms of the templates over the known values (3 K,)."""
        if not np.array_equal(known, self._last[0]):
            self._last = known, np.sqrt(np.maximum(self._fields**2 @ known.astype(np.float32), 1e-9))
        return self._last[1]

    def _between(self, score: np.ndarray, k: int) -> np.ndarray:
        """(2,) m: peak of the parabolas along x and y through the scores of press k and its neighbours."""
        place = self._presses[k].place.copy()
        grid = score.reshape(*GRID, len(DEPTHS))[..., k % len(DEPTHS)]
        at = np.divmod(k // len(DEPTHS), GRID[1])
        for axis, line in enumerate((grid[:, at[1]], grid[at[0]])):
            n = at[axis]
            if 0 < n < len(line) - 1:
                before, middle, after = line[n - 1:n + 2]
                place[axis] += self._step[axis] * 0.5 * (after - before) / max(2 * middle - before - after, 1e-9)
        return place

    def _renew(self, field: MarkerField) -> None:
        """Renew the templates where markers or eyes changed; a marker that is not seen keeps its last position."""
        if len(self._rest) == len(field):
            rest, eye = np.where(np.isfinite(field.rest), field.rest, self._rest), np.where(np.isfinite(field.eye), field.eye, self._eye)
            moved = [(np.abs(now - before) >= _MOVED).any() or np.count_nonzero(np.isnan(now)) != np.count_nonzero(np.isnan(before))
                     for now, before in ((rest, self._rest), (eye, self._eye))]
            if not any(moved):
                return
        else:
            rest, eye = field.rest, field.eye
        self._rest, self._eye = rest, eye
        known = np.isfinite(rest).all(1) & np.isfinite(eye).all(1)
        fields = np.zeros((len(self._presses), len(field), 3))
        for k, press in enumerate(self._presses):
            fields[k, known] = show(self._library, [press], rest[known], eye[known])[0] / self._sigma
        self._known = np.repeat(known, 3)
        self._fields = fields.reshape(len(fields), -1).astype(np.float32)
        self._last = np.zeros(0, bool), np.zeros(0)
