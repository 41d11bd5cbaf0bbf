# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Touches of a dome by its mechanics: the one or two presses, straight or dragged, that best explain a frame (src/press/dome_fit.cpp), from
the best match in a table of starts."""
from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...common.geometry import cross
from ...common.marker_sensor import MarkerSensor, first_touch_height
from ...errors import BadArgument
from ..estimate import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE, Choice, Evidence, TouchEstimate
from ..field import MarkerField
from .library import RADIUS_SPREAD, DomeLibrary
from .mechanics import centres_of, seen_at

X, Y, DEPTH, RADIUS, FRICTION, DRAG = 0, 1, 2, 3, 4, slice(5, 7)  # numbers of a press: see _core.DomeLibrary
PRESS = 7
FAINTEST = 1e-5          # m, least depth. Chosen: far below what markers show
LIMIT = (0.01, 0.01, 0.5, 0.5, 0.5, 0.3, 0.3)  # of one step: m, logs, way of a drag over depth. Chosen
RINGS, DEPTHS = (0.0, 0.14, 0.28, 0.42, 0.56), (0.06, 0.15, 0.35, 0.6, 0.85)  # starts, of rim radius and deepest press. Chosen
FAINTEST_START = 0.01    # least depth of a start over the least one of the table. Chosen
LEAST_MISFIT = 0.1       # of a covariance: no fit is believed to be better. Chosen
TERMS = 5                # degree of the polynomials that describe what a sum of fields lacks, which is smooth. Chosen


SEEN = 12                # markers needed. Chosen
PLACE_AND_DEPTH = 3      # numbers that a faint press tells
BEYOND = 1.02            # times the calibrated depth: deeper is out of range
EDGE = 0.98              # of the library's reach, from which a touch is at the edge


@dataclass(frozen=True)
class DomeConstants:
    """What decides; all chosen on simulated domes. Pairs are of place and depth. Of tips, frictions and drags: PressPrior.

    alike: standard deviation that model errors of neighbouring markers, which are alike, count over their own
    stands_out: least match of a touch, standard deviations of noise; quieter: the same over the greatest match of untouched frames
    sure: least depth over its standard deviation, and tip radius over that of the place: fainter touches are not reported
    faint: times the least match, up to which two presses pass for one
    ordinary: residual chi-square of presses under their own hypothesis, which is 0.4 to 2
    unexplained: chi-square from which an estimate is ambiguous
    not_linear: errors over the way of a drag, which is linearised; the first of displacements, too
    added: error of the depth of each of two presses, whose fields are added
    scaled: error of a scale over the correction that the calibrated tip needs: another tip may need another
    apart: pitches: least distance of the starts of two touches
    """

    alike: float = 4.5
    stands_out: float = 12.0
    quieter: float = 1.5
    sure: float = 2.5
    faint: float = 8.0
    ordinary: float = 1.0
    unexplained: float = 12.0
    not_linear: tuple[float, float] = (0.07, 0.1)
    added: float = 0.12
    scaled: float = 0.5
    apart: float = 2.2


CONSTANTS = DomeConstants()


@dataclass(frozen=True)
class FieldNoise:
    """Standard deviations of displacements per axis: still, m, of an untouched marker; share: model error over a marker's displacement,
    and top: over the greatest displacement."""

    still: float
    share: float
    top: float


@dataclass(frozen=True)
class PressPrior:
    """What is known of a press beforehand: drag: standard deviation of the way of the drag over the depth; friction: of its number (see
    FRICTIONS in library.py); tip, tip_sigma: mean and standard deviation of the log radius over the library's spread; together: what the
    sum of the presses' fields lacks: its RMS over the greatest displacement; rougher, wider: by how much that number and that log radius
    may really differ from their means, standard deviations: covariances count them where they are larger than those of the fit."""

    drag: float
    friction: float
    tip: float = 0.0
    tip_sigma: float = 0.35
    together: float = 0.0
    rougher: float = 0.0
    wider: float = 0.0


#: Number of friction of a tip whose friction is unknown: standard deviation. Chosen: for coefficients from 0.2 to 1.0, evenly over their
#: logs, it is 0.46, but large ones are alike, as the skin sticks
UNKNOWN_FRICTION = 0.35
#: Log radius of an unknown tip over the library's spread: standard deviation for tips of 0.6 to 2 times the calibrated radius, likewise
UNKNOWN_TIP = float(np.log(2.0 / 0.6) / np.sqrt(12) / RADIUS_SPREAD)
#: Of a press that goes straight in, which hardly tells friction, and of one that is dragged, which turns the friction of the press along
#: the drag, so that nothing of it is left once the tip slips; a tip that sticks carries the skin farther than it is deep. Chosen
STRAIGHT, DRAGGED = PressPrior(0.005, 0.02, rougher=UNKNOWN_FRICTION, wider=UNKNOWN_TIP), PressPrior(1.0, 1.0)
#: Of two presses: the more one is dragged by the other or slips, the less else markers tell; gas and tension of the skin are shared. Chosen
OF_TWO = PressPrior(0.1, 0.01, together=0.1)


@dataclass(frozen=True)
class DomeFound:
    """presses: (n, 7); covariance: (7 n, 7 n), of one press in proportion to the misfit: mean squared residual over its variance; radius:
    of the first press, and its standard deviation, were friction and tip what the fit takes them for; shown: (K, 2) m, what the markers
    show of the presses, NaN where not seen; expected: what the error of drags, which are linearised, makes of a misfit of 1."""

    presses: np.ndarray
    covariance: np.ndarray
    misfit: float
    radius: tuple[float, float]
    shown: np.ndarray
    expected: float

    @property
    def is_sure(self) -> bool:
        """Whether the markers show every press: its depth is known."""
        return bool((np.diag(self.covariance)[DEPTH::PRESS] * CONSTANTS.sure**2 < 1).all())


class DomeInverse:
    """points, camera_centres: (K, 3) m, untouched markers and their cameras, NaN unknown; plane_z: m; pitch: m, of the markers."""

    def __init__(self, library: DomeLibrary, noise: FieldNoise, points: np.ndarray, camera_centres: np.ndarray, plane_z: float,
                 pitch: float):
        self.library, self.noise, self.points, self._plane_z = library, noise, np.array(points, float), plane_z
        self._camera_centres = np.array(np.nan_to_num(camera_centres), float)
        self._rest = seen_at(self.points, self._camera_centres, plane_z)
        self.starts = _starts(library)
        shown = np.array([self.appear(start[None]) for start in self.starts]).reshape(len(self.starts), -1)
        self._shown = shown.astype(np.float32)  # far finer than the noise of markers, and half as much to read
        self._sizes = np.sum(shown**2, axis=1)
        apart = np.hypot(*(self.starts[:, None, :2] - self.starts[:, :2]).transpose(2, 0, 1))
        gram = shown @ shown.T
        self._smooth = _polynomials(self._rest)
        self._both = np.where(apart >= CONSTANTS.apart * pitch, 2 * gram + self._sizes[:, None] + self._sizes, np.inf)

    def appear(self, presses: np.ndarray) -> np.ndarray:
        """(K, 2) m, apparent displacement under presses (n, 7); 0 for markers at unknown places."""
        return np.nan_to_num(seen_at(self.points + self.moved(presses), self._camera_centres, self._plane_z) - self._rest)

    def moved(self, presses: np.ndarray) -> np.ndarray:
        """(K, 3) m, displacement of the markers under presses (n, 7)."""
        return self.library.moved(self.points, presses)

    def match(self, field: MarkerField) -> np.ndarray:
        """(S,) m^2, products of the field with the starts' fields."""
        return self._shown @ np.where(field.seen[:, None], field.shift, 0.0).ravel().astype(np.float32)

    def score(self, match: np.ndarray) -> float:
        """Match of the best start, in standard deviations of noise."""
        return float((match / np.sqrt(self._sizes)).max() / self.noise.still)

    def start(self, field: MarkerField, match: np.ndarray, last: DomeFound | None) -> np.ndarray:
        """(1, 7), the start with the least squared residual from the field of a match, or the press of the last frame where that has less;
        a start is less deep where the field is fainter than its own: from starts that are too deep, a faint press would be fitted where
        the dome gives way least."""
        start, least = self._fainter(match, self._sizes)
        return start if last is None or np.nansum(last.shown * (last.shown - 2 * field.shift)) > least else last.presses

    def start_of_two(self, match: np.ndarray) -> np.ndarray:
        """(2, 7), the two starts whose sum has the least squared residual, likewise."""
        return self._fainter(match[:, None] + match, self._both)[0]

    def _fainter(self, match: np.ndarray, sizes: np.ndarray) -> tuple[np.ndarray, float]:
        """(n, 7), the n starts with the least squared residual, by the products of their fields with the field (S, ...) and the squares of
        theirs (S, ...), n axes; and by how much that exceeds the square of the field."""
        fainter = np.clip(match / sizes, FAINTEST_START, 1.0)
        more = fainter * (fainter * sizes - 2 * match)
        best = np.unravel_index(np.argmin(more), sizes.shape)
        starts = self.starts[list(best)]
        starts[:, DEPTH] += np.log(fainter[best])
        return starts, float(more[best])

    def solve(self, field: MarkerField, starts: np.ndarray, prior: PressPrior = STRAIGHT) -> DomeFound:
        """Fit presses to a field, from starts (n, 7)."""
        seen = field.seen & np.isfinite(self.points).all(1)
        square, noise = _squares(field), self.noise.still**2
        model = self.noise.share**2 * square + self.noise.top**2 * square.max()  # m^2, variance of its error
        weight = np.where(seen, 1 / (noise + CONSTANTS.alike**2 * model), 0.0)
        shared = self._shared(square.max(), weight, prior.together) if prior.together else np.zeros((0, len(weight)))
        found = self.library.kernel.fit(
            points=self.points, camera_centres=self._camera_centres, plane_z=self._plane_z, shift=np.where(seen[:, None], field.shift,
                                                                                                           0.0), weight=weight,
            shared=shared, starts=starts, prior=self._prior(prior))
        misfit = float(np.sum(found.left**2 / (noise + model)[:, None])) / max(2 * int(seen.sum()), 1)
        amiss = max(misfit, LEAST_MISFIT) if len(starts) == 1 else 1.0  # what a sum of two fields lacks is in the covariance
        radius = float(found.presses[0, RADIUS]), float(np.sqrt(amiss * found.covariance[RADIUS, RADIUS]))
        drag = CONSTANTS.not_linear[0] * float(np.linalg.norm(found.presses[:, DRAG], axis=1).max())
        expected = 1 + drag**2 * float(np.mean((square / (noise + model))[seen]))
        return DomeFound(found.presses, found.covariance * amiss + self._unknown(found.covariance, prior), misfit, radius,
                         field.shift - found.left, expected)

    def _unknown(self, covariance: np.ndarray, prior: PressPrior) -> np.ndarray:
        """What a covariance (7 n, 7 n) lacks as friction and radius differ from their means by more than the fit was reported: the fit
        holds them there with the weights of its prior."""
        weight, variance = self._prior(prior)[1], np.zeros(PRESS)
        variance[[RADIUS, FRICTION]] = prior.wider**2, prior.rougher**2
        more = np.tile(np.maximum(weight * (weight * variance - 1), 0.0), len(covariance) // PRESS)
        return (covariance * more) @ covariance

    def _shared(self, largest: float, weight: np.ndarray, together: float) -> np.ndarray:
        """(m, K): rows whose products are taken off the diagonal weights (K,) of each axis, so that their inverse counts what a sum of two
        fields lacks (Woodbury 1950); largest: m^2, of the squared displacements."""
        weighted = self._smooth.T * weight
        factor = np.linalg.cholesky(weighted @ self._smooth + np.eye(len(weighted)) * len(weighted) / (together**2 * largest))
        return np.linalg.solve(factor, weighted)

    def _prior(self, prior: PressPrior) -> np.ndarray:
        """(5, 7) mean, weight, least, most and longest step."""
        plan = self.library.plan
        reach, deepest = plan.reach, np.log(plan.depth)
        weight = np.array([1e-6, 1e-6, 1e-6, prior.tip_sigma**-2, prior.friction**-2, prior.drag**-2, prior.drag**-2])
        least = [-reach, -reach, np.log(FAINTEST), -1.0, -1.0, -2.0, -2.0]
        most = [reach, reach, deepest, 1.0, 0.0, 2.0, 2.0]
        return np.array([[0.0, 0.0, 0.0, prior.tip, 0.0, 0.0, 0.0], weight, least, most, LIMIT])


def _squares(field: MarkerField) -> np.ndarray:
    """(K,) m^2, of the displacements, 0 where not seen."""
    return np.sum(np.where(field.seen[:, None], field.shift, 0.0)**2, axis=1)


def _polynomials(places: np.ndarray) -> np.ndarray:
    """(K, m): polynomials of places (K, 2), orthogonal and of unit RMS over the known ones; 0 at others."""
    known = np.isfinite(places).all(1)
    x, y = (places[known] / np.abs(places[known]).max()).T
    terms = np.stack([x**i * y**j for i in range(TERMS + 1) for j in range(TERMS + 1 - i)], axis=1)
    smooth = np.zeros((len(places), terms.shape[1]))
    smooth[known] = np.linalg.qr(terms)[0] * np.sqrt(known.sum())
    return smooth


def _starts(library: DomeLibrary) -> np.ndarray:
    """(S, 7) presses all over the dome."""
    starts, rim, deepest = [], library.plan.rim_radius, library.plan.depth
    for ring in RINGS:
        if ring * rim > library.plan.reach:
            break
        count = max(1, round(2 * np.pi * ring / RINGS[1]))
        for turn in np.arange(count) * 2 * np.pi / count:
            place = ring * rim * np.array([np.cos(turn), np.sin(turn)])
            starts += [[*place, np.log(part * deepest), 0.0, 0.0, 0.0, 0.0] for part in DEPTHS]
    return np.array(starts)


SHALLOW = 0.2           # of the deepest press: above it, model errors are in proportion to depth. Chosen


@dataclass(frozen=True)
class DomeCalibration:
    """library; rest: (K, 2) m, and camera_centres (K, 3) m, untouched markers in the viewing plane and their cameras; noise: of
    fields, with the model error; place_error: m, and depth_share: standard deviations of the remaining errors of place, and of depth
    over depth; wider: fitted distance from the axis over the true one; deeper, deeper_far, deeper_shallow: see depth_scale; deepest,
    farthest: m, calibrated depth, and distance from the axis; quiet: greatest match of an untouched frame.
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
        """The fit to fields of the sensor."""
        points = centres_of(self.rest, self.camera_centres, self.library.plan.marker, sensor)
        return DomeInverse(self.library, self.noise, points, self.camera_centres, sensor.plane_z, max(sensor.pitch))

    def depth_scale(self, place: np.ndarray, depth: float) -> float:
        """Fitted depth over the true one at a place (2,), m, and a fitted depth, m."""
        far = min(place @ place / self.farthest**2, 1.0)
        shallow = self.deeper_shallow * shallowness(depth, self.deepest)
        return float(self.deeper + (self.deeper_far - self.deeper) * far + shallow)


def shallowness(depth: np.ndarray, deepest: float) -> np.ndarray:
    """(...) of fitted depths (...), m: 1 for those up to SHALLOW of the deepest, from there on in inverse proportion to depth."""
    return SHALLOW * deepest / np.maximum(depth, SHALLOW * deepest)


LEANS = 0.5          # share of the slope that one of two presses gives the skin, that moves the other's contact. Chosen on simulated pairs
BESIDE = 3e-3        # m, over which that slope is taken. Chosen
NEAR = 0.05          # gap between skin and tip over the tip's radius, beyond the least one, up to which the skin counts as touching
ACROSS = 15          # points across a tip at which the skin is looked at for its contact
DIFFERENCE = 1e-6    # of a number of a press, for derivatives
OFF_CENTRE = 0.15    # error of a contact's centre over its distance from the lowest point


class DomeModelMethod:
    """The 'model' method for domes. Drags and pairs of presses may start from the last frame's solution."""

    def __init__(self, calibration: DomeCalibration, sensor: MarkerSensor):
        self.calibration, self.sensor = calibration, sensor
        self.solver = calibration.inverse(sensor)
        self._threshold = max(CONSTANTS.stands_out, CONSTANTS.quieter * calibration.quiet)
        self._choice = Choice()
        self._last: tuple[MarkerField, DomeFound | None] | None = None  # of estimate

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The touches of one frame; empty without contact, and where the markers move too little to tell a place. Raises BadArgument for
        another pattern."""
        found = self.find(field)
        self._last = field, found
        if found is None:
            return []
        touches = [self._touch(found, k) for k in range(len(found.presses))]
        radius = self.calibration.library.plan.radius
        return [touch for touch in touches if touch.depth > CONSTANTS.sure * touch.depth_sigma
                and np.sqrt(np.linalg.eigvalsh(touch.covariance[:2, :2])[-1]) * CONSTANTS.sure < radius]

    def find(self, field: MarkerField) -> DomeFound | None:
        """The presses of one frame; None without contact. Raises BadArgument for another pattern."""
        if len(field) != len(self.solver.points):
            raise BadArgument(f'calibrated for {len(self.solver.points)} markers, got a field of {len(field)}')
        match = self.solver.match(field)
        score = self.solver.score(match) if field.seen.sum() >= SEEN and self._spread(field) else 0.0
        if not score > self._threshold:
            self._choice = Choice()  # what comes next is another touch
            return None
        found = self._explained(field, match)
        faint = len(found.presses) == 1 and score < CONSTANTS.faint * self._threshold
        return self._unsure(field, match, found) if faint else found

    def _spread(self, field: MarkerField) -> bool:
        """Whether the seen markers are now in a plane, not on a line or at one place."""
        now = (field.rest + field.shift)[field.seen]
        now -= now.mean(axis=0)
        return bool(np.linalg.eigvalsh(now.T @ now / len(now))[0] > max(self.sensor.pitch)**2)

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
        """Upward displacement (K,), m, of the markers; None without contact. By the solution of estimate, if of this field."""
        found = self._last[1] if self._last is not None and self._last[0] is field else self.find(field)
        return None if found is None else self.solver.moved(found.presses)[:, 2]

    def _explained(self, field: MarkerField, match: np.ndarray) -> DomeFound:
        """The hypothesis of most evidence."""
        def two() -> DomeFound:
            """Straight from the best pair of starts, and dragged from there: from the start, drags might end far off, at small depths with
            long ways."""
            if self._choice.two is not None:
                return self.solver.solve(field, self._choice.two, OF_TWO)
            straight = self.solver.solve(field, self.solver.start_of_two(match))
            return self.solver.solve(field, straight.presses, OF_TWO) if straight.is_sure else straight

        tip, tip_sigma = self._choice.radius or (DRAGGED.tip, DRAGGED.tip_sigma)
        dragged = replace(DRAGGED, tip=tip, tip_sigma=tip_sigma)
        return self._choice.explain(
            Evidence(2 * int(field.seen.sum()), CONSTANTS.ordinary),
            lambda start, drags: self.solver.solve(field, start, dragged if drags else STRAIGHT),
            self.solver.start(field, match, self._choice.one), two)

    def _touch(self, found: DomeFound, number: int) -> TouchEstimate:
        press, calibration = found.presses[number], self.calibration
        radius, pressed = float(calibration.library.plan.radius * np.exp(RADIUS_SPREAD * press[RADIUS])), float(np.exp(press[DEPTH]))
        first = press[[X, Y]] / calibration.wider
        (sunk, slopes), scale = self._by_others(found, number, radius), calibration.depth_scale(first, pressed)
        tip, by = self._tip(press, scale, sunk)
        lowest, depth = tip[:3], float(tip[3])
        aside, deeper = (share * pressed * float(np.hypot(*press[DRAG])) for share in CONSTANTS.not_linear)
        share = calibration.depth_share + CONSTANTS.scaled * abs(scale - 1)
        aside += calibration.place_error + CONSTANTS.scaled * float(np.hypot(*(first - press[[X, Y]])))
        deeper += share * depth + abs(sunk)
        part = slice(PRESS * number, PRESS * (number + 1))
        by, off = np.split(by, [PRESS], axis=1)
        covariance = by @ found.covariance[part, part] @ by.T + off * [aside**2, aside**2, deeper**2] @ off.T
        if not np.isfinite(covariance).all():
            covariance = np.diag([self.sensor.rim_radius**2] * 4)
        reach = calibration.library.plan.reach
        at_edge = np.hypot(*press[[X, Y]]) > EDGE * reach or np.hypot(*first) > calibration.farthest
        flags = OUT_OF_RANGE * (depth > BEYOND * calibration.deepest) | AT_EDGE * bool(at_edge)
        flags |= AMBIGUOUS * (found.misfit > CONSTANTS.unexplained)
        position, wrench = lowest, np.full(6, np.nan)
        if len(found.presses) == 1:
            wrench = self._wrench(press, lowest, radius)
        else:
            position = lowest + self._centre(press, radius, slopes)
            aside, deeper = OFF_CENTRE * float(np.linalg.norm(position - lowest)), CONSTANTS.added * depth
            covariance += np.diag(np.square([aside, aside, deeper, deeper]))
        sigma = float(np.sqrt(covariance[3, 3]))
        return TouchEstimate(position, depth, covariance[:3, :3], sigma, radius, int(flags), wrench=wrench, lowest=lowest)

    def _tip(self, press: np.ndarray, scale: float, sunk: float) -> tuple[np.ndarray, np.ndarray]:
        """(4,) m: lowest point and depth of a press (7,); scale: of its depth; sunk: m, of the skin by others; and their derivatives
        (4, 10) by the press's numbers and by errors of its place and depth, m."""
        steps = np.vstack([np.zeros(PRESS + 3), DIFFERENCE * np.eye(PRESS + 3)])
        presses, off = press + steps[:, :PRESS], steps[:, PRESS:]
        radius, pressed = self.calibration.library.plan.radius * np.exp(RADIUS_SPREAD * presses[:, RADIUS]), np.exp(presses[:, DEPTH])
        first = presses[:, [X, Y]] / self.calibration.wider + off[:, :2]
        low = first_touch_height(self._inside(first), radius, self.sensor) - pressed / scale - sunk - off[:, 2]
        place = self._inside(first + pressed[:, None] * presses[:, DRAG])  # where the drag has carried it
        tips = np.column_stack([place, low, first_touch_height(place, radius, self.sensor) - low])
        return tips[0], (tips[1:] - tips[0]).T / DIFFERENCE

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

    def _inside(self, places: np.ndarray) -> np.ndarray:
        """(..., 2) m, the places (..., 2), not beyond the rim."""
        return places * np.minimum(1.0, 0.95 * self.sensor.rim_radius / np.maximum(np.linalg.norm(places, axis=-1, keepdims=True), 1e-9))

    def _wrench(self, press: np.ndarray, position: np.ndarray, radius: float) -> np.ndarray:
        """(6,) m and m^2, wrench at the origin over the shear modulus and thickness: the force acts where the tip first touched it."""
        force = self.solver.library.push(press)
        normal = self.sensor.normal(press[[X, Y]] / (1 + radius / self.calibration.library.plan.cap.curvature_radius))
        return np.concatenate([force, cross(position + [0.0, 0.0, radius] - radius * normal, force)])

    def _by_others(self, found: DomeFound, number: int, radius: float) -> tuple[float, np.ndarray]:
        """What the other presses do to the skin where one touches it: m, by which they lower it, as depth is measured from the untouched
        dome; and the slopes (2,) that they give it."""
        if len(found.presses) == 1:
            return 0.0, np.zeros(2)
        others = np.delete(found.presses, number, axis=0)
        cap = self.calibration.library.plan.cap
        at = found.presses[number, :2] * cap.curvature_radius / (cap.curvature_radius + radius)
        at = at + BESIDE * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
        touch = np.column_stack([at, cap.heights(at)])
        up = self.solver.library.moved(touch, others)[:, 2]
        return -float(up[0]), (up[1::2] - up[2::2]) / (2 * BESIDE)
