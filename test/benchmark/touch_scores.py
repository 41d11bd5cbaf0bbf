# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Scores of estimated contacts against ground truth: single contacts, two at once, untouched frames, the wrench, and the time taken."""
from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from tactile_perception.evaluation.scores import relative_errors
from tactile_perception.press.presses import Presses, score
from tactile_perception.press.estimate import TouchEstimate
from tactile_perception.press.sensor import MarkerSensor

#: m: shallower presses are not judged, by sensor type; they count neither as missed nor as false.
SHALLOWEST = {'areal_single': 0.3e-3, 'areal_dual': 1e-3, 'air_cushion': 8e-3}
APART = 3.0  # marker pitches: two contacts nearer to each other are not scored
NEAR = 1e-3  # m: an estimate farther away matches neither contact
STAGES = ('dots', 'field', 'touch', 'ids and region')
HEAD = ('place mm', 'place 95 %', 'depth mm', 'depth 95 %', 'nse', 'presses', 'missed', 'split', 'false', 'refused', 'two',
        'two told %', 'both in 1 mm %', 'force %', 'moment %', 'dragged force %', 'dragged moment %',
        *(f'{stage} ms' for stage in STAGES), 'total ms')
_WEAK = 0.05  # of the largest force and moment: relative errors below it are not scored
_STILL = 5e-5  # m from frame to frame: a larger motion is a drag


@dataclass
class TouchScore:
    """One method on one source; moving: whether a tip may move along the surface while it touches."""

    sensor: MarkerSensor
    moving: bool = False
    found: list = field(default_factory=list)
    truth: list = field(default_factory=list)
    two: list = field(default_factory=list)
    wrenches: list = field(default_factory=list)
    times: list = field(default_factory=list)
    refused: int = 0
    _last: np.ndarray | None = None

    def add(self, touches: list[TouchEstimate], wrench: np.ndarray, contacts: list, true_wrench: np.ndarray, seconds: list[float]) -> None:
        """Judge one frame: touches and wrench (6,) as told; contacts, [(position, depth)], and true_wrench; seconds of each stage."""
        self.times.append(seconds)
        place = contacts[0][0] if len(contacts) == 1 else None
        dragged = self.moving and place is not None and self._last is not None and np.hypot(*(place - self._last)[:2]) > _STILL
        self._last = place
        if len(contacts) == 2:
            self._add_two(touches, contacts)
        elif not contacts or contacts[0][1] >= SHALLOWEST[self.sensor.type]:
            self.found.append(touches)
            self.truth.append(contacts[0] if contacts else (np.full(3, np.nan), 0.0))
            if contacts:
                self.wrenches.append((dragged, wrench, true_wrench))

    def _add_two(self, touches: list[TouchEstimate], contacts: list) -> None:
        (one, depth), (other, other_depth) = contacts
        apart = np.abs((one - other)[:2]) / self.sensor.pitch
        if np.hypot(*apart) < APART or min(depth, other_depth) < SHALLOWEST[self.sensor.type]:
            return
        places = np.array([touch.position[:2] for touch in touches]).reshape(-1, 2)
        off = [np.hypot(*(places - true[:2]).T).min(initial=np.inf) for true in (one, other)]
        self.two.append((len(touches) == 2, len(touches) >= 2 and max(off) < NEAR))

    def row(self) -> dict[str, float]:
        """The table's numbers; NaN where there was nothing to judge."""
        s = score(self.found, self._presses())
        two = 100 * np.mean(self.two, axis=0) if self.two else np.full(2, np.nan)
        middle = 1e3 * np.median(self.times, axis=0) if self.times else np.full(len(STAGES), np.nan)
        return dict(zip(HEAD, [1e3 * s.place_mean, 1e3 * s.place_95, 1e3 * s.depth_mean, 1e3 * s.depth_95, s.squares, s.presses, s.missed,
                               s.split, s.false, self.refused, len(self.two), *two, *self._forces(False), *self._forces(True), *middle,
                               middle.sum()]))

    def _presses(self) -> Presses:
        count, nothing = len(self.found), np.full(len(self.found), np.nan)
        position = np.array([place for place, _ in self.truth]).reshape(-1, 3)
        return Presses((None,) * count, position, np.array([depth for _, depth in self.truth]), np.zeros(count, int),
                       np.full((count, 6), np.nan), nothing)

    def _forces(self, dragged: bool) -> tuple[float, float]:
        """Median error of force and of moment, per cent, of presses that are dragged or not."""
        chosen = [(told, true) for moved, told, true in self.wrenches if moved == dragged and np.isfinite(true).all()]
        if not chosen:
            return np.nan, np.nan
        told, true = np.array(chosen).swapaxes(0, 1)
        return tuple(_relative(told[:, part], true[:, part]) for part in (slice(3), slice(3, 6)))


def _relative(told: np.ndarray, true: np.ndarray) -> float:
    """Median of the error over the size, per cent, both of the axes that are told; inf for a frame in which none is."""
    size = np.linalg.norm(true, axis=1)
    strong = size > _WEAK * size.max()
    return float(100 * np.median(relative_errors(told[strong], true[strong]))) if strong.any() else np.nan
