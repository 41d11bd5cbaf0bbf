# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of the sheet model: identification, library of simulated presses, noise and remaining errors."""
from __future__ import annotations

import dataclasses
import logging
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np

from ...common.progress import in_parallel
from ...errors import BadCalibration
from ..field import MarkerField, marker_radii
from ..identification import Prior, identify
from ..presses import SAME_PLACE, Presses
from ..sensor import MarkerSensor
from .fit import FieldNoise, Seen, SheetInverse
from .library import LibraryPlan, Press, SheetLibrary, build_library, field_appearance, library_from_numbers, library_numbers
from .mechanics import SheetMaterial, SheetMesh, least_length, may_be_pressed, press_sheet, uniform

@dataclass(frozen=True)
class CameraShifts:
    """camera_centres: (G, 3) m, camera centres of the views; shifts: (G, 2) m, their corrections in x and y; printed: (2,) m, and turned:
    rad, where on the sheet the printed markers are relative to their nominal places, on which all views are based: turned about the
    centre, then shifted."""

    camera_centres: np.ndarray
    shifts: np.ndarray
    printed: np.ndarray = dataclasses.field(default_factory=partial(np.zeros, 2))
    turned: float = 0.0

    @classmethod
    def of(cls, seen: MarkerField) -> CameraShifts:
        """Zero shifts for the camera centres of a field; camera centres within a tenth of their distance to the sheet are one camera."""
        camera_centres: list[np.ndarray] = []
        for camera_centre in seen.camera_centre[np.isfinite(seen.camera_centre).all(1)]:
            if not any(np.linalg.norm(camera_centre - known) < 0.1 * abs(camera_centre[2]) for known in camera_centres):
                camera_centres.append(camera_centre)
        return cls(np.array(camera_centres).reshape(-1, 3), np.zeros((len(camera_centres), 2)))

    def shifted(self, field: MarkerField) -> MarkerField:
        """The field with corrected camera centres, in the frame of the sheet."""
        cosine, sine = np.cos(self.turned), np.sin(self.turned)
        turn, camera_centre = np.array([[cosine, sine], [-sine, cosine]]), field.camera_centre.copy()
        camera_centre[:, :2] = (camera_centre[:, :2] + self.shifts[self.number(field)]) @ turn + self.printed
        return replace(field, camera_centre=camera_centre, rest=field.rest @ turn + self.printed, shift=field.shift @ turn)

    def number(self, field: MarkerField) -> np.ndarray:
        """(K,) number of the camera that sees each marker of a field with uncorrected camera centres."""
        return np.argmin(np.square(field.camera_centre[:, None] - self.camera_centres).sum(axis=2), axis=1)


MOST_PLACES = 3        # used for the fit. Chosen: its time is in proportion
COARSE = {'n': 7, 'levels': 7, 'substeps': 2}  # mesh and steps of the identification, but for its end
UNSOLVED = 3.0         # normalised residual of presses whose simulation does not converge. Chosen
SHIFT, GROWTH = 1e-5, 4e-3  # m and 1: model error of a marker's position and log area, beside its noise. Chosen
SHARE = 2e-3           # model error over depth (of growth: per mm). Chosen
#: Logs of radius, m, prestretch over 1, friction and bending, m^2: mean and standard deviation, of a rubber sheet and a fingertip
LIKELY = np.log([7.5e-3, 0.03, 0.5, 2.5e-7]), np.array([0.7, 0.7, 0.5, 0.7])
STARTS = ((1.0, 1.0, 1.0, 1.0), (1.0, 3.0, 1.0, 5.0), (1.0, 10.0, 0.7, 20.0))  # times the likely ones: a thin sheet to a thick one. Chosen
FARTHEST = 5.0         # standard deviations of the prior within which every value stays. Chosen
PLACED = 3e-4          # m: prior standard deviation of the shifts of camera centres and print. Chosen
LAST = 2               # evaluations on the plan's mesh

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class SheetNumbers:
    """radius: m, of the calibrated tip; material; marker_radius: m; camera_centres: camera positions."""

    radius: float
    material: SheetMaterial
    marker_radius: float
    camera_centres: CameraShifts

    def summary(self) -> str:
        """For the log."""
        return (f'tip {self.radius * 1e3:.2f} mm, prestretch {self.material.prestretch:.3f}, friction {self.material.friction:.2f}, '
                f'bending {self.material.bending:.1e} m^2')


def fit_numbers(presses: Presses, plan: LibraryPlan) -> SheetNumbers:
    """Maximum a posteriori parameters for the presses, with a weak prior for a rubber sheet and a fingertip: on a coarse mesh, and from
    there on the plan's.

    Raises BadCalibration where there are no presses within plan.reach, or the simulation does not converge.
    """
    groups, first = chosen_places(presses, plan), presses.fields[0]
    camera_centres, radii = CameraShifts.of(first), marker_radii(first)[np.isfinite(marker_radii(first))]
    marker = float(np.median(radii)) if len(radii) else 0.0
    mean, sigma = (np.append(known, np.full(camera_centres.shifts.size + 2, unknown)) for known, unknown in zip(LIKELY, (0.0, PLACED)))
    prior = Prior(mean, sigma, mean - FARTHEST * sigma, mean + FARTHEST * sigma)
    starts = [mean + np.append(np.log(times), np.zeros(len(mean) - 4)) for times in STARTS]
    coarse = _NumbersFit(groups, marker, replace(plan, **{name: min(value, getattr(plan, name)) for name, value in COARSE.items()}),
                         camera_centres)
    found, cost = identify(coarse.residuals, starts, prior)
    _log.info('sheet identification: %s, cost %.3g', coarse.numbers(found).summary(), cost)
    fine = _NumbersFit(groups, marker, plan, camera_centres)
    return fine.numbers(identify(fine.residuals, [found], prior, LAST)[0])


def chosen_places(presses: Presses, plan: LibraryPlan) -> list[Presses]:
    """Presses at up to MOST_PLACES places, far apart when mirrored into one quarter of the sheet, each by rising depth."""
    place = np.where(np.abs(presses.position[:, :2] / plan.reach).max(1) <= 1, presses.places(), -1)
    groups = [presses.select(place == number) for number in np.unique(place[place >= 0])]
    if not groups:
        raise BadCalibration(f'no press within {plan.reach * 1e3} mm of the centre; press farther from the clamp')
    folded = np.array([np.abs(group.position[0, :2]) / plan.reach for group in groups])
    chosen = [int(np.argmin(folded.sum(1)))]
    while len(chosen) < min(MOST_PLACES, len(groups)):
        apart = np.linalg.norm(folded[:, None] - folded[chosen], axis=2).min(1)
        if apart.max() * plan.reach.min() < SAME_PLACE:
            break
        chosen.append(int(np.argmax(apart)))
    return [_by_depth(groups[k]) for k in chosen]


def _by_depth(group: Presses) -> Presses:
    """One press for each depth, by rising depth."""
    depth, first = np.unique(np.round(group.depth, 5), return_index=True)
    keep = np.zeros(len(group), bool)
    keep[first] = True
    group = group.select(keep)
    order = np.argsort(group.depth)
    return replace(group, fields=tuple(group.fields[k] for k in order),
                   **{name: getattr(group, name)[order] for name in ('position', 'depth', 'segment', 'wrench', 'radius')})


class _NumbersFit:
    """Residuals of presses at a few places; values are the logs of radius, prestretch over 1, friction and bending, then the shifts of the
    camera centres and of the print."""

    def __init__(self, groups: list[Presses], marker: float, plan: LibraryPlan, camera_centres: CameraShifts):
        self.camera_centres, self._groups, self._marker, self._plan = camera_centres, groups, marker, plan
        self._solved: dict[tuple, list] = {}  # fields of the groups by the first four values: shifts need no simulation

    def numbers(self, values: np.ndarray) -> SheetNumbers:
        """What values mean."""
        radius, stretch, friction, bending = (float(value) for value in np.exp(values[:4]))
        camera_centres = replace(self.camera_centres, shifts=values[4:-2].reshape(-1, 2), printed=values[-2:])
        return SheetNumbers(radius, SheetMaterial(1 + stretch, bending, friction), self._marker, camera_centres)

    def residuals(self, several: list[np.ndarray]) -> list[np.ndarray]:
        """The normalised residual (N,) at each of several values. Raises BadCalibration where no simulation converges."""
        wanted = {tuple(values[:4]): self.numbers(values) for values in several}
        new = {key: numbers for key, numbers in wanted.items() if key not in self._solved}
        solved = in_parallel(partial(_solve, self._plan), [(numbers, group) for numbers in new.values() for group in self._groups],
                             'places simulated for the identification')
        count = len(self._groups)
        self._solved = {key: self._solved[key] for key in wanted if key in self._solved} | {
            key: solved[count * k:count * (k + 1)] for k, key in enumerate(new)}
        return [self._residual(self.numbers(values), self._solved[tuple(values[:4])]) for values in several]

    def _residual(self, numbers: SheetNumbers, solved: list[np.ndarray]) -> np.ndarray:
        parts = [self._part(numbers.camera_centres.shifted(field), depth, pressed, group.position[0, :2])
                 for group, fields in zip(self._groups, solved)
                 for field, depth, pressed in zip(group.fields, group.depth, fields)]
        residual = np.concatenate(parts, axis=None)
        if np.isinf(residual).all():
            raise BadCalibration(f'the simulation of these presses with {numbers} does not converge; check size, depths and markers')
        residual = np.where(np.isinf(residual), UNSOLVED, residual)
        return residual * np.minimum(1, np.sqrt(3 / np.maximum(np.abs(residual), 3)))  # robust: by the root beyond 3 sigma

    def _part(self, field: MarkerField, depth: float, pressed: np.ndarray, place: np.ndarray) -> np.ndarray:
        seen, radius = field.seen, self._marker
        rest = field.rest[seen]
        shown = field_appearance(pressed, self._plan, place, rest, field.camera_centre[seen], radius)
        difference = np.where(np.isfinite(pressed).all(), np.nan_to_num(shown - np.column_stack([field.shift, field.growth])[seen]), np.inf)
        shift = np.sqrt(SHIFT**2 + np.nan_to_num(field.sigma[seen])**2 + (SHARE * depth)**2)
        growth = np.full_like(shift, np.hypot(GROWTH, SHARE * depth * 1e3))
        return difference / np.stack([shift, shift, growth], axis=1)


def _solve(plan: LibraryPlan, what: tuple[SheetNumbers, Presses]) -> np.ndarray:
    """(M, side * side, 3) fields of the M presses at one place."""
    numbers, group = what
    way = plan.load_steps(group.depth)
    mesh = SheetMesh(group.position[0, :2], plan.half, plan.scale, plan.n)
    solved = press_sheet(mesh, way, numbers.radius, numbers.material)[0][np.searchsorted(way, group.depth)]
    return uniform(solved.reshape(-1, mesh.side, mesh.side, 3)).reshape(len(solved), -1, 3)


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
    """library: centred on the calibrated tip radius; material; marker_radius: m; camera centres; noise: of fields, with the model error;
    place_error: m, and depth_share: standard deviations of the remaining errors of place, and of depth over depth; place_range: (2, 2) m,
    calibrated minimum and maximum of x and y; deepest: m, calibrated.
    """

    library: SheetLibrary
    material: SheetMaterial
    marker_radius: float
    camera_centres: CameraShifts
    noise: FieldNoise
    place_error: float
    depth_share: float
    place_range: np.ndarray
    deepest: float

    @property
    def found(self) -> SheetNumbers:
        """The identified parameters."""
        return SheetNumbers(self.library.plan.radius, self.material, self.marker_radius, self.camera_centres)

    def numbers(self) -> dict:
        """As numbers and arrays, for a calibration file."""
        return {'material': asdict(self.material), 'marker_radius': self.marker_radius,
                'camera_centres': self.camera_centres.camera_centres.tolist(),
                'camera_centre_shifts': self.camera_centres.shifts.tolist(), 'printed': self.camera_centres.printed.tolist(),
                'turned': self.camera_centres.turned,
                'noise': asdict(self.noise), 'place_error': self.place_error, 'depth_share': self.depth_share,
                'place_range': self.place_range.tolist(), 'deepest': self.deepest, 'library': library_numbers(self.library)}

    @classmethod
    def from_numbers(cls, numbers: Mapping) -> SheetCalibration:
        """From these numbers. Raises BadCalibration where one is missing or invalid."""
        try:
            arrays = (np.array(numbers[name], float).reshape(-1, width) for name, width in
                      (('camera_centres', 3), ('camera_centre_shifts', 2)))
            camera_centres = CameraShifts(*arrays, np.array(numbers['printed'], float).reshape(2), float(numbers['turned']))
            material = SheetMaterial(**numbers['material'])
            library = library_from_numbers(numbers['library'], material)
            marker_radius, place_error, depth_share, deepest = (
                float(numbers[name]) for name in ('marker_radius', 'place_error', 'depth_share', 'deepest'))
            place_range = np.array(numbers['place_range'], float).reshape(2, 2)
            noise = FieldNoise(**numbers['noise'])
            return cls(library, material, marker_radius, camera_centres, noise, place_error, depth_share, place_range, deepest)
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
    numbers = replace(numbers, camera_centres=_placed(numbers.camera_centres, touching, truths, first))
    still = [numbers.camera_centres.shifted(field) for field, touched in zip(presses.fields, presses.touching) if not touched]
    fields = [numbers.camera_centres.shifted(field) for field in touching.fields]
    noise = _noise(still, fields, truths, first)
    inverse = SheetInverse(library, noise, numbers.marker_radius, max(sensor.pitch))
    found = [inverse.solve(Seen(field), [truth]) for field, truth in zip(fields, truths)]
    place_error, depth_share = _remaining_errors(found, truths)
    covered = np.stack([touching.position[:, :2].min(0), touching.position[:, :2].max(0)])
    return SheetCalibration(library, numbers.material, numbers.marker_radius, numbers.camera_centres, noise, place_error, depth_share,
                            covered,
                            deepest)


def _placed(camera_centres: CameraShifts, presses: Presses, truths: list[Press], inverse: SheetInverse) -> CameraShifts:
    """camera centres with the print where the places of all presses tell it to be: the identification sees a few."""
    from scipy.optimize import least_squares  # calibration alone needs it
    ways = np.array([[[1.0, 0.0, -y], [0.0, 1.0, x]] for x, y in (truth.place for truth in truths)]).reshape(-1, 3)
    for _ in range(ROUNDS):
        found = [inverse.solve(Seen(camera_centres.shifted(field)), [truth]) for field, truth in zip(presses.fields, truths)]
        error = np.array([one.presses[0].place - truth.place for one, truth in zip(found, truths)])
        spread = max(float(np.median(np.abs(error - np.median(error, axis=0)))), 1e-6)
        off = least_squares(lambda off: np.append((error.ravel() - ways @ off) / spread, off[2] / TURN), np.zeros(3),
                            x_scale=(1e-4, 1e-4, 1e-3), loss='soft_l1').x
        camera_centres = replace(camera_centres, printed=camera_centres.printed - off[:2], turned=camera_centres.turned - float(off[2]))
    return camera_centres


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
