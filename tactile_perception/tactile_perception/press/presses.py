# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Presses with ground truth, to which touch methods are fitted and with which they are evaluated."""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..errors import BadArgument
from .field import MarkerField

SAME_PLACE = 1e-3  # m: presses nearer than this are at one place; a stage repeats to less. Chosen
_STRAIGHT = 2e-4   # m: largest sideways travel since first contact of a straight press. Chosen
_APART = 5e-3      # m: a larger step between two frames means a new press, not a drag. Chosen
_HELD = 5e-5       # m: a stage that holds a depth varies by less. Chosen
_LIFTED = 0.6      # a depth below this share of the last depth means a new press, too. Chosen


@dataclass(frozen=True)
class Presses:
    """M frames with the ground truth of the stage that pressed.

    fields: M MarkerFields; position: (M, 3) m, the tip, NaN without contact; depth: (M,) m, 0 without contact; segment: (M,)
    int, number of the press; wrench: (M, 6) N and N m, NaN where unknown; radius: (M,) m of the tool's tip, NaN where unknown. Raises
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
        """(M,) bool: frames with contact."""
        return (self.depth > 0) & np.isfinite(self.position).all(1)

    def select(self, keep: np.ndarray) -> Presses:
        """The frames where keep (M,) bool."""
        return Presses(tuple(field for field, kept in zip(self.fields, keep) if kept), self.position[keep], self.depth[keep],
                       self.segment[keep], self.wrench[keep], self.radius[keep])

    def places(self, mirrored: bool = False) -> np.ndarray:
        """(M,) int, number of the place pressed, from 0 in order of appearance; -1 without contact. mirrored: mirror images along x and y
        share a number."""
        place, known = np.full(len(self), -1), np.zeros((0, 2))
        for k in np.flatnonzero(self.touching):
            xy = np.abs(self.position[k, :2]) if mirrored else self.position[k, :2]
            near = np.flatnonzero(np.hypot(*(known - xy).T) < SAME_PLACE)
            place[k] = near[0] if len(near) else len(known)
            known = known if len(near) else np.vstack([known, xy])
        return place

    def straight(self) -> np.ndarray:
        """(M,) bool: frames with contact in which the tool has not moved sideways since first contact."""
        straight, before, start = self.touching.copy(), -1, np.zeros(2)
        for k in np.flatnonzero(self.touching):
            xy = self.position[k, :2]
            anew = before != k - 1 or self.depth[k] < _LIFTED * self.depth[k - 1] or np.hypot(*(xy - self.position[k - 1, :2])) > _APART
            start, before = xy if anew else start, k
            straight[k] = np.hypot(*(xy - start)) <= _STRAIGHT
        return straight

    def loading(self) -> np.ndarray:
        """(M,) bool: frames with contact in which the tool is as deep as it has been in this segment."""
        loading = self.touching.copy()
        for number in np.unique(self.segment[loading]):
            mine = np.flatnonzero((self.segment == number) & self.touching)
            loading[mine] = self.depth[mine] > np.maximum.accumulate(self.depth[mine]) - _HELD
        return loading

    def held_out(self, folds: int = 3) -> Iterator[tuple[Presses, Presses]]:
        """Folds (training, held out) for cross-validation by place.

        A place is held out together with its mirror images: a method that uses the sensor's symmetry would learn it from them. Untouched
        frames are always in the training set.
        """
        place = self.places(mirrored=True)
        place = place if place.max(initial=-1) > 0 else self.places()
        for fold in range(folds):
            held = (place >= 0) & (place % folds == fold)
            if held.any() and (self.touching & ~held).any():
                yield self.select(~held), self.select(held)
