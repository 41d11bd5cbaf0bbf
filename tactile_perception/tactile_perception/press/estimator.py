# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contacts, region and wrench from the marker tracks of each frame, with persistent ids and a Kalman filter for each contact."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from math import sqrt

import numpy as np

from ..common.surface import scatter
from ..common.dots import DotTracks
from ..common.estimates import ContactEstimate, ContactRegionEstimate
from ..common.surface_points import UNKNOWN, SurfacePoints, dot_points
from ..dots.reference import CalibratedRest
from ..errors import BadArgument, BadFrame
from .calibration import TouchCalibration
from .estimate import TouchEstimate, region_of
from .field import MarkerField, MarkerView, RestMarkers
from .methods import make_method
from .parameters import AUTO
from .sensor import MarkerSensor, rest_points

# Standard deviation of a touch's acceleration, m/s^2: a hand that is moved starts and stops at 0.1 m/s within 50 ms. Chosen.
ACCELERATION = 2.0
_GATE = 20.0  # squared Mahalanobis distance: exceeded once in 2000 frames (chi-square, four degrees of freedom)
_SPEED = 0.3  # m/s, standard deviation of a new touch's velocity. Chosen
_LEAST = 1e-5  # m: least standard deviation of a measurement, which keeps covariances regular. Chosen
_MISSED_S = 0.1  # s after which a touch that is not seen has ended. Chosen
_MEASURED, _STATE = 4, 8  # position and depth; and their velocities


@dataclass(frozen=True)
class Touch:
    """A touch with its id, which is never reused."""

    id: int
    estimate: TouchEstimate


@dataclass(frozen=True)
class _Track:
    """A touch that is followed: its number; seen_s: stamp of the last frame with it; mean (8,) and covariance (8, 8) of the state."""

    id: int
    seen_s: float
    mean: np.ndarray
    covariance: np.ndarray

    def predicted(self, elapsed: float) -> _Track:
        """After elapsed s at constant velocity with white acceleration."""
        step, pushed = np.eye(_STATE), np.vstack([0.5 * elapsed**2 * np.eye(_MEASURED), elapsed * np.eye(_MEASURED)])
        step[:_MEASURED, _MEASURED:] = elapsed * np.eye(_MEASURED)
        return replace(self, mean=step @ self.mean, covariance=step @ self.covariance @ step.T + ACCELERATION**2 * pushed @ pushed.T)

    def distance(self, value: np.ndarray, spread: np.ndarray) -> float:
        """Squared Mahalanobis distance of a measurement (4,) with covariance (4, 4)."""
        off = value - self.mean[:_MEASURED]
        return float(off @ np.linalg.solve(self.covariance[:_MEASURED, :_MEASURED] + spread, off))

    def corrected(self, value: np.ndarray, spread: np.ndarray, stamp_s: float) -> _Track:
        """With a measurement; in Joseph's form, which keeps the covariance positive definite despite rounding."""
        gain = np.linalg.solve(self.covariance[:_MEASURED, :_MEASURED] + spread, self.covariance[:_MEASURED]).T
        rest = np.eye(_STATE)
        rest[:, :_MEASURED] -= gain
        mean = self.mean + gain @ (value - self.mean[:_MEASURED])
        return replace(self, seen_s=stamp_s, mean=mean, covariance=rest @ self.covariance @ rest.T + gain @ spread @ gain.T)


class TouchTracker:
    """Assigns ids to touches and filters them.

    filtered: False returns each frame's own estimate. The filter's model of place and depth is constant velocity with white acceleration
    (standard deviation ACCELERATION), for any frame interval. A touch at constant velocity has no lag; a step within the gate is
    followed to 90 % in 20 to 35 ms (sigma 0.1 mm, 30 to 200 frames per second).
    """

    def __init__(self, filtered: bool = True):
        self._filtered = filtered
        self._tracks: list[_Track] = []
        self._next = 1
        self._stamp_s: float | None = None

    def check(self, stamp_s: float) -> None:
        """Raise BadFrame for a stamp that is not later than the last."""
        if not np.isfinite(stamp_s) or (self._stamp_s is not None and stamp_s <= self._stamp_s):
            raise BadFrame(f'touches: stamp {stamp_s} s is not later than the last; frame skipped')

    def process(self, estimates: list[TouchEstimate], stamp_s: float) -> list[Touch]:
        """The touches of a frame with their ids. Raises BadFrame for a stamp that is not later than the last."""
        self.check(stamp_s)
        measured = _measurements(estimates)
        before = [track.predicted(stamp_s - self._stamp_s) for track in self._tracks]
        self._stamp_s = stamp_s
        apart = sorted((track.distance(*one), m, k) for m, one in enumerate(measured) for k, track in enumerate(before))
        continued: dict[int, int] = {}  # number of the track that each measurement continues: the nearest pairs first
        for distance, m, k in apart:
            if distance <= _GATE and m not in continued and k not in continued.values():
                continued[m] = k
        tracks = [before[continued[m]].corrected(*one, stamp_s) if m in continued else self._begun(*one)
                  for m, one in enumerate(measured)]
        waiting = [track for k, track in enumerate(before) if k not in continued.values() and stamp_s - track.seen_s <= _MISSED_S]
        self._tracks = tracks + waiting
        return [Touch(track.id, _filtered(estimate, track) if self._filtered else estimate) for track, estimate in zip(tracks, estimates)]

    def _begun(self, value: np.ndarray, spread: np.ndarray) -> _Track:
        covariance = _SPEED**2 * np.eye(_STATE)
        covariance[:_MEASURED, :_MEASURED] = spread
        self._next += 1
        return _Track(self._next - 1, self._stamp_s, np.append(value, np.zeros(_MEASURED)), covariance)


def _filtered(estimate: TouchEstimate, track: _Track) -> TouchEstimate:
    """The estimate with the track's position, depth and covariance."""
    place, covariance = track.covariance[:3, :3], track.covariance
    return replace(estimate, position=track.mean[:3].copy(), depth=max(float(track.mean[3]), 0.0), covariance=0.5 * (place + place.T),
                   depth_sigma=sqrt(covariance[3, 3]))


def _measurements(estimates: list[TouchEstimate]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Place and depth (4,) and their covariance (4, 4) of each. Raises BadArgument for numbers that are not finite."""
    found = []
    for estimate in estimates:
        spread = np.zeros((_MEASURED, _MEASURED))
        spread[:3, :3], spread[3, 3] = estimate.covariance, estimate.depth_sigma**2
        value = np.append(estimate.position, estimate.depth)
        if not (np.isfinite(value).all() and np.isfinite(spread).all()):
            raise BadArgument(f'a touch must have a finite place, depth and covariance, got {value}, covariance {spread}')
        found.append((value, spread + _LEAST**2 * np.eye(_MEASURED)))
    return found


_NO_DOTS = np.zeros(0, bool)


@dataclass(frozen=True)
class TouchResult:
    """Estimates of one frame. wrench: (6,) N and N m, of the object on the sensor, NaN if unknown; points: computes the surface points on
    demand."""

    region: ContactRegionEstimate
    contacts: list[ContactEstimate]
    wrench: np.ndarray
    points: Callable[[], SurfacePoints]


class TouchEstimator:
    """Estimates contacts frame by frame.

    make_view: see RestMarkers; values: of POINT_PARAMETERS; calibration: of the same sensor. Raises BadCalibration for a method that the
    calibration does not contain.
    """

    def __init__(self, sensor: MarkerSensor, make_view: Callable[[np.ndarray], MarkerView], values: Mapping,
                 calibration: TouchCalibration):
        name = calibration.best if values['touch'] == AUTO else values['touch']
        self._sensor, self._tip_radius = sensor, values['tip_radius']
        self._method = make_method(name, calibration.fitted(name), sensor)
        self._stiffness = calibration.stiffness
        count = sensor.rows * sensor.columns if calibration.pattern is None else len(calibration.pattern)
        known = None if calibration.rest is None else CalibratedRest(calibration.rest)
        self._rest = RestMarkers(count, make_view if known is None else partial(_checked, make_view, known))
        self._tracker = TouchTracker(values['filter'])

    def process(self, tracks: DotTracks, stamp_s: float) -> TouchResult:
        """Contacts in one frame; stamp_s: s. Raises BadFrame for markers of another grid, or a stamp that is not later than the last."""
        if (tracks.rows, tracks.columns) != (self._sensor.rows, self._sensor.columns):
            raise BadFrame(f'dots are of a {tracks.rows} x {tracks.columns} grid, but parameters rows and columns are '
                           f'{self._sensor.rows} and {self._sensor.columns}')
        self._tracker.check(stamp_s)
        field = self._rest.field(tracks, stamp_s)
        estimates = self._method.estimate(field)
        touches, wrench = self._tracker.process(estimates, stamp_s), self._wrench_of(estimates)
        force = -float(wrench[2]) if len(touches) == 1 else np.nan
        contacts = [self._contact(touch, force) for touch in touches]
        region = region_of([touch.estimate for touch in touches], field, self._sensor, self._tip_radius)
        return TouchResult(region, contacts, wrench, partial(self._points, tracks, field, region))

    def _points(self, tracks: DotTracks, field: MarkerField, region: ContactRegionEstimate) -> SurfacePoints:
        """Surface points of all markers of the pattern; positions of markers not seen are NaN, and forces are unknown."""
        count, shape = len(field), (self._sensor.rows, self._sensor.columns)
        xyz = np.full((count, 3), np.nan) if tracks.xyz is None else scatter(tracks.xyz, tracks.id, count)
        state = scatter(region.dot_state, region.dot_id, count, UNKNOWN)
        rest = rest_points(field.rest, field.camera_centre, self._sensor)
        return dot_points(shape if shape[0] * shape[1] == count else (1, count), xyz, rest, state, None)

    def _wrench_of(self, estimates: list[TouchEstimate]) -> np.ndarray:
        """(6,) N and N m; NaN without contact, for several contacts, and where the method or the calibration does not give it."""
        return self._stiffness * estimates[0].wrench if len(estimates) == 1 else np.full(6, np.nan)

    def _contact(self, touch: Touch, force: float) -> ContactEstimate:
        found = touch.estimate
        return ContactEstimate(touch.id, found.position, self._sensor.normal(found.position[:2]), found.depth, force, found.covariance,
                               found.flags, _NO_DOTS)


def _checked(make_view: Callable[[np.ndarray], MarkerView], known: CalibratedRest, uv: np.ndarray) -> MarkerView:
    """The view for untouched markers at uv (K, 2) px. Raises BadFrame for markers that do not match the calibrated reference."""
    reason = known.judge(np.arange(len(uv)), uv).reason
    if reason:
        raise BadFrame(reason)
    return make_view(uv)
