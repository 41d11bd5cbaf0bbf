# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tangential motion of the object from the image of its contact score, and its slip over the pad."""
from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from .array import SoftPad, TaxelArray
from .registration import KeyCentroid, Keyframe, KeyframeMotion
from .shear import BORDER_LEAD, SurfaceShear

_KEY_MOVED, _KEY_GREW = 0.8, 0.3  # taxels of motion and of growth after which a new keyframe is taken. Chosen: below one taxel
_WINDOW_S = 0.06  # s, window of velocity and slip. Chosen: 12 frames at 200 Hz
_FEW = 40  # taxels up to which a contact is followed by its pressure's centroid, for want of edges. Chosen
_FEWEST = 4  # frames for a velocity. Chosen: two more than a line needs
_EVIDENT = 0.4  # taxels a frame, from which a centroid's shift is motion even if the load rises a little. Chosen
_LOAD_CHANGE = 0.2  # relative change of the load over the window, from which changes of the image are attributed to it. Chosen
# Noise of the slip over the window: taxels, and standard deviations of the keyframe's registration. Chosen.
_STILL, _STILL_SIGMAS = 0.008, 0.4
# Growth of the contact, taxels and parts of its shift, from which the image is attributed to a change of load. Chosen.
_LOADED, _LOADING = 0.08, 1.5


@dataclass(frozen=True)
class ImprintMotion:
    """Motion of the object in one frame. linear: (2,) m/s at the sensor's origin, and turn: rad/s, over the window, NaN where unknown;
    turns: whether rotation is observable; slipping: (rows, columns) bool, where the object slips over the pad; step: (2,) m, and step_turn:
    rad, since the last frame."""

    linear: np.ndarray
    turn: float
    turns: bool
    slipping: np.ndarray
    step: np.ndarray
    step_turn: float


class ImprintTracker:
    """Tracks all contacts of an array as one rigid object."""

    def __init__(self, array: TaxelArray, pad: SoftPad):
        self._array, self._pad = array, pad
        self.shear = SurfaceShear(array, pad)
        self._middle = 0.5 * np.array([array.columns - 1, array.rows - 1])
        self.reset()

    def reset(self) -> None:
        """Forget; nothing touches."""
        self.shear.reset()
        self._key: Keyframe | KeyCentroid | None = None
        self._seen: KeyframeMotion | None = None  # in the last frame
        self._expected: np.ndarray | None = None  # predicted fit of the next frame
        self._pose = np.zeros(3)  # of the keyframe's centre since the keyframe: m, m, rad
        self._total = np.zeros(3)  # of the object at the origin since it touched: m, m, rad
        self._past: deque[tuple[float, float, float, float]] = deque()  # s, total
        self._loads: deque[tuple[float, float]] = deque()
        self._slipped = np.zeros((2, *self._array.shape), np.float32)  # m, slip of the object over the pad since it touched
        self._slips: deque[tuple[float, np.ndarray]] = deque()  # s, slip before this frame
        self._slip_fraction = self._sigma = 0.0
        self._along = np.zeros(3)

    def traction_pressure(self) -> np.ndarray | None:
        """(rows, columns) Pa, the part of the next frame's pressure that traction causes; None without traction."""
        return self.shear.traction_pressure()

    def process(self, score: np.ndarray, pressure: np.ndarray, touched: np.ndarray, stamp_s: float) -> ImprintMotion:
        """Motion and slip in one frame with score, pressure (rows, columns, Pa) and touched (rows, columns) bool, not empty."""
        inside = pressure[touched]
        load, count = float(inside.sum()), len(inside)
        now = (pressure, touched) if count <= _FEW else (score,)
        kind = Keyframe if len(now) == 1 else KeyCentroid
        if not isinstance(self._key, kind):
            self._rekey(kind, now)
        seen = self._key.motion(score, self._expected) if kind is Keyframe else self._key.motion(*now)
        if seen is None:
            self._rekey(kind, now)
            self._past.clear()
            return self._unknown()
        if self._is_load_change(seen, kind, load, stamp_s):
            self._rekey(kind, now)
            seen = replace(seen, fit=np.zeros(4), turn=0 * seen.turn)
        step = self._step(seen, load / count)
        about = (self._key.middle - self._middle) * self._array.pitch
        at_origin = step[:2] - step[2] * np.array([-about[1], about[0]])
        self._expected = seen.fit if self._seen is None else 1.5 * seen.fit - 0.5 * self._seen.fit
        self._seen, self._sigma = seen, seen.sigma
        self._remember(self.shear.move(touched, pressure, at_origin, step[2]), np.array([*at_origin, step[2]]), stamp_s)
        if seen.largest > _KEY_MOVED or abs(seen.growth) > _KEY_GREW:
            self._rekey(kind, now)
        linear, turn = self._velocity()
        self._along = self._direction(linear, turn, seen)
        slipping = self._slipping() & touched
        self._slip_fraction = np.count_nonzero(slipping) / count
        turns = not np.isnan(seen.turn)
        return ImprintMotion(linear, turn if turns else np.nan, turns, slipping, at_origin, float(step[2]))

    def _is_load_change(self, seen: KeyframeMotion, kind: type, load: float, stamp_s: float) -> bool:
        """Whether the image changed by the load and not by motion."""
        changes = self._load_changed(load, stamp_s)
        if kind is KeyCentroid and seen.largest > _EVIDENT and self._loads[-1][1] < (1 + _LOAD_CHANGE) * self._loads[0][1]:
            changes = False
        return changes or abs(seen.growth) > max(_LOADED, _LOADING * seen.largest)

    def _load_changed(self, load: float, stamp_s: float) -> bool:
        """Whether the load changed by more than _LOAD_CHANGE over the window."""
        self._loads.append((stamp_s, load))
        while self._loads[0][0] < stamp_s - _WINDOW_S * (1 + 1e-6):
            self._loads.popleft()
        least, most = min(value for _, value in self._loads), max(value for _, value in self._loads)
        return most - least > _LOAD_CHANGE * most

    def _slipping(self) -> np.ndarray:
        """(rows, columns) bool: where the surface lagged behind a moving object over the window. Relaxation of the pad as the load falls is
        no slip."""
        least = (max(_STILL, _STILL_SIGMAS * self._sigma) * self._array.pitch)**2
        x, y, turn = (now - then for now, then in zip(self._past[-1][1:], self._past[0][1:]))
        along_x, along_y = x - turn * self._array.y[:, None], y + turn * self._array.x
        slipped = self._slipped - self._slips[0][1]
        return (slipped[0]**2 + slipped[1]**2 > least) & (along_x**2 + along_y**2 > least)

    def _unknown(self) -> ImprintMotion:
        return ImprintMotion(np.full(2, np.nan), np.nan, False, np.zeros(self._array.shape, bool), np.full(2, np.nan), np.nan)

    def _step(self, seen: KeyframeMotion, mean: float) -> np.ndarray:
        """(3,) m, m, rad since the last frame, at the keyframe's centre, under a mean pressure, Pa. The pressure of the last frame's
        traction is already subtracted from the image; that of the new motion is corrected here."""
        found = np.array([*(seen.shift * self._array.pitch), seen.known_turn])
        stiff = BORDER_LEAD * self._pad.thickness * self._pad.shear_stiffness / max(mean, 1.0)
        moved = found - self._pose
        # Where the object slips, traction is at its limit and changes its direction only.
        paths = np.array([1, 1, seen.reach * self._array.pitch])
        along = self._along * float(self._along @ (moved * paths)) / paths
        step = (moved - along) / (1 + stiff) + along / (1 + stiff * (1 - self._slip_fraction))
        self._pose = self._pose + step
        return step

    def _direction(self, linear: np.ndarray, turn: float, seen: KeyframeMotion) -> np.ndarray:
        """(3,) unit vector of the motion at the keyframe's centre, rotation as the path of its edges; 0 where unknown."""
        about = (self._key.middle - self._middle) * self._array.pitch
        motion = np.array([linear[0] - turn * about[1], linear[1] + turn * about[0], turn * seen.reach * self._array.pitch])
        length = math.sqrt(motion @ motion)
        return motion / length if length > 0 else np.zeros(3)

    def _rekey(self, kind: type, now: tuple) -> None:
        self._key, self._seen, self._expected, self._pose = kind(*now), None, None, np.zeros(3)

    def _remember(self, slip: np.ndarray, step: np.ndarray, stamp_s: float) -> None:
        """Append slip (2, rows, columns) m and step (3,) m, m, rad of the object at the origin to the window."""
        self._total = self._total + step
        self._past.append((stamp_s, *self._total.tolist()))
        self._slips.append((stamp_s, self._slipped))
        self._slipped = self._slipped + slip
        for kept in (self._past, self._slips):
            while len(kept) > _FEWEST and kept[0][0] < stamp_s - _WINDOW_S * (1 + 1e-6):
                kept.popleft()

    def _velocity(self) -> tuple[np.ndarray, float]:
        if len(self._past) < _FEWEST:
            return np.full(2, np.nan), np.nan
        stamps, *places = np.array(self._past).T
        off = stamps - stamps.sum() / len(stamps)
        x, y, turn = (float(off @ place) for place in places)
        square = float(off @ off)
        return np.array([x / square, y / square]), turn / square
