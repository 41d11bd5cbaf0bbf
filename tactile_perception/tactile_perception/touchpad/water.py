# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Range of each dot from the colour around it: absorption in the red water along the light path (Beer-Lambert), and glare of the lamps."""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import cv2
import numpy as np

from .. import _core
from .._core.touchpad import (
    RING_POINTS,
    PadGlare,
    PadWater,
    SeenColours,
    WaterColour,
    path_lengths,
    ring_colours,
    water_lengths,
    water_ranges,
)
from ..common.camera import CameraModel
from ..common.dots import DotTracks
from ..common.geometry import Cap
from ..common.statistics import SIGMA_PER_MAD, robust_sigma
from ..core.errors import BadArgument, BadFrame
from .constants import TOUCHPAD


@dataclass
class WaterLimits:
    """Constants of colour and glare. docs/constants.md lists the effect of halving and doubling each of them."""

    ink: float = 0.75  # of the upper quartile of blue on a ring; darker points are ink
    glare: float = 1.2  # of the same quartile; brighter points are glare
    disagree: float = 2.5  # standard deviations between the two ratios, beyond which that of the length is increased
    patchy: float = 2.5  # noise variances of a ring point, beyond which the variance of blue / red around a ring shows glare or an edge
    bright: float = 3.0  # standard deviations above the smooth light, beyond which a position has glare
    least_bright: float = 0.01  # minimum of the same, in ln(red); weaker glare changes a range by less than 0.1 mm
    common: float = 0.01  # share of the untouched pad with glare, from which glare is modelled; pads without glare show 0.002
    common_at_dots: float = 0.03  # the same share of its dots; pads without glare show up to 0.01
    red: float = 0.15  # absorption of red over that of blue minus that of red; dyes that look red absorb red least
    shading: float = 0.015  # standard deviation of ln(red) due to errors of the surface's shape
    probability: float = 0.3  # of glare at a dot of a pad with glare; it also appears where the untouched pad has none


LIMITS = WaterLimits()


@dataclass(frozen=True)
class LightPath:
    """Window and ring light in the sensor frame.

    Attributes
    ----------
    window_z : float
        Height of the plane in which the water begins, in m.
    lamp_z, lamp_radius : float
        Height and radius of the ring light around the camera's axis, in m.
    ambient : float
        Diffuse share of the irradiance; 0 is Lambert's cosine alone.
    centre : tuple of float
        Camera centre (x, y, z) in m.
    """

    window_z: float
    lamp_z: float
    lamp_radius: float
    ambient: float
    centre: tuple[float, float, float]

    @cached_property
    def numbers(self) -> np.ndarray:
        """Array (7,) for the kernels: window_z, lamp_z, lamp_radius, ambient, centre."""
        return np.array([self.window_z, self.lamp_z, self.lamp_radius, self.ambient, *self.centre])

    def lengths(self, positions: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Path lengths (N,), m, in the water to positions (N, 3), m, and back, and their derivatives (N,) along the camera's rays.

        normals: (N, 3), outward unit normals. The derivative neglects that of the irradiance weights and is accurate to 1 %.
        Kernel: src/touchpad/water.cpp.
        """
        return self.light(positions, normals)[:2]

    def irradiance(self, positions: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Irradiance (N,) at positions (N, 3), m, with unit normals (N, 3), in units of the lamps' power.

        It follows the inverse square law and Lambert's cosine, plus ambient light.
        """
        return self.light(positions, normals)[2]

    def light(self, positions: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Lengths, derivatives and irradiance (N,), as lengths and irradiance return them."""
        return path_lengths(self.numbers, np.ascontiguousarray(positions, float), np.ascontiguousarray(normals, float))


RING_PIXELS = 9 * RING_POINTS  # on a ring around each dot


def check_image(image: np.ndarray) -> np.ndarray:
    """Return the image if it is (H, W, 3) uint8, else raise BadFrame."""
    if not isinstance(image, np.ndarray) or image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
        shape = getattr(image, 'shape', None)
        raise BadFrame(f'surface: need a colour image (H, W, 3) uint8 in BGR order, got {shape}; set the camera to bgr8')
    return image


def pitch_px(uv: np.ndarray) -> float:
    """Median distance, px, from each of the dots at uv (N, 2), px, to its nearest neighbour. Raises BadFrame for less than 9 dots."""
    if len(uv) < 9:
        raise BadFrame(f'surface: need at least 9 dots for their pitch, got {len(uv)}')
    points = uv - uv.mean(0)
    length = np.square(points).sum(1)
    square = length[:, None] + length - 2 * points @ points.T
    np.fill_diagonal(square, np.inf)
    return float(np.sqrt(np.median(square.min(1))))


def ring_share(image: np.ndarray, uv: np.ndarray) -> float:
    """Radius over the pitch of the sampling ring around dots at uv (N, 2), px: TOUCHPAD.wide_ring if colour bleeds, else TOUCHPAD.ring.

    image: (H, W, 3) uint8 BGR, untouched. Bleeding changes the background's colour near the dots.
    """
    pitch = pitch_px(uv)
    near, far = (log_ratios(image, uv, share * pitch).ratios[:, 0] for share in (TOUCHPAD.ring, TOUCHPAD.wide_ring))
    gap = (near - far)[np.isfinite(near - far)]
    if len(gap) == 0:
        return TOUCHPAD.ring
    middle = np.median(gap)
    sigma = robust_sigma(gap - middle) / np.sqrt(len(gap))
    return TOUCHPAD.wide_ring if abs(middle) > TOUCHPAD.min_bleeding + 4 * sigma else TOUCHPAD.ring


@dataclass
class RingColours:
    """Colours on the rings around N dots.

    ratios: (N, 2), ln(blue/red) and ln(green/red); brightness: (N,), ln(red in grey levels); count: (N,) ring points used; patchiness:
    (N,), relative variance of blue/red around the ring without its linear gradient, caused by noise, glare and sharp edges.
    """

    ratios: np.ndarray
    brightness: np.ndarray
    count: np.ndarray
    patchiness: np.ndarray


def log_ratios(image: np.ndarray, uv: np.ndarray, radius: float) -> RingColours:
    """Measure the colour of the background around dots. Kernel: src/touchpad/water.cpp.

    image: (H, W, 3) uint8 BGR; uv: (N, 2) px; radius: of the ring, px. Points on ink, on glare or outside the image are not used. Ratios
    are NaN if less than a quarter of the points remain or a channel is dark. Raises BadFrame for a wrong image.
    """
    found = ring_colours(check_image(image), np.asarray(uv, float), float(radius), ink=LIMITS.ink, glare=LIMITS.glare)
    return RingColours(found.ratios, found.brightness, found.count, found.patchiness)


class Background(NamedTuple):
    """Colours of M cells between the dots.

    uv: (M, 2) px; ratios: (M, 2), ln(blue/red) and ln(green/red); brightness: (M,), ln(red in grey levels); pixels: (M,) number used.
    """

    uv: np.ndarray
    ratios: np.ndarray
    brightness: np.ndarray
    pixels: np.ndarray


def background_ratios(image: np.ndarray, radius: float, step: int = 12) -> Background:
    """Measure the colour of the background between the dots of an untouched image, in cells of step x step pixels.

    image: (H, W, 3), uint8 or the float mean of several frames; radius: of the sampling ring, px. A pixel is background if it is nearly as
    bright as the brightest pixel around it.
    """
    values = np.ascontiguousarray(image, np.float32)
    blue, green, red = cv2.split(values)
    smooth = cv2.blur(blue + green + red, (3, 3))
    size = 2 * int(np.ceil(radius)) + 1
    ground = smooth > TOUCHPAD.min_background * cv2.dilate(cv2.blur(smooth, (5, 5)), np.ones((size, size), np.uint8))
    ground &= (smooth > 0.2 * np.percentile(smooth[::4, ::4], 90)) & (cv2.blur(red, (3, 3)) < TOUCHPAD.max_red)
    ground = cv2.erode(ground.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(np.float32)
    return _cells(values, ground, step)


def _cells(values: np.ndarray, ground: np.ndarray, step: int) -> Background:
    """Mean colours over the background pixels of cells of step x step pixels."""
    rows, columns = (side // step for side in ground.shape)
    mask = ground[:rows * step, :columns * step]
    v, u = np.mgrid[0:rows * step, 0:columns * step].astype(np.float32)
    means = [cv2.resize(part * mask, (columns, rows), interpolation=cv2.INTER_AREA).ravel()
             for part in (*cv2.split(values[:rows * step, :columns * step]), u, v, np.float32(1))]
    sums = np.stack(means, axis=1).astype(float) * step**2
    sums = sums[(sums[:, 5] > step * step // 4 - 0.5) & (sums[:, :3].min(1) > 0)]
    logs = np.log(sums[:, :3])
    return Background(sums[:, 3:5] / sums[:, 5:], logs[:, :2] - logs[:, 2:], logs[:, 2] - np.log(sums[:, 5]), sums[:, 5])


@dataclass(frozen=True)
class Glare:
    """Glare of an untouched pad.

    Attributes
    ----------
    colour : ndarray, shape (2,)
        blue/red and green/red of the glare over those of the scattered light.
    size : float
        Root mean square, over positions with glare, of the red glare over the scattered red.
    field : ndarray, shape (7,)
        Coefficients of ln(red) minus ln(irradiance) over the image (smooth_light).
    dry : bool
        Whether the glare does not pass the water; then colour is relative to scattered light before the water has dyed it.
    """

    colour: np.ndarray
    size: float
    field: np.ndarray
    dry: bool = False

    @property
    def kernel(self) -> PadGlare:
        """The same for the kernels."""
        kind = _core.touchpad.Glare(probability=LIMITS.probability, size=self.size)
        return PadGlare(colour=self.colour, field=self.field, kind=kind, dry=self.dry, red=LIMITS.red, shading=LIMITS.shading,
                        min_ratio=TOUCHPAD.min_colour_ratio)


def terms(rays: np.ndarray) -> np.ndarray:
    """Terms (N, 7) of a polynomial over the image for unit rays (N, 3): degree 2, and degree 4 along the radius (vignetting)."""
    x, y = (rays[:, :2] / rays[:, 2:]).T / 0.4  # about 1 at the border of the image
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y, (x * x + y * y)**2], axis=1)


def smooth_light(rays: np.ndarray, brightness: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fit the light without glare by least squares that are reweighted on one side.

    brightness: (N,), ln(light) at unit rays (N, 3) minus ln(expected irradiance). Returns the coefficients (7,) of a polynomial (terms), by
    how much brightness exceeds it (N,), and where that is glare (N,) bool.
    """
    known = np.isfinite(brightness) & np.isfinite(rays).all(axis=1)
    every = terms(rays)
    design, light, weight = every[known], brightness[known], np.ones(known.sum())
    rounds = 30  # of reweighting; in the last third bright positions have no weight
    for number in range(rounds):
        weighted = (design * np.square(weight)[:, None]).T
        field = np.linalg.lstsq(weighted @ design, weighted @ light, rcond=None)[0]
        excess = light - design @ field
        below = -excess[excess < 0]
        limit = max(LIMITS.bright * SIGMA_PER_MAD * (float(np.median(below)) if len(below) else 0.0), LIMITS.least_bright)
        weight = np.where(excess > limit, 0.0 if number > 2 * rounds // 3 else (limit / np.maximum(excess, limit))**2, 1.0)
    excess = brightness - every @ field
    return field, excess, excess > limit


def learn_glare(rays: np.ndarray, brightness: np.ndarray, tinted: np.ndarray, dyed: np.ndarray, common: float) -> Glare | None:
    """Learn the glare of an untouched pad; None if there is almost none.

    rays: (N, 3), unit, to positions all over the pad; brightness: (N,), ln(red) minus ln(irradiance); tinted: (N, 2), log ratios minus
    those of the water; dyed: (N, 2), by how much the water reduces the log ratios of scattered light; common: share of positions with glare
    below which the result is None. Either the glare has passed the water or it has not; the hypothesis with the more uniform colour is
    taken.
    """
    field, excess, bright = smooth_light(rays, brightness)
    bright &= np.isfinite(tinted).all(axis=1)
    if bright.mean() < common:
        return None
    share = np.expm1(excess[bright])
    colour = ((1 + share)[:, None] * np.exp(tinted[bright]) - 1) / share[:, None]  # inverse of a mixture's log ratio
    strong = share > np.median(share)  # the colour of weak glare is noisier
    tint = np.log(np.clip(colour[strong], TOUCHPAD.min_colour_ratio, 1 / TOUCHPAD.min_colour_ratio))
    before = tint - dyed[bright][strong]
    uneven = [robust_sigma(some - np.median(some, axis=0), axis=0) for some in (before, tint)]
    dry = bool((uneven[0] < uneven[1]).all())
    found = np.exp(np.median(before, axis=0)) if dry else np.clip(np.median(colour[strong], axis=0), 0, 1 / TOUCHPAD.min_colour_ratio)
    return Glare(found, float(np.sqrt(np.mean(share**2))), field, dry)


@dataclass(frozen=True)
class WaterModel:
    """Range from colour; made by identification.fit_rest from the untouched pad alone, or by calibration.fit_touchpad.

    Attributes
    ----------
    path : LightPath
        Window and ring light.
    constants : ndarray, shape (2,)
        ln(blue/red) and ln(green/red) without water.
    absorptions : ndarray, shape (2,)
        Absorption of blue and of green minus that of red, in 1/m.
    noise : ndarray, shape (2, 2)
        Covariance of the two log ratios of a whole ring.
    ring : float
        Radius of the sampling ring in px.
    cap : Cap
        Undeformed surface.
    scale_sigma : float
        Standard deviation of the relative error that all values of range minus undeformed range share.
    ring_share : float
        Radius of the ring over the pitch of the dots.

    Raises
    ------
    BadArgument
        If numbers are not finite, an absorption is not positive, or the ring is smaller than 2 px.
    """

    path: LightPath
    constants: np.ndarray
    absorptions: np.ndarray
    noise: np.ndarray
    ring: float
    cap: Cap = Cap()
    scale_sigma: float = 0.05
    ring_share: float = TOUCHPAD.ring

    def __post_init__(self):
        numbers = np.concatenate([np.ravel(v) for v in (self.constants, self.absorptions, self.noise, self.ring, self.path.window_z)])
        if not np.isfinite(numbers).all() or not (np.asarray(self.absorptions) > 0).all() or self.ring < 2:
            raise BadArgument(f'water model: need finite numbers, positive absorptions and a ring of 2 px or more, got {self}')

    @property
    def kernel(self) -> PadWater:
        """The same for the kernels."""
        return PadWater(path=self.path.numbers, colour=self._colour, ring=self.ring, ring_share=self.ring_share, ink=LIMITS.ink,
                        glare=LIMITS.glare, cap_z=self.cap.centre_z, cap_radius=self.cap.curvature_radius)

    @property
    def _colour(self) -> WaterColour:
        constants, absorptions, noise = (np.ravel(np.asarray(one, float)) for one in (self.constants, self.absorptions, self.noise))
        return WaterColour(constants=constants, absorptions=absorptions, noise=noise, disagree=LIMITS.disagree, patchy=LIMITS.patchy)

    def depths(self, image: np.ndarray, tracks: DotTracks, camera: CameraModel) -> tuple[np.ndarray, np.ndarray]:
        """Ranges (N,), m, of the dots along the unit rays from the camera centre, and their standard deviations (N,), m, without glare.

        image: (H, W, 3) uint8 BGR. The standard deviations exclude the common error (scale_sigma). Both are NaN for a dot without a usable
        colour. Raises BadFrame for an image without colour.
        """
        rest = self.cap.meet(camera.centre, camera.rays(tracks.rest_uv))
        length, sigma = self.measure_lengths(log_ratios(image, tracks.uv, self.ring))
        ranges = np.linalg.norm(rest - self.path.centre, axis=1)
        dots = _core.touchpad.SeenDots(id=tracks.id, rays=camera.rays(tracks.uv), rest_ranges=ranges,
                                       rest_normals=(rest - [0, 0, self.cap.centre_z]) / self.cap.curvature_radius)
        found = water_ranges(self.path.numbers, dots, tracks.rows, tracks.columns, length, self.ring_share)
        return found.ranges, sigma / found.slopes

    def measure_lengths(self, colours: RingColours) -> tuple[np.ndarray, np.ndarray]:
        """Path lengths (N,), m, by weighted least squares from both log ratios, and their standard deviations (N,), m, without glare.

        Sharp edges make the two ratios disagree and blue/red vary around the ring; both increase the standard deviation. Kernel:
        src/touchpad/water.cpp.
        """
        unknown = np.full(len(colours.count), np.nan)
        seen = SeenColours(ratios=colours.ratios, count=colours.count, patchiness=colours.patchiness, excess=unknown, excess_sigma=unknown,
                           colour=np.ones((len(unknown), 2)))
        found = water_lengths(seen, self._colour, _core.touchpad.Glare(probability=LIMITS.probability, size=1.0))
        return found.lengths, found.sigma
