# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of the sheet model: identification, library of simulated presses, noise and remaining errors."""
from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np

from ...common.marker_sensor import MarkerSensor
from ...common.progress import in_parallel
from ...core.errors import BadCalibration
from ..calibration import MIN_PRESSES, Prior, excess_sigma, identify, noise_at_rest
from ..field import MarkerField, marker_radii
from ..presses import Presses
from ..simulated import DEPTH_MARGIN
from .library import LibraryPlan, Press, build_library, field_appearance
from .mechanics import SheetMaterial, SheetMesh, may_be_pressed, min_clamp_distance, press_sheet, uniform
from .model import CameraShifts, FieldNoise, Seen, SheetCalibration, SheetInverse

MAX_POSITIONS, MAX_DEPTHS = 6, 5  # used for the fit; with three positions, material and tip are confounded
UNSOLVED_RESIDUAL = 3.0  # normalised residual of presses whose simulation does not converge
MODEL_SHIFT, MODEL_GROWTH = 1e-5, 4e-3  # m and 1; model error of a marker's position and log area, in addition to its noise
MODEL_SHARE = 2e-3  # model error over depth (of growth: per mm)
#: Prior, mean and standard deviation, of the logs of radius, m, prestretch minus 1, friction and bending, m^2: a rubber sheet, a fingertip
PRIOR = np.log([7.5e-3, 0.03, 0.5, 2.5e-7]), np.array([0.7, 0.7, 0.5, 0.7])
STARTS = ((1.0, 1.0, 1.0, 1.0), (1.0, 3.0, 1.0, 5.0), (1.0, 10.0, 0.7, 20.0))  # over the prior mean, from a thin sheet to a thick one
MAX_PRIOR_SIGMAS = 5.0  # bound of every value around the prior mean
ALIGNMENT_SIGMA = 3e-4  # m; prior standard deviation of the shifts of camera centres and print


@dataclass(frozen=True)
class SheetNumbers:
    """Identified numbers. radius: m, of the calibrated tip; marker_radius: m."""

    radius: float
    material: SheetMaterial
    marker_radius: float
    camera_centres: CameraShifts


def fit_numbers(presses: Presses, plan: LibraryPlan) -> SheetNumbers:
    """Find the maximum a posteriori parameters for the presses, with a weak prior for a rubber sheet and a fingertip.

    Raises BadCalibration if there is no press within plan.reach, or the simulation does not converge.
    """
    near, first = presses.select(np.abs(presses.position[:, :2] / plan.reach).max(1) <= 1), presses.fields[0]
    if not len(near):
        raise BadCalibration(f'no press within {plan.reach * 1e3} mm of the centre; press farther from the clamp')
    camera_centres, radii = CameraShifts.of(first), marker_radii(first)[np.isfinite(marker_radii(first))]
    marker = float(np.median(radii)) if len(radii) else 0.0
    mean, sigma = (np.append(known, np.full(camera_centres.shifts.size + 2, unknown)) for known, unknown in zip(PRIOR, (0.0,
    ALIGNMENT_SIGMA)))
    prior = Prior(mean, sigma, mean - MAX_PRIOR_SIGMAS * sigma, mean + MAX_PRIOR_SIGMAS * sigma)
    starts = [mean + np.append(np.log(times), np.zeros(len(mean) - 4)) for times in STARTS]
    fit = _NumbersFit(near.some(MAX_POSITIONS, MAX_DEPTHS), marker, plan, camera_centres)
    return fit.numbers(identify(fit.residuals, starts, prior))


class _NumbersFit:
    """Residuals of presses at a few positions.

    Values are the logs of radius, prestretch minus 1, friction and bending, then the shifts of the camera centres and of the print.
    """

    def __init__(self, groups: list[Presses], marker: float, plan: LibraryPlan, camera_centres: CameraShifts):
        self.camera_centres, self._groups, self._marker, self._plan = camera_centres, groups, marker, plan

    def numbers(self, values: np.ndarray) -> SheetNumbers:
        """Convert values to SheetNumbers."""
        radius, stretch, friction, bending = (float(value) for value in np.exp(values[:4]))
        camera_centres = replace(self.camera_centres, shifts=values[4:-2].reshape(-1, 2), printed=values[-2:])
        return SheetNumbers(radius, SheetMaterial(1 + stretch, bending, friction), self._marker, camera_centres)

    def residuals(self, several: list[np.ndarray]) -> list[np.ndarray]:
        """Normalised residuals (N,) at each of several values. Raises BadCalibration if no simulation converges."""
        wanted = {tuple(values[:4]): self.numbers(values) for values in several}  # shifts need no simulation
        solved = in_parallel(partial(_solve, self._plan), [(numbers, group) for numbers in wanted.values() for group in self._groups],
                             'positions simulated for the identification')
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
        residual = np.where(np.isinf(residual), UNSOLVED_RESIDUAL, residual)
        return residual * np.minimum(1, np.sqrt(3 / np.maximum(np.abs(residual), 3)))  # robust: square root beyond 3 sigma

    def _part(self, field: MarkerField, depth: float, pressed: np.ndarray, position: np.ndarray) -> np.ndarray:
        seen, radius = field.seen, self._marker
        rest = field.rest[seen]
        shown = field_appearance(pressed, self._plan, position, rest, field.camera_centre[seen], radius)
        difference = np.where(np.isfinite(pressed).all(), np.nan_to_num(shown - np.column_stack([field.shift, field.growth])[seen]), np.inf)
        shift = np.hypot(MODEL_SHIFT, MODEL_SHARE * depth)
        return difference / [shift, shift, np.hypot(MODEL_GROWTH, MODEL_SHARE * depth * 1e3)]


def _solve(plan: LibraryPlan, what: tuple[SheetNumbers, Presses]) -> np.ndarray:
    """Fields (M, side * side, 3) of the M presses at one position."""
    numbers, group = what
    steps = plan.load_steps(group.depth)
    mesh = SheetMesh(group.position[0, :2], plan.half, plan.scale, plan.n)
    solved = press_sheet(mesh, steps, numbers.radius, numbers.material)[0][np.searchsorted(steps, group.depth)]
    return uniform(solved.reshape(-1, mesh.side, mesh.side, 3)).reshape(len(solved), -1, 3)


START_RADIUS = 7.5e-3  # m, of a fingertip; start of the fit
MESH_SCALE = 10e-3  # m, of the mesh at the tip, about a tip radius; less on a small sheet
MAX_MESH_SCALE = 0.4  # of the half side
DEFAULT_NOISE = FieldNoise(1e-5, 5e-3, 3e-3, 1.0)  # without untouched frames
STILL_SHARE = 0.05  # of the depth; markers displaced by less show the model error that grows with depth
MIN_NOISE = FieldNoise(1e-6, 5e-4, 5e-4, 0.1)
ROTATION_SIGMA = 5e-3  # rad; prior standard deviation of the print's rotation: half a pitch over a large sheet
ALIGNMENT_ROUNDS = 3  # each step is a fifth too long because of the position of the clamp
FINE_PLAN = {'n': 8, 'order': 4, 'levels': 10, 'substeps': 2}


def calibrate_sheet(presses: Presses, sensor: MarkerSensor, known: SheetCalibration | None = None) -> SheetCalibration:
    """Calibrate a sheet from presses by one round tip.

    known: a calibration whose library and identified parameters are reused. Raises BadCalibration if the presses do not determine them.
    """
    if not sensor.is_sheet or presses.touching.sum() < MIN_PRESSES:
        raise BadCalibration(f'the sheet model needs a flat sheet and {MIN_PRESSES} presses at known positions, got '
                             f'{presses.touching.sum()} on {sensor.type}')
    half, deepest = np.array(sensor.size) / 2, float(presses.depth.max())
    plan = LibraryPlan(tuple(half.tolist()), START_RADIUS, DEPTH_MARGIN * deepest, min(MESH_SCALE, MAX_MESH_SCALE * float(half.min())),
                       **FINE_PLAN)
    usable = presses.touching & may_be_pressed(presses.position[:, :2], half, plan.scale)
    if usable.sum() < MIN_PRESSES:
        raise BadCalibration(f'{usable.sum()} presses are farther than {min_clamp_distance(plan.scale) * 1e3:.1f} mm from the clamp; '
                             f'{MIN_PRESSES} are needed')
    straight = usable & presses.straight()
    touching = presses.select(straight if straight.sum() >= max(MIN_PRESSES, usable.sum() / 3) else usable)
    if known is None:
        numbers = fit_numbers(touching, plan)
        library = build_library(replace(plan, radius=numbers.radius), numbers.material)
        marker_radius, camera_centres = numbers.marker_radius, numbers.camera_centres
    else:
        library, marker_radius, camera_centres = known.library, known.marker_radius, known.camera_centres
    truths = [Press(position[:2], float(depth)) for position, depth in zip(touching.position, touching.depth)]
    first = SheetInverse(library, DEFAULT_NOISE, marker_radius, max(sensor.pitch))
    camera_centres = _aligned(camera_centres, touching, truths, first)
    still = [camera_centres.shifted(field) for field, touched in zip(presses.fields, presses.touching) if not touched]
    fields = [camera_centres.shifted(field) for field in touching.fields]
    noise = _noise(still, fields, truths, first)
    inverse = SheetInverse(library, noise, marker_radius, max(sensor.pitch))
    found = [inverse.solve(Seen(field), [truth]) for field, truth in zip(fields, truths)]
    place_error, depth_share = _remaining_errors(found, truths)
    covered = np.stack([touching.position[:, :2].min(0), touching.position[:, :2].max(0)])
    return SheetCalibration(library, marker_radius, camera_centres, noise, place_error, depth_share, covered, deepest)


def _aligned(camera_centres: CameraShifts, presses: Presses, truths: list[Press], inverse: SheetInverse) -> CameraShifts:
    """Align the print to the positions of all presses; the identification uses only a few."""
    from scipy.optimize import least_squares  # calibration alone needs it
    terms = np.array([[[1.0, 0.0, -y], [0.0, 1.0, x]] for x, y in (truth.position for truth in truths)]).reshape(-1, 3)
    for _ in range(ALIGNMENT_ROUNDS):
        found = [inverse.solve(Seen(camera_centres.shifted(field)), [truth]) for field, truth in zip(presses.fields, truths)]
        error = np.array([one.presses[0].position - truth.position for one, truth in zip(found, truths)])
        spread = max(float(np.median(np.abs(error - np.median(error, axis=0)))), 1e-6)
        offset = least_squares(lambda offset: np.append((error.ravel() - terms @ offset) / spread, offset[2] / ROTATION_SIGMA), np.zeros(3),
                            x_scale=(1e-4, 1e-4, 1e-3), loss='soft_l1').x
        camera_centres = replace(camera_centres, printed=camera_centres.printed - offset[:2],
                                 turned=camera_centres.turned - float(offset[2]))
    return camera_centres


def _noise(still: list[MarkerField], fields: list[MarkerField], truths: list[Press], inverse: SheetInverse) -> FieldNoise:
    """Noise of untouched fields, and the model errors in proportion to a marker's displacement and to the depth of the press.

    The latter follows from markers that hardly move, then the former from all markers.
    """
    shift, growth = (noise_at_rest([getattr(field, name) for field in still], getattr(DEFAULT_NOISE, name), getattr(MIN_NOISE, name))
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
    return FieldNoise(**{name: float(max(value, getattr(MIN_NOISE, name))) for name, value in asdict(values).items()})


def _remaining_errors(found: list, truths: list[Press]) -> tuple[float, float]:
    """Standard deviations of position, m, and of depth over depth, in addition to the covariances of the estimates."""
    error = np.array([inverse.tip(0)[0] - truth.vector[:3] for inverse, truth in zip(found, truths)])
    variance = np.array([np.diag(inverse.tip(0)[1]) for inverse in found])
    depth = np.array([[truth.depth] for truth in truths])
    return excess_sigma(error[:, :2], variance[:, :2]), excess_sigma(error[:, 2:] / depth, variance[:, 2:] / depth**2)
