# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Range of each dot from the colour around it: absorption in the red water along the light's path (Beer-Lambert), beside glare of the
lamps."""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import cv2
import numpy as np

from .._core import path_lengths, ring_colours, water_lengths, water_ranges
from ..common.camera import CameraModel
from ..common.dots import DotTracks
from ..common.geometry import Cap
from ..common.statistics import SIGMA_PER_MAD, robust_sigma
from ..common.surface import grid_normals
from ..errors import BadArgument, BadFrame


@dataclass
class WaterLimits:
    """All that decides about colour and glare. What each is and how it was found: docs/constants.md."""

    ink: float = 0.75  # of a ring's upper quartile of blue: darker points are ink
    glare: float = 1.2  # brighter ones are glare
    disagree: float = 2.5  # standard deviations between the two ratios, from which the length's is widened
    patchy: float = 2.5  # times the noise's variance of a ring point, from which blue / red around a ring shows glare or an edge
    bright: float = 3.0  # standard deviations above the smooth light, from which a place has glare
    least_bright: float = 0.01  # the same, at least, of ln(red): glare of less changes a range by less than 0.1 mm
    common: float = 0.01  # share of the untouched pad with glare from which glare is modelled: pads without have 0.002
    common_at_dots: float = 0.03  # the same of its dots: pads without have up to 0.01
    red: float = 0.15  # absorption of red over that of blue minus red: dyes that look red absorb red least
    red_sigma: float = 0.1  # standard deviation of that
    shading: float = 0.015  # standard deviation of ln(red) by errors of the surface's shape
    probability: float = 0.3  # of glare at a dot of a pad that shows some: it appears where the untouched pad has none, too


LIMITS = WaterLimits()


@dataclass(frozen=True)
class LightPath:
    """Window and ring light in the sensor frame.

    window_z: m, plane where the water begins; lamp_z, lamp_radius: m, ring light around the camera's axis; ambient: diffuse share of the
    irradiance (0: Lambert's cosine alone); centre: (3,) camera centre, m.
    """

    window_z: float
    lamp_z: float
    lamp_radius: float
    ambient: float
    centre: tuple[float, float, float]

    @cached_property
    def numbers(self) -> np.ndarray:
        """(7,) as the kernels take them: window_z, lamp_z, lamp_radius, ambient, centre."""
        return np.array([self.window_z, self.lamp_z, self.lamp_radius, self.ambient, *self.centre])

    def lengths(self, places: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Path lengths (N,), m, in the water to positions places (N, 3), m, and back, and their derivatives (N,) along the camera's rays.

        normals: (N, 3) unit vectors out of the pad. The derivative neglects that of the irradiance weights: accurate to 1 %.
        Kernel: src/touchpad/water.cpp.
        """
        return self.light(places, normals)[:2]

    def irradiance(self, places: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Light (N,) on a skin at places (N, 3), m, with unit normals (N, 3), in units of the lamps' power.

        Inverse square law, Lambert's cosine, ambient.
        """
        return self.light(places, normals)[2]

    def light(self, places: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Lengths, derivatives, irradiance (N,), as above."""
        return path_lengths(self.numbers, np.ascontiguousarray(places, float), np.ascontiguousarray(normals, float))


POINTS = 16  # on a ring around each dot, each the sum of 3 x 3 pixels (src/touchpad/water.cpp)
RING_PIXELS = 9 * POINTS
CLIPPED = 250  # mean grey level of red from which some of its pixels may be clipped; chosen: a few levels of noise below
GROUND = 0.93  # share of the brightest surrounding pixel from which a pixel is background, at rest, where shading varies slowly; chosen
RING = 0.45  # radius over the pitch; chosen: the farthest from the dot without the rim of the next one
WIDE = 0.55  # the same where dots bleed into the background: colour at reduced resolution (4:2:0, 4:2:2, JPEG); chosen
BLED = 2e-3  # difference of log blue/red between the two rings from which colour bleeds; chosen: four times that of a dented surface
NOISE_FLOOR = 0.5  # grey levels, mean below which a channel has no information; chosen


def check_image(image: np.ndarray) -> np.ndarray:
    """The image itself if it is (H, W, 3) uint8. Raises BadFrame."""
    if not isinstance(image, np.ndarray) or image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
        shape = getattr(image, 'shape', None)
        raise BadFrame(f'surface: need a colour image (H, W, 3) uint8 in BGR order, got {shape}; set the camera to bgr8')
    return image


def pitch_px(uv: np.ndarray) -> float:
    """Median distance, px, from each of the dots at uv (N, 2) to the nearest other one. Raises BadFrame for less than 9 dots."""
    if len(uv) < 9:
        raise BadFrame(f'surface: need at least 9 dots for their pitch, got {len(uv)}')
    points = uv - uv.mean(0)
    length = np.square(points).sum(1)
    square = length[:, None] + length - 2 * points @ points.T
    np.fill_diagonal(square, np.inf)
    return float(np.sqrt(np.median(square.min(1))))


def ring_share(image: np.ndarray, uv: np.ndarray) -> float:
    """Radius over the pitch of the sampling ring around dots at uv (N, 2) px: WIDE if colour bleeds, else RING.

    image: (H, W, 3) uint8 BGR, untouched. Colour bleeding changes the background's colour near the dots.
    """
    pitch = pitch_px(uv)
    near, far = (log_ratios(image, uv, share * pitch).ratios[:, 0] for share in (RING, WIDE))
    gap = (near - far)[np.isfinite(near - far)]
    if len(gap) == 0:
        return RING
    middle = np.median(gap)
    sigma = robust_sigma(gap - middle) / np.sqrt(len(gap))
    return WIDE if abs(middle) > BLED + 4 * sigma else RING


@dataclass
class RingColours:
    """ratios: (N, 2) logarithms of blue/red and green/red; brightness: (N,) logarithm of red, grey levels; count: (N,) ring points used;
    patchiness: (N,) relative variance of blue/red around the ring without its linear gradient: noise, glare, sharp edges."""

    ratios: np.ndarray
    brightness: np.ndarray
    count: np.ndarray
    patchiness: np.ndarray


def log_ratios(image: np.ndarray, uv: np.ndarray, radius: float) -> RingColours:
    """Colour of the background around dots.

    image: (H, W, 3) uint8 BGR; uv: (N, 2) px; radius: of the ring, px. Points on ink, on glare or outside the image are not used; ratios
    are NaN with less than a quarter of the points or a dark channel. Raises BadFrame for a wrong image.
    Kernel: src/touchpad/water.cpp.
    """
    return RingColours(*ring_colours(check_image(image), np.asarray(uv, float), float(radius), ink=LIMITS.ink, glare=LIMITS.glare))


class Background(NamedTuple):
    """Places between dots. uv: (M, 2) px; ratios: (M, 2) logarithms of blue/red and green/red; brightness: (M,) logarithm of red, grey
    levels; pixels: (M,) number used."""

    uv: np.ndarray
    ratios: np.ndarray
    brightness: np.ndarray
    pixels: np.ndarray


def background_ratios(image: np.ndarray, radius: float, step: int = 12) -> Background:
    """Colour of the background between the dots of an untouched image.

    image: (H, W, 3), uint8 or float mean of several frames; radius: of the sampling ring, px; cells: step x step pixels. A pixel is
    background if it is nearly as bright as the brightest around it.
    """
    values = np.ascontiguousarray(image, np.float32)
    blue, green, red = cv2.split(values)
    smooth = cv2.blur(blue + green + red, (3, 3))
    size = 2 * int(np.ceil(radius)) + 1
    ground = smooth > GROUND * cv2.dilate(cv2.blur(smooth, (5, 5)), np.ones((size, size), np.uint8))
    ground &= (smooth > 0.2 * np.percentile(smooth[::4, ::4], 90)) & (cv2.blur(red, (3, 3)) < CLIPPED)
    ground = cv2.erode(ground.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(np.float32)
    return _cells(values, ground, step)


def _cells(values: np.ndarray, ground: np.ndarray, step: int) -> Background:
    """Means over the background pixels of cells of step x step pixels."""
    rows, columns = (side // step for side in ground.shape)
    mask = ground[:rows * step, :columns * step]
    v, u = np.mgrid[0:rows * step, 0:columns * step].astype(np.float32)
    means = [cv2.resize(part * mask, (columns, rows), interpolation=cv2.INTER_AREA).ravel()
             for part in (*cv2.split(values[:rows * step, :columns * step]), u, v, np.float32(1))]
    sums = np.stack(means, axis=1).astype(float) * step**2
    sums = sums[(sums[:, 5] > step * step // 4 - 0.5) & (sums[:, :3].min(1) > NOISE_FLOOR * sums[:, 5])]
    logs = np.log(sums[:, :3])
    return Background(sums[:, 3:5] / sums[:, 5:], logs[:, :2] - logs[:, 2:], logs[:, 2] - np.log(sums[:, 5]), sums[:, 5])


_ROUNDS, _FINAL = 30, 20  # rounds of reweighting, and from which on bright places have no weight; chosen
LEAST_COLOUR = 0.01  # of glare over scattered light; chosen: less, or more than its inverse, is noise
MOST_DYED = 5.0  # largest that the water takes from a log ratio; chosen: more leaves no light
_AGREE = 0.4  # share of the dots that tell a frame's gain: those that agree best; chosen


@dataclass(frozen=True)
class Glare:
    """colour: (2,) blue/red and green/red of glare over those of the scattered light; size: root mean square share, red glare over
    scattered red, of places with glare; field: (7,) ln(red) less ln(irradiance) over the image, as of smooth_light; dry: the glare does
    not pass the water, and colour is that over scattered light before the water has dyed it."""

    colour: np.ndarray
    size: float
    field: np.ndarray
    dry: bool = False


class SeenGlare(NamedTuple):
    """Of N dots of one frame. excess: ln(red) over that expected without glare, sigma: its standard deviation; size: of
    Glare; colour: (N, 2) of the glare over the light that each dot scatters."""

    excess: np.ndarray
    sigma: np.ndarray
    size: float
    colour: np.ndarray


@lru_cache(maxsize=8)
def no_glare(count: int) -> SeenGlare:
    """Of count dots whose glare is unknown: they are taken to have none."""
    return SeenGlare(*np.full((2, count), np.nan), 1.0, np.ones((count, 2)))


def terms(rays: np.ndarray) -> np.ndarray:
    """Terms (N, 7) of a polynomial over the image for unit rays (N, 3): degree 2, and degree 4 along the radius (vignetting)."""
    x, y = (rays[:, :2] / rays[:, 2:]).T / 0.4  # about 1 at the image's border
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y, (x * x + y * y)**2], axis=1)


def smooth_light(rays: np.ndarray, brightness: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The light without glare: coefficients (7,) of a polynomial, what brightness (N,) exceeds it by, and where that is glare (N,) bool.

    brightness: ln of the light at unit rays (N, 3), less that of the expected irradiance. Least squares, reweighted on one side.
    """
    known = np.isfinite(brightness) & np.isfinite(rays).all(axis=1)
    every = terms(rays)
    design, light, weight = every[known], brightness[known], np.ones(known.sum())
    for number in range(_ROUNDS):
        weighted = (design * np.square(weight)[:, None]).T
        field = np.linalg.lstsq(weighted @ design, weighted @ light, rcond=None)[0]
        excess = light - design @ field
        below = -excess[excess < 0]
        limit = max(LIMITS.bright * SIGMA_PER_MAD * (float(np.median(below)) if len(below) else 0.0), LIMITS.least_bright)
        weight = np.where(excess > limit, 0.0 if number > _FINAL else (limit / np.maximum(excess, limit))**2, 1.0)
    excess = brightness - every @ field
    return field, excess, excess > limit


def learn_glare(rays: np.ndarray, brightness: np.ndarray, tinted: np.ndarray, dyed: np.ndarray, common: float) -> Glare | None:
    """The glare of an untouched pad, None where there is next to none.

    rays: (N, 3) unit, to places all over the pad; brightness: (N,) ln(red) less ln(irradiance); tinted: (N, 2) log ratios less those of the
    water; dyed: (N, 2) what the water takes from the log ratios of scattered light; common: share of the places with glare
    below which it is None. Glare has passed the water, or it has not: that by which its colour is more even.
    """
    field, excess, bright = smooth_light(rays, brightness)
    bright &= np.isfinite(tinted).all(axis=1)
    if bright.mean() < common:
        return None
    share = np.expm1(excess[bright])
    colour = ((1 + share)[:, None] * np.exp(tinted[bright]) - 1) / share[:, None]  # inverse of a mixture's log ratio
    most = share > np.median(share)  # smaller shares tell the colour less well
    tint = np.log(np.clip(colour[most], LEAST_COLOUR, 1 / LEAST_COLOUR))
    before = tint - dyed[bright][most]
    uneven = [robust_sigma(some - np.median(some, axis=0), axis=0) for some in (before, tint)]
    dry = bool((uneven[0] < uneven[1]).all())
    found = np.exp(np.median(before, axis=0)) if dry else np.clip(np.median(colour[most], axis=0), 0, 1 / LEAST_COLOUR)
    return Glare(found, float(np.sqrt(np.mean(share**2))), field, dry)


class GlaringPad:
    """A pad with glare, frame by frame. absorptions: (2,) 1/m, of blue and green minus that of red."""

    def __init__(self, glare: Glare, path: LightPath, absorptions: np.ndarray, rows: int, columns: int):
        self._glare, self._path, self._absorptions, self._shape = glare, path, np.asarray(absorptions), (rows, columns)
        self._rest: np.ndarray | None = None

    def set_rest(self, places: np.ndarray, normals: np.ndarray) -> None:
        """Take the untouched places (K, 3), m, of all dots of the grid, and unit normals (K, 3) there; NaN where unknown."""
        self._normals = normals.reshape(*self._shape, 3)
        self._rest = self._light(places)[0]

    def seen(self, brightness: np.ndarray, rays: np.ndarray, ids: np.ndarray, places: np.ndarray) -> SeenGlare:
        """Glare at dots ids (N,) seen with ln(red) brightness (N,) along unit rays (N, 3), of a skin through places (K, 3), m."""
        lengths, _, irradiance = (part[ids] for part in self._light(places))
        longer = lengths - self._rest[ids]
        expected = terms(rays) @ self._glare.field + np.log(irradiance) - LIMITS.red * self._absorptions[0] * longer
        excess = brightness - expected
        excess -= _gain(excess)
        sigma = np.hypot(LIMITS.shading, LIMITS.red_sigma * self._absorptions[0] * longer)
        return SeenGlare(excess, sigma, self._glare.size, self._colour(lengths))

    def _colour(self, lengths: np.ndarray) -> np.ndarray:
        """Colour (N, 2) of the glare over light that has gone lengths (N,), m, through the water."""
        if self._glare.dry:
            return self._glare.colour * np.exp(np.clip(self._absorptions * lengths[:, None], 0, MOST_DYED))
        return np.tile(self._glare.colour, (len(lengths), 1))

    def _light(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """LightPath.light of the skin through places (K, 3), m, whose border, and what is beside a gap, keeps its normals of rest."""
        normals, inner = self._normals.copy(), np.s_[1:-1, 1:-1]
        found = grid_normals(places.reshape(*self._shape, 3))[inner]
        normals[inner] = np.where(np.isnan(found), normals[inner], found)
        return self._path.light(places, normals.reshape(-1, 3))


def _gain(over: np.ndarray) -> float:
    """The frame's gain: mean of the values over (N,) that agree best, in the shortest interval with _AGREE of them."""
    known = np.sort(over[np.isfinite(over)])
    some = max(int(_AGREE * len(known)), 1)
    if len(known) < some + 1:
        return 0.0
    start = int(np.argmin(known[some:] - known[:-some]))
    return float(known[start:start + some + 1].mean())


@dataclass(frozen=True)
class RestLight:
    """Untouched dots: ranges (N,), m; normals (N, 3)."""

    ranges: np.ndarray
    normals: np.ndarray

    def take(self, ids: np.ndarray) -> RestLight:
        """The same of dots ids (M,)."""
        return RestLight(self.ranges[ids], self.normals.take(ids, axis=0))


@dataclass(frozen=True)
class WaterModel:
    """Colour -> range. From identification.fit_rest (untouched pad alone) or calibration.fit_touchpad.

    constants: (2,) log blue/red and green/red without water; absorptions: (2,) 1/m, of blue and green minus that of red; noise: (2, 2)
    covariance of the two log ratios of a whole ring; ring: radius of the sampling ring, px; scale_sigma: standard deviation of the common
    relative error of (range - range at rest); ring_share: radius of the ring over the dots' pitch. Raises BadArgument.
    """

    path: LightPath
    constants: np.ndarray
    absorptions: np.ndarray
    noise: np.ndarray
    ring: float
    cap: Cap = Cap()
    scale_sigma: float = 0.05
    ring_share: float = RING

    def __post_init__(self):
        numbers = np.concatenate([np.ravel(v) for v in (self.constants, self.absorptions, self.noise, self.ring, self.path.window_z)])
        if not np.isfinite(numbers).all() or not (np.asarray(self.absorptions) > 0).all() or self.ring < 2:
            raise BadArgument(f'water model: need finite numbers, positive absorptions and a ring of 2 px or more, got {self}')

    def depths(self, image: np.ndarray, tracks: DotTracks, camera: CameraModel) -> tuple[np.ndarray, np.ndarray]:
        """Ranges (N,) of the dots, m along the unit ray from the camera's centre, and their standard deviations (N,), m.

        image: (H, W, 3) uint8 BGR; the standard deviations exclude the common error (scale_sigma). Both are NaN for a dot
        without a usable colour. Raises BadFrame for an image without colour.
        """
        rest = self.at_rest(self.cap.meet(camera.centre, camera.rays(tracks.rest_uv)))
        return self.solve(log_ratios(image, tracks.uv, self.ring), camera.rays(tracks.uv), rest, tracks)

    def at_rest(self, xyz: np.ndarray) -> RestLight:
        """Ranges and normals at untouched positions xyz (N, 3), m."""
        ranges = np.sqrt(np.square(xyz - np.array(self.path.centre)).sum(axis=1))
        return RestLight(ranges, (xyz - [0, 0, self.cap.centre_z]) / self.cap.curvature_radius)

    def solve(self, colours: RingColours, rays: np.ndarray, rest: RestLight, tracks: DotTracks,
              glare: SeenGlare | None = None) -> tuple[np.ndarray, np.ndarray]:
        """As depths, from the colours (N,) around the dots, their unit rays (N, 3), and rest (N,).

        glare: as for path_lengths. Kernel: src/touchpad/water.cpp.
        """
        length, sigma = self.path_lengths(colours, glare)
        ranges, slope = water_ranges(
            self.path.numbers, length, rays=rays, id=tracks.id, rest_ranges=rest.ranges, rest_normals=rest.normals, rows=tracks.rows,
            columns=tracks.columns, ring_share=self.ring_share)
        return ranges, sigma / slope

    def path_lengths(self, colours: RingColours, glare: SeenGlare | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Path lengths (N,), m, by weighted least squares from both log ratios, and their standard deviations, m.

        glare: as seen in this frame, None for a pad without. Unexplained glare and sharp edges make the two ratios disagree and blue/red
        vary around the ring: both widen the standard deviation. Kernel: src/touchpad/water.cpp.
        """
        excess, sigma, size, colour = glare or no_glare(len(colours.count))
        return water_lengths(
            colours.ratios, colours.count, colours.patchiness, excess, sigma, colour, constants=self.constants,
            absorptions=self.absorptions, noise=np.ravel(self.noise), disagree=LIMITS.disagree, patchy=LIMITS.patchy,
            probability=LIMITS.probability, size=size)
