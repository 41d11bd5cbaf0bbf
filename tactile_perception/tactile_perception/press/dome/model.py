# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contacts on a dome from its mechanics.

The result is the one or two presses, straight or dragged, that best explain a frame (src/press/dome_fit.cpp), from the best match in a
table of starts.
"""
from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ... import _core
from ...common.geometry import cross, principal_values
from ...common.marker_sensor import MarkerSensor, first_touch_height
from ...core.errors import BadArgument
from ..constants import DOME, PRESS
from ..estimate import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE, Choice, Evidence, TouchEstimate
from ..field import MarkerField
from .library import DomeLibrary
from .mechanics import centres_of, seen_at

X, Y, DEPTH, RADIUS, FRICTION, DRAG = 0, 1, 2, 3, 4, slice(5, 7)  # numbers of a press: see _core.press.DomeLibrary
PRESS_SIZE = 7


@dataclass(frozen=True)
class FieldNoise:
    """Standard deviations of displacements per axis.

    still: m, of an untouched marker; share: model error over a marker's displacement; top: over the largest displacement.
    """

    still: float
    share: float
    top: float


def straight_press(is_known: bool = False) -> _core.press.DomePrior:
    """Prior of a straight press, which hardly depends on friction. is_known: whether tip and friction are those of the calibration."""
    drag, friction = DOME.straight
    unknown_tip = float(np.log(DOME.unknown_tips[1] / DOME.unknown_tips[0]) / np.sqrt(12) / np.log(DOME.radius_ratio))
    unknown = {} if is_known else {'rougher': DOME.unknown_friction, 'wider': unknown_tip}
    return _core.press.DomePrior(drag=drag, friction=friction, tip_sigma=DOME.tip_sigma, **unknown)


def dragged_press(radius: tuple[float, float] | None = None) -> _core.press.DomePrior:
    """Prior of a dragged press. It rotates the friction of the press into the drag, so that none of it remains once the tip slips.

    radius: mean and standard deviation of the log radius over the library's spread.
    """
    drag, friction = DOME.dragged
    tip, tip_sigma = radius or (0.0, DOME.tip_sigma)
    return _core.press.DomePrior(drag=drag, friction=friction, tip=tip, tip_sigma=tip_sigma)


def two_presses() -> _core.press.DomePrior:
    """Prior of two: the more one is dragged by the other or slips, the less else the markers determine; gas and tension are shared."""
    drag, friction, together = DOME.two
    return _core.press.DomePrior(drag=drag, friction=friction, tip_sigma=DOME.tip_sigma, together=together)


@dataclass(frozen=True)
class DomeFound:
    """Result of a fit of n presses.

    presses: (n, 7); covariance: (7 n, 7 n), of one press in proportion to the misfit; misfit: mean squared residual over its variance;
    radius: of the first press, and its standard deviation if friction and tip are as the fit assumes; shown: (K, 2) m, fitted apparent
    displacements, NaN if not visible; expected: misfit expected with the error of linearised drags, over 1.
    """

    presses: np.ndarray
    covariance: np.ndarray
    misfit: float
    radius: tuple[float, float]
    shown: np.ndarray
    expected: float

    @property
    def is_sure(self) -> bool:
        """Whether the markers show every press, that is, its depth is known."""
        return bool((np.diag(self.covariance)[DEPTH::PRESS_SIZE] * DOME.sure**2 < 1).all())


class DomeInverse:
    """Fits presses to fields.

    points, camera_centres: (K, 3) m, untouched markers and their cameras, NaN if unknown; plane_z: m; pitch: m, of the markers.
    """

    def __init__(self, library: DomeLibrary, noise: FieldNoise, points: np.ndarray, camera_centres: np.ndarray, plane_z: float,
                 pitch: float):
        self.library, self.noise, self.points, self._plane_z = library, noise, np.array(points, float), plane_z
        self._camera_centres = np.array(np.nan_to_num(camera_centres), float)
        self._rest = seen_at(self.points, self._camera_centres, plane_z)
        self._markers = _core.press.DomeMarkers(points=self.points, camera_centres=self._camera_centres, plane_z=plane_z,
                                                smooth=_polynomials(self._rest))
        self._errors = _core.press.DomeErrors(**vars(noise), alike=DOME.alike, not_linear=DOME.not_linear[0],
                                              longest=np.array(DOME.max_steps))
        self.starts = _starts(library)
        shown = np.array([self.appear(start[None]) for start in self.starts]).reshape(len(self.starts), -1)
        self._shown = shown.astype(np.float32)  # far more accurate than the noise of markers, and half as much to read
        self._sizes = np.sum(shown**2, axis=1)
        apart = np.hypot(*(self.starts[:, None, :2] - self.starts[:, :2]).transpose(2, 0, 1))
        gram = shown @ shown.T
        pairs = np.triu(apart >= DOME.apart * pitch)  # each once: of equal matches the first would depend on rounding
        self._pair_sizes = np.where(pairs, 2 * gram + self._sizes[:, None] + self._sizes, np.inf)

    def appear(self, presses: np.ndarray) -> np.ndarray:
        """Apparent displacements (K, 2), m, under presses (n, 7); 0 for markers at unknown positions."""
        return np.nan_to_num(seen_at(self.points + self.moved(presses), self._camera_centres, self._plane_z) - self._rest)

    def moved(self, presses: np.ndarray) -> np.ndarray:
        """Displacements (K, 3), m, of the markers under presses (n, 7)."""
        return self.library.moved(self.points, presses)

    def match(self, field: MarkerField) -> np.ndarray:
        """Products (S,), m^2, of the field with the fields of the starts."""
        return self._shown @ np.where(field.seen[:, None], field.shift, 0.0).ravel().astype(np.float32)

    def score(self, match: np.ndarray) -> float:
        """Match of the best start in noise standard deviations."""
        return float((match / np.sqrt(self._sizes)).max() / self.noise.still)

    def start(self, field: MarkerField, match: np.ndarray, last: DomeFound | None) -> np.ndarray:
        """Select the start (1, 7) with the smallest squared residual, or the press of the last frame if its residual is smaller.

        A start is less deep if the field is fainter than its own: from starts that are too deep, a faint press would be fitted where the
        dome is stiffest.
        """
        start, smallest = self._fainter(match, self._sizes)
        return start if last is None or np.nansum(last.shown * (last.shown - 2 * field.shift)) > smallest else last.presses

    def start_of_two(self, match: np.ndarray) -> np.ndarray:
        """Select the two starts (2, 7) whose sum has the smallest squared residual."""
        return self._fainter(match[:, None] + match, self._pair_sizes)[0]

    def _fainter(self, match: np.ndarray, sizes: np.ndarray) -> tuple[np.ndarray, float]:
        """Select the n starts (n, 7) with the smallest squared residual, and return it minus the square of the field.

        match: (S, ...), n axes, products of the starts' fields with the field; sizes: (S, ...), squares of the starts' fields.
        """
        factor = np.clip(match / sizes, 0.01, 1.0)  # a press that the field opposes starts faintly
        residual = factor * (factor * sizes - 2 * match)
        best = np.unravel_index(np.argmin(residual), sizes.shape)
        starts = self.starts[list(best)]
        starts[:, DEPTH] += np.log(factor[best])
        return starts, float(residual[best])

    def solve(self, field: MarkerField, starts: np.ndarray, prior: _core.press.DomePrior | None = None) -> DomeFound:
        """Fit presses to a field, from starts (n, 7); prior: that of a straight press if not given."""
        found = self.library.kernel.fit(self._markers, self._errors, prior or straight_press(), field.shift, starts)
        radius = float(found.presses[0, RADIUS]), found.radius_sigma
        return DomeFound(found.presses, found.covariance, found.misfit, radius, found.shown, found.expected)


def _polynomials(positions: np.ndarray) -> np.ndarray:
    """Polynomials (K, m) of positions (K, 2), orthogonal and of unit RMS over the known ones; 0 at others."""
    known = np.isfinite(positions).all(1)
    x, y = (positions[known] / np.abs(positions[known]).max()).T
    degree = 5  # the error is smooth
    terms = np.stack([x**i * y**j for i in range(degree + 1) for j in range(degree + 1 - i)], axis=1)
    smooth = np.zeros((len(positions), terms.shape[1]))
    smooth[known] = np.linalg.qr(terms)[0] * np.sqrt(known.sum())
    return smooth


def _starts(library: DomeLibrary) -> np.ndarray:
    """Presses (S, 7) all over the dome."""
    starts, rim, deepest = [], library.plan.rim_radius, library.plan.depth
    for ring in DOME.start_rings:
        if ring * rim > library.plan.reach:
            break
        count = max(1, round(2 * np.pi * ring / DOME.start_rings[1]))
        for turn in np.arange(count) * 2 * np.pi / count:
            position = ring * rim * np.array([np.cos(turn), np.sin(turn)])
            starts += [[*position, np.log(part * deepest), 0.0, 0.0, 0.0, 0.0] for part in DOME.start_depths]
    return np.array(starts)


@dataclass(frozen=True)
class DomeCalibration:
    """Calibration of the dome model.

    Attributes
    ----------
    library : DomeLibrary
        Simulated presses.
    rest, camera_centres : ndarray, shape (K, 2) and (K, 3)
        Untouched markers in the viewing plane, and their cameras, in m.
    noise : FieldNoise
        Noise of fields, with the model error.
    place_error, depth_share : float
        Standard deviations of the remaining errors of position, in m, and of depth over depth.
    wider : float
        Fitted distance from the axis over the true one.
    deeper, deeper_far, deeper_shallow : float
        See depth_scale.
    deepest, farthest : float
        Largest calibrated depth and distance from the axis in m.
    quiet : float
        Largest match of an untouched frame.
    """

    library: DomeLibrary
    rest: np.ndarray
    camera_centres: np.ndarray
    noise: FieldNoise
    place_error: float
    depth_share: float
    wider: float
    deeper: float
    deeper_far: float
    deeper_shallow: float
    deepest: float
    farthest: float
    quiet: float

    def __post_init__(self):
        if self.rest.shape[1:] != (2,) or self.camera_centres.shape != (len(self.rest), 3):
            raise ValueError(f'rest {self.rest.shape} and camera centres {self.camera_centres.shape} must be (K, 2) and (K, 3)')

    def inverse(self, sensor: MarkerSensor) -> DomeInverse:
        """Make the fit to fields of the sensor."""
        points = centres_of(self.rest, self.camera_centres, self.library.plan.marker, sensor)
        return DomeInverse(self.library, self.noise, points, self.camera_centres, sensor.plane_z, max(sensor.pitch))

    def depth_scale(self, position: np.ndarray, depth: float) -> float:
        """Fitted depth over the true one at a position (2,), m, for a fitted depth, m."""
        far = min(position @ position / self.farthest**2, 1.0)
        shallow = self.deeper_shallow * shallowness(depth, self.deepest)
        return float(self.deeper + (self.deeper_far - self.deeper) * far + shallow)


def shallowness(depth: np.ndarray, deepest: float) -> np.ndarray:
    """Shallowness (...) of fitted depths (...), m: 1 up to DOME.shallow of the deepest, above it inversely proportional to depth."""
    return DOME.shallow * deepest / np.maximum(depth, DOME.shallow * deepest)




class DomeModelMethod:
    """The 'model' method for domes. Drags and pairs of presses may start from the last frame's solution."""

    def __init__(self, calibration: DomeCalibration, sensor: MarkerSensor):
        self.calibration, self.sensor = calibration, sensor
        self.solver = calibration.inverse(sensor)
        self._threshold = max(DOME.stands_out, DOME.quieter * calibration.quiet)
        self._choice = Choice()
        self._last: tuple[MarkerField, DomeFound | None] | None = None  # of estimate

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """Estimate the contacts of one frame; empty without contact, and if the markers move too little to determine a position.

        Raises BadArgument for another pattern.
        """
        found = self.find(field)
        self._last = field, found
        if found is None:
            return []
        touches = [self._touch(found, k) for k in range(len(found.presses))]
        radius = self.calibration.library.plan.radius
        return [touch for touch in touches if touch.depth > DOME.sure * touch.depth_sigma
                and math.sqrt(principal_values(touch.covariance[:2, :2])[1]) * DOME.sure < radius]

    def find(self, field: MarkerField) -> DomeFound | None:
        """Find the presses of one frame; None without contact. Raises BadArgument for another pattern."""
        if len(field) != len(self.solver.points):
            raise BadArgument(f'calibrated for {len(self.solver.points)} markers, got a field of {len(field)}')
        match = self.solver.match(field)
        score = self.solver.score(match) if field.seen.sum() >= PRESS.min_markers and self._spread(field) else 0.0
        if not score > self._threshold:
            self._choice = Choice()  # the next press is another contact
            return None
        found = self._explained(field, match)
        faint = len(found.presses) == 1 and score < DOME.faint * self._threshold
        return self._unsure(field, match, found) if faint else found

    def _spread(self, field: MarkerField) -> bool:
        """Whether the visible markers span a plane instead of a line or a point."""
        now = (field.rest + field.shift)[field.seen]
        now -= now.mean(axis=0)
        return principal_values(now.T @ now / len(now))[0] > max(self.sensor.pitch)**2

    def _unsure(self, field: MarkerField, match: np.ndarray, found: DomeFound) -> DomeFound:
        """Increase the covariance of a faint press if two presses explain it better.

        They do if the squared residual decreases by more than two (Akaike 1974) for each number of a second press; the position is then as
        uncertain as the two presses are apart.
        """
        two = self.solver.solve(field, self.solver.start_of_two(match))
        if 2 * field.seen.sum() * (found.misfit / two.misfit - 1) < 2 * 3:  # a faint press determines position and depth
            return found
        covariance, offset = found.covariance.copy(), two.presses[:, :3] - found.presses[0, :3]
        covariance[:3, :3] += offset.T @ offset / 2
        return replace(found, covariance=covariance)

    def raised(self, field: MarkerField) -> np.ndarray | None:
        """Upward displacements (K,), m, of the markers; None without contact. Uses the solution of estimate if it is of this field."""
        found = self._last[1] if self._last is not None and self._last[0] is field else self.find(field)
        return None if found is None else self.solver.moved(found.presses)[:, 2]

    def _explained(self, field: MarkerField, match: np.ndarray) -> DomeFound:
        """Find the hypothesis of the largest evidence."""
        def two() -> DomeFound:
            """Fit two presses, straight from the best pair of starts and then dragged.

            Directly from the start, drags might diverge to small depths with long displacements.
            """
            if self._choice.two is not None:
                return self.solver.solve(field, self._choice.two, two_presses())
            straight = self.solver.solve(field, self.solver.start_of_two(match))
            return self.solver.solve(field, straight.presses, two_presses()) if straight.is_sure else straight

        straight, dragged = straight_press(), dragged_press(self._choice.radius)
        return self._choice.explain(
            Evidence(2 * int(field.seen.sum()), DOME.ordinary),
            lambda start, drags: self.solver.solve(field, start, dragged if drags else straight),
            self.solver.start(field, match, self._choice.one), two)

    def _touch(self, found: DomeFound, number: int) -> TouchEstimate:
        press, calibration = found.presses[number], self.calibration
        radius, pressed = float(calibration.library.plan.radius * np.exp(DOME.radius_spread * press[RADIUS])), float(np.exp(press[DEPTH]))
        first = press[[X, Y]] / calibration.wider
        (sunk, slopes), scale = self._by_others(found, number, radius), calibration.depth_scale(first, pressed)
        tip, by = self._tip(press, scale, sunk)
        lowest, depth = tip[:3], float(tip[3])
        aside, deeper = (share * pressed * float(np.hypot(*press[DRAG])) for share in DOME.not_linear)
        share = calibration.depth_share + DOME.scaled * abs(scale - 1)
        aside += calibration.place_error + DOME.scaled * float(np.hypot(*(first - press[[X, Y]])))
        deeper += share * depth + abs(sunk)
        part = slice(PRESS_SIZE * number, PRESS_SIZE * (number + 1))
        by_numbers, by_errors = np.split(by, [PRESS_SIZE], axis=1)
        covariance = by_numbers @ found.covariance[part, part] @ by_numbers.T + by_errors * [aside**2, aside**2, deeper**2] @ by_errors.T
        if not np.isfinite(covariance).all():
            covariance = np.diag([self.sensor.rim_radius**2] * 4)
        reach = calibration.library.plan.reach
        at_edge = np.hypot(*press[[X, Y]]) > DOME.max_relative_reach * reach or np.hypot(*first) > calibration.farthest
        flags = OUT_OF_RANGE * (depth > PRESS.max_relative_depth * calibration.deepest) | AT_EDGE * bool(at_edge)
        flags |= AMBIGUOUS * (found.misfit > DOME.unexplained)
        position, wrench = lowest, np.full(6, np.nan)
        if len(found.presses) == 1:
            wrench = self._wrench(press, lowest, radius)
        else:
            position = lowest + self._centre(press, radius, slopes)
            aside, deeper = DOME.centre_error * float(np.linalg.norm(position - lowest)), DOME.added * depth
            covariance += np.diag(np.square([aside, aside, deeper, deeper]))
        sigma = float(np.sqrt(covariance[3, 3]))
        return TouchEstimate(position, depth, covariance[:3, :3], sigma, radius, int(flags), wrench=wrench, lowest=lowest)

    def _tip(self, press: np.ndarray, scale: float, sunk: float) -> tuple[np.ndarray, np.ndarray]:
        """Lowest point and depth (4,), m, of a press (7,), and their derivatives (4, 10) by its numbers and by errors of the result.

        scale: of its depth; sunk: m, by which other presses lower the skin.
        """
        difference = 1e-6  # of a number of a press
        steps = np.vstack([np.zeros(PRESS_SIZE + 3), difference * np.eye(PRESS_SIZE + 3)])
        presses, errors = press + steps[:, :PRESS_SIZE], steps[:, PRESS_SIZE:]
        radius, pressed = self.calibration.library.plan.radius * np.exp(DOME.radius_spread * presses[:, RADIUS]), np.exp(presses[:, DEPTH])
        first = presses[:, [X, Y]] / self.calibration.wider + errors[:, :2]
        low = first_touch_height(self._inside(first), radius, self.sensor) - pressed / scale - sunk - errors[:, 2]
        position = self._inside(first + pressed[:, None] * presses[:, DRAG])  # to which the drag has moved it
        tips = np.column_stack([position, low, first_touch_height(position, radius, self.sensor) - low])
        return tips[0], (tips[1:] - tips[0]).T / difference

    def _centre(self, press: np.ndarray, radius: float, slopes: np.ndarray) -> np.ndarray:
        """Vector (3,), m, from the lowest point of a tip of this radius, m, to the centre of its contact on the tip.

        The centre is the mean of the skin that its own press brings near the tip, corrected for slopes (2,) of the skin by other presses.
        """
        library, cap = self.calibration.library, self.calibration.library.plan.cap
        steps = np.linspace(-radius, radius, 15)
        grid = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        skin = press[[X, Y]] * cap.curvature_radius / (cap.curvature_radius + radius) + grid[np.hypot(*grid.T) <= radius]
        skin = skin[np.hypot(*skin.T) < DOME.max_relative_reach * self.sensor.rim_radius]
        skin = np.column_stack([skin, cap.heights(skin)])
        tip = np.append(press[[X, Y]] + np.exp(press[DEPTH]) * press[DRAG],
                        first_touch_height(press[[X, Y]], radius, self.sensor)[0] - np.exp(press[DEPTH]) + radius)
        from_tip = skin + library.moved(skin, press[None]) - tip
        gap = np.linalg.norm(from_tip, axis=1)
        touching = np.clip(2 - 2 * (gap - gap.min()) / (DOME.contact_gap * radius), 0, 1)
        touching *= cap.curvature_radius / (skin[:, 2] - cap.centre_z)
        centre = touching @ from_tip
        centre = centre / np.linalg.norm(centre) - DOME.slope_share * np.append(slopes, 0.0)
        return radius * centre / np.linalg.norm(centre) + [0.0, 0.0, radius]

    def _inside(self, positions: np.ndarray) -> np.ndarray:
        """Limit positions (..., 2), m, to within the rim."""
        distance = np.maximum(np.linalg.norm(positions, axis=-1, keepdims=True), 1e-9)
        return positions * np.minimum(1.0, 0.95 * self.sensor.rim_radius / distance)

    def _wrench(self, press: np.ndarray, position: np.ndarray, radius: float) -> np.ndarray:
        """Wrench (6,), m and m^2, at the origin over shear modulus and thickness; the force acts at the point of first contact."""
        force = self.solver.library.push(press)
        normal = self.sensor.normal(press[[X, Y]] / (1 + radius / self.calibration.library.plan.cap.curvature_radius))
        return np.concatenate([force, cross(position + [0.0, 0.0, radius] - radius * normal, force)])

    def _by_others(self, found: DomeFound, number: int, radius: float) -> tuple[float, np.ndarray]:
        """Effect of the other presses on the skin under one press: by how much they lower it, m, and the slopes (2,) that they cause.

        Depth is measured from the untouched dome.
        """
        if len(found.presses) == 1:
            return 0.0, np.zeros(2)
        others = np.delete(found.presses, number, axis=0)
        cap = self.calibration.library.plan.cap
        at = found.presses[number, :2] * cap.curvature_radius / (cap.curvature_radius + radius)
        at = at + DOME.slope_base * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
        touch = np.column_stack([at, cap.heights(at)])
        up = self.solver.library.moved(touch, others)[:, 2]
        return -float(up[0]), (up[1::2] - up[2::2]) / (2 * DOME.slope_base)
