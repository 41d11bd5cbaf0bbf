# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Identification of the water's colour from the untouched pad, whose known shape gives the light path of each background pixel."""
from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..common.camera import CameraModel
from ..common.geometry import Cap
from ..common.statistics import robust_sigma
from ..core.errors import BadArgument, BadFrame
from .constants import TOUCHPAD
from .water import (
    LIMITS,
    RING_PIXELS,
    RING_POINTS,
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

CHECK_LIGHT = 'check light and exposure (too dark, or red saturated)'

# Prior of the design: a ring light around the lens and a window somewhere between lens and rim. Means and standard deviations of the
# window's height, the lamps' height above the camera and their radius, all over the camera's distance from the rim plane, and of the
# ambient share. They matter for a fit to the untouched pad alone, which hardly separates window and ring light.
_DESIGN = np.array([-0.20, 0.0, 0.375, 0.25]), np.array([0.20, 0.075, 0.15, 0.15])


def design_prior(camera: CameraModel) -> tuple[np.ndarray, np.ndarray]:
    """Means (4,) and standard deviations (4,) of window_z, lamp_z, lamp_radius (m) and ambient for this camera."""
    (mean, sd), height = _DESIGN, camera.centre[2]
    units = np.array([abs(height)] * 3 + [1.0])
    return mean * units + [0.0, height, 0.0, 0.0], sd * units


@dataclass
class Colours:
    """Measured colours: log ratios (M, 2) with covariances (M, 2, 2) at known positions (M, 3), m, with surface normals (M, 3)."""

    ratios: np.ndarray
    covariances: np.ndarray
    positions: np.ndarray
    normals: np.ndarray

    def joined(self, others: list['Colours']) -> 'Colours':
        """Join these and others."""
        parts = [self, *others]
        return Colours(np.concatenate([p.ratios for p in parts]), np.concatenate([p.covariances for p in parts]),
                       np.concatenate([p.positions for p in parts]), np.concatenate([p.normals for p in parts]))


def ring_covariances(noise: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Covariances (M, 2, 2) of log ratios from count (M,) points of a sampling ring; noise: (2, 2) covariance of a whole ring."""
    return noise * (RING_POINTS / np.maximum(count, 1))[:, None, None] + np.eye(2) * TOUCHPAD.model_sigma**2


def predict(q: np.ndarray, positions: np.ndarray, normals: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Log ratios (M, 2) for parameters q (8,): two constants, two absorptions (1/m), window_z, lamp_z, lamp_radius (m), ambient."""
    path = LightPath(*q[4:8], tuple(centre))
    return q[:2] - path.lengths(positions, normals)[0][:, None] * q[2:4]


def fit(colours: Colours, camera: CameraModel) -> tuple[np.ndarray, np.ndarray]:
    """Most likely parameters q (8,) of predict, and their covariance (8, 8). Huber's loss limits the effect of cells with glare.

    Constants and absorptions, which are linear, are solved for again at each step of the others: variable projection (Golub and Pereyra
    1973) by Levenberg and Marquardt's method.
    """
    (mean, sd), centre = design_prior(camera), tuple(camera.centre)
    root = np.linalg.inv(np.linalg.cholesky(colours.covariances))
    (a, b, c), (first, second), zero = (root[:, 0, 0], root[:, 1, 0], root[:, 1, 1]), colours.ratios.T, np.zeros(len(root))
    measured, limit = np.concatenate([a * first, b * first + c * second]), TOUCHPAD.huber_sigmas

    def terms(light: np.ndarray) -> np.ndarray:
        """Compute the derivatives (2 M, 4) of the scaled log ratios with respect to constants and absorptions."""
        length = LightPath(*light, centre).lengths(colours.positions, colours.normals)[0]
        return np.concatenate([np.stack([a, zero, -a * length, zero], 1), np.stack([b, c, -b * length, -c * length], 1)])

    def residuals(linear: np.ndarray, light: np.ndarray) -> np.ndarray:
        return np.concatenate([terms(light) @ linear - measured, (light - mean) / sd])

    def weights(residual: np.ndarray) -> np.ndarray:
        return np.minimum(1.0, limit / np.maximum(np.abs(residual), limit))

    def loss(residual: np.ndarray) -> float:
        inner = np.minimum(np.abs(residual), limit)
        return float(np.sum(inner * (np.abs(residual) - 0.5 * inner)))

    def solved(light: np.ndarray, weight: np.ndarray) -> np.ndarray:
        weighted = terms(light) * weight[:, None]
        return np.linalg.lstsq(weighted.T @ terms(light), weighted.T @ measured, rcond=None)[0]

    def jacobian() -> np.ndarray:
        steps = TOUCHPAD.derivative_step * sd
        light_slopes = np.stack([(residuals(linear, light + step) - residual) / step.sum() for step in np.diag(steps)], axis=1)
        return np.hstack([np.concatenate([terms(light), np.zeros((4, 4))]), light_slopes])

    light, linear = mean, solved(mean, np.ones(len(measured)))
    residual, damping = residuals(linear, light), 1.0
    slopes = jacobian()
    for _ in range(TOUCHPAD.max_fit_steps):
        weighted = slopes * weights(residual)[:, None]
        damped = weighted.T @ slopes + damping * np.diag([0.0] * 4 + [*sd**-2.0])
        moved = light - np.linalg.lstsq(damped, weighted.T @ residual, rcond=None)[0][4:]
        fitting = solved(moved, weights(residual)[:len(measured)])
        decrease = loss(residual) - loss(residuals(fitting, moved))
        if not decrease > 0:
            damping *= 10
            continue
        light, linear, damping = moved, fitting, damping / 10
        residual = residuals(linear, light)
        slopes = jacobian()
        if decrease < TOUCHPAD.min_decrease * loss(residual):
            break
    inner = slopes[np.abs(residual) <= limit]
    return np.concatenate([linear, light]), np.linalg.pinv(inner.T @ inner)


def rest_colours(image: np.ndarray, camera: CameraModel, cap: Cap, radius: float, noise: np.ndarray) -> Colours:
    """Colours of the untouched pad's background between its dots, without glare.

    noise: (2, 2), covariance of one pixel's log ratios. Raises BadFrame if too little background is visible.
    """
    return _plain(_ground(image, camera, cap, radius), camera, noise)


def _plain(ground: _Ground, camera: CameraModel, noise: np.ndarray) -> Colours:
    """Select the colours of the background without glare, as rest_colours."""
    irradiance = LightPath(*design_prior(camera)[0], tuple(camera.centre)).irradiance(ground.positions, ground.normals)
    plain = ~smooth_light(ground.rays, ground.brightness - np.log(irradiance))[2]
    covariances = noise / ground.pixels[plain][:, None, None] + np.eye(2) * TOUCHPAD.model_sigma**2
    return Colours(ground.ratios[plain], covariances, ground.positions[plain], ground.normals[plain])


class _Ground(NamedTuple):
    """Background of the untouched pad, or the rings around its dots.

    rays, positions (m), normals: (M, 3); ratios: (M, 2); brightness, pixels: (M,), as in Background.
    """

    rays: np.ndarray
    positions: np.ndarray
    normals: np.ndarray
    ratios: np.ndarray
    brightness: np.ndarray
    pixels: np.ndarray


def _ground(image: np.ndarray, camera: CameraModel, cap: Cap, radius: float) -> _Ground:
    seen = background_ratios(image, radius)
    rays = camera.rays(seen.uv)
    positions = cap.meet(camera.centre, rays)
    on = positions[:, 2] > TOUCHPAD.rim_margin * cap.height
    if on.sum() < 100:
        raise BadFrame(f'surface: only {on.sum()} cells of the untouched pad show its background; check light, exposure and camera pose')
    normals = (positions[on] - [0, 0, cap.centre_z]) / cap.curvature_radius
    return _Ground(rays[on], positions[on], normals, seen.ratios[on], seen.brightness[on], seen.pixels[on])


def identify(image: np.ndarray, uv: np.ndarray, camera: CameraModel, cap: Cap,
             calibrated: WaterModel | None = None) -> tuple[WaterModel, Glare | None]:
    """Identify the colour model and the glare of a pad from its untouched image.

    Parameters
    ----------
    image : ndarray, shape (H, W, 3), uint8
        Untouched image in BGR order.
    uv : ndarray, shape (N, 2)
        Its dots in px.
    camera : CameraModel
        The camera and its pose in the sensor frame.
    cap : Cap
        The undeformed surface.
    calibrated : WaterModel, optional
        A calibrated model, which is adapted to the image; without one the model is fitted to the image alone (fit_rest).

    Returns
    -------
    model : WaterModel
        The model.
    glare : Glare or None
        The glare; None if there is almost none.

    Raises
    ------
    BadFrame
        If the image shows too little.
    BadArgument
        If the water causes no colour.
    """
    if calibrated is None:
        model, ground = _fit_rest(image, uv, camera, cap)
    else:
        model = update_constants(calibrated, image, uv, camera)
        ground = _ground(image, camera, model.cap, model.ring)
    return model, _find_glare(model, ground, image, uv, camera)


def _find_glare(model: WaterModel, ground: _Ground, image: np.ndarray, uv: np.ndarray, camera: CameraModel) -> Glare | None:
    """Find the glare of an untouched pad; None if there is almost none.

    A highlight hides the background around it, where its light is weaker. So glare is learnt from the rings around the dots and, if these
    show almost none, from the background between them.
    """
    colours, rays = log_ratios(image, uv, model.ring), camera.rays(uv)
    positions = model.cap.meet(camera.centre, rays)
    normals = (positions - [0, 0, model.cap.centre_z]) / model.cap.curvature_radius
    rings = _Ground(rays, positions, normals, colours.ratios, colours.brightness, colours.count)
    q = np.array([*model.constants, *model.absorptions, *model.path.numbers[:4]])
    for seen, common in ((rings, LIMITS.common_at_dots), (ground, LIMITS.common)):
        tinted = seen.ratios - predict(q, seen.positions, seen.normals, camera.centre)
        dyed = model.absorptions * model.path.lengths(seen.positions, seen.normals)[0][:, None]
        light = seen.brightness - np.log(model.path.irradiance(seen.positions, seen.normals))
        glare = learn_glare(seen.rays, light, tinted, dyed, common)
        if glare is not None:
            return glare
    return None


def fit_rest(image: np.ndarray, uv: np.ndarray, camera: CameraModel, cap: Cap = Cap()) -> WaterModel:
    """Fit the WaterModel of a pad to its untouched image alone.

    image: (H, W, 3) uint8 BGR, untouched; uv: (N, 2) px, its dots; camera, cap: known. Raises BadFrame if the image shows too little and
    BadArgument if the water causes no colour.
    """
    return _fit_rest(image, uv, camera, cap)[0]


def _fit_rest(image: np.ndarray, uv: np.ndarray, camera: CameraModel, cap: Cap) -> tuple[WaterModel, _Ground]:
    """Fit as fit_rest, and return also the background that the model was fitted to."""
    share = ring_share(check_image(image), uv)
    radius = share * pitch_px(uv)
    noise = _noise_at_rest(log_ratios(image, uv, radius), uv, camera, cap)
    ground = _ground(image, camera, cap, radius)
    q, covariance = fit(_plain(ground, camera, noise * RING_PIXELS), camera)
    model = replace(model_from(q, covariance, noise, radius, camera, cap), ring_share=share)
    return update_constants(model, image, uv, camera) if share > TOUCHPAD.ring else model, ground


def as_ring_colours(ground: Colours, model: WaterModel, centre: np.ndarray) -> Colours:
    """Shift background colours to those of the model's rings, which are nearer to the dots and differ where colour bleeds."""
    if model.ring_share <= TOUCHPAD.ring:
        return ground
    q = np.array([*model.constants, *model.absorptions, *model.path.numbers[:4]])
    shift = np.median(predict(q, ground.positions, ground.normals, centre) - ground.ratios, axis=0)
    return replace(ground, ratios=ground.ratios + shift)


def _noise_at_rest(colours: RingColours, uv: np.ndarray, camera: CameraModel, cap: Cap) -> np.ndarray:
    """Noise (_ring_noise) of the colours at untouched dots uv (N, 2), px, without those in glare."""
    rays = camera.rays(uv)
    glaring = smooth_light(rays, colours.brightness)[2]
    return _ring_noise(np.where(glaring[:, None], np.nan, colours.ratios), cap.meet(camera.centre, rays))


def _ring_noise(ratios: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Covariance (2, 2) of the rings' log ratios (N, 2): of the residuals of a polynomial of degree 6 over positions (N, 3)."""
    x, y, _ = positions.T / np.nanmax(np.abs(positions))
    known = np.isfinite(ratios).all(1) & np.isfinite(positions).all(1)
    if known.sum() < 30:
        raise BadFrame(f'surface: the colour can be read around {known.sum()} dots only; {CHECK_LIGHT}')
    terms = np.stack([x**i * y**j for i in range(7) for j in range(7 - i)], 1)[known]
    gap = ratios[known] - terms @ np.linalg.lstsq(terms, ratios[known], rcond=None)[0]
    near = (np.abs(gap) < 4 * robust_sigma(gap, axis=0)).all(1)
    return np.cov(gap[near].T) + np.eye(2) * 1e-10


def model_from(q: np.ndarray, covariance: np.ndarray, noise: np.ndarray, radius: float, camera: CameraModel, cap: Cap) -> WaterModel:
    """Make the model for parameters q (8,) with covariance (8, 8). Raises BadArgument if an absorption is not positive."""
    if (q[2:4] <= 0).any():
        raise BadArgument(f'surface: the water causes no colour (absorptions {q[2:4]} 1/m); check channel order and light, fill red water')
    path = LightPath(*(float(v) for v in q[4:8]), tuple(float(v) for v in camera.centre))
    return WaterModel(path, q[:2], q[2:4], noise, radius, cap, scale_sigma(q, covariance, camera, cap))


def scale_sigma(q: np.ndarray, covariance: np.ndarray, camera: CameraModel, cap: Cap, dent: float = 2e-3) -> float:
    """Relative standard deviation of the depth of a dent, m, from the covariance (8, 8) of the parameters; RMS over the cap."""
    side = np.linspace(-0.5, 0.5, 5) * cap.rim_radius
    x, y = (part.ravel() for part in np.meshgrid(side, side))
    z = cap.centre_z + np.sqrt(cap.curvature_radius**2 - x**2 - y**2)
    rest = np.column_stack([x, y, z])
    normals = (rest - [0, 0, cap.centre_z]) / cap.curvature_radius
    rays = (rest - camera.centre) / np.linalg.norm(rest - camera.centre, axis=1, keepdims=True)
    positions = rest - dent * rays
    step = 1e-4 * np.maximum(np.abs(q), np.sqrt(np.diag(covariance)) + 1e-9)
    base = predict(q, positions, normals, camera.centre)
    jacobian = np.stack([(predict(q + e, positions, normals, camera.centre) - base) @ q[2:4] for e in np.diag(step)], 1) / step
    slope = (predict(q, positions + 1e-5 * rays, normals, camera.centre) - base) @ q[2:4] / 1e-5
    gain = jacobian / slope[:, None]
    return float(np.sqrt(np.mean(np.einsum('ni,ij,nj->n', gain, covariance, gain)))) / dent


def update_constants(model: WaterModel, image: np.ndarray, uv: np.ndarray, camera: CameraModel) -> WaterModel:
    """Adapt a calibrated model to a change of illumination colour, white balance, camera noise or chroma resolution.

    image: (H, W, 3) uint8 BGR, untouched, with its dots at uv (N, 2), px. The two constants, the noise and the ring are updated; the
    absorptions and the light path are kept. Raises BadFrame if the colour can be read around too few dots.
    """
    share, pitch = ring_share(check_image(image), uv), pitch_px(uv)
    if share > model.ring / pitch + 0.02:
        model = replace(model, ring=share * pitch)
    model = replace(model, ring_share=model.ring / pitch)
    colours = log_ratios(image, uv, model.ring)
    ratios = colours.ratios
    positions = model.cap.meet(camera.centre, camera.rays(uv))
    known = np.isfinite(ratios).all(1) & np.isfinite(positions).all(1)
    if known.sum() < 30:
        raise BadFrame(f'surface: the colour can be read around {known.sum()} dots only; {CHECK_LIGHT}')
    normals = (positions[known] - [0, 0, model.cap.centre_z]) / model.cap.curvature_radius
    length = model.path.lengths(positions[known], normals)[0]
    constants = np.median(ratios[known] + length[:, None] * model.absorptions, axis=0)
    return replace(model, constants=constants, noise=_noise_at_rest(colours, uv, camera, model.cap))
