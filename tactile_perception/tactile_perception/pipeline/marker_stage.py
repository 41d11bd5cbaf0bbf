# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact stage of marker sensors: contacts, region and wrench from the marker tracks of each frame."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..calibration.files.markers import TouchCalibration
from ..common.dots import DotTracks
from ..common.estimates import ContactEstimate, ContactRegionEstimate
from ..common.surface import scatter
from ..common.surface_points import UNKNOWN, SurfacePoints, dot_points
from ..dots.reference import CalibratedRest
from ..errors import BadFrame
from ..markers.methods import make_method
from ..markers.touches.region import region_of
from ..markers.touches.touch import TouchEstimate
from ..markers.touches.tracker import Touch, TouchTracker
from ..markers.view.marker_field import MarkerField, MarkerView, RestMarkers
from ..markers.view.sensor import MarkerSensor, rest_points
from ..parameters.markers import AUTO

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
        field = self._rest.field(tracks)
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
        rest = rest_points(field.rest, field.eye, self._sensor)
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
