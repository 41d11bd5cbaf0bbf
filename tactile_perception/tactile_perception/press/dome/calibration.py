# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of the dome model: identification, library of simulated presses, noise and remaining errors."""
from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...common.geometry import Cap
from ...common.marker_sensor import MarkerSensor, dome_cap, first_touch_height, rest_points
from ...common.progress import in_parallel
from ...core.errors import BadCalibration
from ..calibration import Prior, excess_sigma, identify, noise_at_rest
from ..constants import DOME, PRESS
from ..field import MarkerField, common_rest, marker_radii
from ..presses import Presses
from .library import DomeLibrary, DomePlan, build_library
from .mechanics import DomeMaterial, DomeMesh, MeshPlan, OnMesh, appear_at, centres_of, outlines, press_dome, shift_of
from .model import DEPTH, DomeCalibration, DomeInverse, DomeModelMethod, FieldNoise, shallowness, straight_press


@dataclass(frozen=True)
class PrintedDome:
    """The untouched dome.

    points, camera_centres: (K, 3) m, of the markers, NaN if unknown; cap: its shape; plane_z: m, of the viewing plane; marker: m, radius of
    the markers.
    """

    points: np.ndarray
    camera_centres: np.ndarray
    cap: Cap
    plane_z: float
    marker: float


def numbers_of(logs: np.ndarray) -> tuple[DomeMaterial, float]:
    """Material of the dome, and radius, m, of the tip, from the logs (4,) of log prestretch, gas, friction and radius."""
    stretch, gas, friction, radius = np.exp(np.clip(logs, np.log(DOME.min_numbers), np.log(DOME.max_numbers))).tolist()
    return DomeMaterial(float(np.exp(-6 * stretch)), gas, friction), radius


def identify_dome(presses: Presses, dome: PrintedDome, radius: float) -> tuple[DomeMaterial, float]:
    """Identify the material and the tip radius, m, that best explain straight presses.

    radius: m, prior mean of the tip radius. Raises BadCalibration if the presses cannot be simulated.
    """
    explain = partial(_explained, presses.some(*DOME.positions_and_depths), deepest=presses.depth.max(), dome=dome)
    prior = Prior(np.log([*DOME.prior_mean, radius]), np.append(DOME.prior_sigma, DOME.radius_sigma),
                  np.log(DOME.min_numbers), np.log(DOME.max_numbers))
    starts = [np.append(np.log([stretch, gas, friction]), prior.mean[3]) for stretch, friction in DOME.starts for gas in DOME.gas_starts]
    return numbers_of(identify(explain, starts, prior))


def _explained(groups: list[Presses], tried: list[np.ndarray], **known) -> list[np.ndarray]:
    """Residuals (N,) of the presses for each of the logs tried, over their standard deviation.

    Model errors are common to all markers, so that all of them contain as much information as one.
    """
    solved = in_parallel(partial(_residuals, **known), [(group, logs) for logs in tried for group in groups],
                         'presses simulated for the identification')
    reported = [np.concatenate(solved[k * len(groups):(k + 1) * len(groups)]) for k in range(len(tried))]
    if np.isnan(reported).all():
        raise BadCalibration(f'presses simulated with {numbers_of(tried[0])} do not converge; check dome and depths')
    seen = np.concatenate([np.isfinite(field.shift).ravel() for group in groups for field in group.fields])
    return [np.nan_to_num(one[seen], nan=DOME.unsolved_error) / (DOME.model_error * np.sqrt(seen.sum())) for one in reported]


def _residuals(case: tuple[Presses, np.ndarray], deepest: float, dome: PrintedDome) -> np.ndarray:
    """Weighted residuals of presses at one position for these logs; NaN if unknown or not converged."""
    pressed, (material, radius) = case[0], numbers_of(case[1])
    (x, y), steps = pressed.position[:, :2].mean(0), load_steps(pressed.depth)
    mesh, turn = DomeMesh(shift_of(np.hypot(x, y), radius, dome.cap), dome.cap, MeshPlan()), np.arctan2(y, x)
    fields = press_dome(mesh, steps, radius, material, drags=0).straight[np.searchsorted(steps, pressed.depth)]
    cos, sin = np.cos(turn), np.sin(turn)
    turned = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    known = np.isfinite(dome.points).all(axis=1)
    rest, camera_centres, residuals = outlines(dome.points[known], dome.marker, dome.cap), dome.camera_centres[known], []
    before, distance = appear_at(rest, camera_centres), dome.plane_z - camera_centres[:, 2:]
    on_mesh = OnMesh(mesh, rest.reshape(-1, 3) @ turned.T)
    for field, seen, depth in zip(fields, pressed.fields, pressed.depth):
        moved = on_mesh.displaced(field) @ turned
        error = np.full(seen.shift.shape, np.nan)
        error[known] = (appear_at(rest + moved.reshape(rest.shape), camera_centres) - before) * distance - seen.shift[known]
        residuals.append(error.ravel() / np.hypot(depth, DOME.shallow * deepest))
    return np.concatenate(residuals)


def load_steps(stops: np.ndarray) -> np.ndarray:
    """Load steps, m, through rising stops, m."""
    fine = stops[-1] * (np.arange(1, DOME.load_steps + 1) / DOME.load_steps)**DOME.load_power
    between = fine[np.abs(fine[:, None] - stops).min(1) > 0.3 * stops[-1] / DOME.load_steps]
    return np.union1d(between, stops)




def calibrate_dome(presses: Presses, sensor: MarkerSensor, known: DomeCalibration | None = None) -> DomeCalibration:
    """Calibrate a dome from presses by one round tip.

    known: a calibration whose library is reused. Raises BadCalibration if the presses do not determine it.
    """
    straight = presses.select(presses.straight() & np.array([field.seen.sum() > len(field) / 4 for field in presses.fields]))
    if sensor.is_sheet or len(straight) < PRESS.min_presses:
        raise BadCalibration(f'the dome model needs a dome and {PRESS.min_presses} straight presses at known positions, got '
                             f'{len(straight)} on {sensor.type}')
    rest, camera_centres = common_rest(presses.fields)
    deepest, reached = float(straight.depth.max()), float(np.hypot(*straight.position[:, :2].T).max())
    library = known.library if known else _simulated(straight, rest, camera_centres, sensor, deepest, reached)
    still = [field for field, on in zip(presses.fields, presses.touching) if not on]
    noise = FieldNoise(noise_at_rest([field.shift for field in still], DOME.default_noise, DOME.min_noise), *DOME.min_shares)
    first = DomeCalibration(library, rest, camera_centres, noise, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, deepest, reached + max(sensor.pitch), 0.0)
    some = straight.select(np.isin(np.arange(len(straight)), np.linspace(0, len(straight) - 1, 60).astype(int)))
    first = replace(first, noise=_with_model_error(first.inverse(sensor), some))
    inverse = first.inverse(sensor)
    quiet = max((DomeModelMethod(first, sensor).score(field) for field in still), default=0.0)
    found = [inverse.solve(field, _true(position, depth), straight_press(is_known=True)) for field, position, depth in _rows(some)]
    return replace(_with_remaining_errors(first, found, some), quiet=float(quiet))


def _simulated(presses: Presses, rest: np.ndarray, camera_centres: np.ndarray, sensor: MarkerSensor, deepest: float,
               reached: float) -> DomeLibrary:
    """Identify the dome and simulate its library."""
    marker, cap = _marker_radius(presses.fields[0], rest_points(rest, camera_centres, sensor), camera_centres, sensor), dome_cap(sensor)
    points = centres_of(rest, camera_centres, marker, sensor)
    dome = PrintedDome(points, np.nan_to_num(camera_centres), cap, sensor.plane_z, marker)
    material, radius = identify_dome(presses, dome, _tip_radius(presses, sensor))
    reach = min(reached + DOME.reach_margin * max(sensor.pitch), 0.9 * sensor.rim_radius)
    camera_centre = float(np.nanmedian(camera_centres[:, 2]))
    plan = DomePlan(sensor.rim_radius, sensor.height, radius, PRESS.depth_margin * deepest, reach, marker, camera_centre)
    return build_library(plan, material)


def _marker_radius(field: MarkerField, points: np.ndarray, camera_centres: np.ndarray, sensor: MarkerSensor) -> float:
    """Median radius, m, of the untouched markers around the top, where they face the camera; points, camera_centres: (K, 3) m."""
    ratio = (points[:, 2] - camera_centres[:, 2]) / (sensor.plane_z - camera_centres[:, 2])  # distances of dome and viewing plane
    radius = marker_radii(field) * ratio
    known = radius[np.isfinite(radius) & (np.hypot(*points[:, :2].T) < DOME.top * sensor.rim_radius)]
    return float(np.median(known)) if len(known) else DOME.default_marker * max(sensor.pitch)


def _tip_radius(presses: Presses, sensor: MarkerSensor) -> float:
    """Tip radius, m, for which the height of first contact fits the presses best."""
    first = presses.position[:, 2] + presses.depth
    radii = np.arange(2e-3, 0.0801, 5e-4)
    misfits = [np.nansum((first_touch_height(presses.position[:, :2], radius, sensor) - first)**2) for radius in radii]
    return float(radii[int(np.argmin(misfits))])


def _rows(presses: Presses):
    return zip(presses.fields, presses.position[:, :2], presses.depth)


def _true(position: np.ndarray, depth: float) -> np.ndarray:
    """Press (1, 7) of the calibrated tip."""
    return np.array([[*position, np.log(depth), 0.0, 0.0, 0.0, 0.0]])


def _with_model_error(inverse: DomeInverse, presses: Presses) -> FieldNoise:
    """The noise with the model error, over the largest displacement, from the residuals of presses at their true positions."""
    over = []
    for field, position, depth in _rows(presses):
        size, seen = np.hypot(*np.nan_to_num(field.shift).T), field.seen
        excess = np.mean((field.shift - inverse.appear(_true(position, depth)))[seen]**2) - inverse.noise.still**2
        over.append(max(excess, 0.0) / np.mean(0.5 * size[seen]**2 + 0.5 * size.max()**2 * np.ones(seen.sum())))
    share = float(np.sqrt(np.median(over)))
    return FieldNoise(inverse.noise.still, max(DOME.min_shares[0], 0.7 * share), max(DOME.min_shares[1], 0.7 * share))


def _with_remaining_errors(known: DomeCalibration, found: list, presses: Presses) -> DomeCalibration:
    """Add the scales of position and depth, and the standard deviations that the estimates show in addition to covariances and scales.

    Tip radius, depth and distance from the axis are correlated, so that model errors appear there, most in shallow presses. Each press is
    weighted by its accuracy. One exact press at the largest distance is added, because presses near the axis hardly determine the scale
    there. If the scales explain no more than their number would by chance (Schwarz 1978), they are 1.
    """
    deep = presses.depth > DOME.shallow * presses.depth.max()
    reported, true = np.array([one.presses[0] for one in found])[deep], presses.position[deep, :2]
    variance = np.array([np.diag(one.covariance)[:3] for one in found])[deep]
    distance, depth = np.maximum(np.hypot(*true.T), 1e-9), np.exp(reported[:, DEPTH])
    shallow, positions, sigma = shallowness(depth, known.deepest), reported[:, :2], np.sqrt(variance)
    out, far, shallow, aside, deeper = (np.append(part, end) for part, end in (
        (np.sum(positions * true, axis=1) / distance, known.farthest), (distance, known.farthest), (shallow, DOME.shallow),
        (np.hypot(*sigma[:, :2].T), np.median(np.hypot(*sigma[:, :2].T))), (sigma[:, 2], np.median(sigma[:, 2]))))
    wider, = _least_absolute(far[:, None] / aside[:, None], out / aside)
    terms = np.column_stack([np.ones(len(far)), (far / known.farthest)**2, shallow])
    deeper, change, deeper_shallow = _least_absolute(terms / deeper[:, None], np.append(depth / presses.depth[deep], 1.0) / deeper)
    scaled = replace(known, wider=float(wider), deeper=float(deeper), deeper_far=float(deeper + change),
                     deeper_shallow=float(deeper_shallow))
    errors = []
    for one in (known, scaled):
        scale = np.array([one.depth_scale(position, fitted) for position, fitted in zip(true, depth)])
        errors.append((positions / one.wider - true, (depth / presses.depth[deep] - scale)[:, None]))
    chi_squares = [np.sum(aside**2 / variance[:, :2]) + np.sum(deeper**2 / variance[:, 2:]) for aside, deeper in errors]
    if chi_squares[0] - chi_squares[1] < 4 * np.log(len(true)):  # the scales are four numbers
        scaled, errors[1] = known, errors[0]
    return replace(scaled, place_error=excess_sigma(errors[1][0], variance[:, :2]), depth_share=excess_sigma(errors[1][1], variance[:, 2:]))


def _least_absolute(matrix: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Solution (n,) of matrix (N, n) for values (N,) with the smallest sum of absolute errors, by reweighted least squares."""
    weight = np.ones(len(values))
    for _ in range(20):
        found = np.linalg.lstsq(matrix * weight[:, None], values * weight, rcond=None)[0]
        error = np.abs(values - matrix @ found)
        weight = 1 / np.sqrt(error + 1e-3 * error.max() + 1e-12)
    return found
