# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The wrench of a grasped object on the finger (paper taxel_array_image_processing, eqs 5 to 9), at the sensor frame's origin, and the
forces on the surface points of the taxels."""
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from .._core.taxel import SurfaceShear
from ..common.estimates import NONE, SlipEstimate
from ..common.surface_points import SLIPPING, STICKING, UNKNOWN, SurfacePoints
from .motion import REACH, ObjectMotion
from .pressure import SoftPad, TaxelArray, grown
from .region import Regions

_LITTLE = 0.02  # friction over load, below which it moves no pressure to speak of
_UNSEEN = 0.5  # of a tension, up to which the pressure there shows that there is one


@dataclass(frozen=True)
class GraspedObject:
    """The object between two fingers; NaN for what is unknown.

    depth: m, indentation of the pad (half of the object's width minus the gap between the fingers; negative: they do not touch it);
    weight: (3,) N in the sensor frame, of which each finger holds half; centre_of_mass: (3,) m in the sensor frame.
    """

    depth: float = np.nan
    weight: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))
    centre_of_mass: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))


def normal_force(area: float, depth: float, pad: SoftPad) -> float:
    """Normal force, N, of a flat face with that area, m^2, at that depth, m (eq 5); NaN for none, which the area contradicts."""
    return pad.stiffness / pad.thickness * depth * area if depth > 0 else np.nan


def pressure_centre(pressure: np.ndarray, touched: np.ndarray, array: TaxelArray, pad: SoftPad) -> np.ndarray:
    """(2,) m, where pressure (rows, columns) float32 acts that faces over touched (rows, columns) bool make on the taxels, under them and
    around; NaN without load."""
    load, moment = _seen(pressure, touched, array, pad)
    return moment / load if load > 0 else np.full(2, np.nan)


def under_friction(pressure: np.ndarray, touched: np.ndarray, friction: np.ndarray, array: TaxelArray, pad: SoftPad,
                   shear: SurfaceShear) -> np.ndarray:
    """(2,) m, where pressure acts on the pad's surface, of which pressure (rows, columns) float32, Pa, acts on the taxels.

    touched: (rows, columns) bool; friction: (2,) N of the object on the pad; shear: of the pad. Friction on the surface has a moment about
    the taxels, a thickness below, which only pressure that moves along it can balance, whatever the pad is made of. A part of that is
    tension behind the object, of which taxels show nothing: it is that of an even traction under the object. NaN for more friction than
    the load can hold.
    """
    load, moment = _seen(pressure, touched, array, pad)
    if not load > 0:
        return np.full(2, np.nan)
    if not math.hypot(*friction) > _LITTLE * load:
        return moment / load
    even = touched / np.float32(np.count_nonzero(touched) * array.taxel_area)
    caused = shear.pressure_of(np.asarray(friction, np.float32)[:, None, None] * even)
    tension, of_tension = _moments(np.where(touched | (pressure > _UNSEEN * -caused), 0, np.minimum(caused, 0)), array)
    normal = load + tension
    return (moment + of_tension - pad.thickness * friction) / normal if normal > 0 else np.full(2, np.nan)


def _seen(pressure: np.ndarray, touched: np.ndarray, array: TaxelArray, pad: SoftPad) -> tuple[float, np.ndarray]:
    """N, and (2,) N m, of the pressure under a face and around."""
    return _moments(pressure * grown(touched, min(round(REACH * pad.thickness / array.pitch), max(array.shape))), array)


def _moments(load: np.ndarray, array: TaxelArray) -> tuple[float, np.ndarray]:
    """N of a load (rows, columns) Pa, and (2,) N m, it times its place."""
    along, down = load.sum(axis=0), load.sum(axis=1)
    return float(along.sum()) * array.taxel_area, np.array([along @ array.x, down @ array.y]) * array.taxel_area


def wrench_of(normal: float, pressure_centre: np.ndarray, contact: np.ndarray, grasped: GraspedObject) -> np.ndarray:
    """(6,) N and N m of the object on the sensor.

    normal: N, NaN if unknown; pressure_centre: (2,) m, where it acts; contact: (3,) m, where friction acts. Friction is half of the weight
    (eqs 6, 7); without the weight, tangential forces and the moment about the normal are NaN. Each finger's friction also holds half of the
    moment of the weight about the fingers' common normal, which eq 9 leaves out; the pressure centre accounts for the other moments.
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
    """Points of all taxels on the untouched surface.

    surface: (rows, columns) pressure, in Pa if known; forces: (rows, columns) N (taxel_forces); state: (rows, columns) (taxel_states).
    Tangential forces and displacements are NaN: the array measures pressure only.
    """
    xyz = np.zeros((array.rows, array.columns, 3))
    xyz[..., 0], xyz[..., 1] = array.x, array.y[:, None]
    depth = surface * (pad.thickness / pad.stiffness) if known else np.full(array.shape, np.nan)
    displacement, force = (np.full((array.rows * array.columns, 3), np.nan) for _ in range(2))
    displacement[:, 2], force[:, 2] = -depth.ravel(), -forces.ravel()
    return SurfacePoints(array.shape, xyz.reshape(-1, 3), np.tile([0.0, 0.0, 1.0], (len(force), 1)), displacement, force, forces.ravel(),
                         state.ravel())


def taxel_forces(regions: Regions, surface: np.ndarray, normal: Sequence[float], known: bool) -> np.ndarray:
    """(rows, columns) N: each region's normal force, N, distributed by pressure; 0 outside the regions. All NaN if not known."""
    forces = np.full(surface.shape, 0.0 if known else np.nan)
    if not known or not regions.all:
        return forces
    load = np.maximum(surface, 0)
    for region, force in zip(regions.all, normal):
        own = regions.near == region.label
        total = float(load[own].sum())
        forces[own] = load[own] * (force / total) if total > 0 else np.nan
    return forces


def taxel_states(regions: Regions, slip: SlipEstimate, motion: ObjectMotion | None) -> np.ndarray:
    """(rows, columns) uint8 state of each taxel; UNKNOWN in contact where slip is detected but not localised."""
    state = np.where(regions.touched, STICKING, 0).astype(np.uint8)
    if motion is not None:
        state[regions.touched & motion.slipping] = SLIPPING
    elif slip.state != NONE:
        state[regions.touched] = UNKNOWN
    return state
