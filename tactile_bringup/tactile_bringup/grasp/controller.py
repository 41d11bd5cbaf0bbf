# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The grip force that holds an object: from the first contact on, raised when it slips, lowered to what load and friction need. Needs no
ROS."""
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

from tactile_driver.errors import BadArgument

from .friction import FrictionEstimate


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
        Held force over the least one: shear over friction where a sensor measures the shear, else the largest force at which the object
        has slipped. 2: a load that doubles before a command takes effect does not slip.
    rise : float
        Factor by which the force is raised when slip is reported.
    rise_interval : float
        Time that a raised force gets to take effect and to be seen, before slip that is still reported raises it again.
    relaxation : float
        Part of the force that is taken away per second while nothing slips and no sensor measures the shear.
    adjustment : float
        The same where a sensor measures it, down to what the load needs.
    slip_probability : float
        Probability of slip, by all reports until now, from which the force is raised: a needless rise costs less than a fall.
    blind_force : float
        Minimum force while it is uncertain whether the object slips.
    timeout : float
        Age of the last message of the sensor from which it is lost.
    """

    max_force: float = 20.0
    min_force: float = 0.5
    approach_force: float = 2.0
    contact_force: float = 0.5
    start_force: float = 4.0
    margin: float = 2.0
    rise: float = 1.8
    rise_interval: float = 0.05
    relaxation: float = 0.05
    adjustment: float = 0.5
    slip_probability: float = 0.8
    blind_force: float = 8.0
    timeout: float = 0.2

    def __post_init__(self) -> None:
        if not 0 < self.min_force <= self.start_force <= self.max_force:
            raise BadArgument(f'grip: min_force {self.min_force:g}, start_force {self.start_force:g} and max_force {self.max_force:g} N '
                              'must be positive and in this order')
        if not (self.margin >= 1 and self.rise > 1 and 0 <= min(self.relaxation, self.adjustment)
                and max(self.relaxation, self.adjustment) < 1 and 0 < self.slip_probability < 1
                and min(self.rise_interval, self.timeout, self.blind_force) > 0 and 0 < self.approach_force <= self.max_force):
            raise BadArgument('grip: margin must be 1 or more, rise above 1, relaxation and adjustment 0 to 1, slip_probability between 0 '
                              'and 1, times and blind_force above 0, and approach_force between 0 and max_force')


@dataclass(frozen=True)
class Reading:
    """What a sensor reports at a time.

    Attributes
    ----------
    time_s : float
    force : float
        Normal force, N; NaN unknown, 0 without contact.
    slip_probability : float
        That the object slips now; NaN unknown.
    shear : float
        Tangential force, N; NaN unknown.
    slipping : float
        Part of the contact that slips; NaN unknown.
    """

    time_s: float
    force: float
    slip_probability: float
    shear: float = math.nan
    slipping: float = math.nan


class SlipBelief:
    """The probability that an object slips, from all reports of a sensor until now.

    Attributes
    ----------
    value : float
        Probability.

    Notes
    -----
    The forward algorithm of a hidden Markov model with two states (Rabiner 1989): evidence adds up over the reports of a slip, and a single
    one of a still object decays. A report states its probability for even odds, so that its odds are the ratio of the likelihoods.
    Between two reports the state changes as in a continuous Markov chain: for a long gap the probability is that of any time.
    """

    BEGINS = 1.0  # 1/s, prior: slips of an object that is disturbed and held near the limit of friction
    LASTS = 0.1  # s, prior: mean duration, as the grip stops a slip within 60 ms
    ALWAYS = BEGINS / (BEGINS + 1 / LASTS)  # probability at any time, without a report

    def __init__(self) -> None:
        self.value, self._time_s = 0.0, math.nan

    def add(self, time_s: float, probability: float) -> None:
        """Take a report; probability: that the object slips, 0 to 1; NaN unknown."""
        elapsed = max(time_s - self._time_s, 0.0) if math.isfinite(self._time_s) else 0.0
        before = self.ALWAYS + (self.value - self.ALWAYS) * math.exp(-(self.BEGINS + 1 / self.LASTS) * elapsed)
        self._time_s = time_s
        if math.isnan(probability):
            self.value = before
            return
        slips, sticks = before * probability, (1 - before) * (1 - probability)
        self.value = slips / (slips + sticks) if slips + sticks else before


class GripController:
    """Commands the grip force.

    Parameters
    ----------
    limits : GripLimits
    sensors : sequence of str, optional
        Names of the sensors that are to send readings; by default those that do.

    Attributes
    ----------
    phase : Phase
    force : float
        Present command, N; 0 while the gripper is open.
    slipped_at : float
        Largest force at which the object slipped since it was grasped, N; NaN before it has.
    rises : int
        How often slip has raised the force since the grasp.
    friction : FrictionEstimate
        Of the object that is held.
    """

    def __init__(self, limits: GripLimits = GripLimits(), sensors: Sequence[str] = ()):
        self.limits, self.friction, self._sensors = limits, FrictionEstimate(), tuple(sensors)
        self.open()

    def open(self) -> None:
        """Let go."""
        self.phase, self.force, self.slipped_at, self.rises = Phase.OPEN, 0.0, math.nan, 0
        self._readings: dict[str, Reading] = {}  # the last one of each sensor
        self._slip: dict[str, SlipBelief] = {}
        self._last = self._raised_s = -math.inf
        self._steady = 0.0  # the force without what a slip in doubt adds, N
        self.friction.reset()

    def close(self) -> None:
        """Approach until a sensor touches, then hold."""
        if self.phase is Phase.OPEN:
            self.phase, self.force = Phase.APPROACH, self.limits.approach_force

    @property
    def lost(self) -> tuple[str, ...]:
        """The sensors without a reading, or whose last one is too old."""
        return tuple(name for name in dict.fromkeys((*self._sensors, *self._readings))
                     if name not in self._readings or self._last - self._readings[name].time_s > self.limits.timeout)

    @property
    def needed_force(self) -> float:
        """The force that load and friction need, with the margin, N; NaN where no sensor measures the shear."""
        shears = [reading.shear for reading in self._present() if math.isfinite(reading.shear)]
        return self.limits.margin * max(shears) / self.friction.cautious if shears else math.nan

    def take(self, reading: Reading, sensor: str = '') -> float:
        """The command after a reading of a sensor, N."""
        elapsed = max(reading.time_s - self._last, 0.0) if math.isfinite(self._last) else 0.0
        self._last = max(reading.time_s, self._last)
        self._readings[sensor] = reading
        self._slip.setdefault(sensor, SlipBelief()).add(reading.time_s, reading.slip_probability)
        if self.phase is Phase.SENSOR_LOST:
            self.phase = Phase.HOLD
            elapsed = 0.0
        if self.phase is Phase.APPROACH and any(each.force >= self.limits.contact_force for each in self._present()):
            self.phase, self.force = Phase.HOLD, self.limits.start_force
            self._steady = self.force
            self._raised_s = reading.time_s  # the rise to the first force moves the object
        elif self.phase is Phase.HOLD:
            self.friction.add(reading.force, reading.shear, reading.slipping)
            self._hold(reading.time_s, elapsed)
        return self.force

    def wait(self, time_s: float) -> float:
        """The command at a time without a reading: the last force, and all sensors are lost after the timeout."""
        if self.phase is Phase.HOLD and time_s - self._last > self.limits.timeout:
            self.phase = Phase.SENSOR_LOST
        return self.force

    def change(self, **limits: float) -> None:
        """Take other limits. Raises BadArgument."""
        self.limits = replace(self.limits, **limits)
        if self.phase is Phase.HOLD:
            self._steady, self.force = self._bounded(self._steady), self._bounded(self.force)

    def _present(self) -> list[Reading]:
        return [self._readings[name] for name in self._readings if name not in self.lost]

    def _hold(self, time_s: float, elapsed: float) -> None:
        probabilities = [reading.slip_probability for reading in self._present() if math.isfinite(reading.slip_probability)]
        sure = [each for each in probabilities if not _is_unknown(each)]
        slip = max(belief.value for name, belief in self._slip.items() if name not in self.lost)
        doubt = max(slip - SlipBelief.ALWAYS, 0.0) if sure else 0.0
        if slip < self.limits.slip_probability:
            is_blind = probabilities and not sure
            self._steady = self._bounded(max(self._steady, self.limits.blind_force) if is_blind else self._lowered(elapsed))
        elif time_s - self._raised_s >= self.limits.rise_interval:
            self._rise(time_s)
            doubt = 0.0
        # The expected need: a slip that is not sure yet raises the force in part, until it is or the belief decays.
        self.force = self._bounded(self._steady * (1 + (self.limits.rise - 1) * doubt))

    def _lowered(self, elapsed: float) -> float:
        """The force without slip, N."""
        needed, rate = self.needed_force, self.limits.adjustment
        if math.isnan(needed):  # what is known is at which force it slipped, and that the present one holds
            known = self.limits.margin * self.slipped_at if math.isfinite(self.slipped_at) else 0.0
            needed, rate = min(known, self._steady), self.limits.relaxation
        return max(needed, self._steady * (1 - rate * elapsed))

    def _rise(self, time_s: float) -> None:
        """Raise the force, and wait for new evidence: what was known of slip was at the force before."""
        self.slipped_at = max(self._steady, self.slipped_at) if math.isfinite(self.slipped_at) else self._steady
        self._steady, self._raised_s = self._bounded(self._steady * self.limits.rise), time_s
        self.rises += 1
        self._slip = {name: SlipBelief() for name in self._slip}

    def _bounded(self, force: float) -> float:
        return min(max(force, self.limits.min_force), self.limits.max_force)


def _is_unknown(probability: float) -> bool:
    """Whether neither slip nor its absence is twice as likely as the other."""
    return 1 / 3 <= probability <= 2 / 3


def slip_probability(state: int, confidence: float, partial: bool = True) -> float:
    """Probability that an object slips, of a state of tactile_msgs/Slip and the probability of that state; NaN unknown.

    partial: whether a contact that slips in part (state 1) counts. It does not where the shear is measured: then it indicates the friction.
    """
    return confidence if state >= (1 if partial else 2) else 1.0 - confidence
