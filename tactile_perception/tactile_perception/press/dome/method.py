# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Touches of a dome by its mechanics: the one or two presses, straight or dragged, that best explain a frame."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from .calibration import DomeCalibration, calibrate_dome
from .library import RADIUS_SPREAD
from .fit import DEPTH, DRAG, DRAGGED, OF_TWO, PRESS, RADIUS, STRAIGHT, X, Y, DomeFound, DomeInverse
from ...common.geometry import cross
from ...errors import BadArgument
from .. import choice
from ..presses import Presses
from ..estimate import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE, TouchEstimate
from ..field import MarkerField
from ..sensor import MarkerSensor, first_touch_height

# All chosen.
SEEN = 12            # markers needed
STANDS_OUT = 12.0    # detection threshold of the match, standard deviations of noise
QUIETER = 1.5        # detection threshold over the greatest match of untouched calibration frames
SURE = 2.5           # least depth over its standard deviation, and tip radius over that of the place: fainter touches are not reported
FAINT = 8.0          # times the detection threshold, up to which two presses pass for one
PLACE_AND_DEPTH = 3  # numbers that a faint press tells
ORDINARY = 1.0       # residual chi-square of presses under their own hypothesis: 0.4 to 2 on simulated domes
NOT_LINEAR = 0.07, 0.1  # error of place, and of depth, over the way of a drag, which is linearised
ADDED = 0.12         # error of the depth of each of two presses, whose fields are added. Chosen on simulated pairs
LEANS = 0.5          # share of the slope that one of two presses gives the skin, that moves the other's contact. Chosen likewise
BESIDE = 3e-3        # m, over which that slope is taken. Chosen
SCALED = 0.5         # error of a scale over the correction that the calibrated tip needs: another tip may need another
UNEXPLAINED = 12.0   # misfit from which an estimate is ambiguous
BEYOND = 1.02        # times the calibrated depth: deeper is out of range
EDGE = 0.98          # of the library's reach, from which a touch is at the edge
NEAR = 0.05          # gap between skin and tip over the tip's radius, beyond the least one, up to which the skin counts as touching
ACROSS = 15          # points across a tip at which the skin is looked at for its contact
OFF_CENTRE = 0.15    # error of a contact's centre over its distance from the lowest point


class DomeModelMethod:
    """The 'model' method for domes. Drags and pairs of presses may start from the last frame's solution."""

    def __init__(self, calibration: DomeCalibration, sensor: MarkerSensor):
        self.calibration, self.sensor = calibration, sensor
        self.solver = DomeInverse(calibration.library, calibration.noise, calibration.points(sensor), calibration.camera_centres,
                                  sensor.plane_z,
                                  max(sensor.pitch))
        self._threshold = max(STANDS_OUT, QUIETER * calibration.quiet)
        self._reset()

    def _reset(self) -> None:
        """What comes next is another touch."""
        self._last: DomeFound | None = None
        self._choice = choice.Choice()

    @classmethod
    def fit(cls, presses: Presses, sensor: MarkerSensor, fitted: Mapping | None = None) -> dict:
        """Parameters for the calibration file; fitted: those of more presses of the same dome, whose simulated library is kept, as a few
        numbers determine it. Raises BadCalibration where the presses do not determine the model."""
        known = DomeCalibration.from_numbers(fitted) if fitted else None
        return calibrate_dome(presses, sensor, known).numbers()

    @classmethod
    def from_fitted(cls, fitted: Mapping, sensor: MarkerSensor) -> DomeModelMethod:
        """The method with its parameters from a calibration file. Raises BadCalibration where they are invalid."""
        return cls(DomeCalibration.from_numbers(fitted), sensor)

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The touches of one frame; empty without contact, and where the markers move too little to tell a place. Raises BadArgument for
        another pattern."""
        found = self.find(field)
        if found is None:
            return []
        touches = [self._touch(found, k) for k in range(len(found.presses))]
        radius = self.calibration.library.plan.radius
        sure = [touch for touch in touches if touch.depth > SURE * touch.depth_sigma
                and np.sqrt(np.linalg.eigvalsh(touch.covariance[:2, :2])[-1]) * SURE < radius]
        return sure if len(found.presses) == 1 else [_added(touch) for touch in sure]

    def find(self, field: MarkerField) -> DomeFound | None:
        """The presses of one frame; None without contact. Raises BadArgument for another pattern."""
        if len(field) != len(self.solver.points):
            raise BadArgument(f'calibrated for {len(self.solver.points)} markers, got a field of {len(field)}')
        match = self.solver.match(field)
        score = self.solver.score(field, match) if field.seen.sum() >= SEEN and self._spread(field) else 0.0
        if not score > self._threshold:
            self._reset()
            return None
        self._last = self._explained(field, match)
        faint = len(self._last.presses) == 1 and score < FAINT * self._threshold
        return self._unsure(field, match, self._last) if faint else self._last

    def _spread(self, field: MarkerField) -> bool:
        """Whether the seen markers are now in a plane, not on a line or at one place."""
        now = (field.rest + field.shift)[field.seen]
        return bool(np.linalg.eigvalsh(np.cov(now.T))[0] > max(self.sensor.pitch)**2)

    def _unsure(self, field: MarkerField, match: np.ndarray, found: DomeFound) -> DomeFound:
        """A faint press, whose place is as uncertain as two presses are apart that explain it better by more than two units of squared
        residual (Akaike 1974) for each number that a second one tells."""
        two = self.solver.solve(field, self.solver.start_of_two(match))
        if 2 * field.seen.sum() * (found.misfit / two.misfit - 1) < 2 * PLACE_AND_DEPTH:
            return found
        covariance, off = found.covariance.copy(), two.presses[:, :3] - found.presses[0, :3]
        covariance[:3, :3] += off.T @ off / 2
        return replace(found, covariance=covariance)

    def raised(self, field: MarkerField) -> np.ndarray | None:
        """Upward displacement (K,), m, of the markers; None without contact."""
        found = self.find(field)
        return None if found is None else self.solver.moved(found.presses)[:, 2]

    def _explained(self, field: MarkerField, match: np.ndarray) -> DomeFound:
        """The hypothesis of most evidence."""
        def two() -> DomeFound:
            """Straight from the best pair of starts, and dragged from there: from the start, drags might end far off, at small depths with
            long ways."""
            if self._last is not None and len(self._last.presses) == 2:
                return self.solver.solve(field, self._last.presses, OF_TWO)
            return self.solver.solve(field, self.solver.solve(field, self.solver.start_of_two(match)).presses, OF_TWO)

        return self._choice.explain(
            choice.Evidence(2 * int(field.seen.sum()), ORDINARY),
            lambda start, what: self.solver.solve(field, start, DRAGGED if what is choice.DRAGGED else STRAIGHT),
            self.solver.start(match), two)

    def _touch(self, found: DomeFound, number: int) -> TouchEstimate:
        press, calibration = found.presses[number], self.calibration
        part = slice(PRESS * number, PRESS * (number + 1))
        radius, pressed = float(calibration.library.plan.radius * np.exp(RADIUS_SPREAD * press[RADIUS])), float(np.exp(press[DEPTH]))
        first = press[[X, Y]] / calibration.wider
        (sunk, slopes), scale = self._by_others(found, number, radius), calibration.depth_scale(first, pressed)
        low = first_touch_height(self._inside(first), radius, self.sensor)[0] - pressed / scale - sunk
        place = self._inside(first + pressed * press[DRAG])  # where the drag has carried it
        depth = float(first_touch_height(place, radius, self.sensor)[0] - low)
        onto = self._onto(press, radius, scale)
        covariance = onto @ found.covariance[part, part] @ onto.T
        aside, deeper = (share * pressed * float(np.hypot(*press[DRAG])) for share in NOT_LINEAR)
        share = calibration.depth_share + SCALED * abs(scale - 1)
        aside += calibration.place_error + SCALED * float(np.hypot(*(first - press[[X, Y]])))
        extra = np.array([aside, aside, np.hypot(share * depth + abs(sunk) + deeper, calibration.depth_error)])
        covariance = covariance + np.diag(extra**2)
        if not np.isfinite(covariance).all():
            covariance = np.diag([self.sensor.rim_radius**2] * 3)
        reach = calibration.library.plan.reach
        at_edge = np.hypot(*press[[X, Y]]) > EDGE * reach or np.hypot(*first) > calibration.farthest
        flags = OUT_OF_RANGE * (depth > BEYOND * calibration.deepest) | AT_EDGE * bool(at_edge)
        flags |= AMBIGUOUS * (found.misfit > UNEXPLAINED)
        lowest = np.append(place, low)
        if len(found.presses) > 1:
            position, wrench = lowest + self._centre(press, radius, slopes), np.full(6, np.nan)
        else:
            position, wrench = lowest, self._wrench(press, lowest, radius)
        sigma = float(np.sqrt(covariance[2, 2]))
        return TouchEstimate(position, depth, covariance, sigma, radius, int(flags), wrench=wrench, lowest=lowest)

    def _centre(self, press: np.ndarray, radius: float, slopes: np.ndarray) -> np.ndarray:
        """(3,) m, from the lowest point of a press's tip of that radius, m, to the centre of its contact, on the tip: the mean of the skin
        that its own press brings next to the tip, which is too far up where others give the skin slopes (2,)."""
        library, cap = self.calibration.library, self.calibration.library.plan.cap
        steps = np.linspace(-radius, radius, ACROSS)
        round_it = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        skin = press[[X, Y]] * cap.curvature_radius / (cap.curvature_radius + radius) + round_it[np.hypot(*round_it.T) <= radius]
        skin = skin[np.hypot(*skin.T) < EDGE * self.sensor.rim_radius]
        skin = np.column_stack([skin, cap.heights(skin)])
        tip = np.append(press[[X, Y]] + np.exp(press[DEPTH]) * press[DRAG],
                        first_touch_height(press[[X, Y]], radius, self.sensor)[0] - np.exp(press[DEPTH]) + radius)
        from_tip = skin + library.moved(skin, press[None]) - tip
        gap = np.linalg.norm(from_tip, axis=1)
        touching = np.clip(2 - 2 * (gap - gap.min()) / (NEAR * radius), 0, 1) * cap.curvature_radius / (skin[:, 2] - cap.centre_z)
        centre = touching @ from_tip
        centre = centre / np.linalg.norm(centre) - LEANS * np.append(slopes, 0.0)
        return radius * centre / np.linalg.norm(centre) + [0.0, 0.0, radius]

    def _inside(self, place: np.ndarray) -> np.ndarray:
        """(2,) m, the place (2,), not beyond the rim."""
        return place * min(1.0, 0.95 * self.sensor.rim_radius / max(np.hypot(*place), 1e-9))

    def _onto(self, press: np.ndarray, radius: float, scale: float) -> np.ndarray:
        """(3, PRESS): derivatives of place and height under first touch (m) by the numbers of a press (7,); scale: of its depth."""
        pressed, size = np.exp(press[DEPTH]), self.calibration.library.plan.cap.curvature_radius + radius
        place = press[[X, Y]] + pressed * press[DRAG]
        onto = np.zeros((3, PRESS))
        onto[:2, [X, Y]], onto[:2, DRAG], onto[:2, DEPTH] = np.eye(2), pressed * np.eye(2), pressed * press[DRAG]
        # The height of first touch falls from the axis outwards, on a sphere.
        falls, fell = (at / np.sqrt(max(size**2 - at @ at, 1e-12)) for at in (place, press[[X, Y]]))
        onto[2] = falls @ onto[:2]
        onto[2, [X, Y]] -= fell
        onto[2, DEPTH] -= pressed / scale
        return onto

    def _wrench(self, press: np.ndarray, position: np.ndarray, radius: float) -> np.ndarray:
        """(6,) m and m^2, wrench at the origin over the shear modulus and thickness: the force acts where the tip first touched it."""
        force = self.solver.library.push(press)
        normal = self.sensor.normal(press[[X, Y]] / (1 + radius / self.calibration.library.plan.cap.curvature_radius))
        return np.concatenate([force, cross(position + [0.0, 0.0, radius] - radius * normal, force)])

    def _by_others(self, found: DomeFound, number: int, radius: float) -> tuple[float, np.ndarray]:
        """What the other presses do to the skin where one touches it: m, by which they lower it, as depth is measured from the untouched
        dome; and the slopes (2,) that they give it."""
        others = np.delete(found.presses, number, axis=0)
        if not len(others):
            return 0.0, np.zeros(2)
        cap = self.calibration.library.plan.cap
        at = found.presses[number, :2] * cap.curvature_radius / (cap.curvature_radius + radius)
        at = at + BESIDE * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
        touch = np.column_stack([at, cap.heights(at)])
        up = self.solver.library.moved(touch, others)[:, 2]
        return -float(up[0]), (up[1::2] - up[2::2]) / (2 * BESIDE)


def _added(touch: TouchEstimate) -> TouchEstimate:
    """One of two touches, with what a sum of two fields lacks in its errors."""
    aside, deeper = OFF_CENTRE * float(np.linalg.norm(touch.position - touch.lowest)), ADDED * touch.depth
    covariance = touch.covariance + np.diag(np.square([aside, aside, deeper]))
    return replace(touch, covariance=covariance, depth_sigma=float(np.hypot(touch.depth_sigma, deeper)))
