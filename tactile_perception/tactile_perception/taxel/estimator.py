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

from .._core.taxel import Estimator, Found, Grasped, Regions
from ..common.estimates import NONE, ContactEstimate, ContactRegionEstimate, SlipEstimate
from ..common.surface_points import SurfacePoints
from ..core.errors import BadArgument, BadFrame
from .motion import LIMITS, TaxelSlip
from .pressure import SoftPad, TaxelArray, pad_on
from .response import Response
from .wrench import GraspedObject

_NO_DOTS = np.zeros(0, np.uint8)
_OUTWARDS = np.array([0.0, 0.0, 1.0])  # normal of the untouched surface


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
    """What a method other than mechanics observes in one frame.

    Attributes
    ----------
    regions : Regions
        The contact regions (region.find_regions).
    slip : SlipEstimate
        State and velocity of slip.
    centre : ndarray, shape (2,)
        Centre of the contact, where all forces act, in m; NaN: those of the regions and of the pressure.
    angle : float
        Direction of the contact in rad.
    outlines, holes : list of ndarray, shape (M, 3)
        In m.
    """

    regions: Regions
    slip: SlipEstimate
    centre: np.ndarray
    angle: float
    outlines: list[np.ndarray]
    holes: list[np.ndarray]


def _no_method(array: TaxelArray, pad: SoftPad, response: Response) -> None:
    """Mechanics of the pad are a part of the kernel."""


#: Name -> function of (array, pad, response) that makes the method: an object with reset(), is_depth_preferred (whether a known depth gives
#: the force even if the response is known) and observe(pressure, sigma, full, stamp_s), which returns an Observed.
#: pressure: (rows, columns); sigma: its noise; full: (rows, columns) bool, saturated taxels; stamp_s: s.
TAXEL_METHODS = PluginTable('tactile_perception.taxel_methods', {
    'mechanics': _no_method,
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
        self._normals = np.tile(_OUTWARDS, (array.xyz.shape[0], 1))
        self._method = TAXEL_METHODS[settings.method](array, pad, settings.response)
        by_depth = self._method is not None and self._method.is_depth_preferred
        self._kernel = Estimator(pad_on(array, pad), pad.stiffness, settings, array.dead(settings.dead), by_depth, LIMITS)
        self._slip = TaxelSlip(settings.response.known)
        self._stamp_s: float | None = None
        self.grasped = GraspedObject()

    @property
    def grasped(self) -> GraspedObject:
        """What is known of the object between the fingers."""
        return self._grasped

    @grasped.setter
    def grasped(self, grasped: GraspedObject) -> None:
        self._grasped = grasped
        self._kernel.grasped = Grasped(depth=grasped.depth, weight=np.asarray(grasped.weight, float),
                                       centre_of_mass=np.asarray(grasped.centre_of_mass, float), can_roll=grasped.can_roll)

    @property
    def sigma(self) -> float:
        """Standard deviation of the noise of a taxel's value."""
        return self._kernel.sigma

    @property
    def looks_pressed(self) -> bool:
        """Whether the first frame may have held a contact."""
        return self._kernel.looks_pressed

    @property
    def dead(self) -> np.ndarray:
        """Mask (rows, columns) bool of dead taxels: the known and the detected ones."""
        return self._kernel.dead

    def set_reference(self) -> None:
        """Use the next frame as the untouched reference."""
        for part in filter(None, (self._method, self._slip)):
            part.reset()
        self._kernel.set_reference()

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
        self._stamp_s = stamp_s
        full_scale = self.array.scale_of(np.asarray(values))
        if self._method is None:
            found = self._kernel.process(frame, full_scale, stamp_s)
            slip, region = self._slip.process(found.sliding), _region(found)
        else:
            load = self._kernel.load(frame, full_scale, stamp_s)
            observed = self._method.observe(load.pressure, load.noise, load.full, stamp_s)
            found, slip = self._kernel.complete(load, observed.regions, observed.centre), observed.slip
            region = _region(found)
            if found.area > 0:
                region.orientation, region.outlines, region.holes = observed.angle, observed.outlines, observed.holes
        contacts = [ContactEstimate(one.id, one.position, _OUTWARDS, one.depth, one.force, one.position_covariance, one.flags, _NO_DOTS)
                    for one in found.contacts]
        return TaxelResult(region, contacts, slip, found.wrench, found.pressure, partial(self._points, found, slip.state != NONE))

    def _points(self, found: Found, slips: bool) -> SurfacePoints:
        """Compute the SurfacePoints of one frame, on the untouched surface."""
        points = self._kernel.points(found, slips)
        return SurfacePoints(self.array.shape, self.array.xyz, self._normals, points.displacement, points.force,
                             points.normal_force, points.state)


def _region(found: Found) -> ContactRegionEstimate:
    """Make the contact region of one frame."""
    if not found.area:
        return ContactRegionEstimate(_NO_DOTS, _NO_DOTS)
    major, minor, orientation = found.axes.tolist()
    return ContactRegionEstimate(_NO_DOTS, _NO_DOTS, found.outlines, found.holes, found.area, found.centroid, _OUTWARDS, orientation, major,
                                 minor, found.motion_translation, found.motion_rotation, found.motion_interval, found.motion_covariance)
