# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The wrench of a grasped object on the finger, at the origin of the sensor frame, and the forces on the surface points of the taxels.

Paper taxel_array_image_processing, eqs 5 to 9.
"""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from .._core.taxel import ObjectMotion, Regions
from ..common.estimates import NONE, SlipEstimate
from ..common.surface_points import SLIPPING, STICKING, UNKNOWN, SurfacePoints
from .pressure import SoftPad, TaxelArray

_OUTWARDS = np.array([0.0, 0.0, 1.0])  # normal of the untouched surface


@dataclass(frozen=True)
class GraspedObject:
    """The object between two fingers; NaN for unknown quantities.

    Attributes
    ----------
    depth : float
        Indentation of the pad in m, half of the object's width minus the gap between the fingers; negative without contact.
    weight : ndarray, shape (3,)
        Weight in N in the sensor frame, of which each finger holds half.
    centre_of_mass : ndarray, shape (3,)
        Centre of mass in m in the sensor frame.
    can_roll : bool
        Whether the object can roll over the pad; parallel fingers prevent it.
    """

    depth: float = np.nan
    weight: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))
    centre_of_mass: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))
    can_roll: bool = True


def normal_force(area: float, depth: float, pad: SoftPad) -> float:
    """Compute the normal force, N, of a flat face of this area, m^2, at this depth, m (eq 5); NaN for a depth of 0 or less."""
    return pad.stiffness / pad.thickness * depth * area if depth > 0 else np.nan


def wrench_of(normal: float, pressure_centre: np.ndarray, contact: np.ndarray, grasped: GraspedObject) -> np.ndarray:
    """Wrench (6,), N and N m, of the object on the sensor.

    normal: N, NaN if unknown; pressure_centre: (2,) m, where the normal force acts; contact: (3,) m, where friction acts. Friction is half
    of the weight (eqs 6, 7); without the weight, tangential forces and the moment about the normal are NaN. The friction of each finger
    also holds half of the weight's moment about the common normal of the fingers, which eq 9 omits; the pressure centre accounts for the
    other moments.
    """
    x, y = pressure_centre
    wrench = np.array([np.nan, np.nan, -normal, -y * normal, x * normal, np.nan])
    half = 0.5 * grasped.weight
    if not np.isfinite(half).all():
        return wrench
    wrench[:2] = half[:2]
    wrench[3] += -contact[2] * half[1]
    wrench[4] += contact[2] * half[0]
    arm = (grasped.centre_of_mass if np.isfinite(grasped.centre_of_mass).all() else contact)[:2]
    wrench[5] = arm[0] * half[1] - arm[1] * half[0]
    return wrench


def taxel_points(array: TaxelArray, pad: SoftPad, surface: np.ndarray, known: bool, forces: np.ndarray, state: np.ndarray) -> SurfacePoints:
    """Make the surface points of all taxels on the untouched surface.

    surface: (rows, columns) pressure, in Pa if known; forces: (rows, columns) N (taxel_forces); state: (rows, columns) (taxel_states).
    Tangential forces and displacements are NaN: the array measures pressure only.
    """
    depth = surface * (pad.thickness / pad.stiffness) if known else np.full(array.shape, np.nan)
    displacement, force = (np.full((array.rows * array.columns, 3), np.nan) for _ in range(2))
    displacement[:, 2], force[:, 2] = -depth.ravel(), -forces.ravel()
    return SurfacePoints(array.shape, array.xyz, np.broadcast_to(_OUTWARDS, force.shape), displacement, force, forces.ravel(),
                         state.ravel())


def taxel_forces(regions: Regions, surface: np.ndarray, normal: Sequence[float], known: bool) -> np.ndarray:
    """Distribute each region's normal force, N, over its taxels (rows, columns) by pressure.

    0 outside of the regions; NaN everywhere if not known.
    """
    forces = np.full(surface.shape, 0.0 if known else np.nan)
    if not known or not regions.all:
        return forces
    load, near = np.maximum(surface, 0), regions.near
    for region, force in zip(regions.all, normal):
        own = near == region.label
        total = float(load[own].sum())
        forces[own] = load[own] * (force / total) if total > 0 else np.nan
    return forces


def taxel_states(regions: Regions, slip: SlipEstimate, motion: ObjectMotion | None) -> np.ndarray:
    """State (rows, columns), uint8, of each taxel; UNKNOWN in contact if slip is detected but not localised."""
    touched = regions.touched
    state = np.where(touched, STICKING, 0).astype(np.uint8)
    if motion is not None:
        state[touched & motion.slipping] = SLIPPING
    elif slip.state != NONE:
        state[touched] = UNKNOWN
    return state
