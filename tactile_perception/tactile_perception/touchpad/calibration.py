# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of a touchpad by presses of a sphere at known places, and its file."""
from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..calibration.files.format import AGAIN, CalibrationFile, Specimen, fitted_arrays, read_calibration
from ..calibration.residuals import Residuals
from ..common.camera import CameraModel
from ..common.dots import DotTracks
from ..common.geometry import Cap, sphere_ranges
from ..errors import BadArgument, BadCalibration, BadFrame
from .identification import Colours, as_ring_colours, fit, fit_rest, model_from, rest_colours, ring_covariances
from .water import RING_PIXELS, LightPath, RingColours, WaterModel, log_ratios

SMALLEST, LARGEST = 2e-3, 30e-3  # m, chosen: bounds of the sphere's radius
TOLERANCE = 0.01  # relative, chosen: accuracy of the radius


def find_sphere_radius(misfit: Callable[[float], float]) -> float:
    """Radius, m, that minimises misfit(radius), m. Raises BadCalibration without a minimum between 2 and 30 mm."""
    def at(log_radius: float) -> float:
        """Misfit, m, at exp(log_radius); 1 where the fit fails."""
        try:
            return misfit(float(np.exp(log_radius)))
        except BadCalibration:
            return 1.0
    coarse = np.linspace(np.log(SMALLEST), np.log(LARGEST), 9)
    values = [at(x) for x in coarse]
    best = int(np.argmin(values))
    if best in (0, len(coarse) - 1) or values[best] >= 1.0:
        raise BadCalibration(f'touchpad calibration: no sphere of {SMALLEST * 1e3:.0f} to {LARGEST * 1e3:.0f} mm radius fits the presses; '
                             'give its radius with --sphere-radius, and check that ground_truth/contacts holds the tips of sphere presses')
    import scipy.optimize  # calibration alone needs it
    found = scipy.optimize.minimize_scalar(at, bounds=(coarse[best - 1], coarse[best + 1]), method='bounded', options={'xatol': TOLERANCE})
    return float(np.exp(found.x))


PENETRATION = 0.5  # of the deepest penetration, chosen: where the sphere is this deep inside the cap at rest, the membrane lies on it
RING = 8           # points on the sampling ring of a dot that must lie on the sphere, chosen


@dataclass
class Press:
    """A static frame of the touchpad with the pose of the sphere that the stage reports.

    image: (H, W, 3) uint8 BGR; tracks: its dots; tip: (3,) m, contact point of the sphere in the sensor frame, NaN without contact; depth:
    m, 0 without contact; name: for messages. The tip is the sphere's deepest point, straight below its centre.
    """

    image: np.ndarray
    tracks: DotTracks
    tip: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))
    depth: float = 0.0
    name: str = ''

    @property
    def touching(self) -> bool:
        """Whether the sphere touches in this frame."""
        return bool(self.depth > 0 and np.isfinite(self.tip).all())

    @property
    def label(self) -> str:
        """Name of the press in messages."""
        return self.name or 'press at ({:.1f}, {:.1f}) mm, {:.2f} mm deep'.format(*np.asarray(self.tip)[:2] * 1e3, self.depth * 1e3)


@dataclass
class OnSphere:
    """Dots of one press that lie on the sphere.

    colours: at the mean positions of their sampling rings; count: (M,) ring pixels used; tip: (3,) m; depth: m; label: name of the press
    in messages.
    """

    colours: Colours
    count: np.ndarray
    tip: np.ndarray
    depth: float
    label: str = ''


def dots_on_sphere(press: Press, radius: float, model: WaterModel, camera: CameraModel) -> OnSphere:
    """Dots of a press whose sampling rings lie on the sphere (radius, m): where it is deep inside the cap at rest (PENETRATION).

    The result may hold no dot. Raises BadFrame for an image without colour.
    """
    centre = np.asarray(press.tip) + [0, 0, radius]
    angle = np.arange(RING) * (2 * np.pi / RING)
    ring = model.ring * np.column_stack([np.cos(angle), np.sin(angle)])
    rays = camera.rays((press.tracks.uv[:, None] + ring).reshape(-1, 2))
    near, _ = sphere_ranges(camera.centre, rays, centre, radius)
    inside = np.nan_to_num(model.cap.ranges(camera.centre, rays) - near, nan=-1.0).reshape(-1, RING)
    rings = log_ratios(press.image, press.tracks.uv, model.ring)
    on = (inside.min(1) > PENETRATION * max(inside.max(initial=0.0), 1e-6)) & np.isfinite(rings.ratios).all(1)
    places = (camera.centre + near[:, None] * rays).reshape(-1, RING, 3)[on].mean(1)
    normals = centre - places
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    colours = Colours(rings.ratios[on], ring_covariances(model.noise, rings.count[on]), places, normals)
    return OnSphere(colours, rings.count[on], np.asarray(press.tip, float), float(press.depth), press.label)


MINIMUM_DEPTH = 3e-4  # m, chosen: too few dots of a shallower press lie on the sphere
MINIMUM_SPAN = 1e-3   # m, chosen: between the shallowest and the deepest press
MINIMUM_SPREAD = 2e-3  # m, chosen: between the positions pressed
MINIMUM_DOTS = 20     # on the sphere, over all presses; chosen
LARGEST_SCALE_SIGMA = 0.03  # chosen: largest relative standard deviation of the depth scale
SCALE_FLOOR = 0.005   # chosen: relative error of the depth scale that the light path model itself leaves


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


def fit_touchpad(presses: list[Press], camera: CameraModel, sphere_radius: float, cap: Cap = Cap()) -> TouchpadCalibration:
    """Fit the absorption and light path to untouched frames and presses of a sphere of sphere_radius (m) at known positions and depths.

    Needs at least one untouched frame, three presses, positions that span at least 2 mm, depths that span at least 1 mm. Raises
    BadCalibration, naming what to add, for data that do not determine the model.
    """
    if not (np.isfinite(sphere_radius) and sphere_radius > 0):
        raise BadCalibration(f'touchpad calibration: sphere radius must be a positive number of metres, got {sphere_radius}')
    model, ground, groups, left_out = _solve(presses, camera, sphere_radius, cap)
    errors = np.concatenate([range_errors(model, group) for group in groups])
    held_out = _held_out(ground, groups, model, camera)
    tips = np.array([group.tip for group in groups])
    depths = [group.depth for group in groups]
    return TouchpadCalibration(model, sphere_radius, len(groups), len(errors), _rms(errors), float(errors.mean()),
                               _rms(np.concatenate(held_out)), (min(depths), max(depths)),
                               np.array([tips[:, :2].min(0), tips[:, :2].max(0)]), left_out, _residuals(groups, held_out))


def sphere_misfit(presses: list[Press], camera: CameraModel, sphere_radius: float, cap: Cap = Cap()) -> float:
    """RMS range error, m, of a fit with a sphere of this radius (m); raises as fit_touchpad does."""
    model, _, groups, _ = _solve(presses, camera, sphere_radius, cap)
    return _rms(np.concatenate([range_errors(model, group) for group in groups]))


def _solve(presses: list[Press], camera: CameraModel, sphere_radius: float, cap: Cap) -> tuple:
    """Model, colours at rest, dots on the sphere of each press, and one line per press left out."""
    rest = [p for p in presses if not p.touching]
    used, left_out = _usable([p for p in presses if p.touching])
    _require_coverage(rest, used, left_out)
    first = fit_rest(rest[0].image, rest[0].tracks.uv, camera, cap)
    image = np.mean([p.image for p in rest], axis=0, dtype=np.float32)
    ground = as_ring_colours(rest_colours(image, camera, cap, first.ring, first.noise * (RING_PIXELS / len(rest))), first, camera.centre)
    on_sphere, empty = _read(used, first, camera, sphere_radius)
    dots = sum(len(group.count) for group in on_sphere)
    if dots < MINIMUM_DOTS:
        raise BadCalibration(f'touchpad calibration: only {dots} dots lie on the sphere, {MINIMUM_DOTS} needed; check sphere radius and '
                             f'ground_truth/contacts, add presses deeper than 1 mm ({"; ".join(empty) or "no press is empty"})')
    model = _fit(ground, on_sphere, first, camera)
    if model.scale_sigma > LARGEST_SCALE_SIGMA:
        raise BadCalibration(f'touchpad calibration: a dent\'s depth stays uncertain by {model.scale_sigma:.1%}, '
                             f'{LARGEST_SCALE_SIGMA:.0%} allowed; add deeper presses at more places')
    return model, ground, on_sphere, left_out + empty


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


def _fit(ground: Colours, groups: list[OnSphere], first: WaterModel, camera: CameraModel) -> WaterModel:
    """Model fitted to the colours at rest and on the sphere."""
    q, covariance = fit(ground.joined([group.colours for group in groups]), camera)
    model = model_from(q, covariance, first.noise, first.ring, camera, first.cap)
    return replace(model, scale_sigma=float(np.hypot(model.scale_sigma, SCALE_FLOOR)), ring_share=first.ring_share)


def range_errors(model: WaterModel, group: OnSphere) -> np.ndarray:
    """Range errors (M,), m: measured less true distances along the rays of dots on the sphere (ring means, as in use)."""
    unknown, even = np.full(len(group.count), np.nan), np.zeros(len(group.count))
    length, _ = model.path_lengths(RingColours(group.colours.ratios, unknown, group.count, even))
    true, slope = model.path.lengths(group.colours.places, group.colours.normals)
    return (length - true) / slope


def _held_out(ground: Colours, groups: list[OnSphere], first: WaterModel, camera: CameraModel) -> list[np.ndarray]:
    """Cross-validation range errors (M,), m, of each press in a fit without the presses near it; NaN for fewer than three positions."""
    places = np.array([np.round(group.tip[:2] / MINIMUM_SPREAD) for group in groups])
    keys = np.unique(places, axis=0)
    errors = [np.full(1, np.nan)] * len(groups)
    for key in keys if len(keys) >= 3 else ():
        out = (places == key).all(1)
        model = _fit(ground, [g for g, leave in zip(groups, out) if not leave], first, camera)
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


SENSOR = 'touchpad'
UNITS = {'lengths': 'm', 'absorptions': '1/m', 'ring': 'px', 'image_size': 'px', 'constants': 'log ratio blue/red, green/red',
         'noise': 'variance of log ratios', 'scale_sigma': '1', 'camera_centre': 'm'}
_LIGHT = 'window_z', 'lamp_z', 'lamp_radius', 'ambient'
_SHAPES = {**dict.fromkeys((*_LIGHT, 'ring', 'scale_sigma', 'curvature_radius', 'height'), ()), 'constants': (2,), 'absorptions': (2,),
           'noise': (2, 2), 'camera_centre': (3,), 'image_size': (2,)}
_POSITIVE = 'ring', 'absorptions', 'curvature_radius', 'height', 'scale_sigma', 'image_size'
POSE_TOLERANCE = 2e-4  # m, chosen: largest difference of the camera's position from that of the calibration


def touchpad_file(calibration: TouchpadCalibration, image_size: tuple[int, int], left_out: Sequence[str] = (),
                  specimen: Specimen = Specimen()) -> CalibrationFile:
    """The calibration file for images of image_size (width, height) px; left_out: one line each."""
    model = calibration.model
    values = {**dict(zip(_LIGHT, model.path.numbers)), 'ring': model.ring, 'scale_sigma': model.scale_sigma,
              'curvature_radius': model.cap.curvature_radius, 'height': model.cap.height, 'constants': model.constants,
              'absorptions': model.absorptions, 'noise': model.noise, 'camera_centre': model.path.centre, 'image_size': image_size}
    fitted = {name: np.asarray(value, float).tolist() for name, value in values.items()}
    residuals = {'range_rms': calibration.residual_rms, 'range_bias': calibration.residual_bias,
                 'held_out_places_range_rms': calibration.held_out_rms,
                 'presses': calibration.presses, 'dots': calibration.dots, 'sphere_radius': calibration.sphere_radius}
    low, high = np.asarray(calibration.place_range, float).tolist()
    span = {'depth': [float(v) for v in calibration.depth_range], 'x': [low[0], high[0]], 'y': [low[1], high[1]]}
    return CalibrationFile(SENSOR, UNITS, fitted, residuals, span, [*left_out, *calibration.left_out], serial=specimen.serial,
                           parameters=specimen.parameters(SENSOR))


def read_touchpad(path: str | Path, camera: CameraModel, image_size: tuple[int, int] | None = None) -> WaterModel:
    """Read the model. Raises BadCalibration for a bad file (read_calibration), a number that is missing or must be positive and is not, and
    another camera position or image_size (width, height) px; None skips the check of the size.
    """
    values = fitted_arrays(read_calibration(path, SENSOR).fitted, _SHAPES, path)
    for name in _POSITIVE:
        if not np.all(values[name] > 0):
            raise BadCalibration(f'{path}: fitted.{name} is {values[name]}, must be positive; {AGAIN}')
    if not (np.linalg.eigvalsh(values['noise']) > 0).all():
        raise BadCalibration(f'{path}: fitted.noise is no covariance; {AGAIN}')
    made_for = values['image_size'].astype(int).tolist()
    if image_size is not None and made_for != list(image_size):
        raise BadCalibration(f'{path}: made for images of {made_for} px, these are {list(image_size)}; calibrate at this size')
    moved = float(np.linalg.norm(values['camera_centre'] - camera.centre))
    if moved > POSE_TOLERANCE:
        raise BadCalibration(f'{path}: the camera stood {moved * 1e3:.2f} mm from where the parameters put it; correct the pose '
                             'or calibrate again')
    light = LightPath(*(values[name] for name in _LIGHT), tuple(values['camera_centre'].tolist()))
    try:
        cap = Cap(values['curvature_radius'], values['height'])
        return WaterModel(light, values['constants'], values['absorptions'], values['noise'], values['ring'], cap, values['scale_sigma'])
    except BadArgument as error:
        raise BadCalibration(f'{path}: {error}') from None
