# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of the sheet model: identification, library of simulated presses, noise and remaining errors."""
from __future__ import annotations

from dataclasses import astuple, dataclass, replace
from functools import partial

import numpy as np

from ...common.marker_sensor import MarkerSensor
from ...common.progress import in_parallel
from ...core.errors import BadCalibration
from ..calibration import Prior, excess_sigma, identify, noise_at_rest
from ..constants import PRESS, SHEET
from ..field import MarkerField, marker_radii
from ..presses import Presses
from .library import LibraryPlan, Press, build_library, field_appearance
from .mechanics import SheetMaterial, SheetMesh, may_be_pressed, min_clamp_distance, press_sheet, uniform
from .model import CameraShifts, FieldNoise, Seen, SheetCalibration, SheetInverse


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
    shifts = np.ones(camera_centres.shifts.size + 2)
    mean, sigma = np.append(np.log(SHEET.prior_mean), 0 * shifts), np.append(SHEET.prior_sigma, SHEET.alignment_sigma * shifts)
    prior = Prior(mean, sigma, mean - SHEET.max_prior_sigmas * sigma, mean + SHEET.max_prior_sigmas * sigma)
    starts = [mean + np.append(np.log(times), np.zeros(len(mean) - 4)) for times in SHEET.starts]
    fit = _NumbersFit(near.some(*SHEET.positions_and_depths), marker, plan, camera_centres)
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
        residual = np.where(np.isinf(residual), SHEET.unsolved_residual, residual)
        return residual * np.minimum(1, np.sqrt(3 / np.maximum(np.abs(residual), 3)))  # robust: square root beyond 3 sigma

    def _part(self, field: MarkerField, depth: float, pressed: np.ndarray, position: np.ndarray) -> np.ndarray:
        seen, radius = field.seen, self._marker
        rest = field.rest[seen]
        shown = field_appearance(pressed, self._plan, position, rest, field.camera_centre[seen], radius)
        difference = np.where(np.isfinite(pressed).all(), np.nan_to_num(shown - np.column_stack([field.shift, field.growth])[seen]), np.inf)
        shift = np.hypot(SHEET.model_shift, SHEET.model_share * depth)
        return difference / [shift, shift, np.hypot(SHEET.model_growth, SHEET.model_share * depth * 1e3)]


def _solve(plan: LibraryPlan, what: tuple[SheetNumbers, Presses]) -> np.ndarray:
    """Fields (M, side * side, 3) of the M presses at one position."""
    numbers, group = what
    steps = plan.load_steps(group.depth)
    mesh = SheetMesh(group.position[0, :2], plan.half, plan.scale, plan.n)
    solved = press_sheet(mesh, steps, numbers.radius, numbers.material)[0][np.searchsorted(steps, group.depth)]
    return uniform(solved.reshape(-1, mesh.side, mesh.side, 3)).reshape(len(solved), -1, 3)




def calibrate_sheet(presses: Presses, sensor: MarkerSensor, known: SheetCalibration | None = None) -> SheetCalibration:
    """Calibrate a sheet from presses by one round tip.

    known: a calibration whose library and identified parameters are reused. Raises BadCalibration if the presses do not determine them.
    """
    if not sensor.is_sheet or presses.touching.sum() < PRESS.min_presses:
        raise BadCalibration(f'the sheet model needs a flat sheet and {PRESS.min_presses} presses at known positions, got '
                             f'{presses.touching.sum()} on {sensor.type}')
    half, deepest = np.array(sensor.size) / 2, float(presses.depth.max())
    scale = min(SHEET.mesh_scale, SHEET.max_mesh_scale * float(half.min()))
    plan = LibraryPlan(tuple(half.tolist()), SHEET.prior_mean[0], PRESS.depth_margin * deepest, scale, n=8, order=4, levels=10, substeps=2)
    usable = presses.touching & may_be_pressed(presses.position[:, :2], half, plan.scale)
    if usable.sum() < PRESS.min_presses:
        raise BadCalibration(f'{usable.sum()} presses are farther than {min_clamp_distance(plan.scale) * 1e3:.1f} mm from the clamp; '
                             f'{PRESS.min_presses} are needed')
    straight = usable & presses.straight()
    touching = presses.select(straight if straight.sum() >= max(PRESS.min_presses, usable.sum() / 3) else usable)
    if known is None:
        numbers = fit_numbers(touching, plan)
        library = build_library(replace(plan, radius=numbers.radius), numbers.material)
        marker_radius, camera_centres = numbers.marker_radius, numbers.camera_centres
    else:
        library, marker_radius, camera_centres = known.library, known.marker_radius, known.camera_centres
    truths = [Press(position[:2], float(depth)) for position, depth in zip(touching.position, touching.depth)]
    first = SheetInverse(library, FieldNoise(*SHEET.default_noise), marker_radius, max(sensor.pitch))
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
    for _ in range(3):  # each step is a fifth too long because of the position of the clamp
        found = [inverse.solve(Seen(camera_centres.shifted(field)), [truth]) for field, truth in zip(presses.fields, truths)]
        error = np.array([one.presses[0].position - truth.position for one, truth in zip(found, truths)])
        spread = max(float(np.median(np.abs(error - np.median(error, axis=0)))), 1e-6)
        offset = least_squares(lambda offset: np.append((error.ravel() - terms @ offset) / spread, offset[2] / SHEET.rotation_sigma),
                               np.zeros(3), x_scale=(1e-4, 1e-4, 1e-3), loss='soft_l1').x
        camera_centres = replace(camera_centres, printed=camera_centres.printed - offset[:2],
                                 turned=camera_centres.turned - float(offset[2]))
    return camera_centres


def _noise(still: list[MarkerField], fields: list[MarkerField], truths: list[Press], inverse: SheetInverse) -> FieldNoise:
    """Noise of untouched fields, and the model errors in proportion to a marker's displacement and to the depth of the press.

    The latter follows from markers that hardly move, then the former from all markers.
    """
    shift, growth = (noise_at_rest([getattr(field, name) for field in still], SHEET.default_noise[k], SHEET.min_noise[k])
                     for k, name in enumerate(('shift', 'growth')))
    rows = []
    for field, truth in zip(fields, truths):
        seen = Seen(field)
        predicted, deformed = inverse.predict([truth], seen)
        excess = (seen.value - predicted)**2 - np.array([shift, shift, growth])**2
        rows.append(np.column_stack([excess, np.sum(deformed[:, 0]**2, axis=1), np.full(len(excess), truth.depth**2)]))
    rows = np.concatenate(rows)
    rows = rows[np.isfinite(rows).all(1)]
    far = rows[rows[:, 3] < SHEET.still_share**2 * rows[:, 4]]
    over = np.maximum(far[:, :3].sum(0) / max(far[:, 4].sum(), 1e-12), 0.0)
    left = np.maximum((rows[:, :3] - over * rows[:, 4:]).sum(0) / rows[:, 3].sum(), 0.0)
    values = FieldNoise(shift, growth, *np.sqrt([left[:2].mean(), left[2], over[:2].mean(), over[2]]))
    return FieldNoise(*map(float, np.maximum(astuple(values), astuple(FieldNoise(*SHEET.min_noise)))))


def _remaining_errors(found: list, truths: list[Press]) -> tuple[float, float]:
    """Standard deviations of position, m, and of depth over depth, in addition to the covariances of the estimates."""
    error = np.array([inverse.tip(0)[0] - truth.vector[:3] for inverse, truth in zip(found, truths)])
    variance = np.array([np.diag(inverse.tip(0)[1]) for inverse in found])
    depth = np.array([[truth.depth] for truth in truths])
    return excess_sigma(error[:, :2], variance[:, :2]), excess_sigma(error[:, 2:] / depth, variance[:, 2:] / depth**2)
