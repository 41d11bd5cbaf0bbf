# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contacts, region and wrench from the marker tracks of each frame, with persistent ids."""
from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from ..common.contact_tracker import may_continue
from ..common.dots import DotTracks
from ..common.estimates import ContactEstimate, ContactRegionEstimate
from ..common.geometry import tangents
from ..common.marker_sensor import MarkerSensor, dome_cap, rest_points
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


RADII = np.geomspace(1e-4, 1.0, 1000)  # over the largest; interpolation of contact radii between them is accurate to 1e-5
RADII_SQUARED, LOG_RADII = RADII**2, np.log(RADII)
UNIT_CIRCLE = np.stack([part(np.arange(36) * 2 * np.pi / 36) for part in (np.cos, np.sin)], axis=1)  # 0.5 % less area than the disc


def region_of(touches: list[TouchEstimate], field: MarkerField, sensor: MarkerSensor, tip_radius: float) -> ContactRegionEstimate:
    """Contact region of a frame's contacts; tip_radius: m, of tips whose radius the method does not estimate.

    The outlines are the circles where the skin separates from the tips, perpendicular to the normal of the untouched surface there. A
    marker that appears under a tip is sticking; slip is not estimated.
    """
    seen = np.flatnonzero(field.seen)
    now, camera_centre, under = (field.rest + field.shift)[seen], field.camera_centre[seen], np.zeros(len(seen), np.uint8)
    estimate = ContactRegionEstimate(seen, under)
    if not touches:
        return estimate
    discs = [_disc(touch, touch.radius if np.isfinite(touch.radius) else tip_radius, sensor) for touch in touches]
    for centre, _, radius in discs:
        share = (sensor.plane_z - camera_centre[:, 2:]) / (centre[2] - camera_centre[:, 2:])  # as the camera sees it in the viewing plane
        under |= np.hypot(*(now - camera_centre[:, :2] - share * (centre[:2] - camera_centre[:, :2])).T) <= radius
    centres, normals, radii = (np.array(part) for part in zip(*discs))
    areas = np.pi * radii**2
    estimate.outlines = [_circle(*disc) for disc in discs]
    estimate.area = float(areas.sum())
    estimate.centroid = areas @ centres / areas.sum()
    normal = areas @ normals
    estimate.normal = normal / np.linalg.norm(normal)
    estimate.major_axis = estimate.minor_axis = 2 * float(radii[0]) if len(discs) == 1 else np.nan
    return estimate


def _disc(touch: TouchEstimate, tip_radius: float, sensor: MarkerSensor) -> tuple[np.ndarray, np.ndarray, float]:
    """Centre (3,), m, normal (3,) and radius, m, of the contact disc between the skin and a tip of tip_radius, m."""
    lowest = touch.position if touch.lowest is None else touch.lowest
    bend = 0.0 if sensor.is_sheet else 1 / dome_cap(sensor).curvature_radius  # a convex skin separates from the tip sooner
    radius = _contact_radius(touch.depth, 1 / (1 / tip_radius + bend), _clearance(lowest[:2], sensor))
    normal = sensor.normal(lowest[:2] / (1 + tip_radius * bend))
    return lowest + [0.0, 0.0, tip_radius] - np.sqrt(max(tip_radius**2 - radius**2, 0.0)) * normal, normal, radius


def _contact_radius(depth: float, tip_radius: float, clearance: float) -> float:
    """Contact radius a, m, of a round tip on a taut membrane clamped at a distance of clearance, m.

    Within a the membrane follows the tip (a paraboloid with the slope a / tip_radius at its edge); outside it solves Laplace's equation, so
    that depth is logarithmic in the distance: depth = a^2 / tip_radius (1/2 + ln(clearance / a)).
    """
    largest = max(min(PRESS.max_radius_ratio * tip_radius, clearance), 1e-9)
    depths = RADII_SQUARED * (0.5 + math.log(max(clearance, 1e-9) / largest) - LOG_RADII)
    return largest * float(np.interp(depth * tip_radius / largest**2, depths, RADII))


def _clearance(position: np.ndarray, sensor: MarkerSensor) -> float:
    """Conformal radius, m, of the clamped area at a position (2,), m: of the circular membrane that is as compliant in its centre.

    That of a disc is (R^2 - r^2) / R; that of a rectangle is approximated from those of its two strips.
    """
    if not sensor.is_sheet:
        return max(sensor.rim_radius - position @ position / sensor.rim_radius, 0.0)
    size = np.array(sensor.size)
    return float(np.sum((2 * size / np.pi * np.cos(np.pi * np.clip(position / size, -0.499, 0.499)))**-4.0)**-0.25)


def _circle(centre: np.ndarray, normal: np.ndarray, radius: float) -> np.ndarray:
    """Corners (36, 3), m, around the disc."""
    return centre + radius * UNIT_CIRCLE @ tangents(normal)


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
