# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contacts on a sheet by model inversion.

The result is the presses (one straight, one dragged, or two at once) that best explain the marker field, starting from a coarse position by
a matched filter.
"""
from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from ... import _core
from ...common.geometry import cross
from ...common.marker_sensor import MarkerSensor
from ..constants import PRESS, SHEET
from ..estimate import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE, Choice, Evidence, TouchEstimate
from ..field import MarkerField
from .library import Press, SheetLibrary, vectors


@dataclass(frozen=True)
class FieldNoise:
    """Standard deviations of a field.

    shift, m, and growth: of an untouched field; share_shift and share_growth (1/m): model error over a marker's displacement, m;
    depth_shift and depth_growth (1/m): over the depth of the press, m.
    """

    shift: float
    growth: float
    share_shift: float
    share_growth: float
    depth_shift: float = 0.0
    depth_growth: float = 0.0


@dataclass(frozen=True)
class Inverse:
    """Result of a fit of T presses.

    covariance: (6 T, 6 T) of their vectors, with one more row for the interaction factor of two; misfit: mean squared normalised residual
    (about 1); expected: misfit expected with the error of drags, over 1; wrenches: (T, 9) log of normal force over depth, tangential over
    normal force, moment about the tip over normal force, m, and centre of the pressure relative to the tip, m; mixed: the interaction
    factor, 0 for one press.
    """

    presses: list[Press]
    covariance: np.ndarray
    misfit: float
    expected: float
    wrenches: np.ndarray
    mixed: float = 0.0

    @property
    def radius(self) -> tuple[float, float]:
        """Log radius of the first press, and its standard deviation."""
        return self.presses[0].log_radius, float(np.sqrt(self.covariance[3, 3]))

    def is_sure(self, k: int) -> bool:
        """Whether the markers show press k, whose depth may still be uncertain, as in drags."""
        (*_, depth), covariance = self.tip(k)
        return bool(depth > SHEET.sure * np.sqrt(covariance[2, 2]))

    def tip(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Position and depth (3,), m, of press k as if it were alone, and their covariance (3, 3), scaled by a misfit above 1."""
        part = slice(6 * k, 6 * k + 3)
        return self.presses[k].vector[:3], self.covariance[part, part] * max(self.misfit, 1.0)


class Seen:
    """The N visible markers of a field: rest (N, 2), camera_centre (N, 3), value (N, 3) shift and growth, NaN if unknown.

    motion: (N, 3), change of value since the last frame of the markers that a second camera observes at another time; they may be late by
    an unknown share of it.
    """

    def __init__(self, field: MarkerField, motion: np.ndarray | None = None):
        self.index = np.flatnonzero(field.seen & np.isfinite(field.camera_centre).all(1))
        self.rest, self.camera_centre = field.rest[self.index], field.camera_centre[self.index]
        self.value = np.column_stack([field.shift[self.index], field.growth[self.index]])
        self.motion = np.zeros((len(self.index), 3)) if motion is None else motion[self.index]


class SheetInverse:
    """Fits presses to marker fields. marker_radius: m; pitch: m, of the markers."""

    def __init__(self, library: SheetLibrary, noise: FieldNoise, marker_radius: float, pitch: float):
        self._library, self._disc = library, MarkerDisc(marker_radius, SHEET.disc_pitches * pitch)
        self._noise = _core.press.MarkerNoise(**vars(noise))

    def solve(self, seen: Seen, start: list[Press], drags: bool = False, tip: tuple[float, float] = (0.0, SHEET.tip)) -> Inverse:
        """Fit one press or two from start.

        drags: whether their drags are unknown, else 0; tip: prior mean and standard deviation of the log of the radius over the calibrated
        one.
        """
        markers = _core.press.SheetMarkers(rest=seen.rest, camera_centre=seen.camera_centre, **self._disc._asdict())
        prior = _core.press.SheetPrior(log_radius=tip[0], sigma=tip[1], drags=drags)
        frame = _core.press.SheetFrame(value=seen.value, motion=seen.motion)
        found = self._library.table.fit(markers, frame, self._noise, prior, vectors(start))
        return Inverse([Press.of(one) for one in found.presses], found.covariance, found.misfit, found.expected, found.wrenches,
                       found.interaction)

    def predict(self, presses: list[Press], seen: Seen, mixed: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Predicted shift and growth (N, 3), and the displacement with its derivatives by x and y (N, 3, 3)."""
        return show(self._library, presses, seen.rest, seen.camera_centre, mixed, self._disc)


class MarkerDisc(NamedTuple):
    """radius: m, of the markers; near: m, distance from a press within which markers are discs, else points."""

    radius: float = 0.0
    near: float = 0.0


def show(library: SheetLibrary, presses: list[Press], rest: np.ndarray, camera_centre: np.ndarray, mixed: float = 0.0,
         disc: MarkerDisc = MarkerDisc()) -> tuple[np.ndarray, np.ndarray]:
    """Predict shift, m, and growth (N, 3) of markers at rest (N, 2), m, observed from camera_centre (N, 3), m, under one press or two.

    mixed: interaction factor of two presses. Also returns the displacement of the sheet there with its derivatives by x and y (N, 3, 3).
    """
    markers = _core.press.SheetMarkers(rest=rest, camera_centre=camera_centre, **disc._asdict())
    shown = library.table.show(markers, vectors(presses), mixed)
    return shown.value, shown.shape.reshape(-1, 3, 3)


class SheetStart:
    """Matches fields of one marker pattern with templates. shift, m, growth: standard deviations of an untouched field."""

    def __init__(self, library: SheetLibrary, shift: float, growth: float):
        self._library, self._sigma = library, np.array([shift, shift, growth])
        x, y = (np.linspace(-0.95, 0.95, count) * reach for count, reach in zip(SHEET.template_grid, library.plan.reach))
        positions = np.stack(np.meshgrid(x, y, indexing='ij'), axis=-1).reshape(-1, 2)
        self._presses = [Press(position, depth * library.plan.depth) for position in positions for depth in SHEET.template_depths]
        self._seen = np.zeros((0, 5))

    def best(self, field: MarkerField) -> tuple[Press, float]:
        """Find the best matching press, with its depth scaled to the match, and the match in standard deviations.

        The standard deviation is that of the noise or of the residual, whichever is larger.
        """
        value, count = self._values(field)
        match = self._fields @ value
        score = match / self._lengths
        k = int(np.argmax(score))
        start, best = self._presses[k], float(score[k])
        depth = min(max(start.depth * best / float(self._lengths[k]), 1e-5), self._library.plan.depth)
        residual = (float(value @ value) - best**2) / max(count, 1)
        return Press(start.position, depth), best / np.sqrt(max(residual, 1.0))

    def best_pair(self, field: MarkerField) -> list[Press]:
        """Find the two templates of the second depth whose scaled fields best add up to the field, as if all markers were visible."""
        fields = self._fields[1::len(SHEET.template_depths)]
        match = fields @ self._values(field)[0]
        if self._gram is None:
            gram = (fields @ fields.T).astype(float)
            own = np.diag(gram) + 1e-9
            determinant = np.maximum(own[:, None] * own - gram**2, 1e-3 * own[:, None] * own)  # similar templates cannot be separated
            self._gram = gram, own, determinant
        gram, own, determinant = self._gram
        share = (match[:, None] * own - gram * match) / determinant  # of the first of each pair
        reported = np.where((share > 0) & (share.T > 0), share * match[:, None] + share.T * match, 0.0)
        first, second = np.unravel_index(np.argmax(reported), reported.shape)
        presses = self._presses[1::len(SHEET.template_depths)]
        return [replace(presses[k], depth=float(np.clip(presses[k].depth * share[k, other], 1e-5, self._library.plan.depth)))
                for k, other in ((first, second), (second, first))]

    def _values(self, field: MarkerField) -> tuple[np.ndarray, int]:
        """Shift and growth (3 K,) of all markers over their noise, 0 if unknown, and how many are known."""
        self._update_templates(field)
        value = (np.column_stack([field.shift, field.growth]) / self._sigma).ravel()
        known = np.isfinite(value) & self._shown
        if not np.array_equal(known, self._known):
            self._known = known
            self._lengths = np.sqrt(np.maximum(self._fields**2 @ known.astype(np.float32), 1e-9))
        return np.where(known, value, 0.0).astype(np.float32), np.count_nonzero(known)

    def _update_templates(self, field: MarkerField) -> None:
        """Recompute the templates if markers or camera centres changed; a marker that is not visible keeps its last position."""
        seen = np.column_stack([field.rest, field.camera_centre])
        if len(seen) == len(self._seen):
            seen = np.where(np.isfinite(seen), seen, self._seen)
            if ((np.abs(seen - self._seen) <= SHEET.max_template_shift) | np.isnan(seen)).all():
                return
        self._seen, shown = seen, np.isfinite(seen).all(1)
        fields = np.zeros((len(self._presses), len(field), 3))
        for k, one in enumerate(self._presses):
            fields[k, shown] = show(self._library, [one], seen[shown, :2], seen[shown, 2:])[0] / self._sigma
        self._shown, self._known, self._gram = np.repeat(shown, 3), np.zeros(0, bool), None
        self._fields = fields.reshape(len(fields), -1).astype(np.float32)


@dataclass(frozen=True)
class CameraShifts:
    """Corrections of camera centres and print.

    camera_centres: (G, 3) m, camera centres of the views; shifts: (G, 2) m, their corrections in x and y; printed, (2,) m, and turned, rad:
    shift and rotation about the centre of the printed markers relative to their nominal positions, on which all views are based.
    """

    camera_centres: np.ndarray
    shifts: np.ndarray
    printed: np.ndarray = field(default_factory=partial(np.zeros, 2))
    turned: float = 0.0

    @classmethod
    def of(cls, seen: MarkerField) -> CameraShifts:
        """Zero shifts for the camera centres of a field; centres within a tenth of their distance to the sheet are one camera."""
        camera_centres: list[np.ndarray] = []
        for camera_centre in seen.camera_centre[np.isfinite(seen.camera_centre).all(1)]:
            if not any(np.linalg.norm(camera_centre - known) < 0.1 * abs(camera_centre[2]) for known in camera_centres):
                camera_centres.append(camera_centre)
        return cls(np.array(camera_centres).reshape(-1, 3), np.zeros((len(camera_centres), 2)))

    @cached_property
    def _turn(self) -> np.ndarray:
        """Rotation (2, 2) of row vectors by turned."""
        cosine, sine = np.cos(self.turned), np.sin(self.turned)
        return np.array([[cosine, sine], [-sine, cosine]])

    def shifted(self, field: MarkerField) -> MarkerField:
        """The field with corrected camera centres, in the frame of the sheet."""
        turn, camera_centre = self._turn, field.camera_centre.copy()
        camera_centre[:, :2] = (camera_centre[:, :2] + self.shifts[self.number(field)]) @ turn + self.printed
        return replace(field, camera_centre=camera_centre, rest=field.rest @ turn + self.printed, shift=field.shift @ turn)

    def number(self, field: MarkerField) -> np.ndarray:
        """Number (K,) of the camera that observes each marker of a field with uncorrected camera centres."""
        if len(self.camera_centres) == 1:
            return np.zeros(len(field), int)
        return np.argmin(np.square(field.camera_centre[:, None] - self.camera_centres).sum(axis=2), axis=1)


@dataclass(frozen=True)
class SheetCalibration:
    """Calibration of the sheet model.

    Attributes
    ----------
    library : SheetLibrary
        Simulated presses, centred on the calibrated tip radius.
    marker_radius : float
        Radius of the markers in m.
    camera_centres : CameraShifts
        Corrected camera centres.
    noise : FieldNoise
        Noise of fields, with the model error.
    place_error, depth_share : float
        Standard deviations of the remaining errors of position, in m, and of depth over depth.
    place_range : ndarray, shape (2, 2)
        Calibrated minimum and maximum of x and y in m.
    deepest : float
        Largest calibrated depth in m.
    """

    library: SheetLibrary
    marker_radius: float
    camera_centres: CameraShifts
    noise: FieldNoise
    place_error: float
    depth_share: float
    place_range: np.ndarray
    deepest: float


class SheetModelMethod:
    """The 'model' method for sheets: inversion of membrane mechanics (mechanics.py, library.py)."""

    def __init__(self, calibration: SheetCalibration, sensor: MarkerSensor):
        self._calibration = calibration
        library, noise = calibration.library, calibration.noise
        inverse = SheetInverse(library, noise, calibration.marker_radius, max(sensor.pitch))
        self._start = SheetStart(library, noise.shift, noise.growth)
        self._inverse, self._choice = inverse, Choice()
        self._margin = np.array(sensor.pitch)
        self._before: np.ndarray | None = None
        self._is_in_contact = False

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """Estimate the contacts of one frame; empty without contact.

        Two cameras may expose at different times, so that the first frame of a contact is skipped if no press explains it. Of earlier
        frames, only the drag and the motion of the second camera's markers are used.
        """
        motion = self._motion(field)
        begins, self._is_in_contact = not self._is_in_contact, False
        if field.seen.sum() < PRESS.min_markers:
            self._choice = Choice()
            return []
        field = self._calibration.camera_centres.shifted(field)
        best, score = self._start.best(field)
        if score < SHEET.stands_out and not self._choice.dragged:  # a drag continues although the field matches no straight press
            self._choice = Choice()
            return []
        self._is_in_contact = True
        found = self._explained(field, [best], motion)
        if begins and motion is not None and found.misfit > SHEET.strange:
            return []
        touches = [self._touch(found, k) for k in range(len(found.presses)) if found.is_sure(k)]
        touches = [touch for touch in touches if self._is_seen(touch, field)]
        if score < SHEET.stands_out:  # the residual field of a contact that has ended may be fitted by a very shallow press
            touches = [touch for touch in touches if touch.depth > SHEET.sure * touch.depth_sigma]
            if not touches:
                self._choice = Choice()
        if len(found.presses) == len(touches) == 1:
            touches = [replace(touches[0], wrench=_wrench_of(found, touches[0].position))]
        return touches

    def _explained(self, field: MarkerField, start: list[Press], motion: np.ndarray | None) -> Inverse:
        """Find the presses that explain a field; start: of one press."""
        seen = Seen(field, motion)

        def two() -> Inverse:
            """Fit two presses from those of the last frame, else straight from the best pair of starts and then dragged."""
            if self._choice.two is not None:
                return self._inverse.solve(seen, self._choice.two, drags=True)
            straight = self._inverse.solve(seen, self._start.best_pair(field))
            if not (straight.is_sure(0) and straight.is_sure(1)):
                return straight
            return self._inverse.solve(seen, straight.presses, drags=True)  # each moves the sheet under the other

        def one(start: list[Press], dragged: bool) -> Inverse:
            return self._inverse.solve(seen, start, dragged, dragged and self._choice.radius or (0.0, SHEET.tip))

        return self._choice.explain(Evidence(seen.value.size, SHEET.ordinary), one, start, two)

    def _is_seen(self, touch: TouchEstimate, field: MarkerField) -> bool:
        """Whether markers around a contact are visible: if it starts between two exposures, one camera may show none."""
        distance = np.abs(field.rest[field.seen] - touch.position[:2]) / self._margin
        return bool(distance.max(axis=1).min() < SHEET.unseen)

    def _motion(self, field: MarkerField) -> np.ndarray | None:
        """Change (K, 3) of shift and growth since the last frame of markers that a second camera observes, else 0; None with one camera."""
        if len(self._calibration.camera_centres.camera_centres) < 2:
            return None
        now, before = np.column_stack([field.shift, field.growth]), self._before
        self._before = now
        moved = np.zeros_like(now) if before is None or len(before) != len(now) else np.nan_to_num(now - before)
        return np.where((self._calibration.camera_centres.number(field) > 0)[:, None], moved, 0.0)

    def _touch(self, found: Inverse, k: int) -> TouchEstimate:
        calibration, press, scale = self._calibration, found.presses[k], self._calibration.library.plan.radius
        (x, y, depth), covariance = found.tip(k)
        position, radius = np.array([x, y, -depth]), float(scale * np.exp(press.log_radius))
        if len(found.presses) == 1:  # change of x, y and depth for an error of the radius by the model
            shift = SHEET.radius[any(press.drag)] * found.covariance[:3, 3] / found.covariance[3, 3]
            covariance = covariance + np.outer(shift, shift)
        else:
            position, depth = self._centre(found, k, radius)
            lacks = np.array(SHEET.apart)[[0, 0, 1]] * scale
            covariance = covariance + np.diag(lacks**2 * max(found.misfit - 1.0, 0.0))
        aside, deeper = np.maximum(np.hypot(*press.drag) * np.array(SHEET.dragged), SHEET.floor) * scale
        aside = np.hypot(aside, calibration.place_error)
        extra = np.array([aside, aside, np.hypot(deeper, calibration.depth_share * depth)])
        turned = np.diag([1.0, 1.0, -1.0])  # deeper is lower
        covariance = turned @ (covariance + np.diag(extra**2)) @ turned
        flags = self._flags(np.append(position[:2], depth)) | AMBIGUOUS * (found.misfit > SHEET.unexplained)
        return TouchEstimate(position, float(depth), covariance, float(np.sqrt(covariance[2, 2])), radius, flags)

    def _centre(self, found: Inverse, k: int, radius: float) -> tuple[np.ndarray, float]:
        """Centre (3,), m, of the contact of one of two presses, and its depth, m.

        The other press inclines the sheet, so that the lowest point lies downhill of the contact.
        """
        press, library = found.presses[k], self._calibration.library
        camera_centre = np.array([[*press.position, -1.0]])
        whole, alone = (show(library, presses, press.position[None], camera_centre, found.mixed)[1][0]
                        for presses in (found.presses, [press]))
        slope, aside, sunk = (whole - alone)[1:, 2], (whole - alone)[0, :2], -(whole - alone)[0, 2]
        centre = found.wrenches[k, 6:]
        depth = press.depth + sunk + 0.5 * radius * slope @ slope
        height = centre[2] - depth + slope @ (0.5 * (radius - centre[2]) * slope + centre[:2])
        return np.append(press.position + aside + centre[:2] - centre[2] * slope, height), depth

    def _flags(self, tip: np.ndarray) -> int:
        low, high = self._calibration.place_range
        outside = (tip[:2] < low - self._margin).any() or (tip[:2] > high + self._margin).any()
        flags = OUT_OF_RANGE if outside or tip[2] > PRESS.max_relative_depth * self._calibration.deepest else 0
        return flags | (AT_EDGE if (np.abs(tip[:2]) >= SHEET.max_relative_reach * self._calibration.library.plan.reach).any() else 0)


def _wrench_of(found: Inverse, position: np.ndarray) -> np.ndarray:
    """Wrench (6,) at the origin, over shear modulus and thickness, m and m^2, of one press with its tip at position (3,), m."""
    stiffness, x, y, *about = found.wrenches[0, :6]
    push = found.presses[0].depth * np.exp(stiffness)
    force = push * np.array([x, y, -1.0])
    return np.concatenate([force, cross(position, force) + push * np.array(about)])
