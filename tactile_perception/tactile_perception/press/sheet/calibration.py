# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of the sheet model: identification, library of simulated presses, noise and remaining errors."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace

import numpy as np

from ...errors import BadCalibration
from .identification import EyeShifts, SheetNumbers, fit_numbers
from .membrane_fem import SheetMaterial
from .mesh import least_length, may_be_pressed
from .projection import Press
from .reduced_model import LibraryPlan, SheetLibrary, build_library, library_from_numbers, library_numbers
from .solver import FieldNoise, Seen, SheetInverse
from ..presses import Presses
from ..field import MarkerField
from ..sensor import MarkerSensor

DEEPER = 1.15         # simulated depth over the deepest calibrated press. Chosen
LIKELY_RADIUS = 7.5e-3  # m, of a fingertip: start of the fit. Chosen
SCALE = 10e-3         # m, of the mesh at the tip; less on a small sheet. Chosen: about a tip radius
SMALL = 0.4           # of the half side: largest scale. Chosen
STILL = FieldNoise(1e-5, 5e-3, 3e-3, 1.0)  # noise without untouched frames. Chosen
STILL_SHARE = 0.05    # of the depth: markers displaced by less show the model error that comes with depth. Chosen
QUIETEST = FieldNoise(1e-6, 5e-4, 5e-4, 0.1)  # least noise. Chosen
FEWEST_TOUCHING = 6   # presses needed. Chosen
MOST_SQUARES = 9.0    # limit of normalised squared errors: outliers beyond three sigmas count no more
TURN = 5e-3           # rad: prior standard deviation of the print's turn. Chosen: half a pitch over a large sheet
ROUNDS = 3            # of placing the print: the clamp's place makes each step a fifth too long
FINE = {'n': 8, 'order': 4, 'levels': 10, 'substeps': 2}


@dataclass(frozen=True)
class SheetCalibration:
    """library: centred on the calibrated tip radius; material; marker_radius: m; eyes; noise: of fields, with the model error;
    place_error: m, and depth_share: standard deviations of the remaining errors of place, and of depth over depth; place_range: (2, 2) m,
    calibrated minimum and maximum of x and y; deepest: m, calibrated.
    """

    library: SheetLibrary
    material: SheetMaterial
    marker_radius: float
    eyes: EyeShifts
    noise: FieldNoise
    place_error: float
    depth_share: float
    place_range: np.ndarray
    deepest: float

    @property
    def found(self) -> SheetNumbers:
        """The identified parameters."""
        return SheetNumbers(self.library.plan.radius, self.material, self.marker_radius, self.eyes)

    def numbers(self) -> dict:
        """As numbers and arrays, for a calibration file."""
        return {'material': asdict(self.material), 'marker_radius': self.marker_radius, 'eyes': self.eyes.eyes.tolist(),
                'eye_shifts': self.eyes.shifts.tolist(), 'printed': self.eyes.printed.tolist(), 'turned': self.eyes.turned,
                'noise': asdict(self.noise), 'place_error': self.place_error, 'depth_share': self.depth_share,
                'place_range': self.place_range.tolist(), 'deepest': self.deepest, 'library': library_numbers(self.library)}

    @classmethod
    def from_numbers(cls, numbers: Mapping) -> SheetCalibration:
        """From these numbers. Raises BadCalibration where one is missing or invalid."""
        try:
            eyes = EyeShifts(*(np.array(numbers[name], float).reshape(-1, width) for name, width in (('eyes', 3), ('eye_shifts', 2))),
                             np.array(numbers['printed'], float).reshape(2), float(numbers['turned']))
            material = SheetMaterial(**numbers['material'])
            library = library_from_numbers(numbers['library'], material)
            marker_radius, place_error, depth_share, deepest = (
                float(numbers[name]) for name in ('marker_radius', 'place_error', 'depth_share', 'deepest'))
            place_range = np.array(numbers['place_range'], float).reshape(2, 2)
            noise = FieldNoise(**numbers['noise'])
            return cls(library, material, marker_radius, eyes, noise, place_error, depth_share, place_range, deepest)
        except (KeyError, TypeError, ValueError) as error:
            raise BadCalibration(f"the sheet model in the calibration file cannot be read ({error}); run calibrate again") from None


def calibrate_sheet(presses: Presses, sensor: MarkerSensor, known: SheetCalibration | None = None) -> SheetCalibration:
    """Calibrate a sheet from presses by one round tip; known: a calibration whose library and identified parameters are taken. Raises
    BadCalibration where the presses do not determine them.
    """
    if not sensor.is_sheet or presses.touching.sum() < FEWEST_TOUCHING:
        raise BadCalibration(f'the sheet model needs a flat sheet and {FEWEST_TOUCHING} presses at known places, got '
                             f'{presses.touching.sum()} on {sensor.type}')
    half, deepest = np.array(sensor.size) / 2, float(presses.depth.max())
    plan = LibraryPlan(tuple(half.tolist()), LIKELY_RADIUS, DEEPER * deepest, min(SCALE, SMALL * float(half.min())), **FINE)
    usable = presses.touching & may_be_pressed(presses.position[:, :2], half, plan.scale)
    if usable.sum() < FEWEST_TOUCHING:
        raise BadCalibration(f'{usable.sum()} presses are farther than {least_length(plan.scale) * 1e3:.1f} mm from the clamp; '
                             f'{FEWEST_TOUCHING} are needed')
    straight = usable & presses.straight()
    touching = presses.select(straight if straight.sum() >= max(FEWEST_TOUCHING, usable.sum() / 3) else usable)
    numbers = fit_numbers(touching, plan) if known is None else known.found
    library = build_library(replace(plan, radius=numbers.radius), numbers.material) if known is None else known.library
    truths = [Press(position[:2], float(depth)) for position, depth in zip(touching.position, touching.depth)]
    first = SheetInverse(library, STILL, numbers.marker_radius, max(sensor.pitch))
    numbers = replace(numbers, eyes=_placed(numbers.eyes, touching, truths, first))
    still = [numbers.eyes.shifted(field) for field, touched in zip(presses.fields, presses.touching) if not touched]
    fields = [numbers.eyes.shifted(field) for field in touching.fields]
    noise = _noise(still, fields, truths, first)
    inverse = SheetInverse(library, noise, numbers.marker_radius, max(sensor.pitch))
    found = [inverse.solve(Seen(field), [truth]) for field, truth in zip(fields, truths)]
    place_error, depth_share = _remaining_errors(found, truths)
    covered = np.stack([touching.position[:, :2].min(0), touching.position[:, :2].max(0)])
    return SheetCalibration(library, numbers.material, numbers.marker_radius, numbers.eyes, noise, place_error, depth_share, covered,
                            deepest)


def _placed(eyes: EyeShifts, presses: Presses, truths: list[Press], inverse: SheetInverse) -> EyeShifts:
    """eyes with the print where the places of all presses tell it to be: the identification sees a few."""
    from scipy.optimize import least_squares  # calibration alone needs it
    ways = np.array([[[1.0, 0.0, -y], [0.0, 1.0, x]] for x, y in (truth.place for truth in truths)]).reshape(-1, 3)
    for _ in range(ROUNDS):
        found = [inverse.solve(Seen(eyes.shifted(field)), [truth]) for field, truth in zip(presses.fields, truths)]
        error = np.array([one.presses[0].place - truth.place for one, truth in zip(found, truths)])
        spread = max(float(np.median(np.abs(error - np.median(error, axis=0)))), 1e-6)
        off = least_squares(lambda off: np.append((error.ravel() - ways @ off) / spread, off[2] / TURN), np.zeros(3),
                            x_scale=(1e-4, 1e-4, 1e-3), loss='soft_l1').x
        eyes = replace(eyes, printed=eyes.printed - off[:2], turned=eyes.turned - float(off[2]))
    return eyes


def _noise(still: list[MarkerField], fields: list[MarkerField], truths: list[Press], inverse: SheetInverse) -> FieldNoise:
    """Noise of untouched fields, and the model error in proportion to a marker's displacement and to the depth of the press:
    of markers that hardly move, then of all."""
    shift, growth = STILL.shift, STILL.growth
    if still:  # unbiased: their own mean is the reference
        spare = np.sqrt(len(still) / max(len(still) - 1, 1))
        shift = spare * float(np.sqrt(np.nanmean([field.shift**2 for field in still])))
        growth = spare * float(np.sqrt(np.nanmean([field.growth**2 for field in still])))
    rows = []
    for field, truth in zip(fields, truths):
        seen = Seen(field)
        predicted, deformed = inverse.predict([truth], seen)
        excess = (seen.value - predicted)**2 - np.array([shift, shift, growth])**2
        rows.append(np.column_stack([excess, np.sum(deformed[:, 0]**2, axis=1), np.full(len(excess), truth.depth**2)]))
    rows = np.concatenate(rows)
    rows = rows[np.isfinite(rows).all(1)]
    far = rows[rows[:, 3] < STILL_SHARE**2 * rows[:, 4]]
    over = np.maximum(far[:, :3].sum(0) / max(far[:, 4].sum(), 1e-12), 0.0)
    left = np.maximum((rows[:, :3] - over * rows[:, 4:]).sum(0) / rows[:, 3].sum(), 0.0)
    values = FieldNoise(shift, growth, *np.sqrt([left[:2].mean(), left[2], over[:2].mean(), over[2]]))
    return FieldNoise(**{name: float(max(value, getattr(QUIETEST, name))) for name, value in asdict(values).items()})


def _remaining_errors(found: list, truths: list[Press]) -> tuple[float, float]:
    """Standard deviations of place, m, and of depth over depth, beyond the estimates' covariances."""
    error = np.array([inverse.tip(0)[0] - truth.vector[:3] for inverse, truth in zip(found, truths)])
    variance = np.array([np.diag(inverse.tip(0)[1]) for inverse in found])
    depth = np.array([truth.depth for truth in truths])
    place = _extra(error[:, :2].ravel()**2, variance[:, :2].ravel(), np.ones(2 * len(depth)))
    return place, _extra(error[:, 2]**2, variance[:, 2], depth**2)


def _extra(squares: np.ndarray, variance: np.ndarray, scale: np.ndarray) -> float:
    """The s >= 0 for which squares / (variance + s^2 scale), limited to MOST_SQUARES, have mean 1."""
    def over(s: float) -> float:
        return float(np.mean(np.minimum(squares / (variance + s * s * scale), MOST_SQUARES)) - 1)
    largest = float(np.sqrt((squares / scale).max())) * 2 + 1e-12
    from scipy.optimize import brentq  # calibration alone needs it
    return float(brentq(over, 0.0, largest, xtol=1e-9)) if over(0.0) > 0 > over(largest) else 0.0
