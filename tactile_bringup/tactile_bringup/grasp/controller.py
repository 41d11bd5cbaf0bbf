# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The grip force that holds an object: from first contact on, raised when it slips, relaxed slowly while it does not. Needs no ROS."""
from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

from tactile_driver.errors import BadArgument


class Phase(Enum):
    """What the controller does."""

    OPEN = 'open'
    APPROACH = 'approach'
    HOLD = 'hold'
    SENSOR_LOST = 'sensor lost'


@dataclass(frozen=True)
class GripLimits:
    """Limits of the grip, all in N, s and 1.

    Attributes
    ----------
    max_force, min_force : float
        The command never leaves this range while an object is held.
    approach_force : float
        With which the fingers close until they touch.
    contact_force : float
        Reported force from which the sensor touches the object.
    start_force : float
        With which an object is held first, before anything is known of its weight and friction.
    margin : float
        Held force over the largest force at which the object has slipped.
    rise : float
        Factor by which the force is raised when slip is reported.
    rise_interval : float
        Time that a raised force gets to take effect and to be seen, before slip that is still reported raises it again.
    relaxation : float
        Part of the force that is taken away per second while nothing slips.
    slip_probability : float
        Probability of slip from which the force is raised: a needless rise costs less than a fall.
    timeout : float
        Age of the last message of the sensor from which it is lost.
    """

    max_force: float = 20.0
    min_force: float = 0.5
    approach_force: float = 2.0
    contact_force: float = 0.5
    start_force: float = 4.0
    margin: float = 1.3
    rise: float = 1.4
    rise_interval: float = 0.05
    relaxation: float = 0.05
    slip_probability: float = 0.8
    timeout: float = 0.1

    def __post_init__(self) -> None:
        if not 0 < self.min_force <= self.start_force <= self.max_force:
            raise BadArgument(f'grip: min_force {self.min_force:g}, start_force {self.start_force:g} and max_force {self.max_force:g} N '
                              'must be positive and in this order')
        if not (self.margin >= 1 and self.rise > 1 and 0 <= self.relaxation < 1 and 0 < self.slip_probability < 1
                and min(self.rise_interval, self.timeout) > 0 and 0 < self.approach_force <= self.max_force):
            raise BadArgument('grip: margin must be 1 or more, rise above 1, relaxation 0 to 1, slip_probability between 0 and 1, times '
                              'above 0, and approach_force between 0 and max_force')


@dataclass(frozen=True)
class Reading:
    """What a sensor reports at a time.

    force: normal force, N, NaN unknown, 0 without contact; slip_probability: that the object slips now, NaN unknown.
    """

    time_s: float
    force: float
    slip_probability: float


class GripController:
    """Commands the grip force.

    Parameters
    ----------
    limits : GripLimits

    Attributes
    ----------
    phase : Phase
    force : float
        Present command, N; 0 while the gripper is open.
    slipped_at : float
        Largest force at which the object slipped since it was grasped, N; NaN before it has.
    rises : int
        How often slip has raised the force since the grasp.
    """

    def __init__(self, limits: GripLimits = GripLimits()):
        self.limits = limits
        self.open()

    def open(self) -> None:
        """Let go."""
        self.phase, self.force, self.slipped_at, self.rises = Phase.OPEN, 0.0, math.nan, 0
        self._last = self._raised_s = -math.inf

    def close(self) -> None:
        """Approach until the sensor touches, then hold."""
        if self.phase is Phase.OPEN:
            self.phase, self.force = Phase.APPROACH, self.limits.approach_force

    def take(self, reading: Reading) -> float:
        """The command after a reading, N."""
        elapsed = reading.time_s - self._last if math.isfinite(self._last) else 0.0
        self._last = reading.time_s
        if self.phase is Phase.SENSOR_LOST:
            self.phase = Phase.HOLD
            elapsed = 0.0
        if self.phase is Phase.APPROACH and reading.force >= self.limits.contact_force:
            self.phase, self.force = Phase.HOLD, self.limits.start_force
            self._raised_s = reading.time_s  # the rise to the first force moves the object
        elif self.phase is Phase.HOLD:
            self._hold(reading, elapsed)
        return self.force

    def wait(self, time_s: float) -> float:
        """The command at a time without a reading: the last force, and the sensor is lost after the timeout."""
        if self.phase is Phase.HOLD and time_s - self._last > self.limits.timeout:
            self.phase = Phase.SENSOR_LOST
        return self.force

    def change(self, **limits: float) -> None:
        """Take other limits. Raises BadArgument."""
        self.limits = replace(self.limits, **limits)
        if self.phase is Phase.HOLD:
            self.force = self._bounded(self.force)

    def _hold(self, reading: Reading, elapsed: float) -> None:
        if reading.slip_probability >= self.limits.slip_probability:
            if reading.time_s - self._raised_s >= self.limits.rise_interval:
                self.slipped_at = max(self.force, self.slipped_at) if math.isfinite(self.slipped_at) else self.force
                self.force, self._raised_s = self._bounded(self.force * self.limits.rise), reading.time_s
                self.rises += 1
            return
        floor = self.limits.margin * self.slipped_at if math.isfinite(self.slipped_at) else self.limits.min_force
        if self.force > floor:
            self.force = self._bounded(max(floor, self.force * (1 - self.limits.relaxation * elapsed)))

    def _bounded(self, force: float) -> float:
        return min(max(force, self.limits.min_force), self.limits.max_force)


def slip_probability(state: int, confidence: float) -> float:
    """Probability that an object slips at all, of a state of tactile_msgs/Slip (0: none) and the probability of that state; NaN unknown."""
    return 1.0 - confidence if state == 0 else confidence
