# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Identification of the water's colour from the untouched pad: its rest shape gives the light path of each background pixel."""
from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..common.camera import CameraModel
from ..common.geometry import Cap
from ..common.statistics import robust_sigma
from ..errors import BadArgument, BadFrame
from .water import (
    LIMITS,
    POINTS,
    RING,
    RING_PIXELS,
    Glare,
    LightPath,
    RingColours,
    WaterModel,
    background_ratios,
    check_image,
    learn_glare,
    log_ratios,
    pitch_px,
    ring_share,
    smooth_light,
)

MODEL_FLOOR = 5e-4  # standard deviation of the path model's error in a log ratio; chosen
CHECK_LIGHT = 'check light and exposure (too dark, or red saturated)'
_HUBER = 3.0  # standard deviations, from which residuals count by their size
_ENOUGH = 1e-6  # relative decrease of the sum of squares that ends the fit; chosen
RIM_MARGIN = 0.04  # of the cap's height; chosen: nearer to the rim the image is blurred with the outside


# Prior of the design: a ring light around the lens and a window somewhere between lens and rim. Means and standard deviations of the
# window's height, the lamps' height over the camera and their radius, in units of the camera's distance from the rim plane, and of the
# ambient share. They matter for a fit to the untouched pad alone, in which window and ring light are nearly confounded.
_DESIGN = np.array([-0.20, 0.0, 0.375, 0.25]), np.array([0.20, 0.075, 0.15, 0.15])


def design_prior(camera: CameraModel) -> tuple[np.ndarray, np.ndarray]:
    """Means (4,) and standard deviations (4,) of window_z, lamp_z, lamp_radius (m) and ambient for this camera."""
    (mean, sd), height = _DESIGN, camera.centre[2]
    units = np.array([abs(height)] * 3 + [1.0])
    return mean * units + [0.0, height, 0.0, 0.0], sd * units


@dataclass
class Colours:
    """Measured colours: log ratios (M, 2) with covariances (M, 2, 2) at known positions places (M, 3), m, with normals (M, 3)."""

    ratios: np.ndarray
    covariances: np.ndarray
    places: np.ndarray
    normals: np.ndarray

    def joined(self, others: list['Colours']) -> 'Colours':
        """These and others together."""
        parts = [self, *others]
        return Colours(np.concatenate([p.ratios for p in parts]), np.concatenate([p.covariances for p in parts]),
                       np.concatenate([p.places for p in parts]), np.concatenate([p.normals for p in parts]))


def ring_covariances(noise: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Covariances (M, 2, 2) of log ratios from count (M,) points of a sampling ring; noise: (2, 2), of a whole ring."""
    return noise * (POINTS / np.maximum(count, 1))[:, None, None] + np.eye(2) * MODEL_FLOOR**2


def predict(q: np.ndarray, places: np.ndarray, normals: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Log ratios (M, 2) for parameters q (8,): two constants, two absorptions (1/m), window_z, lamp_z, lamp_radius (m), ambient."""
    path = LightPath(*q[4:8], tuple(centre))
    return q[:2] - path.lengths(places, normals)[0][:, None] * q[2:4]


def fit(colours: Colours, camera: CameraModel) -> tuple[np.ndarray, np.ndarray]:
    """Most likely parameters q (8,) of predict, and their covariance (8, 8); cells with glare count by Huber's loss."""
    (mean, sd), centre = design_prior(camera), tuple(camera.centre)
    root = np.linalg.inv(np.linalg.cholesky(colours.covariances))

    def lengths(light: np.ndarray) -> np.ndarray:
        return LightPath(*light, centre).lengths(colours.places, colours.normals)[0]

    def residuals(q: np.ndarray) -> np.ndarray:
        first, second = (q[:2] - lengths(q[4:])[:, None] * q[2:4] - colours.ratios).T
        return np.concatenate([root[:, 0, 0] * first, root[:, 1, 0] * first + root[:, 1, 1] * second, (q[4:] - mean) / sd])

    import scipy.optimize  # 0.3 s that a calibrated touchpad saves
    line = np.polyfit(lengths(mean), colours.ratios, 1)
    start = np.concatenate([line[1], np.maximum(-line[0], 1.0), mean])
    scale = np.concatenate([[1, 1], np.abs(start[2:4]) + 1, sd])
    found = scipy.optimize.least_squares(residuals, start, x_scale=scale, loss='huber', f_scale=_HUBER, max_nfev=60, ftol=_ENOUGH)
    return found.x, np.linalg.pinv(found.jac.T @ found.jac)


def rest_colours(image: np.ndarray, camera: CameraModel, cap: Cap, radius: float, noise: np.ndarray) -> Colours:
    """Colours of the untouched pad's ground between its dots, without glare; noise: (2, 2) covariance of one pixel's log ratios. Raises
    BadFrame."""
    return _plain(_ground(image, camera, cap, radius), camera, noise)


def _plain(ground: _Ground, camera: CameraModel, noise: np.ndarray) -> Colours:
    """See rest_colours."""
    irradiance = LightPath(*design_prior(camera)[0], tuple(camera.centre)).irradiance(ground.places, ground.normals)
    plain = ~smooth_light(ground.rays, ground.brightness - np.log(irradiance))[2]
    covariances = noise / ground.pixels[plain][:, None, None] + np.eye(2) * MODEL_FLOOR**2
    return Colours(ground.ratios[plain], covariances, ground.places[plain], ground.normals[plain])


class _Ground(NamedTuple):
    """Ground of the untouched pad, or rings around its dots. rays, places (m), normals: (M, 3); ratios: (M, 2); brightness, pixels: (M,),
    as in Background."""

    rays: np.ndarray
    places: np.ndarray
    normals: np.ndarray
    ratios: np.ndarray
    brightness: np.ndarray
    pixels: np.ndarray


def _ground(image: np.ndarray, camera: CameraModel, cap: Cap, radius: float) -> _Ground:
    seen = background_ratios(image, radius)
    rays = camera.rays(seen.uv)
    places = cap.meet(camera.centre, rays)
    on = places[:, 2] > RIM_MARGIN * cap.height
    if on.sum() < 100:
        raise BadFrame(f'surface: only {on.sum()} cells of the untouched pad show its ground; check light, exposure and camera pose')
    normals = (places[on] - [0, 0, cap.centre_z]) / cap.curvature_radius
    return _Ground(rays[on], places[on], normals, seen.ratios[on], seen.brightness[on], seen.pixels[on])


def identify(image: np.ndarray, uv: np.ndarray, camera: CameraModel, cap: Cap,
             calibrated: WaterModel | None = None) -> tuple[WaterModel, Glare | None]:
    """Model and glare of a pad from its untouched image (H, W, 3) uint8 BGR with dots at uv (N, 2), px: the calibrated model adapted to
    it, else fit_rest; None where there is next to no glare. Raises BadFrame and BadArgument as fit_rest does."""
    if calibrated is None:
        model, ground = _fit_rest(image, uv, camera, cap)
    else:
        model = update_constants(calibrated, image, uv, camera)
        ground = _ground(image, camera, model.cap, model.ring)
    return model, _find_glare(model, ground, image, uv, camera)


def _find_glare(model: WaterModel, ground: _Ground, image: np.ndarray, uv: np.ndarray, camera: CameraModel) -> Glare | None:
    """A highlight hides the ground around it, where its light is weaker. So glare is learnt from the rings around the dots, and where
    they show next to none, from the ground between them."""
    colours, rays = log_ratios(image, uv, model.ring), camera.rays(uv)
    places = model.cap.meet(camera.centre, rays)
    rings = _Ground(rays, places, (places - [0, 0, model.cap.centre_z]) / model.cap.curvature_radius, colours.ratios, colours.brightness,
                    colours.count)
    q = np.array([*model.constants, *model.absorptions, *model.path.numbers[:4]])
    for seen, common in ((rings, LIMITS.common_at_dots), (ground, LIMITS.common)):
        tinted = seen.ratios - predict(q, seen.places, seen.normals, camera.centre)
        dyed = model.absorptions * model.path.lengths(seen.places, seen.normals)[0][:, None]
        light = seen.brightness - np.log(model.path.irradiance(seen.places, seen.normals))
        glare = learn_glare(seen.rays, light, tinted, dyed, common)
        if glare is not None:
            return glare
    return None


def fit_rest(image: np.ndarray, uv: np.ndarray, camera: CameraModel, cap: Cap = Cap()) -> WaterModel:
    """The WaterModel of a pad from its untouched image alone.

    image: (H, W, 3) uint8 BGR, untouched; uv: (N, 2) px, its dots; camera, cap: known. Raises BadFrame where the image shows too little,
    BadArgument where the water leaves no colour.
    """
    return _fit_rest(image, uv, camera, cap)[0]


def _fit_rest(image: np.ndarray, uv: np.ndarray, camera: CameraModel, cap: Cap) -> tuple[WaterModel, _Ground]:
    """See fit_rest; and the ground that the model was fitted to."""
    share = ring_share(check_image(image), uv)
    radius = share * pitch_px(uv)
    noise = _noise_at_rest(log_ratios(image, uv, radius), uv, camera, cap)
    ground = _ground(image, camera, cap, radius)
    q, covariance = fit(_plain(ground, camera, noise * RING_PIXELS), camera)
    model = replace(model_from(q, covariance, noise, radius, camera, cap), ring_share=share)
    return update_constants(model, image, uv, camera) if share > RING else model, ground


def as_ring_colours(ground: Colours, model: WaterModel, centre: np.ndarray) -> Colours:
    """Background colours shifted to those of the model's sampling rings, which are nearer to the dots and differ where colour bleeds."""
    if model.ring_share <= RING:
        return ground
    q = np.array([*model.constants, *model.absorptions, *model.path.numbers[:4]])
    shift = np.median(predict(q, ground.places, ground.normals, centre) - ground.ratios, axis=0)
    return replace(ground, ratios=ground.ratios + shift)


def _noise_at_rest(colours: RingColours, uv: np.ndarray, camera: CameraModel, cap: Cap) -> np.ndarray:
    """_ring_noise of colours at untouched dots uv (N, 2), px, without those in glare."""
    rays = camera.rays(uv)
    glaring = smooth_light(rays, colours.brightness)[2]
    return _ring_noise(np.where(glaring[:, None], np.nan, colours.ratios), cap.meet(camera.centre, rays))


def _ring_noise(ratios: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Covariance (2, 2) of log ratios (N, 2) over rings: of the residuals of a polynomial of degree 6 over places (N, 3)."""
    x, y, _ = places.T / np.nanmax(np.abs(places))
    known = np.isfinite(ratios).all(1) & np.isfinite(places).all(1)
    if known.sum() < 30:
        raise BadFrame(f'surface: the colour can be read around {known.sum()} dots only; {CHECK_LIGHT}')
    terms = np.stack([x**i * y**j for i in range(7) for j in range(7 - i)], 1)[known]
    gap = ratios[known] - terms @ np.linalg.lstsq(terms, ratios[known], rcond=None)[0]
    near = (np.abs(gap) < 4 * robust_sigma(gap, axis=0)).all(1)
    return np.cov(gap[near].T) + np.eye(2) * 1e-10


def model_from(q: np.ndarray, covariance: np.ndarray, noise: np.ndarray, radius: float, camera: CameraModel, cap: Cap) -> WaterModel:
    """The model for parameters q (8,) with covariance (8, 8): absorptions must be positive, else BadArgument says so."""
    if (q[2:4] <= 0).any():
        raise BadArgument(f'surface: the water leaves no colour (absorptions {q[2:4]} 1/m); check channel order and light, fill red water')
    path = LightPath(*(float(v) for v in q[4:8]), tuple(float(v) for v in camera.centre))
    return WaterModel(path, q[:2], q[2:4], noise, radius, cap, scale_sigma(q, covariance, camera, cap))


def scale_sigma(q: np.ndarray, covariance: np.ndarray, camera: CameraModel, cap: Cap, dent: float = 2e-3) -> float:
    """Relative standard deviation of the depth of a dent, m, from the parameters' covariance (8, 8), RMS over the cap."""
    side = np.linspace(-0.5, 0.5, 5) * cap.rim_radius
    x, y = (part.ravel() for part in np.meshgrid(side, side))
    z = cap.centre_z + np.sqrt(cap.curvature_radius**2 - x**2 - y**2)
    rest = np.column_stack([x, y, z])
    normals = (rest - [0, 0, cap.centre_z]) / cap.curvature_radius
    rays = (rest - camera.centre) / np.linalg.norm(rest - camera.centre, axis=1, keepdims=True)
    places = rest - dent * rays
    step = 1e-4 * np.maximum(np.abs(q), np.sqrt(np.diag(covariance)) + 1e-9)
    base = predict(q, places, normals, camera.centre)
    jacobian = np.stack([(predict(q + e, places, normals, camera.centre) - base) @ q[2:4] for e in np.diag(step)], 1) / step
    slope = (predict(q, places + 1e-5 * rays, normals, camera.centre) - base) @ q[2:4] / 1e-5
    gain = jacobian / slope[:, None]
    return float(np.sqrt(np.mean(np.einsum('ni,ij,nj->n', gain, covariance, gain)))) / dent


def update_constants(model: WaterModel, image: np.ndarray, uv: np.ndarray, camera: CameraModel) -> WaterModel:
    """A calibrated model adapted to changes of illumination colour, white balance, camera noise or chroma resolution.

    image: (H, W, 3) uint8 BGR, untouched, its dots at uv (N, 2), px. Updates the two constants, the noise and the ring; the absorptions and
    the light path stay. Raises BadFrame if the colour can be read around too few dots.
    """
    share, pitch = ring_share(check_image(image), uv), pitch_px(uv)
    if share > model.ring / pitch + 0.02:
        model = replace(model, ring=share * pitch)
    model = replace(model, ring_share=model.ring / pitch)
    colours = log_ratios(image, uv, model.ring)
    ratios = colours.ratios
    places = model.cap.meet(camera.centre, camera.rays(uv))
    known = np.isfinite(ratios).all(1) & np.isfinite(places).all(1)
    if known.sum() < 30:
        raise BadFrame(f'surface: the colour can be read around {known.sum()} dots only; {CHECK_LIGHT}')
    normals = (places[known] - [0, 0, model.cap.centre_z]) / model.cap.curvature_radius
    length = model.path.lengths(places[known], normals)[0]
    constants = np.median(ratios[known] + length[:, None] * model.absorptions, axis=0)
    return replace(model, constants=constants, noise=_noise_at_rest(colours, uv, camera, model.cap))
