# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact region, contacts, slip and wrench of a touchpad from the dots of one frame."""
from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..common.camera import CameraModel
from ..common.dots import DotTracks
from ..common.estimates import AMBIGUOUS, ContactEstimate, ContactRegionEstimate, SlipEstimate
from ..common.geometry import quaternion
from ..common.surface import scatter
from ..common.surface_points import UNKNOWN, SurfacePoints, dot_points
from ..core.calibration_file import CalibrationFile
from ..core.errors import BadFrame
from ..dots.reference import rest_warning
from .constants import TOUCHPAD
from .contact import DotClassification, make_method
from .pose import ObjectPose
from .positions import RestPositions
from .region import ContactDots, ContactFinder, describe, find_regions
from .sensor import Touchpad
from .slip import SlipEstimator


@dataclass(frozen=True)
class ContactResult:
    """Estimates of one frame.

    Attributes
    ----------
    region : ContactRegionEstimate
        The contact region.
    contacts : list of ContactEstimate
        One contact for each separate region, largest first.
    slip : SlipEstimate
        State and velocity of slip.
    wrench : ndarray, shape (6,)
        Force (N) and moment (N m) of the object on the sensor at the origin of the sensor frame; NaN if unknown.
    points : callable
        Computes the SurfacePoints on demand.
    """

    region: ContactRegionEstimate
    contacts: list[ContactEstimate]
    slip: SlipEstimate
    wrench: np.ndarray
    points: Callable[[], SurfacePoints]


class ContactEstimator:
    """Estimates contact frame by frame.

    While the reference seems to have been taken under a press, contacts are AMBIGUOUS, and depth, force and wrench are NaN.

    Parameters
    ----------
    sensor : Touchpad
        Geometry and material.
    camera : CameraModel
        The camera and its pose in the sensor frame.
    values : Mapping
        Values of TOUCHPAD_PARAMETERS.
    calibration : CalibrationFile, optional
        Provides the calibrated range and the range error.
    rest : RestPositions, optional
        Reference positions of the DotPositions of the same images, which updates them; an own set by default.
    """

    def __init__(self, sensor: Touchpad, camera: CameraModel, values: Mapping, calibration: CalibrationFile | None = None,
                 rest: RestPositions | None = None):
        self._sensor = sensor
        self._rest, self._version = rest or RestPositions(sensor.cap, camera, sensor.rows, sensor.columns), 0
        self._updates_rest = rest is None
        self._method = make_method(sensor.rows, sensor.columns, sensor.material, camera.centre, values)
        self._pose = ObjectPose()
        self._contacts = ContactFinder(sensor.cap, *_calibrated_reach(calibration))
        self._origin, self._range_sigma = camera.centre, _calibrated_sigma(calibration)
        self._slip = SlipEstimator()
        self._suspected, self._checked = False, np.full_like(self._rest.uv, np.inf)

    def process(self, tracks: DotTracks, stamp_s: float) -> ContactResult:
        """Estimate contact in one frame.

        Parameters
        ----------
        tracks : DotTracks
            The dots with their 3D positions.
        stamp_s : float
            Exposure time in s; later than that of the previous frame.

        Returns
        -------
        ContactResult
            The estimates of the frame.

        Raises
        ------
        BadFrame
            If the dots have no 3D positions or are of another grid, or the stamp is not later than the last.
        """
        if (tracks.rows, tracks.columns) != (self._sensor.rows, self._sensor.columns):
            raise BadFrame(f'the dots form a {tracks.rows} x {tracks.columns} grid, but parameters rows and columns are '
                           f'{self._sensor.rows} and {self._sensor.columns}')
        if tracks.xyz is None:
            raise BadFrame('dots have no 3D positions: a calibrated camera is needed')
        version = self._rest.update(tracks) if self._updates_rest else self._rest.version
        if version != self._version:
            self._method.set_rest(self._rest.xyz)
            self._version = version
            self._check_rest()
        ids, xyz = self._usable(tracks)
        found = self._method.classify(ids, xyz, stamp_s)
        force = None if found.all_dots is None else found.all_dots.force
        dots = ContactDots(tracks.rows, tracks.columns, ids, xyz, found.score, found.state, force, all_dots=found.all_dots)
        return self._describe(dots, found, stamp_s)

    def _check_rest(self) -> None:
        """Check the reference for a press if it is new, has drifted, or was suspected before."""
        uv = self._rest.uv
        known = np.flatnonzero(np.isfinite(uv[:, 0]))
        if self._suspected or not (np.abs(uv[known] - self._checked[known]) < TOUCHPAD.max_unchecked_drift).all():
            self._suspected, self._checked = bool(rest_warning(known, uv[known], self._sensor.columns)), uv.copy()

    def _usable(self, tracks: DotTracks) -> tuple[np.ndarray, np.ndarray]:
        """Ids (N,) and positions (N, 3), m, of the dots that also have a reference position."""
        limit = TOUCHPAD.max_coordinate * self._sensor.cap.curvature_radius
        usable = np.logical_and.reduce(np.abs(tracks.xyz.T) <= limit) & np.isfinite(self._rest.xyz[tracks.id, 0])
        if len(usable) and not usable.any():
            raise BadFrame('no dot has a 3D position: images must be in colour, under the illumination of the reference; shield the '
                           'pad from other light, or take a new reference')
        return tracks.id[usable], tracks.xyz.compress(usable, axis=0)

    def _describe(self, dots: ContactDots, found: DotClassification, stamp_s: float) -> ContactResult:
        regions = find_regions(dots)
        contacts = self._contacts.process(dots, regions, stamp_s)
        slip = self._slip.process(dots, contacts, found.displacements, stamp_s, found.objects)
        region = describe(dots, regions, found.motion, found.interval)
        region.dot_confidence = found.confidence
        pose = self._pose.process(bool(regions), found.motion, found.interval, stamp_s)
        if pose is not None:
            region.pose_rotation, region.pose_translation = quaternion(pose[0]), pose[1]
        contacts = [self._with_range_error(contact) for contact in contacts]
        wrench, force = found.wrench, dots.force
        if self._suspected:
            contacts, wrench, force = [_without_reference(contact) for contact in contacts], np.full(6, np.nan), None
        return ContactResult(region, contacts, slip, wrench, partial(_points, dots, found, self._rest.xyz.copy(), force))

    def _with_range_error(self, contact: ContactEstimate) -> ContactEstimate:
        """Add the common-mode error of the ranges to the covariance of a contact."""
        ray = contact.position - self._origin
        along = ray * (self._range_sigma / math.sqrt(ray @ ray))
        return replace(contact, position_covariance=contact.position_covariance + along[:, None] * along)


def _points(dots: ContactDots, found: DotClassification, rest: np.ndarray, force: np.ndarray | None) -> SurfacePoints:
    """Surface points of all K dots of the grid; rest: (K, 3) m; force: (K, 3) N, or None if unknown."""
    xyz, state = (scatter(dots.xyz, dots.ids, len(rest)), scatter(found.state, dots.ids, len(rest), UNKNOWN)) if found.all_dots is None \
        else (found.all_dots.xyz, found.all_dots.state)
    return dot_points((dots.rows, dots.columns), xyz, rest, state, force)


def _without_reference(contact: ContactEstimate) -> ContactEstimate:
    """Remove depth and force, which need an untouched reference, from a contact."""
    return replace(contact, depth=np.nan, force=np.nan, flags=contact.flags | AMBIGUOUS)


def _calibrated_sigma(calibration: CalibrationFile | None) -> float:
    """Common-mode error of the ranges, m: the calibration's cross-validation RMSE, or TOUCHPAD.range_sigma without one."""
    found = np.nan if calibration is None else calibration.residuals.get('held_out_places_range_rms', np.nan)
    return float(found) if found > 0 else TOUCHPAD.range_sigma


def _calibrated_reach(calibration: CalibrationFile | None) -> tuple[float | None, float | None]:
    """Largest calibrated depth and distance from the z axis, m; None without a calibration."""
    if calibration is None:
        return None, None
    span = calibration.calibrated_range
    return span['depth'][1], float(np.hypot(np.max(np.abs(span['x'])), np.max(np.abs(span['y']))))
