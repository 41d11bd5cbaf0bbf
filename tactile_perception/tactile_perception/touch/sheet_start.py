# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where a press may be: the field seen, matched against those of presses all over the sheet."""
from __future__ import annotations

import numpy as np

from .field import MarkerField
from .sheet_appearance import Press, appearance, read_press
from .sheet_library import SheetLibrary

GRID = (13, 11)          # places along x and y
DEPTHS = (0.1, 0.4, 0.8)  # of the library's largest
_MOVED = 1e-4            # m: an eye or a marker at rest that moved by more asks for new fields


class SheetStart:
    """Matches fields of the same untouched markers against a list of presses. shift, m, growth: standard deviations of a still field."""

    def __init__(self, library: SheetLibrary, shift: float, growth: float):
        self._library, self._sigma = library, np.array([shift, shift, growth])
        x, y = (np.linspace(-0.95, 0.95, count) * reach for count, reach in zip(GRID, library.plan.reach))
        places = np.stack(np.meshgrid(x, y, indexing='ij'), axis=-1).reshape(-1, 2)
        self._presses = [Press(place, depth * library.plan.depth) for place in places for depth in DEPTHS]
        self._rest = self._eye = np.zeros((0, 2))

    def best(self, field: MarkerField) -> tuple[Press, float]:
        """The press that matches the field best, its depth to scale, and by how many standard deviations it stands out of the noise, which
        is no less than what the press leaves unexplained."""
        self._renew(field)
        value = np.column_stack([field.shift, field.growth]) / self._sigma
        known = np.isfinite(value).ravel() & self._known
        value = np.where(known, np.nan_to_num(value.ravel()), 0.0)
        match, size = self._fields @ value, self._squares @ known
        score = match / np.sqrt(np.maximum(size, 1e-9))
        k = int(np.argmax(score))
        press = self._presses[k]
        depth = np.clip(press.depth * match[k] / max(size[k], 1e-9), 1e-5, self._library.plan.depth)
        left = (value @ value - score[k]**2) / max(known.sum(), 1)
        return Press(press.place, float(depth)), float(score[k] / np.sqrt(max(left, 1.0)))

    def _renew(self, field: MarkerField) -> None:
        """Work the fields out anew where markers or eyes are others than last time; one that is not seen leaves what is known of it."""
        if len(self._rest) == len(field):
            rest, eye = np.where(np.isfinite(field.rest), field.rest, self._rest), np.where(np.isfinite(field.eye), field.eye, self._eye)
            if np.nanmax(np.abs(np.hstack([rest - self._rest, eye - self._eye])), initial=0) < _MOVED \
                    and np.isnan(rest).sum() == np.isnan(self._rest).sum():
                return
        else:
            rest, eye = field.rest, field.eye
        self._rest, self._eye = rest, eye
        known = np.isfinite(rest).all(1) & np.isfinite(eye).all(1)
        fields = np.zeros((len(self._presses), len(field), 3))
        for k, press in enumerate(self._presses):
            fields[k, known] = appearance(read_press(self._library, press, rest[known]), rest[known], eye[known]) / self._sigma
        self._known = np.repeat(known, 3)
        self._fields = fields.reshape(len(fields), -1)
        self._squares = self._fields**2
