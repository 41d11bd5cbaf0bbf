# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From the dots of one frame to region, contacts, slip and wrench: what contact_region_node and process_bag run."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..calibration.files.format import CalibrationFile
from ..common.camera import CameraModel
from ..common.dots import DotTracks
from ..common.estimates import AMBIGUOUS, ContactEstimate, ContactRegionEstimate, SlipEstimate
from ..common.dot_grid import scatter
from ..common.surface_points import UNKNOWN, SurfacePoints, dot_points
from ..dots.reference.untouched_shape import rest_suspicion
from ..errors import BadArgument, BadFrame
from ..touchpad.contact.methods import DotClassification, make_method
from ..touchpad.contact.region import ContactDots, describe, find_regions
from ..touchpad.contact.object_motion import ObjectMotion
from ..touchpad.contact.slip import SlipEstimator
from ..touchpad.contact.tracker import ContactTracker
from ..touchpad.places import RestPlaces
from ..touchpad.sensor import Touchpad

_FARTHEST = 10.0  # radii of the cap: no dot of it gets so far
_DRIFTED = 0.1  # px: a reference that has moved by more is looked at anew
_FROM_REST = 0.15e-3  # m: what colour tells of all ranges alike is wrong by, where only the rest shape is known


@dataclass(frozen=True)
class ContactResult:
    """region, contacts, slip of one frame; wrench: (6,) N and N m of the object on the sensor, NaN where not known; points: makes the
    surface's points, which few ask for."""

    region: ContactRegionEstimate
    contacts: list[ContactEstimate]
    slip: SlipEstimate
    wrench: np.ndarray
    points: Callable[[], SurfacePoints]


class ContactStage:
    """Contact frame by frame; values: of REGION_PARAMETERS; calibration: whose range contacts are held against.

    While the reference looks as if it was taken under a press, contacts are AMBIGUOUS and depth, force and wrench are NaN.
    Raises BadArgument for a sensor whose dots have no places in 3D.
    """

    def __init__(self, sensor: Touchpad, camera: CameraModel, values: Mapping, calibration: CalibrationFile | None = None):
        if sensor.cap is None:
            raise BadArgument('parameter surface is none: dots have no places in 3D, so contact cannot be told')
        self._sensor = sensor
        self._rest = RestPlaces(sensor.cap, camera, sensor.rows, sensor.columns)
        self._method = make_method(sensor.rows, sensor.columns, sensor.material, camera.centre, values)
        self._motion = ObjectMotion(sensor.rows, sensor.columns)
        self._contacts = ContactTracker(sensor.cap, *_calibrated_reach(calibration))
        self._eye, self._range_sigma = camera.centre, _range_sigma(calibration)
        self._slip = SlipEstimator()
        self._suspected, self._examined = False, np.full_like(self._rest.uv, np.inf)

    def process(self, tracks: DotTracks, stamp_s: float) -> ContactResult:
        """The contact that the dots of one frame show. Raises BadFrame for dots without places, of another grid, or an earlier stamp."""
        if (tracks.rows, tracks.columns) != (self._sensor.rows, self._sensor.columns):
            raise BadFrame(f'dots are of a {tracks.rows} x {tracks.columns} grid, parameters rows and columns say '
                           f'{self._sensor.rows} x {self._sensor.columns}')
        if tracks.xyz is None:
            raise BadFrame('dots have no places in 3D: the tracker needs surface cap and a calibrated camera')
        if self._rest.update(tracks):
            self._method.renew(self._rest.xyz)
            self._examine_rest()
        ids, xyz, rest_xyz = self._usable(tracks)
        judged = self._method.judge(ids, xyz, stamp_s)
        dots = ContactDots(tracks.rows, tracks.columns, ids, xyz, rest_xyz, judged.score, judged.state, judged.force, whole=judged.whole)
        return self._describe(dots, judged, stamp_s)

    def _examine_rest(self) -> None:
        """Look whether the reference was taken under a press: a new one, one that has drifted, and one that was suspected."""
        uv = self._rest.uv
        known = np.flatnonzero(np.isfinite(uv[:, 0]))
        if self._suspected or not (np.abs(uv[known] - self._examined[known]) < _DRIFTED).all():
            self._suspected, self._examined = bool(rest_suspicion(known, uv[known], self._sensor.columns)), uv.copy()

    def _usable(self, tracks: DotTracks) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Numbers (N,), places (N, 3) and rest places (N, 3), m, of the dots that have both."""
        rest_xyz = self._rest.xyz.take(tracks.id, axis=0)
        reach = _FARTHEST * self._sensor.cap.curvature_radius
        usable = (np.abs(tracks.xyz) < reach).all(axis=1) & np.isfinite(rest_xyz).all(axis=1)
        if usable.all():
            return tracks.id, tracks.xyz, rest_xyz
        if not usable.any():
            raise BadFrame('no dot has a place in 3D: grey images tell none, the driver has to publish colour; or take a new reference')
        return tracks.id[usable], tracks.xyz[usable], rest_xyz[usable]

    def _describe(self, dots: ContactDots, judged: DotClassification, stamp_s: float) -> ContactResult:
        regions = find_regions(dots)
        motion = self._motion.process(dots, stamp_s)
        contacts = self._contacts.process(dots, regions)
        slip = self._slip.process(dots, contacts, motion, stamp_s)
        region = describe(dots, regions, motion.motion, motion.interval)
        contacts = [self._with_common_error(contact) for contact in contacts]
        wrench, force = judged.wrench, judged.whole and judged.whole.force
        if self._suspected:
            contacts, wrench, force = [_doubted(contact) for contact in contacts], np.full(6, np.nan), None
        return ContactResult(region, contacts, slip, wrench, partial(_points, dots, judged, self._rest.xyz.copy(), force))

    def _with_common_error(self, contact: ContactEstimate) -> ContactEstimate:
        """The same contact with what its dots' ranges are wrong by all alike: a movement does not show it, a place does."""
        ray = contact.position - self._eye
        along = ray * (self._range_sigma / np.linalg.norm(ray))
        return replace(contact, position_covariance=contact.position_covariance + np.outer(along, along))


def _points(dots: ContactDots, judged: DotClassification, rest: np.ndarray, force: np.ndarray | None) -> SurfacePoints:
    """The points of all dots of the grid; rest: (K, 3) m, force: (K, 3) N or None."""
    xyz, state = (scatter(dots.xyz, dots.ids, len(rest)), scatter(judged.state, dots.ids, len(rest), UNKNOWN)) if judged.whole is None \
        else (judged.whole.xyz, judged.whole.state)
    return dot_points((dots.rows, dots.columns), xyz, rest, state, force)


def _doubted(contact: ContactEstimate) -> ContactEstimate:
    """The same contact without what only an untouched reference can tell: depth and force."""
    return replace(contact, depth=np.nan, force=np.nan, flags=contact.flags | AMBIGUOUS)


def _range_sigma(calibration: CalibrationFile | None) -> float:
    """m, of ranges at places that were not calibrated at."""
    found = np.nan if calibration is None else calibration.residuals.get('held_out_places_range_rms', np.nan)
    return float(found) if found > 0 else _FROM_REST


def _calibrated_reach(calibration: CalibrationFile | None) -> tuple[float | None, float | None]:
    """Largest depth and distance from the z axis, m, that calibration covered."""
    if calibration is None:
        return None, None
    span = calibration.calibrated_range
    return span['depth'][1], float(np.hypot(np.max(np.abs(span['x'])), np.max(np.abs(span['y']))))
