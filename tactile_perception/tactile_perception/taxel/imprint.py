# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tangential motion of the object from the image of its pressure, and its slip over the pad.

Images are registered relative to the mean pressure of the keyframe, grown with the load: the level that is fitted for a contact's border
(score.ContactScore) varies by itself from frame to frame.
"""
from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from operator import mul

import numpy as np

from .._core import noise_of_places, steady_motion, taxel_lagging
from .array import SoftPad, TaxelArray
from .breakaway import PHASE, SIGMAS, broke_away, has_stopped
from .registration import KeyCentroid, Keyframe, KeyframeMotion
from .score import BORDER_SHARE, LEVEL
from .shear import BORDER_LEAD, SurfaceShear
from .traction_watch import TractionWatch, is_curved

_KEY_MOVED, _KEY_GREW = 0.8, 0.3  # taxels of motion and of growth after which a new keyframe is taken. Chosen: below one taxel
_LOAD_WINDOW_S = 0.06  # s, over which changes of the load are judged. Chosen: 12 frames at 200 Hz
_VELOCITY_S = 0.06  # s, over which the velocity that is reported is averaged. Chosen: 12 frames at 200 Hz
_WINDOW_S = 0.2  # s, longest stretch by which a motion is followed. Chosen: a turn of 0.01 rad/s is told from noise
_FEW = 40  # taxels up to which a contact is followed by its pressure's centroid, for want of edges. Chosen
_FEWEST = 4  # frames for a velocity that is reported. Chosen: two more than a line needs
# Friction of an object that slides: part of the present traction over pressure, which is uneven, and the least such. Chosen.
_LOOSENED, _SMOOTHEST = 0.8, 0.08
# Parts of the friction that the pad is said to have: traction over pressure before a motion, and when the object slides, up to which it is
# smoother. Chosen: a traction that is released, and the rim that slips first, look alike.
_LOOSE, _SMOOTH = 0.25, 0.6
_RELEASED = 0.05  # traction over pressure, up to which an object at rest is without. Chosen: the least that traction_watch sees
_TURNS = 0.6  # speed of the edges by a turn, of that of the middle, up to which a breakaway is told. Chosen
_SUMMED = 3  # frames at most over which slip is summed against noise. Chosen
_BOUND = 2.5  # standard deviations: see steady_motion. Chosen
_EVIDENT_SIGMAS, _LASTING_SIGMAS = 5.0, 3.0  # standard deviations of a velocity, from which an object moves, and moves on. Chosen
_CREEP = 0.2  # taxels/s, up to which the picture creeps by itself: pad and sensing layer relax. Chosen
_LEAST_NOISE = 2e-3  # taxels, of a place, at least. Chosen: what registration leaves of the phase between object and taxels
_EVIDENT = 0.4  # taxels a frame, from which a centroid's shift is motion even if the load rises a little. Chosen
_LOAD_CHANGE = 0.2  # relative change of the load over the window, from which changes of the image are attributed to it. Chosen
_OTHER_LOAD = 0.1  # of the keyframe's load, from which a settled load is another one. Chosen: half of _LOAD_CHANGE
_SLIDES = 0.1  # part of the object's motion by which the pad's surface lags where it slips. Chosen: coupled neighbours creep a little
# Growth of the contact, taxels and parts of its shift, from which the image is attributed to a change of load. Chosen.
_LOADED, _LOADING = 0.08, 1.5


@dataclass(frozen=True)
class SeenPressure:
    """pressure: (rows, columns) as the taxels see it; sigma: its noise; clipped: whether taxels are saturated, so that what is curved looks
    flat."""

    pressure: np.ndarray
    sigma: float
    clipped: bool = False


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
        self._watch = TractionWatch(array, pad)
        self._middle = 0.5 * np.array([array.columns - 1, array.rows - 1])
        self.reset()

    def reset(self) -> None:
        """Forget; nothing touches."""
        self.shear.reset()
        self._watch.reset()
        self._key: Keyframe | KeyCentroid | None = None
        self._seen: KeyframeMotion | None = None  # in the last frame
        self._expected: np.ndarray | None = None  # predicted fit of the next frame
        self._pose = np.zeros(3)  # of the keyframe's centre since the keyframe: m, m, rad
        self._total = np.zeros(3)  # of the object at the origin since it touched: m, m, rad
        self._past: deque[tuple[float, float, float, float]] = deque()  # s, total
        self._smooth = np.zeros(3)  # total without noise
        self._loads: deque[tuple[float, float]] = deque()
        self._lags: deque[tuple[np.ndarray, np.ndarray]] = deque(maxlen=_SUMMED)  # slip and motion of each of the last frames
        self._slip_fraction = self._pulled_at_rest = 0.0
        self._lead = 1.0  # speed of the picture over that of an object that sticks
        self._waited = False  # since the last frames, for a load that varies
        self._key_load, self._key_count = 0.0, 1  # sum of pressure in the keyframe, Pa, and taxels
        self._followed_part = 1.0  # object's part of the picture's motion
        self._moves = False
        self._noise = 0.0  # m, of a place
        self._along = np.zeros(3)

    def traction_pressure(self) -> np.ndarray | None:
        """(rows, columns) Pa, the part of the next frame's pressure that traction causes; None without traction."""
        return self.shear.traction_pressure()

    def process(self, pressure: np.ndarray, touched: np.ndarray, stamp_s: float, seen: SeenPressure | None = None) -> ImprintMotion:
        """Motion and slip in one frame with pressure (rows, columns, Pa) and touched (rows, columns) bool, not empty; seen: the
        pressure with the part that traction causes, without which sudden slip of a smooth object is told late."""
        inside = pressure[touched]
        load, count = float(inside.sum()), len(inside)
        kind = KeyCentroid if count <= _FEW else Keyframe
        now = (pressure, touched, load)
        if not isinstance(self._key, kind):
            self._rekey(kind, *now)
        if kind is KeyCentroid:
            found = self._key.motion(pressure, touched)
        else:
            found = self._key.motion(self._image(pressure, load), self._expected)
        if found is None:
            self._rekey(kind, *now)
            self._past.clear()
            self._moves = False
            return self._unknown()
        waits, grew = self._load_varies(found, kind, load, stamp_s), self._grew(found)
        same_load = not (waits or grew)
        if grew or self._waited and not waits and abs(load - self._key_load) > _OTHER_LOAD * self._key_load:
            self._rekey(kind, *now)
            found = replace(found, fit=np.zeros(4), turn=0 * found.turn)
        self._waited = waits and not grew
        step = np.zeros(3) if self._waited else self._step(found, load / count)
        about = (self._key.middle - self._middle) * self._array.pitch
        at_origin = step[:2] - step[2] * np.array([-about[1], about[0]])
        self._expected = found.fit if self._seen is None else 1.5 * found.fit - 0.5 * self._seen.fit
        self._seen = found
        smooth, velocity, moves, steady = self._followed(np.array([*at_origin, step[2]]), stamp_s)
        if seen is not None and self._rolls(seen, touched, velocity if moves else None, same_load, load):
            smooth, moves = np.zeros(3), False
        slip = self.shear.move(touched, pressure, smooth[:2], smooth[2])
        self._lags.append((slip, smooth))
        slipping = self._lagging(steady, touched) if moves else np.zeros_like(touched)
        if found.largest > _KEY_MOVED or abs(found.growth) > _KEY_GREW:
            self._rekey(kind, *now)
        self._along = self._direction(velocity[:2], float(velocity[2]), found) if moves else np.zeros(3)
        linear, turn = self._velocity()
        self._slip_fraction = np.count_nonzero(slipping) / count
        turns = not np.isnan(found.turn)
        return ImprintMotion(linear, turn if turns else np.nan, turns, slipping, at_origin, float(step[2]))

    def _load_varies(self, seen: KeyframeMotion, kind: type, load: float, stamp_s: float) -> bool:
        """Whether the load varies, so that motion since the keyframe is told when it has settled: a new keyframe at each variation would
        add up the errors of those places."""
        varies = self._load_changed(load, stamp_s)
        moved = kind is KeyCentroid and seen.largest > _EVIDENT and self._loads[-1][1] < (1 + _LOAD_CHANGE) * self._loads[0][1]
        return varies and not moved

    @staticmethod
    def _grew(seen: KeyframeMotion) -> bool:
        """Whether the contact's image grew or shrank by the load."""
        return abs(seen.growth) > max(_LOADED, _LOADING * seen.largest)

    def _load_changed(self, load: float, stamp_s: float) -> bool:
        """Whether the load changed by more than _LOAD_CHANGE over the window."""
        self._loads.append((stamp_s, load))
        while self._loads[0][0] < stamp_s - _LOAD_WINDOW_S * (1 + 1e-6):
            self._loads.popleft()
        least, most = min(value for _, value in self._loads), max(value for _, value in self._loads)
        return most - least > _LOAD_CHANGE * most

    def _followed(self, step: np.ndarray, stamp_s: float) -> tuple[np.ndarray, np.ndarray, bool, int]:
        """The last motion (3,) m, m at the origin, rad, without noise, the velocity (3,), whether it is evident, and for how many frames it
        was steady; step: with noise."""
        self._total = self._total + step
        self._past.append((stamp_s, *self._total.tolist()))
        while len(self._past) > _FEWEST and self._past[0][0] < stamp_s - _WINDOW_S * (1 + 1e-6):
            self._past.popleft()
        about = (self._key.middle - self._middle) * self._array.pitch
        reach = self._key.reach * self._array.pitch
        to_contact = np.array([[1, 0, -about[1]], [0, 1, about[0]], [0, 0, reach]])  # path of the contact's middle, and of its edges
        past = np.array(self._past)
        times, places = past[:, 0], past[:, 1:] @ to_contact.T
        noise = max(noise_of_places(places), _LEAST_NOISE * self._array.pitch)
        self._noise = noise
        place, speed, sigma, used = steady_motion(times, places, sigma=noise, bound=_BOUND)
        turn, turn_rate = place[2] / reach, speed[2] / reach
        smooth = np.array([place[0] + turn * about[1], place[1] - turn * about[0], turn])
        last, self._smooth = self._smooth, smooth
        velocity = np.array([speed[0] + turn_rate * about[1], speed[1] - turn_rate * about[0], turn_rate])
        self._moves = (used > 1 and self._is_evident(math.sqrt(speed @ speed), sigma, float(times[-1] - times[-used]))
                       and not (self._moves and has_stopped(times, places, speed, noise)))
        return smooth - last, velocity if used > 1 else np.full(3, np.nan), self._moves, used - 1

    def _is_evident(self, speed: float, sigma: float, lasting: float) -> bool:
        """Whether a speed, m/s, with a standard deviation sigma, over lasting, s, is a motion of the object. It begins by a path longer
        than the registration's own error, by which pressure wanders without motion."""
        if speed <= max((_LASTING_SIGMAS if self._moves else _EVIDENT_SIGMAS) * sigma, _CREEP * self._array.pitch):
            return False
        return self._moves or speed * lasting > self._seen.sigma * self._array.pitch * self._followed_part

    def _rolls(self, seen: SeenPressure, touched: np.ndarray, velocity: np.ndarray | None, same_load: bool, load: float) -> bool:
        """Whether the object, which moves by velocity (3,), rolls without traction. If it slides, take the present traction for that of
        friction; load: sum of pressure."""
        pulled = float(np.hypot(*self.shear.force)) / max(load * self._array.taxel_area, 1e-12)
        if velocity is None or not same_load:
            self._pulled_at_rest = pulled
            self._watch.rest(seen.pressure, same_load)
            if pulled < _RELEASED:
                self._watch.release()
            return False
        found = self._watch.follow(seen.pressure, touched, seen.sigma, velocity[:2])
        smooth = self._pulled_at_rest < _LOOSE * self._pad.friction and _SMOOTHEST < pulled < _SMOOTH * self._pad.friction
        if smooth and (found.slides or not seen.clipped and self._breaks_away(seen.pressure, touched, velocity)):
            self.shear.friction = min(self.shear.friction, _LOOSENED * pulled)
        return found.rolls and isinstance(self._key, Keyframe) and not self._turns_mostly(velocity)

    def _breaks_away(self, pressure: np.ndarray, touched: np.ndarray, velocity: np.ndarray) -> bool:
        """Whether a flat face that moves by velocity (3,), mostly without a turn, has just begun to slide; once a contact."""
        if self.shear.friction < self._pad.friction or self._turns_mostly(velocity, _TURNS) or is_curved(pressure, touched, velocity[:2]):
            return False
        past = np.array(self._past)
        along = past[:, 1:3] @ (velocity[:2] / max(np.hypot(*velocity[:2]), 1e-12))
        return broke_away(past[:, 0], along, self._lead, max(SIGMAS * self._noise, PHASE * self._array.pitch))

    def _turns_mostly(self, velocity: np.ndarray, part: float = 1.0) -> bool:
        """Whether the edges of a contact that moves by velocity (3,) turn faster than that part of its middle's speed."""
        x, y = (self._key.middle - self._middle) * self._array.pitch
        along_x, along_y, turn = velocity.tolist()
        return abs(turn) * self._key.reach * self._array.pitch > part * math.hypot(along_x - turn * y, along_y + turn * x)

    def _lagging(self, steady: int, touched: np.ndarray) -> np.ndarray:
        """(rows, columns) bool: where the pad's surface lagged behind the object in the last frames, steady of them at most."""
        last = list(self._lags)[-min(steady, _SUMMED):]
        return taxel_lagging([slip for slip, _ in last], touched, sum(step for _, step in last), pitch=self._array.pitch, part=_SLIDES)

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
        self._followed_part = 1 / (1 + stiff * (1 - self._slip_fraction))
        self._lead = 1 + stiff
        step = (moved - along) / (1 + stiff) + along * self._followed_part
        self._pose = self._pose + step
        return step

    def _direction(self, linear: np.ndarray, turn: float, seen: KeyframeMotion) -> np.ndarray:
        """(3,) unit vector of the motion at the keyframe's centre, rotation as the path of its edges; 0 where unknown."""
        about = (self._key.middle - self._middle) * self._array.pitch
        motion = np.array([linear[0] - turn * about[1], linear[1] + turn * about[0], turn * seen.reach * self._array.pitch])
        length = math.sqrt(motion @ motion)
        return motion / length if length > 0 else np.zeros(3)

    def _rekey(self, kind: type, pressure: np.ndarray, touched: np.ndarray, load: float) -> None:
        self._key_load, self._key_count, self._waited = load, int(np.count_nonzero(touched)), False
        self._key = kind(pressure, touched) if kind is KeyCentroid else kind(self._image(pressure, load))
        self._seen, self._expected, self._pose = None, None, np.zeros(3)

    def _image(self, pressure: np.ndarray, load: float) -> np.ndarray:
        """(rows, columns) float32, pressure over that of the keyframe at this load, scaled as the score of a flat face."""
        mean = max(load / self._key_count, 1e-9)
        return np.maximum(pressure, 0) * np.float32(LEVEL / BORDER_SHARE / mean)

    def _velocity(self) -> tuple[np.ndarray, float]:
        """Velocity (2,) m/s at the origin, and rad/s, that is reported: by a line over _VELOCITY_S; NaN with fewer than _FEWEST frames."""
        first = self._past[-1][0] - _VELOCITY_S * (1 + 1e-6)
        recent = [one for one in self._past if one[0] >= first]
        if len(recent) < _FEWEST:
            recent = list(self._past)[-_FEWEST:]
        if len(recent) < _FEWEST:
            return np.full(2, np.nan), np.nan
        times, *totals = zip(*recent)
        mean = sum(times) / len(times)
        off = [time - mean for time in times]
        square = sum(map(mul, off, off))
        x, y, turn = (sum(map(mul, off, total)) / square for total in totals)
        return np.array([x, y]), turn
