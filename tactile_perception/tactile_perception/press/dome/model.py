# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contacts on a dome from its mechanics.

The result is the one or two presses, straight or dragged, that best explain a frame (src/press/dome_fit.cpp), from the best match in a
table of starts.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ... import _core
from ...common.marker_sensor import MarkerSensor
from ...core.errors import BadArgument
from ..constants import DOME
from ..estimate import TouchEstimate, constants_of, estimates_of
from ..field import MarkerField
from .library import DomeLibrary
from .mechanics import centres_of, seen_at

DEPTH = 2  # number of a press, its log depth: see _core.press.DomeLibrary


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


def dragged_press() -> _core.press.DomePrior:
    """Prior of a dragged press. It rotates the friction of the press into the drag, so that none of it remains once the tip slips."""
    drag, friction = DOME.dragged
    return _core.press.DomePrior(drag=drag, friction=friction, tip_sigma=DOME.tip_sigma)


def two_presses() -> _core.press.DomePrior:
    """Prior of two: the more one is dragged by the other or slips, the less else the markers determine; gas and tension are shared."""
    drag, friction, together = DOME.two
    return _core.press.DomePrior(drag=drag, friction=friction, tip_sigma=DOME.tip_sigma, together=together)


class DomeInverse:
    """Fits presses to fields.

    points, camera_centres: (K, 3) m, untouched markers and their cameras, NaN if unknown; plane_z: m; pitch: m, of the markers.
    """

    def __init__(self, library: DomeLibrary, noise: FieldNoise, points: np.ndarray, camera_centres: np.ndarray, plane_z: float,
                 pitch: float):
        self.library, self.noise, self.points, self._plane_z = library, noise, np.array(points, float), plane_z
        self._camera_centres = np.array(np.nan_to_num(camera_centres), float)
        self._rest = seen_at(self.points, self._camera_centres, plane_z)
        self.markers = _core.press.DomeMarkers(points=self.points, camera_centres=self._camera_centres, plane_z=plane_z,
                                               smooth=_polynomials(self._rest))
        self.errors = _core.press.DomeErrors(**vars(noise), alike=DOME.alike, not_linear=DOME.not_linear[0],
                                             longest=np.array(DOME.max_steps))

    def appear(self, presses: np.ndarray) -> np.ndarray:
        """Apparent displacements (K, 2), m, under presses (n, 7); 0 for markers at unknown positions."""
        moved = self.library.moved(self.points, presses)
        return np.nan_to_num(seen_at(self.points + moved, self._camera_centres, self._plane_z) - self._rest)

    def solve(self, field: MarkerField, starts: np.ndarray, prior: _core.press.DomePrior | None = None) -> _core.press.DomeFit:
        """Fit presses to a field, from starts (n, 7); prior: that of a straight press if not given."""
        return self.library.kernel.fit(self.markers, self.errors, prior or straight_press(), field.shift, starts)


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

    @property
    def scales(self) -> _core.press.DomeScales:
        """Scales and errors of fitted presses, for kernels."""
        names = [name for name in dir(_core.press.DomeScales) if name in vars(self)]
        return _core.press.DomeScales(reach=self.library.plan.reach, **{name: getattr(self, name) for name in names})

    def depth_scale(self, position: np.ndarray, depth: float) -> float:
        """Fitted depth over the true one at a position (2,), m, for a fitted depth, m."""
        return self.scales.depth_scale(position, depth, DOME.shallow)


def shallowness(depth: np.ndarray, deepest: float) -> np.ndarray:
    """Shallowness (...) of fitted depths (...), m: 1 up to DOME.shallow of the deepest, above it inversely proportional to depth."""
    return DOME.shallow * deepest / np.maximum(depth, DOME.shallow * deepest)


class DomeModelMethod:
    """The 'model' method for domes: src/press/dome_method.hpp."""

    def __init__(self, calibration: DomeCalibration, sensor: MarkerSensor):
        library, self.solver = calibration.library, calibration.inverse(sensor)
        device = _core.press.DomeDevice(
            markers=self.solver.markers, errors=self.solver.errors, surface=sensor.surface, scales=calibration.scales,
            straight=straight_press(), dragged=dragged_press(), two=two_presses(), pitch=max(sensor.pitch))
        self._kernel = _core.press.DomeMethod(library.kernel, library.pushes, device, constants_of(_core.press.DomeRules, DOME),
                                              _starts(library))
        self._last: MarkerField | None = None  # whose presses the kernel knows

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """Estimate the contacts of one frame; empty without contact, and if the markers move too little to determine a position.

        Raises BadArgument for another pattern.
        """
        self._check(field)
        self._last = field
        return estimates_of(self._kernel.estimate(field.rest, field.shift))

    def score(self, field: MarkerField) -> float:
        """Match of a field with that of a press, in standard deviations."""
        return self._kernel.score(field.shift)

    def raised(self, field: MarkerField) -> np.ndarray | None:
        """Upward displacements (K,), m, of the markers; None without contact. Uses the solution of estimate if it is of this field."""
        if self._last is not field:
            self._check(field)
            self._kernel.find(field.rest, field.shift)
            self._last = field
        return self._kernel.raised()

    def _check(self, field: MarkerField) -> None:
        if len(field) != len(self.solver.points):
            raise BadArgument(f'calibrated for {len(self.solver.points)} markers, got a field of {len(field)}')
