# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tangential motion of the object from images of its pressure, and its slip over the pad.

Images are registered relative to the mean pressure of a keyframe, grown with the load. Pressure rises where traction converges, so the
image leads an object that sticks: its motion is a known part of the image's (BORDER_LEAD). The pad's surface follows it up to friction
times pressure (SurfaceShear); where it lags behind, the object slips. An object that rolls moves without the pressure of traction
(RollWatch).
"""
from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from .._core import taxel as _kernel
from ..common.estimates import FAR, NONE, SlipEstimate, next_state, state_probability
from .pressure import SoftPad, TaxelArray
from .region import BORDER_SHARE, LEVEL


class Limits:
    """What decides, each with what it is: docs/taxel_array.md. Lengths in taxels, times in s."""

    # Registration
    edge = 0.08  # limit: gradient of an image, 1/taxel, from which a taxel belongs to an edge: above the roughness of gains and faces
    key_moved = 0.4  # limit: motion since a keyframe, or the picture before a motion: slopes hold for parts of a taxel
    # Load
    load_s, load_change = 0.06, 0.2  # prior: a change over this time to which the image's is attributed
    # Motion
    bound = 2.5  # noise: sigmas, by which velocities of ever longer stretches may differ (98 %)
    begins = 4.0  # noise: sigmas of its velocity, from which an object moves
    creep = 0.16  # physical: taxels/s, up to which the picture creeps by itself, as pad and sensing layer relax
    # Slip
    lag = 0.05  # physical: of the object's motion, by which the pad's surface lags where it slips: coupled neighbours creep a little
    # Rolling
    traction = 0.04  # noise: traction over pressure, 1/taxel of motion, which a picture that changes on its way seems to show
    curved = 0.03  # noise: variance of pressure over that of the area, along a motion


# Least information on a motion, over the best direction: the rough edge of a half plane has up to 0.06 on a shift, a bar of 5 : 2 has 0.4;
# a face of 3 : 2 has 0.06 on a turn, a ring has only that of its roughness, so many times one over the number of edges.
_INFORMATION, _ROUGHNESS, _UNKNOWNS = 0.04, 3.0, 4
_SPREAD = 0.2  # standard deviation of an image's residuals, up to which a fit holds; of an image of about 0.8
_FEW = 40  # taxels, up to which a contact is followed by its pressure's centroid, for want of edges
# Taxels: standard deviation of the centroid of few of them, as pressure shifts without motion; and a jump that is no motion.
_CENTROID_SIGMA, _FARTHEST = 0.3, 5.0
_WINDOW_S = 0.2  # s, longest stretch of a steady motion
_WANDERS = 2.0  # sigmas of the registration (95 %), by which pressure wanders without motion
_LEAST_NOISE = 2e-3  # taxels, of a position: what registration leaves of the phase between object and taxels
_REST_S = 0.1  # s, over which the picture before a motion is averaged
# Variance of pressure over that of the area, of a curved face (0.6 to 0.67 where pressure is a paraboloid, 0.75 to 0.8 by Hertz) and of a
# flat one, which the pad blurs.
_CURVED, _FLAT = 0.7, 0.95
_STIFFENED = 2.0  # of the pad's shear stiffness, that of a contact at most, whose surroundings hold it, too
# Of the state's confidence, measured on two simulated devices: taxels that slip independently, and frames that no fraction explains.
_PATCHES, _MISTAKEN = 44.0, 0.012
# Where pressure is not calibrated: share of the frames reported as NONE, INCIPIENT and GROSS that are. Measured on those devices in ten
# scenes, with the data of four pads in turn: 0.978 to 0.989, 0.07 to 0.32, 0.57 to 0.70.
_RIGHT_UNCALIBRATED = 0.98, 0.26, 0.63
_HALF = math.sqrt(0.5)
REACH = 2.5  # thicknesses around a contact in which its pressure is seen: beyond the wider spread of what traction causes

#: The border of the pressure image leads by so many thicknesses times traction over pressure (theory of a bonded elastic layer).
BORDER_LEAD = 0.5


class KeyframeMotion(NamedTuple):
    """Motion since the keyframe: a point p (column, row, taxels) of the contact moves to middle + R(turn) (p - middle) + shift.

    fit: (4,) taxels, shift along columns and rows, turn times reach, growth along the edges' normals; turn: rad, NaN where unobservable;
    middle: (2,) column and row; reach: distance of far edges from there, taxels; sigma: standard deviation of the registered position,
    taxels.
    """

    fit: np.ndarray
    turn: float
    middle: np.ndarray
    reach: float
    sigma: float

    @property
    def known_turn(self) -> float:
        """rad, 0 where unobservable."""
        return 0.0 if math.isnan(self.turn) else self.turn

    @property
    def largest(self) -> float:
        """Largest displacement, taxels."""
        return math.hypot(self.fit[0], self.fit[1]) + abs(self.known_turn) * self.reach


class EdgeKeyframe:
    """An image that later ones are registered with by the normal flow of its edges: positive pressure (rows, columns) float32 times scale,
    about 0.8 in a contact. Growth along the edges' normals is fitted too, since a change of load makes a contact grow without motion."""

    def __init__(self, pressure: np.ndarray, scale: float = 1.0):
        self._key = _kernel.Keyframe(pressure, scale=scale, steep=Limits.edge)
        self.middle, self.reach = self._key.middle, self._key.reach
        self._turns = self._determined()

    def motion(self, pressure: np.ndarray, scale: float = 1.0, start: np.ndarray | None = None) -> KeyframeMotion | None:
        """The motion from the keyframe to the image by pressure and scale; start: predicted fit (4,). None where the fit fails."""
        if self._turns is None:
            return None
        found = self._key.motion(pressure, scale=scale, turns=self._turns, guess=np.zeros(4) if start is None else start)
        if not found.spread <= _SPREAD:
            return None
        return KeyframeMotion(found.fit, found.fit[2] / self.reach if self._turns else math.nan, self.middle, self.reach,
                              found.spread * self._position_sigma)

    def _determined(self) -> bool | None:
        """Whether the edges determine a turn, from the products of their slopes; None where a shift is unobservable. Of the slopes of few
        edges, a part of one over their number has any direction by chance."""
        normal, count = self._key.normal, self._key.count
        if count < _UNKNOWNS:
            return None
        xx, xy, yy = normal[0, 0], normal[0, 1], normal[1, 1]
        total, apart = xx + yy, math.hypot(xx - yy, 2 * xy)
        least = _INFORMATION + _ROUGHNESS / count
        if total - apart < least * (total + apart):
            return None
        x, y = normal[2, :2]
        turning = normal[2, 2] - (yy * x * x - 2 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)
        turns = bool(turning > least * total)
        used = [0, 1, 2, 3] if turns else [0, 1, 3]
        covariance = np.linalg.pinv(normal[used][:, used], hermitian=True)[:-1, :-1]
        self._position_sigma = math.sqrt(np.linalg.eigvalsh(covariance)[-1])
        return turns


class CentroidKeyframe:
    """Keyframe of a contact of few taxels, registered by the centroid of pressure (rows, columns) in touched (rows, columns) bool."""

    def __init__(self, pressure: np.ndarray, touched: np.ndarray):
        self._pressure, self._touched = pressure, touched
        self.middle, self.reach = _centroid(pressure, touched), 1.0

    def motion(self, pressure: np.ndarray, touched: np.ndarray) -> KeyframeMotion | None:
        """The motion from the keyframe to pressure (rows, columns) where touched; None for a jump. Both centroids are taken over the taxels
        that either touches: one that crosses the border moves no centroid at once."""
        either = touched | self._touched
        shift = _centroid(pressure, either) - _centroid(self._pressure, either)
        if not np.hypot(*shift) < _FARTHEST:
            return None
        return KeyframeMotion(np.array([*shift, 0.0, 0.0]), np.nan, self.middle, self.reach, _CENTROID_SIGMA)


def _centroid(pressure: np.ndarray, touched: np.ndarray) -> np.ndarray:
    row, column = np.nonzero(touched)
    weight = np.maximum(pressure[row, column], 0) + 1e-12
    return np.array([weight @ column, weight @ row]) / weight.sum()


class RollWatch:
    """Whether an object that moves has no traction, so that it rolls, by the odds of two hypotheses.

    Traction raises the pressure before an object at the expense of that behind it, over some two thicknesses of the pad. So a picture is
    fitted by the one before the motion, shifted, turned, grown, of another load, and with some traction (least squares). An object that
    slides has any traction from none to what its way and friction allow; one that rolls has none, and is curved.
    """

    def __init__(self, array: TaxelArray, pad: SoftPad, shear: _kernel.SurfaceShear):
        self._thickness, self._pad, self._shear = pad.thickness / array.pitch, pad, shear
        self._stiff = _STIFFENED * pad.shear_stiffness * array.pitch  # Pa/taxel
        self.reset()

    def reset(self) -> None:
        """The next picture is the one before a motion."""
        self._before: np.ndarray | None = None

    def rest(self, pressure: np.ndarray, same_load: bool, stamp_s: float) -> None:
        """Take pressure (rows, columns) as of an object that does not move; same_load: since the last frame."""
        if self._before is None or not same_load:
            self._before, self._frames, self._rested_s = pressure.copy(), 0, -math.inf
        self._share, self._near = None, True
        self._frames += 1
        self._newest = max(1 / self._frames, min((stamp_s - self._rested_s) / _REST_S, 1.0))  # its part of the picture
        self._rested_s = stamp_s
        self._before += (pressure - self._before) * np.float32(self._newest)

    def follow(self, pressure: np.ndarray, sigma: float, touched: np.ndarray, pulled: np.ndarray, mean: float) -> bool:
        """Whether an object that moves, after a rest, over touched (rows, columns) bool under a mean pressure, Pa, rolls. pressure: (rows,
        columns) as taxels see it, of noise sigma; pulled: (2,) traction over pressure, if it slides."""
        if min(pressure.shape) < 4:
            return False
        if self._share is None:
            self._fit(touched)
            self._pulled, self._odds = pulled, 0.0  # logarithm of the odds that it rolls
        shift, traction = (self._share @ (pressure[self._box] - self._before[self._box]).ravel()).reshape(2, 2)
        went = math.hypot(*shift)
        self._near = self._near and went < Limits.key_moved  # beyond, it moves as before
        if self._near and went > 0:
            along = shift / went
            most = min(self._pad.friction - float(self._pulled @ along), self._stiff * went / mean)
            noise = math.hypot(self._noise * sigma, Limits.traction * went)
            self._odds = _odds_of_none(float(traction @ along), most, noise) + _odds_of_curved(pressure, touched, along)
        return self._odds > 0

    def _fit(self, touched: np.ndarray) -> None:
        """Least squares by the picture before the motion: its slopes, the pressure of an even traction, turn, growth, load."""
        row, column = np.nonzero(touched)
        reach = math.ceil(REACH * self._thickness)
        self._box = tuple(slice(max(int(at.min()) - reach, 0), int(at.max()) + reach + 1) for at in (row, column))
        even = cv2.GaussianBlur(touched * np.float32(self._before[touched].mean()), (0, 0), 0.5)
        none = np.zeros_like(even)
        before = self._before[self._box]
        down, across = np.gradient(cv2.GaussianBlur(before, (0, 0), 0.5))
        y, x = (np.arange(length)[side] for length, side in zip(touched.shape, self._box))
        terms = np.stack([-across, -down, *(self._shear.pressure_of(np.stack(pull))[self._box] for pull in ((even, none), (none, even))),
                          (y[:, None] - row.mean()) * across - (x - column.mean()) * down, np.hypot(across, down), before]).reshape(7, -1)
        self._share = (np.linalg.pinv(terms.astype(float) @ terms.T.astype(float), rcond=1e-9, hermitian=True)[:4] @ terms)
        self._noise = math.sqrt(np.square(self._share[2:]).sum(axis=1).max() * (1 + self._newest))


def _odds_of_none(traction: float, most: float, sigma: float) -> float:
    """Logarithm of the odds of no traction against any from 0 to most, by one that is seen with a noise of sigma; 0 where none can be."""
    if not most > 0:
        return 0.0
    seen, most = min(max(traction / sigma, -6.0), most / sigma), most / sigma  # more than most does not speak for none
    some = math.sqrt(math.pi / 2) * (math.erfc(-seen * _HALF) - math.erfc((most - seen) * _HALF)) / most
    return -0.5 * seen * seen - math.log(some)


def _odds_of_curved(pressure: np.ndarray, touched: np.ndarray, direction: np.ndarray) -> float:
    """Logarithm of the odds of a face that is curved along a direction (2,) against one that is so or flat, from pressure (rows, columns)
    where touched (rows, columns) bool."""
    row, column = np.nonzero(touched)
    places, load = column * direction[0] + row * direction[1], np.maximum(pressure[touched], 0)
    if not load.sum() * places.var() > 0:
        return 0.0
    places = places - np.average(places, weights=load)
    spread = np.average(places * places, weights=load) / places.var()
    return -float(np.logaddexp(0, ((spread - _CURVED)**2 - (spread - _FLAT)**2) / (2 * Limits.curved**2)))


@dataclass(frozen=True)
class ObjectMotion:
    """Motion of the object in one frame. linear: (2,) m/s at the sensor's origin, and turn: rad/s, NaN where unknown; slipping: (rows,
    columns) bool, where the object slips over the pad; step: (2,) m, and step_turn: rad, since the last frame."""

    linear: np.ndarray
    turn: float
    slipping: np.ndarray
    step: np.ndarray
    step_turn: float


class MotionTracker:
    """Tracks all contacts of an array as one rigid object.

    shear: of the pad's surface; traction_pressure: (rows, columns) Pa that its traction causes under the pad; lead: (2,) m, by which that
    moves the border of the picture.
    """

    def __init__(self, array: TaxelArray, pad: SoftPad):
        self._array, self._pad = array, pad
        self.shear = _kernel.SurfaceShear(rows=array.rows, columns=array.columns, pitch=array.pitch,
                                          thickness=pad.thickness / array.pitch, stiffness=pad.shear_stiffness)
        self._watch = RollWatch(array, pad, self.shear)
        self._path = _kernel.Path(window=_WINDOW_S, reported=Limits.load_s, least_noise=_LEAST_NOISE * array.pitch,
                                  bound=Limits.bound)
        self._middle = 0.5 * np.array([array.columns - 1, array.rows - 1])
        self.reset()

    def reset(self) -> None:
        """Nothing touches."""
        self.shear.reset()
        self.traction_pressure = np.zeros(self._array.shape, np.float32)
        self._watch.reset()
        self._key: EdgeKeyframe | CentroidKeyframe | None = None
        self._seen: KeyframeMotion | None = None  # in the last frame
        self._expected: np.ndarray | None = None  # predicted fit of the next frame
        self._pose = np.zeros(3)  # of the keyframe's centre since the keyframe: m, m, rad
        self._total = np.zeros(3)  # of the object at the origin since it touched: m, m, rad
        self._path.reset()
        self._smooth = np.zeros(3)  # total without noise
        self._loads: deque[tuple[float, float]] = deque()
        self._slip_fraction = 0.0
        self.lead = np.zeros(2)
        self._waited = False  # since the last frames, for a load that varies
        self._key_count = 1  # taxels in the keyframe
        self._followed = 1.0  # object's part of the picture's motion
        self._moves = False
        self._arm = np.zeros(2)  # m, of the keyframe's centre from the origin
        self._along = np.zeros(3)  # unit vector of the motion of that centre, rotation as the path of the edges

    def process(self, pressure: np.ndarray, touched: np.ndarray, stamp_s: float, seen: np.ndarray, sigma: float) -> ObjectMotion:
        """Motion and slip in one frame with pressure (rows, columns, Pa) without the part that traction causes, and touched (rows, columns)
        bool, not empty; seen: the pressure with that part, of noise sigma."""
        count = int(np.count_nonzero(touched))
        load = float(pressure[touched].sum(dtype=float))
        pulled = np.array(self.shear.force) / max(load * self._array.taxel_area, 1e-12)
        self.lead = BORDER_LEAD * self._pad.thickness * pulled
        few, now = count <= _FEW, (pressure, touched, load)
        if self._key is None or few != isinstance(self._key, CentroidKeyframe):
            self._rekey(few, *now)
        found = self._key.motion(pressure, touched) if few else self._key.motion(pressure, self._scale(load), self._expected)
        if found is None:
            self._rekey(few, *now)
            self._path.reset()
            self._moves = False
            return ObjectMotion(np.full(2, np.nan), np.nan, np.zeros(self._array.shape, bool), np.full(2, np.nan), np.nan)
        waits = self._load_varies(found, few, load, stamp_s)
        if self._waited and not waits:
            self._rekey(few, *now)
            found = found._replace(fit=np.zeros(4), turn=0 * found.turn)
        self._waited = waits
        along_x, along_y, turned = np.zeros(3) if waits else self._step(found, load / count)
        step = np.array([along_x + turned * self._arm[1], along_y - turned * self._arm[0], turned])
        self._expected = found.fit if self._seen is None else 1.5 * found.fit - 0.5 * self._seen.fit
        self._seen = found
        smooth, path = self._follow(step, stamp_s)
        if waits or not self._moves:
            self._watch.rest(seen, not waits, stamp_s)
        elif not few and self._shifts(path.velocity) and self._watch.follow(seen, sigma, touched, pulled, load / count):
            smooth, self._moves = np.zeros(3), False
        slip = self.shear.move(touched, pressure, smooth, self._pad.friction)
        self.traction_pressure = self.shear.traction_pressure()
        slipping = self._lagging(slip, smooth, touched) if self._moves else np.zeros_like(touched)
        self._along = self._direction(path.velocity) if self._moves else np.zeros(3)
        if found.largest > Limits.key_moved:
            self._rekey(few, *now)
        self._slip_fraction = np.count_nonzero(slipping) / count
        linear, turn = path.reported[:2], float(path.reported[2])
        return ObjectMotion(linear, math.nan if math.isnan(found.turn) else turn, slipping, step[:2], float(turned))

    def _load_varies(self, seen: KeyframeMotion, few: bool, load: float, stamp_s: float) -> bool:
        """Whether the load varies, so that motion since the keyframe is estimated when it has settled: a new keyframe at each variation
        would add up the errors of those positions."""
        while self._loads and self._loads[0][0] < stamp_s - _WINDOW_S * (1 + 1e-6):
            self._loads.popleft()
        self._loads.append((stamp_s, load))
        moved = few and seen.largest > _CENTROID_SIGMA and load < (1 + Limits.load_change) * self._lately(Limits.load_s)[0]
        return self._variation(Limits.load_s) > Limits.load_change and not moved

    def _lately(self, interval_s: float) -> list[float]:
        """The loads of the last interval, s."""
        return [load for at, load in self._loads if at >= self._loads[-1][0] - interval_s * (1 + 1e-6)]

    def _variation(self, interval_s: float) -> float:
        """Relative change of the load over the last interval, s."""
        loads = self._lately(interval_s)
        return 1 - min(loads) / max(*loads, 1e-9)

    def _step(self, seen: KeyframeMotion, mean: float) -> np.ndarray:
        """m, m, rad since the last frame, at the keyframe's centre, under a mean pressure, Pa. The pressure of the last frame's
        traction is already subtracted from the image; that of the new motion is corrected here."""
        pitch = self._array.pitch
        stiff = BORDER_LEAD * self._pad.thickness * self._pad.shear_stiffness / max(mean, 1.0)
        moved = np.array([seen.fit[0] * pitch, seen.fit[1] * pitch, seen.known_turn]) - self._pose
        # Where the object slips, traction is at its limit and changes its direction only.
        paths = np.array([1.0, 1.0, seen.reach * pitch])
        along = self._along * (self._along @ (moved * paths)) / paths
        self._followed = 1 / (1 + stiff * (1 - self._slip_fraction))
        step = (moved - along) / (1 + stiff) + along * self._followed
        self._pose = self._pose + step
        return step

    def _follow(self, step: np.ndarray, stamp_s: float) -> tuple[np.ndarray, _kernel.PathMotion]:
        """The last motion (3,) m, m at the origin, rad, without noise, and that of the path; step: with noise."""
        self._total = self._total + step
        found = self._path.add(stamp_s, self._total, self._arm, self._key.reach * self._array.pitch)
        self._moves = found.used > 1 and self._is_evident(found)
        last, self._smooth = self._smooth, found.pose
        return self._smooth - last, found

    def _is_evident(self, path: _kernel.PathMotion) -> bool:
        """Whether the path is a motion of the object. It begins by a displacement longer than the registration's own error, by which
        pressure wanders without motion, and than that of the traction that a load lets go."""
        pitch = self._array.pitch
        if path.speed <= max(Limits.begins * path.sigma, Limits.creep * pitch):
            return False
        released = math.hypot(*self.lead) * self._variation(path.lasting)
        wanders = 0 if self._moves else _WANDERS * self._seen.sigma * pitch
        return path.speed * path.lasting > (wanders + released) * self._followed

    def _shifts(self, velocity: np.ndarray) -> bool:
        """Whether a velocity (3,) at the origin shifts the contact more than it turns it."""
        x, y, turn = self._along_of(velocity)
        return abs(turn) <= math.hypot(x, y)

    def _along_of(self, velocity: np.ndarray) -> tuple[float, float, float]:
        """m/s of the keyframe's centre, and of its edges by the turn, for a velocity (3,) at the origin."""
        (x, y), (along_x, along_y, turn) = self._arm, velocity
        return along_x - turn * y, along_y + turn * x, turn * self._key.reach * self._array.pitch

    def _direction(self, velocity: np.ndarray) -> np.ndarray:
        motion = np.array(self._along_of(velocity))
        length = math.hypot(*motion)
        return motion / length if length > 0 else np.zeros(3)

    def _lagging(self, slip: np.ndarray, step: np.ndarray, touched: np.ndarray) -> np.ndarray:
        """(rows, columns) bool: where the pad's surface lagged by slip (2, rows, columns), m, behind the object's step (3,)."""
        x, y, turn = step
        square = (x - turn * self._array.y[:, None])**2 + (y + turn * self._array.x)**2
        return touched & (slip[0]**2 + slip[1]**2 > Limits.lag**2 * square)

    def _rekey(self, few: bool, pressure: np.ndarray, touched: np.ndarray, load: float) -> None:
        self._key_count, self._waited = int(np.count_nonzero(touched)), False
        self._key = CentroidKeyframe(pressure, touched) if few else EdgeKeyframe(pressure, self._scale(load))
        self._arm = (self._key.middle - self._middle) * self._array.pitch
        self._seen, self._expected, self._pose = None, None, np.zeros(3)

    def _scale(self, load: float) -> float:
        """1/Pa that makes pressure an image: over that of the keyframe at this load, scaled as the score of a flat face. The level that is
        fitted for a contact's border varies by itself from frame to frame."""
        return LEVEL / BORDER_SHARE / max(load / self._key_count, 1e-9)


class TaxelSlip:
    """Slip of the object from its motion and the slipping taxels, with hysteresis of the state. calibrated: whether pressure is."""

    def __init__(self, array: TaxelArray, calibrated: bool = True):
        self._array, self._right = array, (1 - _MISTAKEN,) * 3 if calibrated else _RIGHT_UNCALIBRATED
        self.reset()

    def reset(self) -> None:
        """Nothing slips."""
        self._state = NONE

    def process(self, motion: ObjectMotion, touched: np.ndarray) -> SlipEstimate:
        """Slip in a frame; touched: (rows, columns) bool, taxels in contact, at least one."""
        fraction = np.count_nonzero(motion.slipping) / np.count_nonzero(touched)
        self._state = next_state(self._state, fraction)
        estimate = SlipEstimate(self._state, fraction, np.zeros(3), np.zeros(3))
        estimate.confidence = self._right[self._state] * state_probability(self._state, fraction, _PATCHES)
        if self._state == NONE:
            return estimate
        x, y = estimate.x, estimate.y = self._positions(motion.slipping)
        turn = 0.0 if math.isnan(motion.turn) else motion.turn
        along_x, along_y = motion.linear.tolist()
        estimate.vx, estimate.vy = along_x - turn * y, along_y + turn * x
        estimate.linear, estimate.angular = np.array([along_x, along_y, 0.0]), np.array([0.0, 0.0, motion.turn])
        if turn:  # else a translation, or rotation is unobservable
            centre = -along_y / turn, along_x / turn
            x, y = self._positions(touched)
            if math.dist(centre, (x.mean(), y.mean())) < FAR * math.sqrt(len(x) / math.pi) * self._array.pitch:
                estimate.rotation_center = np.array([*centre, 0.0])
        return estimate

    def _positions(self, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """x and y (M,) m of the taxels in mask (rows, columns) bool."""
        row, column = np.divmod(np.flatnonzero(mask), self._array.columns)  # half of the time of np.nonzero
        return self._array.x[column], self._array.y[row]
