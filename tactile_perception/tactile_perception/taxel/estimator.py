# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Estimator of a taxel array: regions, contacts, slip and wrench, frame by frame; methods by name."""
from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from tactile_driver.plugins import PluginTable

from .._core.taxel import Baseline, DeadTaxels, Hysteresis, Region
from ..common.contact_tracker import ContactTracker, TrackedContact
from ..common.estimates import AMBIGUOUS, AT_EDGE, SATURATED, ContactEstimate, ContactRegionEstimate, SlipEstimate
from ..common.surface import axes
from ..common.surface_points import SurfacePoints
from ..errors import BadArgument, BadFrame
from .motion import MotionTracker, ObjectMotion, TaxelSlip
from .pressure import SoftPad, TaxelArray
from .region import ContactScore, Regions, find_regions
from .response import Response
from .wrench import GraspedObject, normal_force, pressure_centre, taxel_forces, taxel_points, taxel_states, under_friction, wrench_of

_FULL = 0.995  # of the full scale, from which a taxel is saturated: a count below 255
_OUTLINE_SD = 0.5  # pitches, standard deviation of an outline's vertices for the test of roundness
_NOISE_AT = 5.0  # standard deviations of the noise at which the slope of the response is evaluated: half of a score's least level
# Standard deviations of the noise, peak of a contact that is reported at once: four times a score's least level. A lighter one is
# reported if it is the largest, or lasts: a face that begins or ceases to touch shows as pieces for a frame.
_AT_ONCE = 40.0
_REACH = 1.5  # pitches between the borders of a contact in one frame and in the next
# Standard deviation of a centroid, pitches, and of an object's friction, as part of the pad's: what of the traction is not known moves it.
_PLACE_SD, _FRICTION_SD = 0.03, 0.3
# Standard deviations of the noise, peak of a contact whose place is a thickness off, and with the third power of which that falls: a rough
# face touches by a few of its bumps at first. Measured on recordings of two simulations.
_BUMPS = 17.0
_NO_DOTS = np.zeros(0, np.uint8)
_ASSUMED_SLIDE = 0.1  # thicknesses that a pad of unknown pressure is dragged before it slips, as the usual pad at the usual load


@dataclass(frozen=True)
class TaxelSettings:
    """method: name in TAXEL_METHODS; dead: indices row * columns + column of dead taxels; reference_frames, time_constant (s): see
    Baseline; response: of the taxels; zeroed: see Baseline."""

    method: str = 'mechanics'
    dead: tuple = ()
    reference_frames: int = 10
    time_constant: float = 30.0
    response: Response = field(default_factory=Response)
    zeroed: bool = False


@dataclass(frozen=True)
class TaxelResult:
    """Results of one frame. wrench: (6,) N and N m, NaN where unknown; pressure: (rows, columns), Pa if the response is known; points:
    computes the surface points on demand."""

    region: ContactRegionEstimate
    contacts: list[ContactEstimate]
    slip: SlipEstimate
    wrench: np.ndarray
    pressure: np.ndarray
    points: Callable[[], SurfacePoints]


class MechanicsMethod:
    """Contact and slip by a model of the pad: pressure at the border, pressure caused by traction, friction.

    response: of the taxels; located: None, centroid and angle are those of the regions' outlines; is_depth_preferred: whether the force by
    the depth is preferred to that by the pressure; shear: of the pad's surface; lead: (2,) m by which traction moves the border of the
    pressure.
    """

    located, is_depth_preferred = None, False

    def __init__(self, array: TaxelArray, pad: SoftPad, response: Response):
        self._array, self._pad, self._known = array, pad, response.known
        self._score, self._motion, self._slip = ContactScore(array, pad), MotionTracker(array, pad), TaxelSlip(array, response.known)
        self.shear, self.lead = self._motion.shear, self._motion.lead
        self._assumed = np.float32(1)  # Pa per unit of pressure

    def reset(self) -> None:
        """Nothing touches."""
        self._motion.reset()
        self._slip.reset()

    def regions(self, pressure: np.ndarray, sigma: float, full: np.ndarray) -> tuple[Regions, np.ndarray]:
        """Regions, and pressure (rows, columns) without the part caused by traction, which at most doubles or cancels it; sigma: noise of
        pressure (rows, columns); full: (rows, columns) bool, taxels that are saturated."""
        bound = np.maximum(pressure, 0)
        surface = pressure - np.minimum(np.maximum(self._motion.traction_pressure / self._assumed, -bound), bound)
        self._seen = pressure, sigma
        score = self._score.compute(surface, sigma, full)
        return find_regions(score, surface, self._array, self._pad.thickness / self._array.pitch, full), surface

    def slip(self, regions: Regions, surface: np.ndarray, stamp_s: float) -> tuple[SlipEstimate, ObjectMotion | None]:
        """Slip, and motion of the contacts, in the frame of the last call of regions; stamp_s: s."""
        if not regions.all:
            self.reset()
            return SlipEstimate(), None
        touched = regions.touched
        if not self._known:
            mean = max(float(surface[touched].mean()), 1e-6)
            self._assumed = np.float32(_ASSUMED_SLIDE * self._pad.shear_modulus / (self._pad.friction * mean))
        motion = self._motion.process(surface * self._assumed, touched, stamp_s, *self._seen)
        self.lead = self._motion.lead
        return self._slip.process(motion, touched), motion

    def wrench(self, normal: float, contact: np.ndarray, touched: np.ndarray, pressure: np.ndarray, grasped: GraspedObject) -> np.ndarray:
        """(6,) N and N m of the object on the sensor. normal: N; contact: (3,) m, its centre; touched: (rows, columns) bool; pressure:
        (rows, columns) Pa or counts."""
        if self._known:
            half = 0.5 * grasped.weight[:2]
            friction = half if np.isfinite(half).all() else self.shear.force  # by the object's motion
            centre = under_friction(pressure, touched, friction, self._array, self._pad, self.shear)
        else:
            centre = pressure_centre(pressure, touched, self._array, self._pad)
        return wrench_of(normal, centre, contact, grasped)


#: Name -> function of (array, pad, response) that makes the method.
TAXEL_METHODS = PluginTable('tactile_perception.taxel_methods', {
    'mechanics': MechanicsMethod,
    'paper': 'tactile_perception.published.taxel_array_image_processing:make_method',
})


class TaxelEstimator:
    """The array's state between frames. Raises BadArgument for an unknown method."""

    def __init__(self, array: TaxelArray, pad: SoftPad, settings: TaxelSettings = TaxelSettings()):
        if settings.method not in TAXEL_METHODS:
            raise BadArgument(f'method {settings.method!r} is unknown; choose one of {", ".join(TAXEL_METHODS)}')
        self.array, self.pad, self.settings = array, pad, settings
        self._method = TAXEL_METHODS[settings.method](array, pad, settings.response)
        self._dead = DeadTaxels(array.dead(settings.dead))
        self.baseline = Baseline(settings.reference_frames, settings.time_constant,
                                 None if settings.response.zero is None else np.float32(settings.response.zero), settings.zeroed)
        self._hysteresis, self._tracker = Hysteresis(settings.response.loop), ContactTracker()
        self._stamp_s: float | None = None
        self.grasped = GraspedObject()

    def set_reference(self) -> None:
        """Take the next frame as the untouched baseline."""
        self.baseline.reset(start=False)
        for part in (self._method, self._hysteresis, self._tracker):
            part.reset()

    def process(self, values: np.ndarray, stamp_s: float) -> TaxelResult:
        """Results for values (rows, columns) at stamp_s, s. Raises BadFrame for another shape, a frame without finite values, or a stamp
        that is not later than the last."""
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
        noise = sigma * response.slope(_NOISE_AT * sigma) * response.loop.noise_gain
        full = frame >= _FULL * full_scale
        regions, surface = self._method.regions(pressure, noise, full)
        self.baseline.follow(change, regions.touched, interval)
        slip, motion = self._method.slip(regions, surface, stamp_s)
        tracked = self._tracker.assign(regions.labels, [(region.label, region.moments) for region in regions.all],
                                       _REACH * self.array.pitch, stamp_s)
        normal = [np.nan if regions.broken else self._normal_force(region) for region in regions.all]
        contacts = [self._contact(*one, regions.broken, noise) for k, one in enumerate(zip(regions.all, tracked, normal))
                    if k == 0 or one[1].is_persistent or one[0].peak >= _AT_ONCE * noise]
        return TaxelResult(self._region(regions, motion, interval), contacts, slip, self._wrench(regions, normal, pressure), pressure,
                           partial(self._points, regions, surface, normal, slip, motion))

    def _normal_force(self, region: Region) -> float:
        """N, by calibrated pressure, else by depth and area (eq 5); NaN if both are unknown. Saturated taxels show too little: there the
        larger of both counts."""
        by_depth = normal_force(region.moments.area, self.grasped.depth, self.pad)
        by_pressure = max(region.force, 0.0) if self.settings.response.known else np.nan
        if region.saturated:
            return float(np.fmax(by_pressure, by_depth))
        first, second = (by_depth, by_pressure) if self._method.is_depth_preferred else (by_pressure, by_depth)
        return first if math.isfinite(first) else second

    def _wrench(self, regions: Regions, normal: list[float], pressure: np.ndarray) -> np.ndarray:
        if not regions.all:
            return np.zeros(6) if self.settings.response.known or math.isfinite(self.grasped.depth) else np.full(6, np.nan)
        contact = regions.total.centroid.copy()
        contact[2] = -self.grasped.depth if self.grasped.depth > 0 else 0.0
        return self._method.wrench(sum(normal), contact, regions.touched, pressure, self.grasped)

    def _points(self, regions: Regions, surface: np.ndarray, normal: list[float], slip: SlipEstimate, motion: ObjectMotion | None):
        """The SurfacePoints of one frame."""
        in_pascal = self.settings.response.known
        forces = taxel_forces(regions, surface, normal, not regions.broken and (in_pascal or self.grasped.depth > 0))
        return taxel_points(self.array, self.pad, surface, in_pascal, forces, taxel_states(regions, slip, motion))

    def _contact(self, region: Region, tracked: TrackedContact, normal: float, broken: bool, noise: float) -> ContactEstimate:
        depth = self.grasped.depth if self.grasped.depth > 0 else np.nan
        if not math.isfinite(depth) and self.settings.response.known:
            depth = region.peak * self.pad.thickness / self.pad.stiffness
        position = tracked.moments.centroid.copy()
        position[2] = -depth
        (x, y), light = (_FRICTION_SD * self._method.lead).tolist(), self.pad.thickness * (_BUMPS * noise / region.peak)**3
        alone = (_PLACE_SD * self.array.pitch)**2 + light**2
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
            estimate.major_axis, estimate.minor_axis, estimate.orientation = axes(total, loops, _OUTLINE_SD * self.array.pitch)
        if self._method.located is not None:
            (x, y), estimate.orientation = self._method.located
            estimate.outlines, estimate.holes = self._method.loops
            estimate.centroid = np.array([x, y, 0.0])
        if motion is not None and math.isfinite(motion.step_turn) and interval > 0:
            estimate.motion_translation = np.array([*motion.step, 0.0])
            estimate.motion_rotation = np.array([0.0, 0.0, math.sin(0.5 * motion.step_turn), math.cos(0.5 * motion.step_turn)])
            estimate.motion_interval = interval
        return estimate
