# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Estimator of a taxel array: regions, contacts, slip and wrench, frame by frame; methods by name."""
from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import numpy as np

from tactile_driver.plugins import PluginTable

from .._core.taxel import Baseline, DeadTaxels, Hysteresis, Mechanics, ObjectMotion, Region, Regions
from ..common.constants import COMMON
from ..common.contact_tracker import ContactTracker, TrackedContact
from ..common.estimates import AMBIGUOUS, AT_EDGE, SATURATED, ContactEstimate, ContactRegionEstimate, SlipEstimate, planar_covariance
from ..common.surface import axes
from ..common.surface_points import SurfacePoints
from ..core.errors import BadArgument, BadFrame
from .constants import TAXEL
from .motion import LIMITS, TaxelSlip
from .pressure import SoftPad, TaxelArray, pad_on
from .response import Response
from .wrench import GraspedObject, normal_force, taxel_forces, taxel_points, taxel_states, wrench_of

# Noise standard deviations; a contact with a higher peak is reported at once: four times the lowest level of a score. A lighter one is
# reported if it is the largest or persists, because a face splits into pieces for a frame when it starts or ends touching.
# Standard deviation, over the lead that is subtracted, of a lead that is anywhere from none to that. It follows from a balance of moments
# of a pad of the stated thickness and from a traction that no taxel measures: a thinner pad, or an object that creeps, has less of it.
# Noise standard deviations; at this peak the position error is one pad thickness, and it falls with the third power of the peak: a rough
# face first touches with a few bumps. Measured on recordings of two simulations.
_NO_DOTS = np.zeros(0, np.uint8)


@dataclass(frozen=True)
class TaxelSettings:
    """Settings of an estimator.

    Attributes
    ----------
    method : str
        Name in TAXEL_METHODS.
    dead : tuple of int
        Indices row * columns + column of dead taxels.
    reference_frames : int
        Untouched frames that are averaged for the reference.
    time_constant : float
        Time constant in s with which the reference follows drift.
    response : Response
        Response of the taxels.
    zeroed : bool
        Whether the reference is zero if most values of the first frame are zero.
    """

    method: str = 'mechanics'
    dead: tuple = ()
    reference_frames: int = 10
    time_constant: float = 30.0
    response: Response = field(default_factory=Response)
    zeroed: bool = False


@dataclass(frozen=True)
class TaxelResult:
    """Results of one frame.

    Attributes
    ----------
    region : ContactRegionEstimate
        The contact region.
    contacts : list of ContactEstimate
        The contacts, largest first.
    slip : SlipEstimate
        State and velocity of slip.
    wrench : ndarray, shape (6,)
        Force (N) and moment (N m) of the object on the sensor; NaN if unknown.
    pressure : ndarray, shape (rows, columns)
        Pressure, in Pa if the response is known.
    points : callable
        Computes the SurfacePoints on demand.
    """

    region: ContactRegionEstimate
    contacts: list[ContactEstimate]
    slip: SlipEstimate
    wrench: np.ndarray
    pressure: np.ndarray
    points: Callable[[], SurfacePoints]


class Observed(NamedTuple):
    """What a method observes in one frame.

    Attributes
    ----------
    regions : Regions
        The contact regions.
    surface : ndarray, shape (rows, columns)
        Pressure without the part that traction causes.
    slip : SlipEstimate
        State and velocity of slip.
    motion : ObjectMotion or None
        Motion of the object; None if unknown.
    """

    regions: Regions
    surface: np.ndarray
    slip: SlipEstimate
    motion: ObjectMotion | None


class MechanicsMethod:
    """Contact and slip from a model of the pad: pressure at the border, pressure caused by traction, friction.

    Attributes
    ----------
    located : None
        Centroid and angle of the contact; None: those of the outlines are used.
    is_depth_preferred : bool
        Whether the force from the depth is preferred to that from the pressure.
    """

    located, is_depth_preferred = None, False

    def __init__(self, array: TaxelArray, pad: SoftPad, response: Response):
        self._known = response.known
        self._mechanics, self._slip = Mechanics(pad_on(array, pad), LIMITS, response.known), TaxelSlip(array, response.known)

    def reset(self) -> None:
        """Drop all earlier frames."""
        self._mechanics.reset()
        self._slip.reset()

    def observe(self, pressure: np.ndarray, sigma: float, full: np.ndarray, stamp_s: float, can_roll: bool) -> Observed:
        """Observe regions, slip and motion in one frame.

        pressure: (rows, columns); sigma: its noise; full: (rows, columns) bool, saturated taxels; stamp_s: s; can_roll: whether the object
        can roll over the pad.
        """
        found = self._mechanics.process(pressure, sigma, full, stamp_s, can_roll)
        if found.motion is None:
            self._slip.reset()
            return Observed(found.regions, found.surface, SlipEstimate(), None)
        return Observed(found.regions, found.surface, self._slip.process(found.motion, found.regions.touched), found.motion)

    @property
    def lead(self) -> np.ndarray:
        """Displacement (2,), m, of the border of the pressure by traction."""
        return self._mechanics.tracker.lead

    def wrench(self, normal: float, contact: np.ndarray, touched: np.ndarray, pressure: np.ndarray, grasped: GraspedObject) -> np.ndarray:
        """Wrench (6,), N and N m, of the object on the sensor.

        normal: N; contact: (3,) m, centre of the contact; touched: (rows, columns) bool; pressure: (rows, columns), Pa or counts.
        """
        shear, friction = self._mechanics.tracker.shear, np.zeros(2)
        if self._known:
            half = 0.5 * grasped.weight[:2]
            friction = half if np.isfinite(half).all() else shear.force  # from the object's motion
        return wrench_of(normal, shear.pressure_centre(pressure, touched, friction), contact, grasped)


#: Name -> function of (array, pad, response) that makes the method.
TAXEL_METHODS = PluginTable('tactile_perception.taxel_methods', {
    'mechanics': MechanicsMethod,
    'paper': 'tactile_perception.published.taxel_array_image_processing:make_method',
})


class TaxelEstimator:
    """Estimates contact of a taxel array frame by frame.

    Parameters
    ----------
    array : TaxelArray
        Geometry of the array.
    pad : SoftPad
        The pad on it.
    settings : TaxelSettings, optional
        Method, dead taxels, reference and response.

    Attributes
    ----------
    grasped : GraspedObject
        What is known of the object between the fingers.

    Raises
    ------
    BadArgument
        If the method is unknown.
    """

    def __init__(self, array: TaxelArray, pad: SoftPad, settings: TaxelSettings = TaxelSettings()):
        if settings.method not in TAXEL_METHODS:
            raise BadArgument(f'method {settings.method!r} is unknown; choose one of {", ".join(TAXEL_METHODS)}')
        self.array, self.pad, self.settings = array, pad, settings
        self._method = TAXEL_METHODS[settings.method](array, pad, settings.response)
        self._dead = DeadTaxels(array.dead(settings.dead))
        self.baseline = Baseline(settings.reference_frames, settings.time_constant,
                                 np.zeros((0, 0), np.float32) if settings.response.zero is None else np.float32(settings.response.zero),
                                 settings.zeroed)
        self._hysteresis, self._tracker = Hysteresis(settings.response.loop), ContactTracker()
        self._stamp_s: float | None = None
        self.grasped = GraspedObject()

    def set_reference(self) -> None:
        """Use the next frame as the untouched reference."""
        self.baseline.reset(start=False)
        for part in (self._method, self._hysteresis, self._tracker):
            part.reset()

    def process(self, values: np.ndarray, stamp_s: float) -> TaxelResult:
        """Estimate contact in one frame.

        Parameters
        ----------
        values : ndarray, shape (rows, columns)
            Values of the taxels.
        stamp_s : float
            Time of the frame in s.

        Returns
        -------
        TaxelResult
            The estimates of the frame.

        Raises
        ------
        BadFrame
            If the shape is wrong, no value is finite, or the stamp is not later than the last.
        """
        frame = self.array.frame(values)
        if not np.isfinite(frame).any():
            raise BadFrame('taxel image holds no finite value; frame skipped')
        if not math.isfinite(stamp_s) or (self._stamp_s is not None and stamp_s <= self._stamp_s):
            raise BadFrame(f'taxels: stamp {stamp_s} s is not later than the last; frame skipped')
        interval = 0.0 if self._stamp_s is None else stamp_s - self._stamp_s
        self._stamp_s = stamp_s
        response, full_scale = self.settings.response, self.array.scale_of(np.asarray(values))
        change = self.baseline.change(frame, full_scale)
        sigma = self.baseline.sigma
        repaired = self._dead.repaired(change, sigma)
        pressure = self._hysteresis.undone(response.pressure(repaired), interval)
        noise = sigma * response.slope(TAXEL.slope_sigmas * sigma) * response.loop.noise_gain
        full = frame >= TAXEL.saturation * full_scale
        regions, surface, slip, motion = self._method.observe(pressure, noise, full, stamp_s, self.grasped.can_roll)
        touched = regions.touched
        self.baseline.follow(change, touched, interval)
        tracked = self._tracker.assign(regions.labels, [(region.label, region.moments) for region in regions.all],
                                       COMMON.max_step * self.array.pitch, stamp_s)
        normal = [np.nan if regions.broken else self._normal_force(region) for region in regions.all]
        contacts = [self._contact(*one, regions.broken, noise) for k, one in enumerate(zip(regions.all, tracked, normal))
                    if k == 0 or one[1].is_persistent or one[0].peak >= TAXEL.min_peak_sigmas * noise]
        region = self._region(regions, motion, interval)
        return TaxelResult(region, contacts, slip, self._wrench(region, normal, touched, pressure), pressure,
                           partial(self._points, regions, surface, normal, slip, motion))

    def _normal_force(self, region: Region) -> float:
        """Compute the normal force, N, from calibrated pressure, else from depth and area (eq 5); NaN if both are unknown.

        Saturated taxels show too little: there the larger of the two is used.
        """
        by_depth = normal_force(region.moments.area, self.grasped.depth, self.pad)
        by_pressure = max(region.force, 0.0) if self.settings.response.known else np.nan
        if region.saturated:
            return float(np.fmax(by_pressure, by_depth))
        first, second = (by_depth, by_pressure) if self._method.is_depth_preferred else (by_pressure, by_depth)
        return first if math.isfinite(first) else second

    def _wrench(self, region: ContactRegionEstimate, normal: list[float], touched: np.ndarray, pressure: np.ndarray) -> np.ndarray:
        if not normal:
            return np.zeros(6) if self.settings.response.known or math.isfinite(self.grasped.depth) else np.full(6, np.nan)
        contact = region.centroid.copy()
        contact[2] = -self.grasped.depth if self.grasped.depth > 0 else 0.0
        return self._method.wrench(sum(normal), contact, touched, pressure, self.grasped)

    def _points(self, regions: Regions, surface: np.ndarray, normal: list[float], slip: SlipEstimate, motion: ObjectMotion | None):
        """Compute the SurfacePoints of one frame."""
        in_pascal = self.settings.response.known
        forces = taxel_forces(regions, surface, normal, not regions.broken and (in_pascal or self.grasped.depth > 0))
        return taxel_points(self.array, self.pad, surface, in_pascal, forces, taxel_states(regions, slip, motion))

    def _contact(self, region: Region, tracked: TrackedContact, normal: float, broken: bool, noise: float) -> ContactEstimate:
        depth = self.grasped.depth if self.grasped.depth > 0 else np.nan
        if not math.isfinite(depth) and self.settings.response.known:
            depth = region.peak * self.pad.thickness / self.pad.stiffness
        position = tracked.moments.centroid.copy()
        position[2] = -depth
        # The lead is anywhere from none to that which is subtracted. It follows from a balance of moments of a pad of the stated thickness
        # and from a traction that no taxel measures: a thinner pad, or an object that creeps, has less of it.
        x, y = (1 / math.sqrt(3) * self._method.lead).tolist()
        light = self.pad.thickness * (TAXEL.roughness_sigmas * noise / region.peak)**3
        alone = (TAXEL.centroid_sigma * self.array.pitch)**2 + light**2
        covariance = np.array([[alone + x * x, x * y, np.nan], [x * y, alone + y * y, np.nan], [np.nan] * 3])
        flags = AMBIGUOUS * (tracked.merged or broken) | AT_EDGE * region.at_edge | SATURATED * region.saturated
        return ContactEstimate(tracked.number, position, np.array([0.0, 0.0, 1.0]), float(depth), float(normal), covariance, flags,
                               _NO_DOTS)

    def _region(self, regions: Regions, motion: ObjectMotion | None, interval: float) -> ContactRegionEstimate:
        estimate = ContactRegionEstimate(_NO_DOTS, _NO_DOTS)
        if not regions.all:
            return estimate
        total = regions.total
        estimate.outlines = [outline for region in regions.all for outline in region.outlines]
        estimate.holes = [hole for region in regions.all for hole in region.holes]
        estimate.area, estimate.centroid, estimate.normal = total.area, total.centroid, total.normal
        loops = estimate.outlines + estimate.holes
        if not regions.broken:
            estimate.major_axis, estimate.minor_axis, estimate.orientation = axes(total, loops, TAXEL.outline_sigma * self.array.pitch)
        if self._method.located is not None:
            (x, y), estimate.orientation = self._method.located
            estimate.outlines, estimate.holes = self._method.loops
            estimate.centroid = np.array([x, y, 0.0])
        if motion is not None and math.isfinite(motion.step_turn) and interval > 0:
            estimate.motion_translation = np.array([*motion.step, 0.0])
            estimate.motion_rotation = np.array([0.0, 0.0, math.sin(0.5 * motion.step_turn), math.cos(0.5 * motion.step_turn)])
            estimate.motion_interval = interval
            estimate.motion_covariance = planar_covariance(motion.step_covariance)
        return estimate
