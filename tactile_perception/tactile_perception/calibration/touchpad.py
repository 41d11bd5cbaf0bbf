# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of the touchpad's surface model with presses of a known sphere at known places."""
from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..common.camera import CameraModel
from ..common.spherical_cap import Cap
from ..common.statistics import robust_sigma
from ..errors import BadArgument, BadCalibration, BadFrame
from .residuals import Residuals
from .sphere_presses import OnSphere, Press, dots_on_sphere
from ..touchpad.optics.absorption import WaterModel
from ..touchpad.optics.colour import RING_PIXELS, RingColours
from ..touchpad.optics.identification import Colours, OpticsPrior, as_ring_colours, fit, fit_rest, model_from, rest_colours

MINIMUM_DEPTH = 3e-4  # m: a shallower press holds too few dots on the sphere
MINIMUM_SPAN = 1e-3   # m, between the shallowest and the deepest press
MINIMUM_SPREAD = 2e-3  # m, between the places pressed
MINIMUM_DOTS = 20     # on the sphere, over all presses
LARGEST_SCALE_SIGMA = 0.03  # relative error of a dent's depth that may be left
SCALE_FLOOR = 0.005   # of it: what the path model itself leaves open
UPRIGHT = 0.9998      # z of a normal that stands along the stage's axis, within a degree
OUTLIER = 4.0         # standard deviations (robust): a dot that the first fit puts so far from the sphere does not lie on it


@dataclass
class TouchpadCalibration:
    """What a fit found, in SI units.

    model: calibrated; sphere_radius: m, as given; presses, dots: used; residual_rms, residual_bias: m, of ranges of dots on the sphere;
    held_out_rms: m, the same for places that the fit did not see (each left out in turn; NaN with two places); depth_range: m; place_range:
    (2, 2) smallest and largest x, y, m; left_out: a line for each press not used; held_out: of each press, at a place that the fit did not
    see.
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
    """The touchpad's water and light from untouched frames and presses of a sphere of sphere_radius (m) at known places and depths.

    Needs at least one untouched frame, two places at least 2 mm apart, and depths that span 1 mm or more. Where normals stand askew they
    may be the membrane's instead of the stage's: both readings are tried, the better kept, and left_out says so. Raises BadCalibration,
    naming what to add, where the data cannot determine the model.
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
    """Root mean square range error, m, that fit_touchpad leaves with a sphere of this radius (m), upright on its tip; raises as it does."""
    upright = [replace(press, normal=np.array([0.0, 0.0, 1.0])) for press in presses]
    model, _, groups, _ = _solve(upright, camera, sphere_radius, cap, OpticsPrior())
    return _rms(np.concatenate([range_errors(model, group) for group in groups]))


def _fit_presses(presses: list[Press], camera: CameraModel, sphere_radius: float, cap: Cap, prior: OpticsPrior) -> TouchpadCalibration:
    """The fit with the normals as they are."""
    model, ground, groups, left_out = _solve(presses, camera, sphere_radius, cap, prior)
    return _report(model, ground, groups, camera, sphere_radius, prior, left_out)


def _solve(presses: list[Press], camera: CameraModel, sphere_radius: float, cap: Cap, prior: OpticsPrior) -> tuple:
    """The model, the ground's colours, the dots on the sphere of each press, and a line for each press or dot left out."""
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
    """Presses that can serve, and a line for each that cannot."""
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
    """Raises BadCalibration where rest frames, presses, places or depths are too few."""
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
    """Dots on the sphere in each press; a line for each press without one or with an image that cannot be read."""
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
    """The model that explains the ground at rest and the dots on the sphere."""
    q, covariance, _ = fit(ground.joined([group.colours for group in groups]), camera, prior)
    model = model_from(q, covariance, first.noise, first.ring, camera, first.cap)
    return replace(model, scale_sigma=float(np.hypot(model.scale_sigma, SCALE_FLOOR)), ring_share=first.ring_share)


def range_errors(model: WaterModel, group: OnSphere) -> np.ndarray:
    """Measured less true distances (M,), m, along the rays, of dots on the sphere (ring means, as they are measured)."""
    length, _ = model.path_lengths(RingColours(group.colours.ratios, group.count, np.zeros(len(group.count))))
    true, slope = model.path.lengths(group.colours.places, group.colours.normals)
    return (length - true) / slope


def _trim(groups: list[OnSphere], model: WaterModel) -> tuple[list[OnSphere], list[str]]:
    """Groups without the dots that turn out not to lie on the sphere, and a line that says how many those were."""
    errors = [range_errors(model, group) for group in groups]
    size = np.abs(np.concatenate(errors) - np.median(np.concatenate(errors)))
    limit = OUTLIER * robust_sigma(size)
    kept = [group.select(np.abs(error) <= limit) for group, error in zip(groups, errors)]
    gone = sum(len(g.count) for g in groups) - sum(len(g.count) for g in kept)
    line = [f'{gone} dots at the edge of a contact, over {limit * 1e3:.2f} mm off the sphere'] if gone else []
    return [group for group in kept if len(group.count)], line


def _held_out(ground: Colours, groups: list[OnSphere], first: WaterModel, camera: CameraModel, prior: OpticsPrior) -> list[np.ndarray]:
    """Range errors (M,), m, of each press, its place and those near it left out of the fit; none with fewer than three places."""
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
    """Mean and scatter of each press's range errors, over the pad."""
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
