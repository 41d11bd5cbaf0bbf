# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of a touchpad by presses of a sphere at known positions, and the calibration file."""
from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..common.camera import CameraModel
from ..common.dots import DotTracks
from ..common.geometry import Cap, sphere_ranges
from ..common.residuals import Residuals
from ..core.calibration_file import AGAIN, CalibrationFile, Specimen, fitted_arrays, read_calibration
from ..core.errors import BadArgument, BadCalibration, BadFrame
from .constants import TOUCHPAD
from .identification import Colours, as_ring_colours, fit, fit_rest, model_from, rest_colours, ring_covariances
from .water import RING_PIXELS, LightPath, RingColours, WaterModel, log_ratios


def find_sphere_radius(misfit: Callable[[float], float]) -> float:
    """Find the radius, m, that minimises misfit(radius), m.

    Raises BadCalibration if there is no minimum between 2 and 30 mm.
    """
    def log_misfit(log_radius: float) -> float:
        """Misfit, m, at exp(log_radius); 1 where the fit fails."""
        try:
            return misfit(float(np.exp(log_radius)))
        except BadCalibration:
            return 1.0
    coarse = np.linspace(np.log(TOUCHPAD.min_sphere_radius), np.log(TOUCHPAD.max_sphere_radius), 9)
    values = [log_misfit(x) for x in coarse]
    best = int(np.argmin(values))
    if best in (0, len(coarse) - 1) or values[best] >= 1.0:
        raise BadCalibration(f'touchpad calibration: no sphere of {TOUCHPAD.min_sphere_radius * 1e3:.0f} to '
                             f'{TOUCHPAD.max_sphere_radius * 1e3:.0f} mm radius fits the presses; give its '
                             'radius with --sphere-radius, and check that ground_truth/contacts holds the tips of sphere presses')
    import scipy.optimize  # calibration alone needs it
    found = scipy.optimize.minimize_scalar(log_misfit, bounds=(coarse[best - 1], coarse[best + 1]), method='bounded',
                                           options={'xatol': TOUCHPAD.radius_tolerance})
    return float(np.exp(found.x))


@dataclass
class Press:
    """A static frame of the touchpad with the pose of the sphere, as reported by the positioning stage.

    Attributes
    ----------
    image : ndarray, shape (H, W, 3), uint8
        Image in BGR order.
    tracks : DotTracks
        The dots in the image.
    tip : ndarray, shape (3,)
        Deepest point of the sphere, straight below its centre, in m in the sensor frame; NaN without contact.
    depth : float
        Penetration depth in m; 0 without contact.
    name : str
        Name of the press in messages.
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
    """The M dots of one press that lie on the sphere.

    Attributes
    ----------
    colours : Colours
        Colours at the mean positions of the sampling rings.
    count : ndarray, shape (M,)
        Ring pixels used for each dot.
    tip : ndarray, shape (3,)
        Deepest point of the sphere in m.
    depth : float
        Penetration depth in m.
    label : str
        Name of the press in messages.
    """

    colours: Colours
    count: np.ndarray
    tip: np.ndarray
    depth: float
    label: str = ''


def dots_on_sphere(press: Press, radius: float, model: WaterModel, camera: CameraModel) -> OnSphere:
    """Select the dots of a press whose sampling rings lie on the sphere of this radius, m, by TOUCHPAD.penetration_share.

    The result may be empty. Raises BadFrame for an image without colour.
    """
    centre = np.asarray(press.tip) + [0, 0, radius]
    angle = np.arange(TOUCHPAD.ring_test_points) * (2 * np.pi / TOUCHPAD.ring_test_points)
    ring = model.ring * np.column_stack([np.cos(angle), np.sin(angle)])
    rays = camera.rays((press.tracks.uv[:, None] + ring).reshape(-1, 2))
    near, _ = sphere_ranges(camera.centre, rays, centre, radius)
    inside = np.nan_to_num(model.cap.ranges(camera.centre, rays) - near, nan=-1.0).reshape(-1, TOUCHPAD.ring_test_points)
    rings = log_ratios(press.image, press.tracks.uv, model.ring)
    on = (inside.min(1) > TOUCHPAD.penetration_share * max(inside.max(initial=0.0), 1e-6)) & np.isfinite(rings.ratios).all(1)
    positions = (camera.centre + near[:, None] * rays).reshape(-1, TOUCHPAD.ring_test_points, 3)[on].mean(1)
    normals = centre - positions
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    colours = Colours(rings.ratios[on], ring_covariances(model.noise, rings.count[on]), positions, normals)
    return OnSphere(colours, rings.count[on], np.asarray(press.tip, float), float(press.depth), press.label)


@dataclass
class TouchpadCalibration:
    """Result of a fit.

    Attributes
    ----------
    model : WaterModel
        The calibrated model.
    sphere_radius : float
        Radius of the sphere in m.
    presses, dots : int
        Number of presses and of dots used.
    residual_rms, residual_bias : float
        RMS and mean range error of the dots on the sphere, in m.
    held_out_rms : float
        RMS range error in m in cross-validation, with each position left out in turn; NaN for fewer than three positions.
    depth_range : tuple of float
        Smallest and largest depth in m.
    xy_range : ndarray, shape (2, 2)
        Smallest and largest x and y of the presses in m.
    left_out : list of str
        One line for each press that was not used.
    held_out : list of Residuals
        Cross-validation residuals of the presses.
    """

    model: WaterModel
    sphere_radius: float
    presses: int
    dots: int
    residual_rms: float
    residual_bias: float
    held_out_rms: float
    depth_range: tuple[float, float]
    xy_range: np.ndarray
    left_out: list[str]
    held_out: list[Residuals] = field(default_factory=list)


def fit_touchpad(presses: list[Press], camera: CameraModel, sphere_radius: float, cap: Cap = Cap()) -> TouchpadCalibration:
    """Fit absorption and light path to untouched frames and to presses of a sphere at known positions and depths.

    Parameters
    ----------
    presses : list of Press
        At least one untouched frame and three presses, at positions that span 2 mm or more and depths that span 1 mm or more.
    camera : CameraModel
        The camera and its pose in the sensor frame.
    sphere_radius : float
        Radius of the sphere in m.
    cap : Cap
        The undeformed surface.

    Returns
    -------
    TouchpadCalibration
        The fitted model and its errors.

    Raises
    ------
    BadCalibration
        If the data do not determine the model; the message says what to add.
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
    """RMS range error, m, of a fit with a sphere of this radius, m. Raises the same errors as fit_touchpad."""
    model, _, groups, _ = _solve(presses, camera, sphere_radius, cap)
    return _rms(np.concatenate([range_errors(model, group) for group in groups]))


def _solve(presses: list[Press], camera: CameraModel, sphere_radius: float, cap: Cap) -> tuple:
    """Find the model, the colours of the untouched pad, the dots on the sphere of each press, and one line per press left out."""
    rest = [p for p in presses if not p.touching]
    used, left_out = _usable([p for p in presses if p.touching])
    _require_coverage(rest, used, left_out)
    first = fit_rest(rest[0].image, rest[0].tracks.uv, camera, cap)
    image = np.mean([p.image for p in rest], axis=0, dtype=np.float32)
    ground = as_ring_colours(rest_colours(image, camera, cap, first.ring, first.noise * (RING_PIXELS / len(rest))), first, camera.centre)
    on_sphere, empty = _read(used, first, camera, sphere_radius)
    dots = sum(len(group.count) for group in on_sphere)
    if dots < TOUCHPAD.min_dots:
        raise BadCalibration(f'touchpad calibration: only {dots} dots lie on the sphere, {TOUCHPAD.min_dots} needed; check the sphere '
                             f'radius and ground_truth/contacts, add presses deeper than 1 mm ({"; ".join(empty) or "no press is empty"})')
    model = _fit(ground, on_sphere, first, camera)
    if model.scale_sigma > TOUCHPAD.max_scale_sigma:
        raise BadCalibration(f'touchpad calibration: the depth scale has a standard deviation of {model.scale_sigma:.1%}, '
                             f'{TOUCHPAD.max_scale_sigma:.0%} allowed; add deeper presses at more positions')
    return model, ground, on_sphere, left_out + empty


def _usable(presses: list[Press]) -> tuple[list[Press], list[str]]:
    """Presses that can be used, and one line per press that cannot."""
    used, left_out = [], []
    for press in presses:
        if press.depth < TOUCHPAD.min_depth:
            left_out.append(f'{press.label}: {press.depth * 1e3:.2f} mm deep, less than {TOUCHPAD.min_depth * 1e3:.1f} mm')
        elif len(press.tracks) < 9:
            left_out.append(f'{press.label}: only {len(press.tracks)} dots seen')
        else:
            used.append(press)
    return used, left_out


def _require_coverage(rest: list[Press], used: list[Press], left_out: list[str]):
    """Raise BadCalibration for too few untouched frames, presses, positions or depths."""
    tail = f' (left out: {"; ".join(left_out)})' if left_out else ''
    if not rest:
        raise BadCalibration('touchpad calibration: no untouched frame; add a second of recording before the first press')
    if len(used) < 3:
        raise BadCalibration(f'touchpad calibration: {len(used)} usable presses, at least 3 needed; untouched frames alone do not '
                             f'determine the absorption; add sphere presses of 1 to 4 mm at several positions{tail}')
    depths, tips = np.array([p.depth for p in used]), np.array([p.tip for p in used])
    if np.ptp(depths) < TOUCHPAD.min_depth_span:
        raise BadCalibration(f'touchpad calibration: depths span {np.ptp(depths) * 1e3:.2f} mm, {TOUCHPAD.min_depth_span * 1e3:.0f} mm '
                             f'needed; add presses of other depths{tail}')
    spread = float(np.linalg.norm(tips[:, :2] - tips[0, :2], axis=1).max())
    if spread < TOUCHPAD.min_spread:
        raise BadCalibration(f'touchpad calibration: all presses lie within {spread * 1e3:.2f} mm of one position, '
                             f'{TOUCHPAD.min_spread * 1e3:.0f} mm needed; press at other positions too{tail}')


def _read(presses: list[Press], model: WaterModel, camera: CameraModel, radius: float) -> tuple[list[OnSphere], list[str]]:
    """Find the dots on the sphere of each press; one line for each press without such a dot or with an unusable image."""
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
    """Fit the model to the colours of the untouched pad and on the sphere."""
    q, covariance = fit(ground.joined([group.colours for group in groups]), camera)
    model = model_from(q, covariance, first.noise, first.ring, camera, first.cap)
    return replace(model, scale_sigma=float(np.hypot(model.scale_sigma, TOUCHPAD.scale_sigma_floor)), ring_share=first.ring_share)


def range_errors(model: WaterModel, group: OnSphere) -> np.ndarray:
    """Range errors (M,), m: measured minus true distances along the rays of dots on the sphere, from ring means as in use."""
    unknown, even = np.full(len(group.count), np.nan), np.zeros(len(group.count))
    length, _ = model.measure_lengths(RingColours(group.colours.ratios, unknown, group.count, even))
    true, slope = model.path.lengths(group.colours.positions, group.colours.normals)
    return (length - true) / slope


def _held_out(ground: Colours, groups: list[OnSphere], first: WaterModel, camera: CameraModel) -> list[np.ndarray]:
    """Cross-validation range errors (M,), m, of each press in a fit without the presses near it; NaN for fewer than three positions."""
    cells = np.array([np.round(group.tip[:2] / TOUCHPAD.min_spread) for group in groups])
    keys = np.unique(cells, axis=0)
    errors = [np.full(1, np.nan)] * len(groups)
    for key in keys if len(keys) >= 3 else ():
        out = (cells == key).all(1)
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


def touchpad_file(calibration: TouchpadCalibration, image_size: tuple[int, int], left_out: Sequence[str] = (),
                  specimen: Specimen = Specimen()) -> CalibrationFile:
    """Make the calibration file for images of image_size (width, height) px; left_out: one line each."""
    model = calibration.model
    values = {**dict(zip(_LIGHT, model.path.numbers)), 'ring': model.ring, 'scale_sigma': model.scale_sigma,
              'curvature_radius': model.cap.curvature_radius, 'height': model.cap.height, 'constants': model.constants,
              'absorptions': model.absorptions, 'noise': model.noise, 'camera_centre': model.path.centre, 'image_size': image_size}
    fitted = {name: np.asarray(value, float).tolist() for name, value in values.items()}
    residuals = {'range_rms': calibration.residual_rms, 'range_bias': calibration.residual_bias,
                 'held_out_places_range_rms': calibration.held_out_rms,
                 'presses': calibration.presses, 'dots': calibration.dots, 'sphere_radius': calibration.sphere_radius}
    low, high = np.asarray(calibration.xy_range, float).tolist()
    span = {'depth': [float(v) for v in calibration.depth_range], 'x': [low[0], high[0]], 'y': [low[1], high[1]]}
    return CalibrationFile(SENSOR, UNITS, fitted, residuals, span, [*left_out, *calibration.left_out], serial=specimen.serial,
                           parameters=specimen.parameters(SENSOR))


def read_touchpad(path: str | Path, camera: CameraModel, image_size: tuple[int, int] | None = None) -> WaterModel:
    """Read the model from a calibration file.

    Parameters
    ----------
    path : str or Path
        The calibration file.
    camera : CameraModel
        The camera in use.
    image_size : tuple of int, optional
        Width and height of the images in use, in px; None skips the check of the size.

    Returns
    -------
    WaterModel
        The calibrated model.

    Raises
    ------
    BadCalibration
        If the file cannot be read (read_calibration), a number is missing or out of range, or the file was made for another camera
        position or image size.
    """
    values = fitted_arrays(read_calibration(path, SENSOR).fitted, _SHAPES, path)
    for name in _POSITIVE:
        if not np.all(values[name] > 0):
            raise BadCalibration(f'{path}: fitted.{name} is {values[name]}, must be positive; {AGAIN}')
    if not (np.linalg.eigvalsh(values['noise']) > 0).all():
        raise BadCalibration(f'{path}: fitted.noise is not a covariance (not positive definite); {AGAIN}')
    made_for = values['image_size'].astype(int).tolist()
    if image_size is not None and made_for != list(image_size):
        raise BadCalibration(f'{path}: calibrated with images of {made_for} px, these have {list(image_size)} px; calibrate at this size')
    moved = float(np.linalg.norm(values['camera_centre'] - camera.centre))
    if moved > TOUCHPAD.pose_tolerance:
        raise BadCalibration(f'{path}: the camera position of the parameters is {moved * 1e3:.2f} mm from the calibrated one; '
                             'correct the pose or calibrate again')
    light = LightPath(*(values[name] for name in _LIGHT), tuple(values['camera_centre'].tolist()))
    try:
        cap = Cap(values['curvature_radius'], values['height'])
        return WaterModel(light, values['constants'], values['absorptions'], values['noise'], values['ring'], cap, values['scale_sigma'])
    except BadArgument as error:
        raise BadCalibration(f'{path}: {error}') from None
