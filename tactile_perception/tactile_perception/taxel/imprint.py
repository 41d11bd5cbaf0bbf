# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The object's motion along the pad frame by frame, from the picture of where it touches, and its slip over the pad's surface."""
from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from .array import SoftPad, TaxelArray
from .registration import KeyCentre, KeyPicture, PictureMotion
from .shear import LEAD, SurfaceShear

_KEY_MOVED, _KEY_GREW = 0.8, 0.3  # taxels, from which on another key is taken
_WINDOW_S = 0.06  # over which velocity and slip are told
_FEW = 40  # taxels: a contact of no more has no edges to speak of
_FEWEST = 4  # frames that a velocity needs
_EVIDENT = 0.4  # taxels from frame to frame, that a pressure's centre does not move by load alone
_UNEVEN = 0.2  # change of the load over the window, from which it is the load that changes the picture
# Slip over the window that is noise: taxels, and standard deviations of the picture's place.
_STILL, _DOUBT = 0.008, 0.4
# Growth, taxels, of the contact from which its picture changes by load, if it is so many times its shift: that is no motion.
_LOADED, _LOADING = 0.08, 1.5


@dataclass(frozen=True)
class ImprintMotion:
    """Of one frame. linear (2,) m/s of the object at the sensor's origin and turn rad/s over the window, NaN where not known; turns:
    whether a turn can be seen in this picture; slipping: (rows, columns) bool, where the object slips over the pad; step (2,) m and
    step_turn rad: the motion since the last frame."""

    linear: np.ndarray
    turn: float
    turns: bool
    slipping: np.ndarray
    step: np.ndarray
    step_turn: float


class Imprint:
    """Follows all contacts of an array as one object; process is given pressure in Pa."""

    def __init__(self, array: TaxelArray, pad: SoftPad):
        self._array, self._pad = array, pad
        self.shear = SurfaceShear(array, pad)
        self._middle = 0.5 * np.array([array.columns - 1, array.rows - 1])
        self.reset()

    def reset(self) -> None:
        """Nothing touches."""
        self.shear.reset()
        self._key: KeyPicture | KeyCentre | None = None
        self._seen: PictureMotion | None = None  # of the last frame
        self._expected: np.ndarray | None = None  # fit of the next one
        self._pose = np.zeros(3)  # since the key, of the key's middle: m, m, rad
        self._total = np.zeros(3)  # of the object's point at the origin, and its turn, since it touched
        self._past: deque[tuple[float, float, float, float]] = deque()  # s, and the total then
        self._loads: deque[tuple[float, float]] = deque()
        self._slipped = np.zeros((2, *self._array.shape), np.float32)  # m, of the object over the pad, since it touched
        self._slips: deque[tuple[float, np.ndarray]] = deque()  # s, and what had slipped before
        self._share = self._sigma = 0.0
        self._along = np.zeros(3)

    def lead(self) -> np.ndarray | None:
        """(rows, columns) Pa that traction adds to the pressure, as it will be in the next frame."""
        return self.shear.leading()

    def process(self, score: np.ndarray, pressure: np.ndarray, touched: np.ndarray, stamp_s: float) -> ImprintMotion:
        """Motion and slip in one frame with score, pressure (rows, columns, Pa) and touched (rows, columns) bool, not empty."""
        inside = pressure[touched]
        load, count = float(inside.sum()), len(inside)
        now = (pressure, touched) if count <= _FEW else (score,)
        kind = KeyPicture if len(now) == 1 else KeyCentre
        if not isinstance(self._key, kind):
            self._rekey(kind, now)
        seen = self._key.motion(score, self._expected) if kind is KeyPicture else self._key.motion(*now)
        if seen is None:
            self._rekey(kind, now)
            self._past.clear()
            return self._unknown()
        if self._loads_picture(seen, kind, load, stamp_s):
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
        self._share = np.count_nonzero(slipping) / count
        turns = not np.isnan(seen.turn)
        return ImprintMotion(linear, turn if turns else np.nan, turns, slipping, at_origin, float(step[2]))

    def _loads_picture(self, seen: PictureMotion, kind: type, load: float, stamp_s: float) -> bool:
        """Whether the picture has changed by the load, and not by motion."""
        changes = self._load_changes(load, stamp_s)
        if kind is KeyCentre and seen.largest > _EVIDENT and self._loads[-1][1] < (1 + _UNEVEN) * self._loads[0][1]:
            changes = False
        return changes or abs(seen.growth) > max(_LOADED, _LOADING * seen.largest)

    def _load_changes(self, load: float, stamp_s: float) -> bool:
        """Whether the load has changed so much over the window that the picture's changes are not the object's motion."""
        self._loads.append((stamp_s, load))
        while self._loads[0][0] < stamp_s - _WINDOW_S * (1 + 1e-6):
            self._loads.popleft()
        least, most = min(value for _, value in self._loads), max(value for _, value in self._loads)
        return most - least > _UNEVEN * most

    def _slipping(self) -> np.ndarray:
        """(rows, columns) bool: where the surface has lagged behind over the window, and the object moves. A pad that lets go as the load
        falls is no slip."""
        least = (max(_STILL, _DOUBT * self._sigma) * self._array.pitch)**2
        x, y, turn = (now - then for now, then in zip(self._past[-1][1:], self._past[0][1:]))
        along_x, along_y = x - turn * self._array.y[:, None], y + turn * self._array.x
        slipped = self._slipped - self._slips[0][1]
        return (slipped[0]**2 + slipped[1]**2 > least) & (along_x**2 + along_y**2 > least)

    def _unknown(self) -> ImprintMotion:
        return ImprintMotion(np.full(2, np.nan), np.nan, False, np.zeros(self._array.shape, bool), np.full(2, np.nan), np.nan)

    def _step(self, seen: PictureMotion, mean: float) -> np.ndarray:
        """(3,) m, m, rad since the last frame, at the key's middle, under a mean pressure, Pa. The picture has been freed of the lead that
        traction was to have made; what the object has moved since shows in it together with the lead of that."""
        found = np.array([*(seen.shift * self._array.pitch), seen.known_turn])
        stiff = LEAD * self._pad.thickness * self._pad.shear_stiffness / max(mean, 1.0)
        moved = found - self._pose
        # Where the object slips, traction has its size already and only changes its direction.
        paths = np.array([1, 1, seen.reach * self._array.pitch])
        along = self._along * float(self._along @ (moved * paths)) / paths
        step = (moved - along) / (1 + stiff) + along / (1 + stiff * (1 - self._share))
        self._pose = self._pose + step
        return step

    def _direction(self, linear: np.ndarray, turn: float, seen: PictureMotion) -> np.ndarray:
        """(3,) unit, of the motion at the key's middle with turns as paths of the key's edges; 0 where it is not known."""
        about = (self._key.middle - self._middle) * self._array.pitch
        motion = np.array([linear[0] - turn * about[1], linear[1] + turn * about[0], turn * seen.reach * self._array.pitch])
        length = math.sqrt(motion @ motion)
        return motion / length if length > 0 else np.zeros(3)

    def _rekey(self, kind: type, now: tuple) -> None:
        self._key, self._seen, self._expected, self._pose = kind(*now), None, None, np.zeros(3)

    def _remember(self, slip: np.ndarray, step: np.ndarray, stamp_s: float) -> None:
        """Of this frame: slip (2, rows, columns) m over the pad; step (3,) of the object's point at the origin, m, m, rad."""
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
