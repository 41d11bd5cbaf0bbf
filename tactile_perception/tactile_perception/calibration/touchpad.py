# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of the touchpad's optics by presses of a known sphere at known positions."""
from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..common.camera import CameraModel
from ..common.geometry import Cap
from ..common.statistics import robust_sigma
from ..errors import BadArgument, BadCalibration, BadFrame
from .residuals import Residuals
from .sphere_presses import OnSphere, Press, dots_on_sphere
from ..touchpad.optics.absorption import WaterModel
from ..touchpad.optics.colour import RING_PIXELS, RingColours
from ..touchpad.optics.identification import Colours, OpticsPrior, as_ring_colours, fit, fit_rest, model_from, rest_colours

MINIMUM_DEPTH = 3e-4  # m, chosen: too few dots of a shallower press lie on the sphere
MINIMUM_SPAN = 1e-3   # m, chosen: between the shallowest and the deepest press
MINIMUM_SPREAD = 2e-3  # m, chosen: between the positions pressed
MINIMUM_DOTS = 20     # on the sphere, over all presses; chosen
LARGEST_SCALE_SIGMA = 0.03  # chosen: largest relative standard deviation of the depth scale
SCALE_FLOOR = 0.005   # chosen: relative error of the depth scale that the light path model itself leaves
UPRIGHT = 0.9998      # chosen: z of a normal within about a degree of the stage's axis
OUTLIER = 4.0         # robust standard deviations, chosen: a dot farther from the sphere after the first fit does not lie on it


@dataclass
class TouchpadCalibration:
    """Result of a fit, in SI units.

    model: calibrated; sphere_radius: m; presses, dots: numbers used; residual_rms, residual_bias: of the ranges of dots on the sphere, m;
    held_out_rms: cross-validation RMS of the ranges, m, with each position left out in turn, NaN for fewer than three positions;
    depth_range: m; place_range: (2, 2) smallest and largest x, y, m; left_out: one line per press not used; held_out: cross-validation
    residuals of each press.
    """

    model: WaterModel
    sphere_radius: float
    presses: int
    dots: int
    residual_rms: float
    residual_bias: float
    held_out_rms: float
    depth_range: tuple[float, float]
    place_range: np.ndarray
    left_out: list[str]
    held_out: list[Residuals] = field(default_factory=list)


def fit_touchpad(presses: list[Press], camera: CameraModel, sphere_radius: float, cap: Cap = Cap(),
                 prior: OpticsPrior = OpticsPrior()) -> TouchpadCalibration:
    """Fit the absorption and light path to untouched frames and presses of a sphere of sphere_radius (m) at known positions and depths.

    Needs at least one untouched frame, three presses, positions that span at least 2 mm, depths that span at least 1 mm. Tilted normals
    may be those of the membrane instead of the stage: both readings are fitted and the better one is kept, which left_out reports. Raises
    BadCalibration, naming what to add, for data that do not determine the model.
    """
    if not (np.isfinite(sphere_radius) and sphere_radius > 0):
        raise BadCalibration(f'touchpad calibration: sphere radius must be a positive number of metres, got {sphere_radius}')
    if all(press.normal[2] > UPRIGHT for press in presses if press.touching):
        return _fit_presses(presses, camera, sphere_radius, cap, prior)
    upright = _fit_presses([replace(press, normal=np.array([0.0, 0.0, 1.0])) for press in presses], camera, sphere_radius, cap, prior)
    try:
        given = _fit_presses(presses, camera, sphere_radius, cap, prior)
    except (BadCalibration, BadArgument):
        given = upright
    if given is not upright and given.residual_rms <= upright.residual_rms:
        return given
    upright.left_out.append('normals of the contacts: with the sphere straight above its tip the dots fit better')
    return upright


def sphere_misfit(presses: list[Press], camera: CameraModel, sphere_radius: float, cap: Cap = Cap()) -> float:
    """RMS range error, m, of a fit with a sphere of this radius (m) and vertical normals; raises as fit_touchpad does."""
    upright = [replace(press, normal=np.array([0.0, 0.0, 1.0])) for press in presses]
    model, _, groups, _ = _solve(upright, camera, sphere_radius, cap, OpticsPrior())
    return _rms(np.concatenate([range_errors(model, group) for group in groups]))


def _fit_presses(presses: list[Press], camera: CameraModel, sphere_radius: float, cap: Cap, prior: OpticsPrior) -> TouchpadCalibration:
    """Fit with the normals as given."""
    model, ground, groups, left_out = _solve(presses, camera, sphere_radius, cap, prior)
    return _report(model, ground, groups, camera, sphere_radius, prior, left_out)


def _solve(presses: list[Press], camera: CameraModel, sphere_radius: float, cap: Cap, prior: OpticsPrior) -> tuple:
    """Model, colours at rest, dots on the sphere of each press, and one line per press or group of dots left out."""
    rest = [p for p in presses if not p.touching]
    used, left_out = _usable([p for p in presses if p.touching])
    _require_coverage(rest, used, left_out)
    first = fit_rest(rest[0].image, rest[0].tracks.uv, camera, cap, prior)
    image = np.mean([p.image for p in rest], axis=0, dtype=np.float32)
    ground = as_ring_colours(rest_colours(image, camera, cap, first.ring, first.noise * (RING_PIXELS / len(rest))), first, camera.centre)
    on_sphere, empty = _read(used, first, camera, sphere_radius)
    dots = sum(len(group.count) for group in on_sphere)
    if dots < MINIMUM_DOTS:
        raise BadCalibration(f'touchpad calibration: only {dots} dots lie on the sphere, {MINIMUM_DOTS} needed; check sphere radius and '
                             f'ground_truth/contacts, add presses deeper than 1 mm ({"; ".join(empty) or "no press is empty"})')
    model = _fit(ground, on_sphere, first, camera, prior)
    on_sphere, dropped = _trim(on_sphere, model)
    model = _fit(ground, on_sphere, first, camera, prior)
    if model.scale_sigma > LARGEST_SCALE_SIGMA:
        raise BadCalibration(f'touchpad calibration: a dent\'s depth stays uncertain by {model.scale_sigma:.1%}, '
                             f'{LARGEST_SCALE_SIGMA:.0%} allowed; add deeper presses at more places')
    return model, ground, on_sphere, left_out + empty + dropped


def _usable(presses: list[Press]) -> tuple[list[Press], list[str]]:
    """Presses that can be used, and one line per press that cannot."""
    used, left_out = [], []
    for press in presses:
        if press.depth < MINIMUM_DEPTH:
            left_out.append(f'{press.label}: {press.depth * 1e3:.2f} mm deep, less than {MINIMUM_DEPTH * 1e3:.1f} mm')
        elif len(press.tracks) < 9:
            left_out.append(f'{press.label}: only {len(press.tracks)} dots seen')
        else:
            used.append(press)
    return used, left_out


def _require_coverage(rest: list[Press], used: list[Press], left_out: list[str]):
    """Raise BadCalibration for too few rest frames, presses, positions or depths."""
    tail = f' (left out: {"; ".join(left_out)})' if left_out else ''
    if not rest:
        raise BadCalibration('touchpad calibration: no untouched frame; add a second of recording before the first press')
    if len(used) < 3:
        raise BadCalibration(f'touchpad calibration: {len(used)} usable presses, at least 3 needed; rest frames alone cannot tell how '
                             f'fast the water absorbs; add sphere presses of 1 to 4 mm at several places{tail}')
    depths, tips = np.array([p.depth for p in used]), np.array([p.tip for p in used])
    if np.ptp(depths) < MINIMUM_SPAN:
        raise BadCalibration(f'touchpad calibration: depths span {np.ptp(depths) * 1e3:.2f} mm, {MINIMUM_SPAN * 1e3:.0f} mm needed; '
                             f'add presses of other depths{tail}')
    spread = float(np.linalg.norm(tips[:, :2] - tips[0, :2], axis=1).max())
    if spread < MINIMUM_SPREAD:
        raise BadCalibration(f'touchpad calibration: all presses lie within {spread * 1e3:.2f} mm of one place, '
                             f'{MINIMUM_SPREAD * 1e3:.0f} mm needed; press at other places too{tail}')


def _read(presses: list[Press], model: WaterModel, camera: CameraModel, radius: float) -> tuple[list[OnSphere], list[str]]:
    """Dots on the sphere of each press; one line per press without one or with an unusable image."""
    found, empty = [], []
    for press in presses:
        try:
            group = dots_on_sphere(press, radius, model, camera)
        except BadFrame as error:
            empty.append(f'{press.label}: {error}')
            continue
        if len(group.count):
            found.append(group)
        else:
            empty.append(f'{press.label}: no dot lies on the sphere')
    return found, empty


def _fit(ground: Colours, groups: list[OnSphere], first: WaterModel, camera: CameraModel, prior: OpticsPrior) -> WaterModel:
    """Model fitted to the colours at rest and on the sphere."""
    q, covariance, _ = fit(ground.joined([group.colours for group in groups]), camera, prior)
    model = model_from(q, covariance, first.noise, first.ring, camera, first.cap)
    return replace(model, scale_sigma=float(np.hypot(model.scale_sigma, SCALE_FLOOR)), ring_share=first.ring_share)


def range_errors(model: WaterModel, group: OnSphere) -> np.ndarray:
    """Range errors (M,), m: measured less true distances along the rays of dots on the sphere (ring means, as in use)."""
    unknown, even = np.full(len(group.count), np.nan), np.zeros(len(group.count))
    length, _ = model.path_lengths(RingColours(group.colours.ratios, unknown, group.count, even))
    true, slope = model.path.lengths(group.colours.places, group.colours.normals)
    return (length - true) / slope


def _trim(groups: list[OnSphere], model: WaterModel) -> tuple[list[OnSphere], list[str]]:
    """Groups without the dots that are not on the sphere, and a line with the number removed."""
    errors = [range_errors(model, group) for group in groups]
    size = np.abs(np.concatenate(errors) - np.median(np.concatenate(errors)))
    limit = OUTLIER * robust_sigma(size)
    kept = [group.select(np.abs(error) <= limit) for group, error in zip(groups, errors)]
    gone = sum(len(g.count) for g in groups) - sum(len(g.count) for g in kept)
    line = [f'{gone} dots at the edge of a contact, over {limit * 1e3:.2f} mm off the sphere'] if gone else []
    return [group for group in kept if len(group.count)], line


def _held_out(ground: Colours, groups: list[OnSphere], first: WaterModel, camera: CameraModel, prior: OpticsPrior) -> list[np.ndarray]:
    """Cross-validation range errors (M,), m, of each press in a fit without the presses near it; NaN for fewer than three positions."""
    places = np.array([np.round(group.tip[:2] / MINIMUM_SPREAD) for group in groups])
    keys = np.unique(places, axis=0)
    errors = [np.full(1, np.nan)] * len(groups)
    for key in keys if len(keys) >= 3 else ():
        out = (places == key).all(1)
        model = _fit(ground, [g for g, leave in zip(groups, out) if not leave], first, camera, prior)
        for k in np.flatnonzero(out):
            errors[k] = range_errors(model, groups[k])
    return errors


def _residuals(groups: list[OnSphere], errors: list[np.ndarray]) -> list[Residuals]:
    """Mean and RMS of the range errors of each press over the pad."""
    tips, labels = 1e3 * np.array([group.tip[:2] for group in groups]), [group.label for group in groups]
    return [Residuals(name, 'mm', 1e3 * np.array([measure(error) for error in errors]), tips, ('x (mm)', 'y (mm)'), labels)
            for name, measure in (('range, mean of a press', np.mean), ('range, RMS of a press', _rms))]


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _report(model, ground, groups, camera, radius, prior, left_out) -> TouchpadCalibration:
    errors = np.concatenate([range_errors(model, group) for group in groups])
    held_out = _held_out(ground, groups, model, camera, prior)
    tips = np.array([group.tip for group in groups])
    depths = [group.depth for group in groups]
    return TouchpadCalibration(model, radius, len(groups), len(errors), _rms(errors), float(errors.mean()), _rms(np.concatenate(held_out)),
                               (min(depths), max(depths)), np.array([tips[:, :2].min(0), tips[:, :2].max(0)]), left_out,
                               _residuals(groups, held_out))
