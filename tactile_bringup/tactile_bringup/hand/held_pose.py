# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The pose of an object since a hand gripped it, from what its sensors report, fused by covariance. Needs no ROS."""
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from .constants import HAND
from .urdf import Pose, chained, inverted


@dataclass(frozen=True)
class Report:
    """What a sensor reports of one time.

    Attributes
    ----------
    time_s : float
    pose : Pose or None
        Of the sensor frame in the hand's frame; None unknown.
    touches : bool
    position : ndarray, shape (3,)
        Of the contact, in the sensor frame, m; the mean of several; NaN along directions in which it is unknown.
    covariance : ndarray, shape (3, 3)
        Of the position as one of the object, m^2; NaN with several contacts, and where a part of the contact is beyond the sensor.
    orientation : float
        Of the contact about the sensor's z axis, rad, modulo half a turn; NaN unknown.
    area, elongation : float
        Of the contact, m^2, and its major axis without its minor one, m.
    has_motion : bool
        Whether the sensor reports motions in space at all.
    motion : Pose or None
        In the sensor frame, of the object over `interval`, s: a point p moves to rotation p + translation. None unknown.
    interval : float
    """

    time_s: float
    pose: Pose | None
    touches: bool
    position: np.ndarray = field(default_factory=np.full(3, np.nan).copy)
    covariance: np.ndarray = field(default_factory=np.full((3, 3), np.nan).copy)
    orientation: float = math.nan
    area: float = HAND.area
    elongation: float = 0.02
    has_motion: bool = False
    motion: Pose | None = None
    interval: float = math.nan


@dataclass(frozen=True)
class HeldPose:
    """Where the object is.

    Attributes
    ----------
    rotation : Rotation
        Since the object was gripped, in the hand's axes.
    position : ndarray, shape (3,)
        In the hand's frame, m, of the point of the object that was midway between the contacts when it was gripped.
    covariance : ndarray, shape (6, 6)
        Of position, m, and of the rotation about the hand's axes, rad, since it was gripped.
    """

    rotation: Rotation
    position: np.ndarray
    covariance: np.ndarray


class _Sensor:
    """What one sensor knows of the object since it was gripped. origin: (3,) m, of the object in the hand's frame, when it was gripped."""

    def __init__(self, first: Report, origin: np.ndarray):
        self.last, self._first, self._origin = first, first, origin
        self._path: Pose = Rotation.identity(), np.zeros(3)  # in the hand's frame
        self._spread, self._lost_s = HAND.start_sigma**2 * np.eye(6), 0.0  # covariance, and time in which the motion was unknown

    def take(self, report: Report) -> None:
        """The next report."""
        elapsed, before = report.time_s - self.last.time_s, self.last.pose
        if report.motion is not None and report.pose is not None and before is not None:
            self._lost_s += max(elapsed - report.interval, 0.0)
            self._path = chained(chained(report.pose, chained(report.motion, inverted(before))), self._path)
            self._spread += self._motion_spread(report)
        else:
            self._lost_s += max(elapsed, 0.0)
        self.last = report

    def _motion_spread(self, report: Report) -> np.ndarray:
        """Covariance (6, 6), in the hand's axes, that a motion adds at the object's origin."""
        axes = report.pose[0].as_matrix()
        share = HAND.area / max(report.area, 1e-9)
        turned = axes @ np.diag(np.square(np.multiply(share, [HAND.tilt_sigma, HAND.tilt_sigma, HAND.turn_sigma]))) @ axes.T
        position = np.nan_to_num(report.position)
        contact = report.pose[1] + axes @ position
        moved = report.motion[0].apply(position) + report.motion[1] - position
        arm = -_cross(self._path[0].apply(self._origin) + self._path[1] - contact)
        spread = np.zeros((6, 6))
        shift = np.diag(np.square([HAND.along_sigma, HAND.along_sigma, HAND.normal_sigma]))
        spread[:3, :3] = share * axes @ shift @ axes.T + arm @ turned @ arm.T + HAND.motion_error**2 * (moved @ moved) * np.eye(3)
        spread[:3, 3:], spread[3:, :3], spread[3:, 3:] = arm @ turned, turned @ arm.T, turned
        return spread

    def information(self, now_s: float) -> tuple[np.ndarray, np.ndarray]:
        """Information matrix (6, 6) and vector (6,) of the object's displacement and rotation vector at a time."""
        if self.last.has_motion:
            moved = np.concatenate([self._path[0].apply(self._origin) + self._path[1] - self._origin, self._path[0].as_rotvec()])
            expected_s = self.last.interval if math.isfinite(self.last.interval) else 0.0  # to the next report
            unknown_s = self._lost_s + max(now_s - self.last.time_s - expected_s, 0.0)
            unseen = np.square(unknown_s * np.repeat([HAND.speed_sigma, HAND.spin_sigma], 3))
            inverse = np.linalg.inv(self._spread + np.diag(unseen))
            return inverse, inverse @ moved
        return self._by_contact()

    def _by_contact(self) -> tuple[np.ndarray, np.ndarray]:
        """The same of a sensor that reports no motion in space: by position and orientation of its contact."""
        now, first = self.last, self._first
        matrix, vector = np.zeros((6, 6)), np.zeros(6)
        if now.pose is None or first.pose is None:
            return matrix, vector
        rows, moved, variances = [], [], []
        (axes, at), (first_axes, first_at) = ((pose[0].as_matrix(), pose[1]) for pose in (now.pose, first.pose))
        variance = np.diag(now.covariance) + np.diag(first.covariance)
        start = first_at + first_axes @ np.nan_to_num(first.position)
        displacement = at + axes @ np.nan_to_num(now.position) - start
        arm = -_cross(start - self._origin)
        for k in range(3):
            if math.isfinite(variance[k] + now.position[k] + first.position[k]):
                rows.append(np.concatenate([axes[:, k], axes[:, k] @ arm]))
                moved.append(axes[:, k] @ displacement)
                variances.append(variance[k])
        turn = now.orientation - first.orientation
        if math.isfinite(turn):
            rows.append(np.concatenate([np.zeros(3), axes[:, 2]]))
            moved.append((turn + math.pi / 2) % math.pi - math.pi / 2)
            variances.append(_angle_variance(now.elongation) + _angle_variance(first.elongation))
        for row, value, spread in zip(rows, moved, variances):
            matrix += np.outer(row, row) / spread
            vector += row * value / spread
        return matrix, vector


class HeldPoseTracker:
    """Follows the object from the reports of all sensors.

    An object is gripped once `enough` sensors have touched it long enough, and until none touches it. A sensor that reports motions in
    space, such as a touchpad, adds them up; what moves while it does not know the motion makes its covariance larger. Of another one, such
    as an array, position and orientation of its only contact count.

    Parameters
    ----------
    enough : int
        Number of sensors that hold an object: two, or one of a hand with a single sensor.
    """

    def __init__(self, enough: int = 2):
        self._enough = enough
        self.release()

    def release(self) -> None:
        """Nothing is held."""
        self._latest: dict[str, Report] = {}
        self._sensors: dict[str, _Sensor] = {}
        self._since_s, self._origin = math.nan, np.full(3, np.nan)

    @property
    def is_held(self) -> bool:
        """Whether an object is gripped."""
        return bool(self._sensors)

    def take(self, sensor: str, report: Report) -> None:
        """A report of a sensor."""
        before = self._latest.get(sensor)
        if before is not None and report.time_s < before.time_s:  # a recording that is played again
            self.release()
        self._latest[sensor] = report
        now = max(one.time_s for one in self._latest.values())
        touching = [name for name, one in self._latest.items() if one.touches and now - one.time_s <= HAND.max_age_s]
        if self.is_held:
            self._follow(sensor, report)
            if not touching:
                self.release()
            return
        if len(touching) < self._enough:
            self._since_s = math.nan
            return
        if math.isnan(self._since_s):
            self._since_s = now
        if now - self._since_s >= HAND.gripped_s:
            self._grip([(name, self._latest[name]) for name in touching])

    def _grip(self, reports: Sequence[tuple[str, Report]]) -> None:
        positions = [one.pose[1] + one.pose[0].apply(np.nan_to_num(one.position)) for _, one in reports if one.pose is not None]
        if positions:
            self._origin = np.mean(positions, axis=0)
            self._sensors = {name: _Sensor(one, self._origin) for name, one in reports}

    def _follow(self, sensor: str, report: Report) -> None:
        if sensor in self._sensors and report.touches:
            self._sensors[sensor].take(report)
        elif sensor in self._sensors and not report.touches:  # it knows nothing of what follows
            del self._sensors[sensor]

    def pose(self) -> HeldPose | None:
        """The pose now; None while nothing is held, or no position of a sensor is known."""
        if not self.is_held:
            return None
        matrix, vector = np.diag(1 / np.square(np.repeat([HAND.range_sigma, HAND.angle_range], 3))), np.zeros(6)
        now = max(one.last.time_s for one in self._sensors.values())
        for sensor in self._sensors.values():
            if now - sensor.last.time_s <= HAND.max_age_s:
                information, weighed = sensor.information(now)
                matrix, vector = matrix + information, vector + weighed
        covariance = np.linalg.inv(matrix)
        moved = covariance @ vector
        return HeldPose(Rotation.from_rotvec(moved[3:]), self._origin + moved[:3], covariance)


def _angle_variance(elongation: float) -> float:
    """Of a contact's orientation, rad^2: that of a round one is unknown."""
    return HAND.angle_sigma**2 + (HAND.axis_sigma / max(elongation, 1e-9))**2


def _cross(vector: np.ndarray) -> np.ndarray:
    """(3, 3): the matrix of the cross product with a vector."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
