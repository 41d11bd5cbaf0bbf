# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The wrench of a grasped object on the finger (paper taxel_array_image_processing, eqs 5 to 9), at the sensor frame's origin."""
from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .._core import taxel_load, taxel_pull_pressure
from .array import SoftPad, TaxelArray
from .shear import SPREADS

_REACH = 2.5  # thicknesses around a face, in which pressure counts. Chosen: beyond the wider of SPREADS
_LITTLE = 0.02  # friction over load, below which it moves no pressure to speak of. Chosen
_UNSEEN = 0.5  # of a tension, up to which the pressure there says that there is one. Chosen


@dataclass(frozen=True)
class GraspedObject:
    """The object between two fingers; NaN for what is unknown.

    depth: m, indentation of the pad (half of the object's width minus the gap between the fingers); weight: (3,) N in the sensor frame, of
    which each finger holds half; centre_of_mass: (3,) m in the sensor frame.
    """

    depth: float = np.nan
    weight: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))
    centre_of_mass: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))


def normal_force(area: float, depth: float, pad: SoftPad) -> float:
    """Normal force, N, of a flat face with that area, m^2, at that depth, m (eq 5)."""
    return pad.stiffness / pad.thickness * depth * area


def pressure_centre(pressure: np.ndarray, touched: np.ndarray, array: TaxelArray, pad: SoftPad) -> np.ndarray:
    """(2,) m, where pressure (rows, columns) float32 acts that faces over touched (rows, columns) bool make on the taxels, under them and
    around; NaN without load."""
    return _seen(pressure, touched, array, pad)[1]


def under_friction(pressure: np.ndarray, touched: np.ndarray, friction: np.ndarray, array: TaxelArray, pad: SoftPad) -> np.ndarray:
    """(2,) m, where pressure acts on the pad's surface, of which pressure (rows, columns) float32, Pa, acts on the taxels.

    touched: (rows, columns) bool; friction: (2,) N of the object on the pad. Friction on the surface has a moment about the taxels, a
    thickness below, which only pressure that moves along it can balance, whatever the pad is made of. A part of that is tension behind the
    object, of which taxels show nothing: it is that of an even traction under the object. NaN for more friction than the load can hold.
    """
    load, centre = _seen(pressure, touched, array, pad)
    if not (load > 0 and np.hypot(*friction) > _LITTLE * load):
        return centre
    thickness = pad.thickness / array.pitch
    even = touched / np.float32(np.count_nonzero(touched) * array.taxel_area)
    caused = taxel_pull_pressure(friction.astype(np.float32)[:, None, None] * even, gain=0.5 * thickness,
                                 spreads=np.array(SPREADS) * [1, thickness])
    tension = array.taxel_area * np.where(~touched & (caused < 0) & (pressure < _UNSEEN * -caused), caused, 0)
    moment = load * centre + [tension.sum(axis=0) @ array.x, tension.sum(axis=1) @ array.y]
    normal = load + float(tension.sum())
    return (moment - pad.thickness * friction) / normal if normal > 0 else np.full(2, np.nan)


def _seen(pressure: np.ndarray, touched: np.ndarray, array: TaxelArray, pad: SoftPad) -> tuple[float, np.ndarray]:
    """N, and (2,) m, where it acts, of the pressure under a face and around."""
    load, row, column, _ = taxel_load(pressure, touched, around=min(round(_REACH * pad.thickness / array.pitch), max(array.shape)))
    return load * array.taxel_area, array.pitch * np.array([column - 0.5 * (array.columns - 1), row - 0.5 * (array.rows - 1)])


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


def transform_wrench(wrench: np.ndarray, rotation: np.ndarray, translation: np.ndarray) -> np.ndarray:
    """The wrench (6,) about the origin of a frame in which a point x of the sensor frame is rotation (3, 3) @ x + translation (3,) (eqs 8,
    9)."""
    force = rotation @ wrench[:3]
    return np.concatenate([force, rotation @ wrench[3:] + np.cross(translation, force)])
