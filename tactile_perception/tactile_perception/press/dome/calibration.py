# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of the dome model: identification, library of simulated presses, noise and remaining errors."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np

from ...common.progress import in_parallel
from ...common.geometry import Cap
from ...errors import BadCalibration
from ..field import MarkerField, marker_radii
from ..identification import Prior, identify
from ..presses import Presses
from ..published import common_rest
from ..sensor import MarkerSensor, dome_cap, first_touch_height, rest_points
from .library import DomeLibrary, DomePlan, build_library, library_from_numbers, library_numbers
from .mechanics import DomeMaterial, DomeMesh, MeshPlan, appear_at, centres_of, evaluate, outlines, press_dome, shift_of
from .fit import DEPTH, STRAIGHT, DomeFound, DomeInverse, FieldNoise

LOAD_STEPS = 18         # of a press to the deepest. Chosen: friction depends on the path
DEPTH_POWER = 1.3       # grading of the load steps. Chosen
PLACES = 3              # simulated at most, evenly over their distances from the axis. Chosen
DEPTHS = 4              # of a place at most. Chosen
TENSIONS = 1.0, 0.4, 0.15  # over shear modulus and thickness: starts. Chosen
GASES = 1.0, 0.03, 1e-4  # over the likely one: starts of sealed gas, of gas with a reservoir, and of a pressure that is held. Chosen
HOPELESS = 10.0         # times the least cost of a start: kinds of gas whose starts are worse are not followed. Chosen
EVALUATIONS = 6         # of the presses, at most, beside their slopes. Chosen
SHALLOW = 0.2           # of the deepest press: above it, model errors are in proportion to depth. Chosen
SIGMA = np.array([1.5, 3.0, 0.7, 0.03])    # prior standard deviations of the logs. Chosen: wide, but of the radius, which heights tell
TRUST = 0.002           # relative error of the model. Chosen
UNSOLVED = 0.2          # relative error of presses whose simulation does not converge. Chosen
LEAST_LOGS = np.log([0.02, 1e-3, 0.05, 2e-3])   # bounds of the logs; such gas counts as a pressure that is held
MOST_LOGS = np.log([1.0, 500.0, 3.0, 0.2])


@dataclass(frozen=True)
class DomeNumbers:
    """material: of the dome; radius: m, of the tip that pressed."""

    material: DomeMaterial
    radius: float

    @property
    def logs(self) -> np.ndarray:
        """(4,) logs of the tension over the shear modulus and thickness, of the gas, of friction and of the radius."""
        material = self.material
        return np.log([1 - material.squeeze, max(material.gas, 1e-3), max(material.friction, 1e-3), self.radius])

    @classmethod
    def from_logs(cls, logs: np.ndarray) -> DomeNumbers:
        """Inverse of logs, within bounds."""
        tension, gas, friction, radius = np.exp(np.clip(logs, LEAST_LOGS, MOST_LOGS)).tolist()
        return cls(DomeMaterial(1 - tension, gas, friction), radius)


@dataclass(frozen=True)
class _Place:
    """One place pressed. across, turn: m and rad, of the tip; depths (D,) m, rising; shifts: (D, K, 2) m, apparent; weights (D,)."""

    across: float
    turn: float
    depths: np.ndarray
    shifts: np.ndarray
    weights: np.ndarray


def identify_dome(presses: Presses, points: np.ndarray, camera_centres: np.ndarray, cap: Cap, plane_z: float, marker: float,
             start: DomeNumbers) -> DomeNumbers:
    """The numbers that explain straight presses best; points, camera_centres: (K, 3) m, of the markers, NaN unknown; plane_z: m, of the
    viewing plane; marker: m, radius of the markers.

    Raises BadCalibration where the presses cannot be simulated.
    """
    places = _places(presses)
    explain = partial(_explained, places, points=points, camera_centres=camera_centres, cap=cap, plane_z=plane_z, marker=marker)
    priors = [Prior(start.logs + [0, np.log(gas), 0, 0], SIGMA, LEAST_LOGS, MOST_LOGS) for gas in GASES]  # each kind of gas is as likely
    tried = [[np.array([np.log(tension), *prior.mean[1:]]) for tension in TENSIONS] for prior in priors]
    left = [np.sum(np.square(explain(starts)), axis=1) for starts in tried]
    least = np.min(left)
    if least >= 0.5 * (UNSOLVED / TRUST)**2:
        raise BadCalibration(f'presses simulated with {DomeNumbers.from_logs(tried[0][0])} do not converge; check dome and depths')
    found = [identify(explain, [starts[int(np.argmin(squares))]], prior, EVALUATIONS)
             for prior, starts, squares in zip(priors, tried, left) if squares.min() < HOPELESS * least]
    return DomeNumbers.from_logs(min(found, key=lambda solution: solution[1])[0])


def _explained(places: list[_Place], tried: list[np.ndarray], **known) -> list[np.ndarray]:
    """Residuals (N,) of the places for each of the logs tried, over their standard deviation: errors of the model are alike at all markers,
    so that all of them tell as much as one does."""
    solved = in_parallel(partial(_residuals, **known), [(place, logs) for logs in tried for place in places],
                         'presses simulated for the identification')
    reported = [np.concatenate(solved[k * len(places):(k + 1) * len(places)]) for k in range(len(tried))]
    seen = np.concatenate([np.isfinite(place.shifts).ravel() for place in places])
    return [np.nan_to_num(one[seen], nan=UNSOLVED) / (TRUST * np.sqrt(seen.sum())) for one in reported]


def _places(presses: Presses) -> list[_Place]:
    """The places pressed, at most PLACES; without frames of the tip's retreat, when friction has turned."""
    number, deepest, loading = presses.places(), presses.depth.max(), presses.loading()
    across = np.hypot(*presses.position[:, :2].T)
    order = sorted(range(number.max() + 1), key=lambda k: across[number == k].mean())
    places = []
    for k in [order[i] for i in np.unique(np.linspace(0, len(order) - 1, PLACES).round().astype(int))]:
        mine = np.flatnonzero((number == k) & loading)
        mine = mine[np.argsort(presses.depth[mine])]
        mine = mine[np.unique(np.linspace(0, len(mine) - 1, DEPTHS + 1).round().astype(int)[1:])]
        x, y = presses.position[mine, :2].mean(0)
        depths = presses.depth[mine]
        depths = depths + 1e-7 * np.arange(len(depths))  # rising, even where two are equal
        shifts = np.array([presses.fields[i].shift for i in mine])
        places.append(_Place(float(np.hypot(x, y)), float(np.arctan2(y, x)), depths, shifts, 1 / np.hypot(depths, SHALLOW * deepest)))
    return places


def _residuals(case: tuple[_Place, np.ndarray], points: np.ndarray, camera_centres: np.ndarray, cap: Cap, plane_z: float,
               marker: float) -> np.ndarray:
    """Weighted residuals of one place with numbers of those logs; NaN where unknown or not converged."""
    place, numbers = case[0], DomeNumbers.from_logs(case[1])
    mesh = DomeMesh(shift_of(place.across, numbers.radius, cap), cap, MeshPlan())
    steps = load_steps(place.depths)
    pressed = press_dome(mesh, steps, numbers.radius, numbers.material, drags=0).straight[np.searchsorted(steps, place.depths)]
    cos, sin = np.cos(place.turn), np.sin(place.turn)
    turned = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    known = np.isfinite(points).all(axis=1)
    rest, camera_centres, left = outlines(points[known], marker, cap), camera_centres[known], []
    before, away = appear_at(rest, camera_centres), plane_z - camera_centres[:, 2:]
    for field, shift, weight in zip(pressed, place.shifts, place.weights):
        moved = evaluate(field, mesh, rest.reshape(-1, 3) @ turned.T) @ turned
        off = np.full(shift.shape, np.nan)
        off[known] = (appear_at(rest + moved.reshape(rest.shape), camera_centres) - before) * away - shift[known]
        left.append(off.ravel() * weight)
    return np.concatenate(left)


def load_steps(stops: np.ndarray) -> np.ndarray:
    """Load steps, m, through rising stops, m."""
    fine = stops[-1] * (np.arange(1, LOAD_STEPS + 1) / LOAD_STEPS)**DEPTH_POWER
    between = fine[np.abs(fine[:, None] - stops).min(1) > 0.3 * stops[-1] / LOAD_STEPS]
    return np.union1d(between, stops)


FEWEST = 6            # presses needed. Chosen
DEEPER = 1.15         # simulated depth over the deepest calibrated press. Chosen
FARTHER = 1.5         # pitches by which the library reaches farther out than the presses. Chosen
LIKELY = DomeMaterial(0.7, 70.0, 0.5)  # start of the identification: sealed air at 1.5 kPa. Chosen
RADII = np.arange(2e-3, 0.0801, 5e-4)  # m, candidates for the start of the tip's radius
LIKELY_MARKER = 0.3   # of the pitch: radius of a marker whose area is unknown. Chosen
TOP = 0.35            # of the rim's radius: markers nearer to the axis tell their radius. Chosen
STILL = 2e-5          # m, noise without untouched frames. Chosen
SHARES = 0.003, 0.002  # least model error over a marker's displacement, and over the greatest. Chosen
NUMBERS = ('place_error', 'depth_share', 'depth_error', 'wider', 'deeper', 'deeper_far', 'deeper_shallow', 'deepest', 'farthest', 'quiet')
MOST_PRESSES = 60             # presses that tell the noise, at most. Chosen
SAME = replace(STRAIGHT, rougher=0.0, wider=0.0)  # of presses by the tip and with the friction that are identified
REWEIGHTED = 20       # times that the least absolute errors are weighed. Chosen


@dataclass(frozen=True)
class DomeCalibration:
    """library; material; rest: (K, 2) m, and camera_centres (K, 3) m, untouched markers in the viewing plane and their cameras; noise: of
    fields, with the model error; place_error: m, and depth_share: standard deviations of the remaining errors of place, and of depth
    over depth; depth_error: m, that of depth where presses are shallow; wider: fitted distance from the axis over the true one; deeper,
    deeper_far, deeper_shallow: see depth_scale; deepest, farthest: m, calibrated depth, and distance from the axis; quiet: greatest
    match of an untouched frame.
    """

    library: DomeLibrary
    material: DomeMaterial
    rest: np.ndarray
    camera_centres: np.ndarray
    noise: FieldNoise
    place_error: float
    depth_share: float
    depth_error: float
    wider: float
    deeper: float
    deeper_far: float
    deeper_shallow: float
    deepest: float
    farthest: float
    quiet: float

    def points(self, sensor: MarkerSensor) -> np.ndarray:
        """(K, 3) m, places of the untouched markers; NaN unknown."""
        return centres_of(self.rest, self.camera_centres, self.library.plan.marker, sensor)

    def depth_scale(self, place: np.ndarray, depth: float) -> float:
        """Fitted depth over the true one at a place (2,), m, and a fitted depth, m."""
        far = min(place @ place / self.farthest**2, 1.0)
        shallow = self.deeper_shallow * _shallowness(depth, self.deepest)
        return float(self.deeper + (self.deeper_far - self.deeper) * far + shallow)

    def numbers(self) -> dict:
        """As numbers and arrays, for a calibration file."""
        plain = {name: getattr(self, name) for name in NUMBERS}
        return plain | {'material': asdict(self.material), 'rest': self.rest, 'camera_centre': self.camera_centres,
                        'noise': asdict(self.noise), 'library': library_numbers(self.library)}

    @classmethod
    def from_numbers(cls, numbers: Mapping) -> DomeCalibration:
        """From these numbers. Raises BadCalibration where one is missing or invalid."""
        try:
            plain = [float(numbers[name]) for name in NUMBERS]
            rest, camera_centres = np.array(numbers['rest'], float).reshape(-1, 2), np.array(numbers['camera_centre'], float).reshape(-1, 3)
            if len(rest) != len(camera_centres):
                raise ValueError('rest and camera centre differ in length')
            return cls(library_from_numbers(numbers['library']), DomeMaterial(**numbers['material']), rest, camera_centres,
                       FieldNoise(**numbers['noise']), *plain)
        except (KeyError, TypeError, ValueError) as error:
            raise BadCalibration(f'the dome model in the calibration file cannot be read ({error!r}); run calibrate again') from None


def calibrate_dome(presses: Presses, sensor: MarkerSensor, known: DomeCalibration | None = None) -> DomeCalibration:
    """Calibrate a dome from presses by one round tip; known: a calibration whose library is taken. Raises BadCalibration where the presses
    do not determine it.
    """
    straight = presses.select(presses.straight() & np.array([field.seen.sum() > len(field) / 4 for field in presses.fields]))
    if sensor.is_sheet or len(straight) < FEWEST:
        raise BadCalibration(f'the dome model needs a dome and {FEWEST} straight presses at known places, got {len(straight)} on '
                             f'{sensor.type}')
    rest, camera_centres = common_rest(presses.fields)
    deepest, reached = float(straight.depth.max()), float(np.hypot(*straight.position[:, :2].T).max())
    library, material = (known.library, known.material) if known else _simulated(straight, rest, camera_centres, sensor, deepest, reached)
    still = [field for field, on in zip(presses.fields, presses.touching) if not on]
    noise = FieldNoise(_still(still), *SHARES)
    first = DomeCalibration(library, material, rest, camera_centres, noise, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, deepest,
                            reached + max(sensor.pitch), 0.0)
    some = straight.select(np.isin(np.arange(len(straight)), np.linspace(0, len(straight) - 1, MOST_PRESSES).astype(int)))
    inverse = _inverse(first, noise, sensor)
    inverse = _inverse(first, noise := _with_model_error(inverse, some), sensor)
    quiet = max((inverse.score(field, inverse.match(field)) for field in still), default=0.0)
    found = [inverse.solve(field, _true(place, depth), SAME) for field, place, depth in _rows(some)]
    return replace(_with_remaining_errors(first, found, some), noise=noise, quiet=float(quiet))


def _simulated(presses: Presses, rest: np.ndarray, camera_centres: np.ndarray, sensor: MarkerSensor, deepest: float,
               reached: float) -> tuple[DomeLibrary, DomeMaterial]:
    """Library and material of the dome."""
    marker, cap = _marker_radius(presses.fields[0], rest_points(rest, camera_centres, sensor), camera_centres, sensor), dome_cap(sensor)
    points = centres_of(rest, camera_centres, marker, sensor)
    start = DomeNumbers(LIKELY, _tip_radius(presses, sensor))
    found = identify_dome(presses, points, np.nan_to_num(camera_centres), cap, sensor.plane_z, marker, start)
    reach = min(reached + FARTHER * max(sensor.pitch), 0.9 * sensor.rim_radius)
    camera_centre = float(np.nanmedian(camera_centres[:, 2]))
    plan = DomePlan(sensor.rim_radius, sensor.height, found.radius, found.material.friction, DEEPER * deepest, reach, marker, camera_centre)
    return build_library(plan, found.material), found.material


def _marker_radius(field: MarkerField, points: np.ndarray, camera_centres: np.ndarray, sensor: MarkerSensor) -> float:
    """m: median radius of the untouched markers round the top, where they face the camera; points, camera_centres: (K, 3) m."""
    nearer = (points[:, 2] - camera_centres[:, 2]) / (sensor.plane_z - camera_centres[:, 2])  # on the dome than in the viewing plane
    radius = marker_radii(field) * nearer
    known = radius[np.isfinite(radius) & (np.hypot(*points[:, :2].T) < TOP * sensor.rim_radius)]
    return float(np.median(known)) if len(known) else LIKELY_MARKER * max(sensor.pitch)


def _tip_radius(presses: Presses, sensor: MarkerSensor) -> float:
    """Tip radius, m, for which the height of first contact fits the presses best."""
    first = presses.position[:, 2] + presses.depth
    off = [np.nansum((first_touch_height(presses.position[:, :2], radius, sensor) - first)**2) for radius in RADII]
    return float(RADII[int(np.argmin(off))])


def _still(fields: list) -> float:
    """m, noise of untouched fields per axis: their own mean is the reference."""
    if len(fields) < 2:
        return STILL
    return max(float(np.sqrt(np.nanmean([field.shift**2 for field in fields]) * len(fields) / (len(fields) - 1))), 1e-6)


def _inverse(calibration: DomeCalibration, noise: FieldNoise, sensor: MarkerSensor) -> DomeInverse:
    return DomeInverse(calibration.library, noise, calibration.points(sensor), calibration.camera_centres, sensor.plane_z,
                       max(sensor.pitch))


def _rows(presses: Presses):
    return zip(presses.fields, presses.position[:, :2], presses.depth)


def _true(place: np.ndarray, depth: float) -> np.ndarray:
    """(1, 7), the press of the calibrated tip."""
    return np.array([[*place, np.log(depth), 0.0, 0.0, 0.0, 0.0]])


def _with_model_error(inverse: DomeInverse, presses: Presses) -> FieldNoise:
    """The noise with the model error, over the greatest displacement, that the presses' residuals at their true places show."""
    over = []
    for field, place, depth in _rows(presses):
        size, seen = np.hypot(*np.nan_to_num(field.shift).T), field.seen
        left = np.mean((field.shift - inverse.appear(_true(place, depth)))[seen]**2) - np.mean(inverse.sigma(field)[seen]**2)
        over.append(max(left, 0.0) / np.mean(0.5 * size[seen]**2 + 0.5 * size.max()**2 * np.ones(seen.sum())))
    share = float(np.sqrt(np.median(over)))
    return FieldNoise(inverse.noise.still, max(SHARES[0], 0.7 * share), max(SHARES[1], 0.7 * share))


def _with_remaining_errors(known: DomeCalibration, found: list[DomeFound], presses: Presses) -> DomeCalibration:
    """The calibration with scales that most presses show, and with the standard deviations of place and of depth over depth that the
    estimates show beyond their covariances and scales.

    Tip radius, depth and distance from the axis are reported together: errors of the model show there, most where a press is shallow. One
    exact
    press at the farthest is added: presses near the axis hardly tell what is there.
    """
    deep = presses.depth > SHALLOW * presses.depth.max()
    reported, true = np.array([one.presses[0] for one in found])[deep], presses.position[deep, :2]
    away, depth = np.maximum(np.hypot(*true.T), 1e-9), np.exp(reported[:, DEPTH])
    shallow = _shallowness(depth, known.deepest)
    places = reported[:, :2]
    out, far, shallow = (np.append(part, end) for part, end in ((np.sum(places * true, axis=1) / away, known.farthest),
                                                                 (away, known.farthest), (shallow, SHALLOW)))
    wider, = _least_absolute(far[:, None], out)
    deeper, change, deeper_shallow = _least_absolute(np.column_stack([np.ones(len(far)), (far / known.farthest)**2, shallow]),
                                                     np.append(depth / presses.depth[deep], 1.0))
    scaled = replace(known, wider=float(wider), deeper=float(deeper), deeper_far=float(deeper + change),
                     deeper_shallow=float(deeper_shallow))
    variance = np.array([np.diag(one.covariance)[:3] for one in found])[deep]
    scale = np.array([scaled.depth_scale(place, fitted) for place, fitted in zip(true, depth)])
    place = np.median(np.mean((places / wider - true)**2 - variance[:, :2], axis=1))
    share = np.median((depth / presses.depth[deep] - scale)**2 - variance[:, 2])
    scaled = replace(scaled, place_error=float(np.sqrt(max(place, 0.0))), depth_share=float(np.sqrt(max(share, 0.0))))
    return replace(scaled, depth_error=_shallow_error(scaled, [one for one, kept in zip(found, deep) if not kept], presses.select(~deep)))


def _shallow_error(known: DomeCalibration, found: list[DomeFound], presses: Presses) -> float:
    """m: standard deviation that depths of shallow presses, of which the scales know nothing, show beyond their covariances; 0 of too
    few."""
    if len(found) < FEWEST:
        return 0.0
    over = []
    for one, place, depth in zip(found, presses.position[:, :2], presses.depth):
        reported = float(np.exp(one.presses[0, DEPTH]))
        over.append((reported / known.depth_scale(place, reported) - depth)**2 - one.covariance[DEPTH, DEPTH] * reported**2)
    return float(np.sqrt(max(np.median(over), 0.0)))


def _shallowness(depth: np.ndarray, deepest: float) -> np.ndarray:
    """(...) of fitted depths (...), m: 1 for those up to SHALLOW of the deepest, from there on in inverse proportion to depth."""
    return SHALLOW * deepest / np.maximum(depth, SHALLOW * deepest)


def _least_absolute(matrix: np.ndarray, values: np.ndarray) -> np.ndarray:
    """(n,) solution of matrix (N, n) for values (N,) with the least sum of absolute errors, by reweighted least squares."""
    weight = np.ones(len(values))
    for _ in range(REWEIGHTED):
        found = np.linalg.lstsq(matrix * weight[:, None], values * weight, rcond=None)[0]
        left = np.abs(values - matrix @ found)
        weight = 1 / np.sqrt(left + 1e-3 * left.max() + 1e-12)
    return found
