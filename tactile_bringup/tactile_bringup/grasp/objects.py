# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the simulated gripper grasps, and what happens to it while it is held."""
from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from tactile_driver.errors import by_name

from .constants import GRASP

#: Pad of the left finger -> sensor type.
PADS: Mapping[str, str] = {'array': 'taxel_array', 'force_taxels': 'force_taxels'}
FLAT_PAD, DOMED_PAD = PADS  # pressures of an array; forces on domes
#: Of the array's perception. The engine's taxels lie on the face of a rigid pad, so that they show no moment of friction: their cover is
#: thinner than what they resolve. It shears as that of the usual pad does before it slips.
ARRAY_PARAMETERS = {'pad.thickness': 1e-4, 'pad.shear_modulus': 5.2e3, 'object.can_roll': False}
READY = 'the array of the gripper sends to'  # how the log of gripper_node says that its port is there


@dataclass(frozen=True)
class HeldObject:
    """An object.

    Attributes
    ----------
    shape : str
        A geometry of MuJoCo: box, cylinder, sphere or ellipsoid.
    size : tuple of float
        Its size, m, as MuJoCo has it: half lengths of a box (x across the fingers, z up), radius and half length of a cylinder, radius of a
        sphere, half axes of an ellipsoid.
    mass : float
        In kg.
    friction : float
        Coefficient of friction between the pads and the object.
    crushing_force : float
        Grip force that breaks it, N; infinite for a solid one.
    softness : float
        Time constant of its contact, s: MuJoCo's `solref`; larger is softer.
    """

    shape: str
    size: tuple[float, ...]
    mass: float
    friction: float = 0.6
    crushing_force: float = math.inf
    softness: float = 0.006

    @property
    def half_height(self) -> float:
        """From its centre to the table, m."""
        return self.size[0] if self.shape == 'sphere' else self.size[-1]

    @property
    def half_width(self) -> float:
        """From its centre to each pad, m."""
        return self.size[0]


def closing_width(held: HeldObject) -> float:
    """Position of the finger joints at which the pads would meet, m: at 0 the gripper is open around the object."""
    return held.half_width + GRASP.opening


OBJECTS: Mapping[str, HeldObject] = {
    'box': HeldObject('box', (0.020, 0.012, 0.015), 0.20),
    'long_box': HeldObject('box', (0.020, 0.012, 0.040), 0.30),
    'cylinder': HeldObject('cylinder', (0.020, 0.015), 0.20),
    'sphere': HeldObject('sphere', (0.025,), 0.15),
    'bottle': HeldObject('cylinder', (0.025, 0.060), 0.10),
    'soft_ball': HeldObject('sphere', (0.025,), 0.06, 0.8, softness=0.03),
    'egg': HeldObject('ellipsoid', (0.022, 0.022, 0.028), 0.06, 0.5, crushing_force=12.0),
    'smooth_box': HeldObject('box', (0.020, 0.012, 0.015), 0.15, 0.25),
    'light_rough_box': HeldObject('box', (0.015, 0.010, 0.012), 0.02, 1.0),
    'heavy_box': HeldObject('box', (0.025, 0.018, 0.018), 1.00, 0.6),
}


@dataclass(frozen=True)
class Disturbance:
    """A force on the object or a motion of the wrist between two times, which are counted from the beginning of the lift.

    force: (3,) N on the object in the world's axes, in units of its weight; acceleration: (3,) m/s^2 of the wrist; fills: the force rises
    evenly from 0, as water that is poured in, instead of at once, and stays.
    """

    begin_s: float
    end_s: float
    force: tuple[float, float, float] = (0.0, 0.0, 0.0)
    acceleration: tuple[float, float, float] = (0.0, 0.0, 0.0)
    fills: bool = False

    def force_at(self, time_s: float) -> tuple[float, float, float]:
        """The force at a time, in units of the object's weight."""
        if self.fills:
            share = min(max((time_s - self.begin_s) / (self.end_s - self.begin_s), 0.0), 1.0)
        else:
            share = float(self.begin_s <= time_s < self.end_s)
        return tuple(share * value for value in self.force)


def _shaken(begin_s: float, end_s: float, x: float, y: float, z: float) -> list[Disturbance]:
    """The wrist is accelerated in one direction, twice as long in the other, and again in the first, so that it returns and stops."""
    quarter = 0.25 * (end_s - begin_s)
    signs_and_times = ((1, begin_s, quarter), (-1, begin_s + quarter, 2 * quarter), (1, begin_s + 3 * quarter, quarter))
    return [Disturbance(start, start + length, acceleration=(sign * x, sign * y, sign * z)) for sign, start, length in signs_and_times]


#: Jerks of the wrist, up and to the side.
JERKS: tuple[Disturbance, ...] = (*_shaken(2.0, 2.4, 0.0, 0.0, 4.0), *_shaken(3.0, 3.4, 0.0, 4.0, 0.0))
#: Jerks, the weight doubled for a second, a tap from the side.
DISTURBANCES: tuple[Disturbance, ...] = (*JERKS, Disturbance(4.0, 5.0, (0.0, 0.0, -1.0)),
                                          Disturbance(6.0, 6.01, (0.0, 3.0, 0.0)))
#: The bottle gets three times its own mass while it is held.
FILLED: tuple[Disturbance, ...] = (Disturbance(2.0, 6.0, (0.0, 0.0, -3.0), fills=True),)


def object_named(name: str) -> tuple[HeldObject, tuple[Disturbance, ...]]:
    """An object and what happens to it. Raises BadArgument for an unknown name."""
    return by_name(OBJECTS, name, 'grasp: object'), FILLED if name == 'bottle' else DISTURBANCES
