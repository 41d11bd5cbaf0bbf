# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contacts on a sheet by model inversion.

The result is the presses (one straight, one dragged, or two at once) that best explain the marker field, starting from a coarse position by
a matched filter.
"""
from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ... import _core
from ...common.marker_sensor import MarkerSensor
from ..constants import SHEET
from ..estimate import TouchEstimate, constants_of, estimates_of
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

    def tip(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Position and depth (3,), m, of press k as if it were alone, and their covariance (3, 3), scaled by a misfit above 1."""
        part = slice(6 * k, 6 * k + 3)
        return self.presses[k].vector[:3], self.covariance[part, part] * max(self.misfit, 1.0)


class Seen:
    """The N visible markers of a field: rest (N, 2), camera_centre (N, 3), value (N, 3) shift and growth, NaN if unknown."""

    def __init__(self, field: MarkerField):
        index = np.flatnonzero(field.seen & np.isfinite(field.camera_centre).all(1))
        self.rest, self.camera_centre = field.rest[index], field.camera_centre[index]
        self.value = np.column_stack([field.shift[index], field.growth[index]])


class SheetInverse:
    """Fits presses to marker fields. marker_radius: m; pitch: m, of the markers."""

    def __init__(self, library: SheetLibrary, noise: FieldNoise, marker_radius: float, pitch: float):
        self._library, self._disc = library, MarkerDisc(marker_radius, SHEET.disc_pitches * pitch)
        self._noise = _core.press.MarkerNoise(**vars(noise))

    def solve(self, seen: Seen, start: list[Press]) -> Inverse:
        """Fit straight presses from start."""
        markers = _core.press.SheetMarkers(rest=seen.rest, camera_centre=seen.camera_centre, **self._disc._asdict())
        prior = _core.press.SheetPrior(log_radius=0.0, sigma=SHEET.tip, drags=False)
        frame = _core.press.SheetFrame(value=seen.value, motion=np.zeros_like(seen.value))
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

    @property
    def kernel(self) -> _core.press.CameraShifts:
        """The same, for kernels."""
        return _core.press.CameraShifts(**{name: np.array(value) for name, value in vars(self).items()} | {'turned': self.turned})

    def shifted(self, field: MarkerField) -> MarkerField:
        """The field with corrected camera centres, in the frame of the sheet."""
        rest, shift, camera_centre = self.kernel.shifted(field.rest, field.shift, field.camera_centre)
        return replace(field, rest=rest, shift=shift, camera_centre=camera_centre)


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
    """The 'model' method for sheets: inversion of membrane mechanics (mechanics.py, library.py), src/press/sheet_method.hpp."""

    def __init__(self, calibration: SheetCalibration, sensor: MarkerSensor):
        plan, (lowest, highest) = calibration.library.plan, calibration.place_range
        device = _core.press.SheetDevice(
            shifts=calibration.camera_centres.kernel, noise=_core.press.MarkerNoise(**vars(calibration.noise)), tip_radius=plan.radius,
            marker_radius=calibration.marker_radius, place_error=calibration.place_error, depth_share=calibration.depth_share,
            deepest=calibration.deepest, pitch=np.array(sensor.pitch), lowest=lowest, highest=highest)
        x, y = (np.linspace(-0.95, 0.95, count) * reach for count, reach in zip(SHEET.template_grid, plan.reach))
        templates = np.stack(np.meshgrid(x, y, np.array(SHEET.template_depths) * plan.depth, indexing='ij'), axis=-1).reshape(-1, 3)
        rules = constants_of(_core.press.SheetRules, SHEET)
        self._kernel = _core.press.SheetMethod(calibration.library.table, device, rules, templates, len(SHEET.template_depths))

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """Estimate the contacts of one frame; empty without contact."""
        return estimates_of(self._kernel.estimate(field.rest, field.shift, field.growth, field.camera_centre))

    def score(self, field: MarkerField) -> float:
        """Match of a field with that of a press, in standard deviations."""
        return self._kernel.score(field.rest, field.shift, field.growth, field.camera_centre)
