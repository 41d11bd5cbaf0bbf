# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contacts, region and wrench from the marker tracks of each frame, with persistent ids."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from .._core.common import may_continue
from ..common.dots import DotTracks
from ..common.estimates import ContactEstimate, ContactRegionEstimate
from ..common.marker_sensor import MarkerSensor, rest_points
from ..common.surface import scatter
from ..common.surface_points import UNKNOWN, SurfacePoints, dot_points
from ..core.errors import BadArgument, BadFrame
from .calibration import TouchCalibration
from .constants import PRESS
from .estimate import TouchEstimate
from .field import MarkerField, RestMarkers
from .methods import make_method, methods_for
from .parameters import AUTO


class TouchTracker:
    """Assigns ids, which are never reused, to contacts: each estimate continues the nearest contact within reach."""

    def __init__(self):
        self._last: dict[int, tuple[float, TouchEstimate]] = {}  # stamp, s, and estimate by id
        self._next, self._stamp_s = 1, -np.inf

    def check(self, stamp_s: float) -> None:
        """Raise BadFrame for a stamp that is not later than the last."""
        if not stamp_s > self._stamp_s or not np.isfinite(stamp_s):
            raise BadFrame(f'touches: stamp {stamp_s} s is not later than the last; frame skipped')

    def process(self, estimates: list[TouchEstimate], stamp_s: float) -> list[int]:
        """Assign ids to the estimates of a frame.

        Raises BadFrame for a stamp that is not later than the last, BadArgument for numbers that are not finite.
        """
        self.check(stamp_s)
        for one in estimates:
            if not np.isfinite([*one.position, *one.covariance.ravel(), one.depth, one.depth_sigma]).all():
                raise BadArgument(f'a contact must have a finite position, depth and covariance, got {one}')
        known = {id: last for id, last in self._last.items() if may_continue(last[0], self._stamp_s, stamp_s)}
        apart = sorted((self._apart(one, last, stamp_s), m, id) for m, one in enumerate(estimates) for id, last in known.items())
        continued: dict[int, int] = {}  # id of the contact that each estimate continues; the nearest pairs come first
        for distance, m, id in apart:
            if distance <= 1 and m not in continued and id not in continued.values():
                continued[m] = id
        for m in range(len(estimates)):
            if m not in continued:
                continued[m], self._next = self._next, self._next + 1
        self._last = known | {continued[m]: (stamp_s, one) for m, one in enumerate(estimates)}
        self._stamp_s = stamp_s
        return [continued[m] for m in range(len(estimates))]

    @staticmethod
    def _apart(one: TouchEstimate, last: tuple[float, TouchEstimate], stamp_s: float) -> float:
        """Distance of an estimate from the last one of a contact, over the largest possible one."""
        seen_s, before = last
        sigma = np.sqrt(np.trace(one.covariance + before.covariance))
        return float(np.linalg.norm(one.position - before.position) / (PRESS.max_speed * (stamp_s - seen_s) + PRESS.gate_sigmas * sigma))


def region_of(touches: list[TouchEstimate], field: MarkerField, sensor: MarkerSensor, tip_radius: float) -> ContactRegionEstimate:
    """Contact region of a frame's contacts; tip_radius: m, of tips whose radius the method does not estimate.

    The outlines are the circles where the skin separates from the tips, perpendicular to the normal of the untouched surface there
    (src/press/region.hpp). A marker that appears under a tip is sticking; slip is not estimated.
    """
    seen = np.flatnonzero(field.seen)
    if not touches:
        return ContactRegionEstimate(seen, np.zeros(len(seen), np.uint8))
    tips = np.array([[*(one.position if one.lowest is None else one.lowest), one.depth,
                      one.radius if np.isfinite(one.radius) else tip_radius] for one in touches])
    region = sensor.surface.press_region(tips, (field.rest + field.shift)[seen], field.camera_centre[seen], PRESS.max_radius_ratio)
    outlines = list(region.corners.reshape(len(touches), -1, 3))
    return ContactRegionEstimate(seen, region.under.astype(np.uint8), outlines, area=region.area, centroid=region.centroid,
                                 normal=region.normal, major_axis=region.diameter, minor_axis=region.diameter)


_NO_DOTS = np.zeros(0, bool)


@dataclass(frozen=True)
class TouchResult:
    """Estimates of one frame.

    Attributes
    ----------
    contacts : list of ContactEstimate
        The contacts.
    wrench : ndarray, shape (6,)
        Force (N) and moment (N m) of the object on the sensor; NaN if unknown.
    make_region : callable
        Computes the contact region on demand.
    make_points : callable
        Computes the surface points from the region on demand.
    """

    contacts: list[ContactEstimate]
    wrench: np.ndarray
    make_region: Callable[[], ContactRegionEstimate]
    make_points: Callable[[ContactRegionEstimate], SurfacePoints]

    @cached_property
    def region(self) -> ContactRegionEstimate:
        """The contact region."""
        return self.make_region()

    def points(self) -> SurfacePoints:
        """Compute the surface points of all markers."""
        return self.make_points(self.region)


class TouchEstimator:
    """Estimates contacts frame by frame.

    Parameters
    ----------
    sensor : MarkerSensor
        Geometry of the sensor.
    rest : RestMarkers
        The untouched markers.
    values : Mapping
        Values of MARKER_PARAMETERS.
    calibration : TouchCalibration
        Calibration of the same sensor.

    Attributes
    ----------
    model : TouchMethod or None
        The method if it estimates the heights of a dome's markers, else None.

    Raises
    ------
    BadCalibration
        If the calibration does not contain the method.
    """

    def __init__(self, sensor: MarkerSensor, rest: RestMarkers, values: Mapping, calibration: TouchCalibration):
        name = calibration.best if values['touch'] == AUTO else values['touch']
        self._sensor, self._tip_radius = sensor, values['tip_radius']
        self._method = make_method(name, calibration.fitted(name), sensor)
        self._stiffness = calibration.stiffness
        self.model, self._rest = (self._method if hasattr(self._method, 'raised') else None), rest
        self._tracker = TouchTracker()
        make_filter = methods_for(sensor)[name].contact_filter if values['paper.kalman'] else None
        self._filter = make_filter() if make_filter else None

    def process(self, tracks: DotTracks, stamp_s: float) -> TouchResult:
        """Estimate the contacts in one frame.

        Parameters
        ----------
        tracks : DotTracks
            The markers of the frame.
        stamp_s : float
            Exposure time in s.

        Returns
        -------
        TouchResult
            The estimates of the frame.

        Raises
        ------
        BadFrame
            If the markers are of another grid, or the stamp is not later than the last.
        """
        self.check(tracks, stamp_s)
        return self.touches(tracks, self._rest.field(tracks, stamp_s), stamp_s)

    def check(self, tracks: DotTracks, stamp_s: float) -> None:
        """Raise BadFrame as process does."""
        if (tracks.rows, tracks.columns) != (self._sensor.rows, self._sensor.columns):
            raise BadFrame(f'the dots form a {tracks.rows} x {tracks.columns} grid, but parameters rows and columns are '
                           f'{self._sensor.rows} and {self._sensor.columns}')
        self._tracker.check(stamp_s)

    def touches(self, tracks: DotTracks, field: MarkerField, stamp_s: float) -> TouchResult:
        """Estimate the contacts in one frame that passed check; field: of its tracks."""
        estimates = self._method.estimate(field)
        wrench, force = np.full(6, np.nan), np.nan  # unknown for several contacts
        if len(estimates) == 1:
            wrench = self._stiffness * estimates[0].wrench
            force = -float(wrench[2])
        ids = self._tracker.process(estimates, stamp_s)
        if self._filter:
            estimates = self._filter.update(estimates, ids, stamp_s)
        contacts = [ContactEstimate(id, one.position, self._sensor.normal(one.position[:2]), one.depth, force, one.covariance, one.flags,
                                    _NO_DOTS) for id, one in zip(ids, estimates)]
        return TouchResult(contacts, wrench, partial(region_of, estimates, field, self._sensor, self._tip_radius),
                           partial(self._points, tracks, field))

    def _points(self, tracks: DotTracks, field: MarkerField, region: ContactRegionEstimate) -> SurfacePoints:
        """Surface points of all markers of the pattern; NaN for markers that are not visible, forces are unknown."""
        count, shape = len(field), (self._sensor.rows, self._sensor.columns)
        xyz = np.full((count, 3), np.nan) if tracks.xyz is None else scatter(tracks.xyz, tracks.id, count)
        state = scatter(region.dot_state, region.dot_id, count, UNKNOWN)
        rest = rest_points(field.rest, field.camera_centre, self._sensor)
        return dot_points(shape if shape[0] * shape[1] == count else (1, count), xyz, rest, state, None)
