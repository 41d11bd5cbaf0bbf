# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tangential motion of the object from the image of its pressure, and its slip over the pad.

Images are registered relative to the mean pressure of the keyframe, grown with the load: the level that is fitted for a contact's border
(score.ContactScore) varies by itself from frame to frame.
"""
from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from .._core import taxel_lagging, taxel_load, taxel_motion
from .array import SoftPad, TaxelArray
from .breakaway import LATEST, PHASE, SIGMAS, broke_away, has_stopped
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
_BOUND = 2.5  # standard deviations: see taxel_motion. Chosen
_EVIDENT_SIGMAS, _LASTING_SIGMAS = 5.0, 3.0  # standard deviations of a velocity, from which an object moves, and moves on. Chosen
_PATH_SIGMAS = 2.0  # standard deviations of a registered position, of the path by which a motion begins. Chosen: 95 %
_CREEP = 0.2  # taxels/s, up to which the picture creeps by itself: pad and sensing layer relax. Chosen
_LEAST_NOISE = 2e-3  # taxels, of a place, at least. Chosen: what registration leaves of the phase between object and taxels
_EVIDENT = 0.4  # taxels a frame, from which a centroid's shift is motion even if the load rises a little. Chosen
_LOAD_CHANGE = 0.2  # relative change of the load over the window, from which changes of the image are attributed to it. Chosen
_OTHER_LOAD = 0.1  # of the keyframe's load, from which a settled load is another one. Chosen: half of _LOAD_CHANGE
_SLIDES = 0.1  # part of the object's motion by which the pad's surface lags where it slips. Chosen: coupled neighbours creep a little
# Growth of the contact, taxels and parts of its shift, from which the image is attributed to a change of load. Chosen.
_LOADED, _LOADING = 0.08, 1.5
_NO_PAST = np.zeros((0, 4))  # frames: s, m, m, rad: the object's motion at the origin since it touched


@dataclass(frozen=True)
class SeenPressure:
    """pressure: (rows, columns) as the taxels see it; sigma: its noise; clipped: whether taxels are saturated, so that what is curved looks
    flat; loop: width of the layer's loop over the mean load."""

    pressure: np.ndarray
    sigma: float
    clipped: bool = False
    loop: float = 0.0


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
        self._pose = [0.0] * 3  # of the keyframe's centre since the keyframe: m, m, rad
        self._total = np.zeros(3)  # of the object at the origin since it touched: m, m, rad
        self._past = _NO_PAST
        self._smooth = np.zeros(3)  # total without noise
        self._loads: deque[tuple[float, float]] = deque()
        self._lags: deque[tuple[np.ndarray, np.ndarray]] = deque(maxlen=_SUMMED)  # slip and motion of each of the last frames
        self._slip_fraction = self._pulled = self._pulled_at_rest = 0.0  # pulled: traction over pressure
        self._broke_s, self._broke_along = -math.inf, [0.0, 0.0]  # s and m/s, when the picture last told a breakaway
        self._lead = 1.0  # speed of the picture over that of an object that sticks
        self._waited = False  # since the last frames, for a load that varies
        self._varied = 0.0  # relative change of the load over the last frames
        self._key_load, self._key_count = 0.0, 1  # sum of pressure in the keyframe, Pa, and taxels
        self._followed_part = 1.0  # object's part of the picture's motion
        self._moves = False
        self._noise = 0.0  # m, of a place
        self._arm = (0.0, 0.0)  # m, of the keyframe's centre from the origin
        self._along = (0.0, 0.0, 0.0)

    def traction_pressure(self) -> np.ndarray | None:
        """(rows, columns) Pa, the part of the next frame's pressure that traction causes; None without traction."""
        return self.shear.traction_pressure()

    def process(self, pressure: np.ndarray, touched: np.ndarray, stamp_s: float, seen: SeenPressure | None = None) -> ImprintMotion:
        """Motion and slip in one frame with pressure (rows, columns, Pa) and touched (rows, columns) bool, not empty; seen: the
        pressure with the part that traction causes, without which sudden slip of a smooth object is told late."""
        load, _, _, count = taxel_load(pressure, touched, around=0)
        self._pulled = math.hypot(*self.shear.force) / max(load * self._array.taxel_area, 1e-12)
        kind = KeyCentroid if count <= _FEW else Keyframe
        now = (pressure, touched, load)
        if not isinstance(self._key, kind):
            self._rekey(kind, *now)
        if kind is KeyCentroid:
            found = self._key.motion(pressure, touched)
        else:
            found = self._key.motion(pressure, self._scale(load), self._expected)
        if found is None:
            self._rekey(kind, *now)
            self._past = _NO_PAST
            self._moves = False
            return self._unknown()
        waits, grew = self._load_varies(found, kind, load, stamp_s), self._grew(found)
        same_load = not (waits or grew)
        if grew or self._waited and not waits and abs(load - self._key_load) > _OTHER_LOAD * self._key_load:
            self._rekey(kind, *now)
            found = found._replace(fit=np.zeros(4), turn=0 * found.turn)
        self._waited = waits and not grew
        along_x, along_y, turned = (0.0, 0.0, 0.0) if self._waited else self._step(found, load / count)
        step = np.array([along_x + turned * self._arm[1], along_y - turned * self._arm[0], turned])
        self._expected = found.fit if self._seen is None else 1.5 * found.fit - 0.5 * self._seen.fit
        self._seen = found
        smooth, velocity, moves, steady = self._followed(step, stamp_s)
        if seen is not None and self._rolls(seen, touched, velocity if moves else None, same_load):
            smooth, moves = np.zeros(3), False
        slip = self.shear.move(touched, pressure, smooth)
        self._lags.append((slip, smooth))
        slipping = self._lagging(steady, touched) if moves else np.zeros_like(touched)
        if found.largest > _KEY_MOVED or abs(found.growth) > _KEY_GREW:
            self._rekey(kind, *now)
        self._along = self._direction(velocity, found) if moves else (0.0, 0.0, 0.0)
        self._slip_fraction = np.count_nonzero(slipping) / count
        turns = not math.isnan(found.turn)
        return ImprintMotion(self._reported[:2], float(self._reported[2]) if turns else math.nan, turns, slipping, step[:2], turned)

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
        self._varied = 1 - least / max(most, 1e-9)
        return self._varied > _LOAD_CHANGE

    def _followed(self, step: np.ndarray, stamp_s: float) -> tuple[np.ndarray, list[float], bool, int]:
        """The last motion (3,) m, m at the origin, rad, without noise, the velocity (3,), whether it is evident, and for how many frames it
        was steady; step: with noise."""
        self._total = self._total + step
        pitch = self._array.pitch
        (self._past, smooth, velocity, self._reported, noise, speed, sigma, lasting, used, expected, went) = taxel_motion(
            self._past, np.array([stamp_s, *self._total.tolist()]), window=_WINDOW_S, reported=_VELOCITY_S, fewest=_FEWEST, latest=LATEST,
            arm=self._arm, reach=self._key.reach * pitch, least=_LEAST_NOISE * pitch, bound=_BOUND)
        self._noise = noise
        last, self._smooth = self._smooth, smooth
        evident = used > 1 and self._is_evident(speed, sigma, lasting)
        stopped = evident and self._moves and has_stopped(expected, went, noise)
        if stopped:  # what came before is another motion
            self._past = self._past[-LATEST:]
        self._moves = evident and not stopped
        return smooth - last, velocity.tolist() if used > 1 else [math.nan] * 3, self._moves, used - 1

    def _is_evident(self, speed: float, sigma: float, lasting: float) -> bool:
        """Whether a speed, m/s, with a standard deviation sigma, over lasting, s, is a motion of the object. It begins by a path longer
        than the registration's own error, by which pressure wanders without motion."""
        if speed <= max((_LASTING_SIGMAS if self._moves else _EVIDENT_SIGMAS) * sigma, _CREEP * self._array.pitch):
            return False
        released = BORDER_LEAD * self._pad.thickness * self._pulled * self._varied
        return self._moves or speed * lasting > (_PATH_SIGMAS * self._seen.sigma * self._array.pitch + released) * self._followed_part

    def _rolls(self, seen: SeenPressure, touched: np.ndarray, velocity: list[float] | None, same_load: bool) -> bool:
        """Whether the object, which moves by velocity (3,), rolls without traction. If it slides, take the present traction for that of
        friction."""
        if velocity is None or not same_load:
            self._pulled_at_rest = self._pulled
            self._watch.rest(seen.pressure, same_load)
            if self._pulled < _RELEASED:
                self._watch.release()
            return False
        found = self._watch.follow(seen.pressure, touched, seen.sigma, velocity[:2], seen.clipped, self._lead, seen.loop)
        smooth = self._pulled_at_rest < _LOOSE * self._pad.friction and _SMOOTHEST < self._pulled < _SMOOTH * self._pad.friction
        if self._past[-1, 0] - self._broke_s < _WINDOW_S and velocity[0] * self._broke_along[0] + velocity[1] * self._broke_along[1] < 0:
            self.shear.friction, self._broke_s = self._pad.friction, -math.inf  # it had slowed down to turn back
        if found.sticks:
            self.shear.friction = self._pad.friction
        breaks = smooth and not (found.slides or found.sticks) and not seen.clipped and self._breaks_away(seen.pressure, touched, velocity)
        if breaks:
            self._broke_s, self._broke_along = float(self._past[-1, 0]), velocity[:2]
        if breaks or smooth and found.slides:
            self.shear.friction = min(self.shear.friction, _LOOSENED * self._pulled)
        return found.rolls and isinstance(self._key, Keyframe) and not self._turns_mostly(velocity)

    def _breaks_away(self, pressure: np.ndarray, touched: np.ndarray, velocity: list[float]) -> bool:
        """Whether a flat face that moves by velocity (3,), mostly without a turn, has just begun to slide; once a contact."""
        way = np.array(velocity[:2])
        if self.shear.friction < self._pad.friction or self._turns_mostly(velocity, _TURNS) or is_curved(pressure, touched, way):
            return False
        along = self._past[:, 1:3] @ (way / max(math.hypot(*velocity[:2]), 1e-12))
        return broke_away(self._past[:, 0], along, self._lead, max(SIGMAS * self._noise, PHASE * self._array.pitch))

    def _turns_mostly(self, velocity: list[float], part: float = 1.0) -> bool:
        """Whether the edges of a contact that moves by velocity (3,) turn faster than that part of its middle's speed."""
        (x, y), (along_x, along_y, turn) = self._arm, velocity
        return abs(turn) * self._key.reach * self._array.pitch > part * math.hypot(along_x - turn * y, along_y + turn * x)

    def _lagging(self, steady: int, touched: np.ndarray) -> np.ndarray:
        """(rows, columns) bool: where the pad's surface lagged behind the object in the last frames, steady of them at most."""
        last = list(self._lags)[-min(steady, _SUMMED):]
        return taxel_lagging([slip for slip, _ in last], touched, sum(step for _, step in last), pitch=self._array.pitch, part=_SLIDES)

    def _unknown(self) -> ImprintMotion:
        return ImprintMotion(np.full(2, np.nan), np.nan, False, np.zeros(self._array.shape, bool), np.full(2, np.nan), np.nan)

    def _step(self, seen: KeyframeMotion, mean: float) -> list[float]:
        """m, m, rad since the last frame, at the keyframe's centre, under a mean pressure, Pa. The pressure of the last frame's
        traction is already subtracted from the image; that of the new motion is corrected here."""
        along_x, along_y = (seen.shift * self._array.pitch).tolist()
        stiff = BORDER_LEAD * self._pad.thickness * self._pad.shear_stiffness / max(mean, 1.0)
        moved = [now - before for now, before in zip((along_x, along_y, seen.known_turn), self._pose)]
        # Where the object slips, traction is at its limit and changes its direction only.
        paths = (1.0, 1.0, seen.reach * self._array.pitch)
        way = sum(map(math.prod, zip(self._along, moved, paths)))
        self._followed_part = 1 / (1 + stiff * (1 - self._slip_fraction))
        self._lead = 1 + stiff
        along = [one * way / path for one, path in zip(self._along, paths)]
        step = [(part - one) / (1 + stiff) + one * self._followed_part for part, one in zip(moved, along)]
        self._pose = [before + one for before, one in zip(self._pose, step)]
        return step

    def _direction(self, velocity: list[float], seen: KeyframeMotion) -> tuple[float, float, float]:
        """Unit vector of the motion by velocity (3,) at the keyframe's centre, rotation as the path of its edges; 0 where unknown."""
        (x, y), (along_x, along_y, turn) = self._arm, velocity
        motion = (along_x - turn * y, along_y + turn * x, turn * seen.reach * self._array.pitch)
        length = math.hypot(*motion)
        return tuple(part / length for part in motion) if length > 0 else (0.0, 0.0, 0.0)

    def _rekey(self, kind: type, pressure: np.ndarray, touched: np.ndarray, load: float) -> None:
        self._key_load, self._key_count, self._waited = load, int(np.count_nonzero(touched)), False
        self._key = kind(pressure, touched) if kind is KeyCentroid else kind(pressure, self._scale(load))
        self._arm = tuple(((self._key.middle - self._middle) * self._array.pitch).tolist())
        self._seen, self._expected, self._pose = None, None, [0.0] * 3

    def _scale(self, load: float) -> float:
        """1/Pa that makes pressure an image: over that of the keyframe at this load, scaled as the score of a flat face."""
        return LEVEL / BORDER_SHARE / max(load / self._key_count, 1e-9)
