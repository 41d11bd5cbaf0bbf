# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of the sheet model: identification, library of simulated presses, noise and remaining errors."""
from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np

from ...common.marker_sensor import MarkerSensor
from ...common.progress import in_parallel
from ...errors import BadCalibration
from ..calibration import Prior, beyond, identify, noise_at_rest
from ..field import MarkerField, marker_radii
from ..presses import Presses
from .library import LibraryPlan, Press, build_library, field_appearance
from .mechanics import SheetMaterial, SheetMesh, least_length, may_be_pressed, press_sheet, uniform
from .model import CameraShifts, FieldNoise, Seen, SheetCalibration, SheetInverse

PLACES, DEPTHS = 6, 5  # used for the fit, at most. Chosen: three places leave material and tip to each other
UNSOLVED = 3.0         # normalised residual of presses whose simulation does not converge. Chosen
SHIFT, GROWTH = 1e-5, 4e-3  # m and 1: model error of a marker's position and log area, beside its noise. Chosen
SHARE = 2e-3           # model error over depth (of growth: per mm). Chosen
#: Logs of radius, m, prestretch over 1, friction and bending, m^2: mean and standard deviation, of a rubber sheet and a fingertip
LIKELY = np.log([7.5e-3, 0.03, 0.5, 2.5e-7]), np.array([0.7, 0.7, 0.5, 0.7])
STARTS = ((1.0, 1.0, 1.0, 1.0), (1.0, 3.0, 1.0, 5.0), (1.0, 10.0, 0.7, 20.0))  # times the likely ones: a thin sheet to a thick one. Chosen
FARTHEST = 5.0         # standard deviations of the prior within which every value stays. Chosen
PLACED = 3e-4          # m: prior standard deviation of the shifts of camera centres and print. Chosen


@dataclass(frozen=True)
class SheetNumbers:
    """radius: m, of the calibrated tip; material; marker_radius: m; camera_centres: camera positions."""

    radius: float
    material: SheetMaterial
    marker_radius: float
    camera_centres: CameraShifts


def fit_numbers(presses: Presses, plan: LibraryPlan) -> SheetNumbers:
    """Maximum a posteriori parameters for the presses, with a weak prior for a rubber sheet and a fingertip.

    Raises BadCalibration where there are no presses within plan.reach, or the simulation does not converge.
    """
    near, first = presses.select(np.abs(presses.position[:, :2] / plan.reach).max(1) <= 1), presses.fields[0]
    if not len(near):
        raise BadCalibration(f'no press within {plan.reach * 1e3} mm of the centre; press farther from the clamp')
    camera_centres, radii = CameraShifts.of(first), marker_radii(first)[np.isfinite(marker_radii(first))]
    marker = float(np.median(radii)) if len(radii) else 0.0
    mean, sigma = (np.append(known, np.full(camera_centres.shifts.size + 2, unknown)) for known, unknown in zip(LIKELY, (0.0, PLACED)))
    prior = Prior(mean, sigma, mean - FARTHEST * sigma, mean + FARTHEST * sigma)
    starts = [mean + np.append(np.log(times), np.zeros(len(mean) - 4)) for times in STARTS]
    fit = _NumbersFit(near.some(PLACES, DEPTHS), marker, plan, camera_centres)
    return fit.numbers(identify(fit.residuals, starts, prior))


class _NumbersFit:
    """Residuals of presses at a few places; values are the logs of radius, prestretch over 1, friction and bending, then the shifts of the
    camera centres and of the print."""

    def __init__(self, groups: list[Presses], marker: float, plan: LibraryPlan, camera_centres: CameraShifts):
        self.camera_centres, self._groups, self._marker, self._plan = camera_centres, groups, marker, plan

    def numbers(self, values: np.ndarray) -> SheetNumbers:
        """What values mean."""
        radius, stretch, friction, bending = (float(value) for value in np.exp(values[:4]))
        camera_centres = replace(self.camera_centres, shifts=values[4:-2].reshape(-1, 2), printed=values[-2:])
        return SheetNumbers(radius, SheetMaterial(1 + stretch, bending, friction), self._marker, camera_centres)

    def residuals(self, several: list[np.ndarray]) -> list[np.ndarray]:
        """The normalised residual (N,) at each of several values. Raises BadCalibration where no simulation converges."""
        wanted = {tuple(values[:4]): self.numbers(values) for values in several}  # shifts need no simulation
        solved = in_parallel(partial(_solve, self._plan), [(numbers, group) for numbers in wanted.values() for group in self._groups],
                             'places simulated for the identification')
        count = len(self._groups)
        fields = {key: solved[count * k:count * (k + 1)] for k, key in enumerate(wanted)}
        return [self._residual(self.numbers(values), fields[tuple(values[:4])]) for values in several]

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
        shift = np.hypot(SHIFT, SHARE * depth)
        return difference / [shift, shift, np.hypot(GROWTH, SHARE * depth * 1e3)]


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
TURN = 5e-3           # rad: prior standard deviation of the print's turn. Chosen: half a pitch over a large sheet
ROUNDS = 3            # of placing the print: the clamp's place makes each step a fifth too long
FINE = {'n': 8, 'order': 4, 'levels': 10, 'substeps': 2}


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
    if known is None:
        numbers = fit_numbers(touching, plan)
        library = build_library(replace(plan, radius=numbers.radius), numbers.material)
        marker_radius, camera_centres = numbers.marker_radius, numbers.camera_centres
    else:
        library, marker_radius, camera_centres = known.library, known.marker_radius, known.camera_centres
    truths = [Press(position[:2], float(depth)) for position, depth in zip(touching.position, touching.depth)]
    first = SheetInverse(library, STILL, marker_radius, max(sensor.pitch))
    camera_centres = _placed(camera_centres, touching, truths, first)
    still = [camera_centres.shifted(field) for field, touched in zip(presses.fields, presses.touching) if not touched]
    fields = [camera_centres.shifted(field) for field in touching.fields]
    noise = _noise(still, fields, truths, first)
    inverse = SheetInverse(library, noise, marker_radius, max(sensor.pitch))
    found = [inverse.solve(Seen(field), [truth]) for field, truth in zip(fields, truths)]
    place_error, depth_share = _remaining_errors(found, truths)
    covered = np.stack([touching.position[:, :2].min(0), touching.position[:, :2].max(0)])
    return SheetCalibration(library, marker_radius, camera_centres, noise, place_error, depth_share, covered, deepest)


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
    shift, growth = (noise_at_rest([getattr(field, name) for field in still], getattr(STILL, name), getattr(QUIETEST, name))
                     for name in ('shift', 'growth'))
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
    depth = np.array([[truth.depth] for truth in truths])
    return beyond(error[:, :2], variance[:, :2]), beyond(error[:, 2:] / depth, variance[:, 2:] / depth**2)
