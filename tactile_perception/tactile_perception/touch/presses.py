# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Presses with known truth: what touch methods are fitted to, and judged by."""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..errors import BadArgument
from .field import MarkerField

SAME_PLACE = 1e-3  # m: presses nearer than this are at one place


@dataclass(frozen=True)
class Presses:
    """M frames with what the stage knows of them.

    fields: M MarkerFields; position: (M, 3) m, the tip, NaN where nothing touches; depth: (M,) m, 0 where nothing touches; segment: (M,)
    int, which press; wrench: (M, 6) N and N m, NaN where not known; radius: (M,) m of the tool's tip, NaN where not known. Raises
    BadArgument where lengths differ.
    """

    fields: tuple[MarkerField, ...]
    position: np.ndarray
    depth: np.ndarray
    segment: np.ndarray
    wrench: np.ndarray
    radius: np.ndarray

    def __post_init__(self):
        count = len(self.fields)
        shapes = {'position': (count, 3), 'depth': (count,), 'segment': (count,), 'wrench': (count, 6), 'radius': (count,)}
        for name, shape in shapes.items():
            if np.shape(getattr(self, name)) != shape:
                raise BadArgument(f'presses: {name} must have shape {shape}, got {np.shape(getattr(self, name))}')

    def __len__(self) -> int:
        return len(self.fields)

    @property
    def touching(self) -> np.ndarray:
        """(M,) bool: frames in which the tool touches."""
        return (self.depth > 0) & np.isfinite(self.position).all(1)

    def select(self, keep: np.ndarray) -> Presses:
        """The frames where keep (M,) bool."""
        return Presses(tuple(field for field, kept in zip(self.fields, keep) if kept), self.position[keep], self.depth[keep],
                       self.segment[keep], self.wrench[keep], self.radius[keep])

    def places(self) -> np.ndarray:
        """(M,) int, number of the place pressed, counted from 0 in order of appearance; -1 where nothing touches."""
        place, known = np.full(len(self), -1), np.zeros((0, 2))
        for k in np.flatnonzero(self.touching):
            xy = self.position[k, :2]
            near = np.flatnonzero(np.hypot(*(known - xy).T) < SAME_PLACE)
            place[k] = near[0] if len(near) else len(known)
            known = known if len(near) else np.vstack([known, xy])
        return place

    def held_out(self, folds: int = 3) -> Iterator[tuple[Presses, Presses]]:
        """Pairs (to fit, held out): in each, every so many-th place is held out; untouched frames are always among those to fit."""
        place = self.places()
        for fold in range(folds):
            held = (place >= 0) & (place % folds == fold)
            if held.any() and (self.touching & ~held).any():
                yield self.select(~held), self.select(held)
