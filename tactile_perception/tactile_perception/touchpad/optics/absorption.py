# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Range of each dot from the colour around it: absorption in the red water along the light's path (Beer-Lambert)."""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .colour import POINTS, RING, RingColours, log_ratios
from ...common.camera import CameraModel
from ...common.dots import DotTracks
from ...common.spherical_cap import Cap
from ...common.vectors import dot
from ...errors import BadArgument
from .light_path import LightPath
from .surface_shape import SurfaceShape

PATCHY = 2.5  # times the noise variance of ring points above which blue/red around a ring shows glare or an edge; chosen
IN_PLACE = 0.7  # px; chosen: a dot that has moved by more lies differently in the blocks of pixels that share a stored colour
LARGEST_BLED = 3e-4  # m; chosen: larger errors are not colour bleeding
DISAGREE = 2.5  # standard deviations of disagreement between the two ratios above which sigma is widened; chosen


@dataclass(frozen=True)
class RestLight:
    """Untouched dots: ranges (N,), m; normals (3, N); slants, changes (N,): LightPath.slants there; bled: (N,) m, range error by colour
    bleeding, None without. Single precision."""

    ranges: np.ndarray
    normals: np.ndarray
    slants: np.ndarray
    changes: np.ndarray
    bled: np.ndarray | None = None

    def take(self, ids: np.ndarray) -> RestLight:
        """The same of dots ids (M,)."""
        bled = None if self.bled is None else self.bled[ids]
        return RestLight(self.ranges[ids], self.normals.take(ids, axis=1), self.slants[ids], self.changes[ids], bled)


@dataclass(frozen=True)
class WaterModel:
    """Colour -> range. From optics.identification.fit_rest (untouched pad alone) or calibration.touchpad.fit_touchpad.

    constants: (2,) log blue/red and green/red without water; absorptions: (2,) 1/m, of blue and green minus that of red; noise: (2, 2)
    covariance of the two log ratios of a whole ring; ring: radius of the sampling ring, px; ring_offset: m, mean range over that ring
    minus the range at its centre, on the cap at rest; scale_sigma: standard deviation of the common relative error of (range - range at
    rest); offset_sigma: m, of the common offset of the ranges; ring_share: radius of the ring over the dots' pitch. Raises BadArgument.
    """

    path: LightPath
    constants: np.ndarray
    absorptions: np.ndarray
    noise: np.ndarray
    ring: float
    cap: Cap = Cap()
    ring_offset: float = 0.0
    scale_sigma: float = 0.05
    offset_sigma: float = 1e-5
    ring_share: float = RING

    def __post_init__(self):
        numbers = np.concatenate([np.ravel(v) for v in (self.constants, self.absorptions, self.noise, self.ring, self.path.window_z)])
        if not np.isfinite(numbers).all() or not (np.asarray(self.absorptions) > 0).all() or self.ring < 2:
            raise BadArgument(f'water model: need finite numbers, positive absorptions and a ring of 2 px or more, got {self}')

    def depths(self, image: np.ndarray, tracks: DotTracks, camera: CameraModel) -> tuple[np.ndarray, np.ndarray]:
        """Ranges (N,) of the dots, m along the unit ray from the camera's centre, and their standard deviations (N,), m.

        image: (H, W, 3) uint8 BGR; the standard deviations exclude the common errors (scale_sigma, offset_sigma). Both are NaN for a dot
        without a usable colour. Raises BadFrame for an image without colour.
        """
        rest = self.at_rest(self.cap.meet(camera.centre, camera.rays(tracks.rest_uv)))
        return self.solve(log_ratios(image, tracks.uv, self.ring), camera.rays(tracks.uv), rest, tracks)

    def at_rest(self, xyz: np.ndarray) -> RestLight:
        """Ranges, normals and light paths at untouched positions xyz (N, 3), m."""
        places = np.ascontiguousarray(xyz.T, np.float32)
        away, normals = places - np.float32(self.path.centre)[:, None], places.copy()
        normals[2] -= self.cap.centre_z
        normals /= np.float32(self.cap.curvature_radius)
        ranges = np.sqrt(dot(away, away))
        return RestLight(ranges, normals, *self.path.slants(places, normals, away / ranges))

    def solve(self, colours: RingColours, rays: np.ndarray, rest: RestLight, tracks: DotTracks,
              shape: SurfaceShape | None = None) -> tuple[np.ndarray, np.ndarray]:
        """As depths, from the colours (N,) around the dots, their unit rays (N, 3), and rest (N,).

        shape: the surface's shape, kept between frames. Single precision inside: 2 nm of a range.
        """
        length, sigma = self.path_lengths(colours)
        length, rays, centre = np.float32(length), np.ascontiguousarray(rays.T, np.float32), np.float32(self.path.centre)[:, None]
        first, _ = self._march(length, centre, rays, rest.ranges, (rest.slants, rest.changes))
        facing, curvature = (shape or SurfaceShape()).at(first, rays, centre, rest, tracks)
        second, slope = self._march(length, centre, rays, first, self.path.slants(centre + first * rays, facing, rays))
        ranges = second - curvature * np.float32(self.ring_share**2 / 4) - self.ring_offset
        if rest.bled is not None:
            ranges -= rest.bled * np.exp(-np.square(tracks.duv).sum(1) / (2 * IN_PLACE**2))
        return ranges, sigma / slope

    def bled(self, image: np.ndarray, tracks: DotTracks, camera: CameraModel) -> np.ndarray | None:
        """Range error (N,), m, of the tracks by colour bleeding, from an untouched image (H, W, 3); None for colour at full resolution.

        It depends on a dot's position in the blocks of pixels that share a colour, and is constant while the dot stays there.
        """
        if self.ring_share <= RING:
            return None
        rest = self.at_rest(self.cap.meet(camera.centre, camera.rays(tracks.uv)))
        error = self.solve(log_ratios(image, tracks.uv, self.ring), camera.rays(tracks.uv), rest, tracks)[0] - rest.ranges
        return np.where(np.abs(error) < LARGEST_BLED, error, np.float32(0))

    def path_lengths(self, colours: RingColours) -> tuple[np.ndarray, np.ndarray]:
        """Path lengths (N,), m, by weighted least squares from both log ratios, and their standard deviations, m.

        Glare and sharp edges make the two ratios disagree and blue/red vary around the ring: both widen the standard deviation.
        """
        gain, apart, scale = self._explanation
        short = self.constants[:, None] - colours.ratios.T
        length = gain @ short
        share = np.maximum(colours.count, 1) * (1 / POINTS)
        widen = np.maximum(np.square(apart @ short) * share, 1.0)
        patches = np.maximum(colours.patchiness - PATCHY * POINTS * self.noise[0, 0], 0) / self.absorptions[0]**2
        return length, np.sqrt(np.square(widen) / (share * scale) + patches)

    @cached_property
    def _explanation(self) -> tuple[np.ndarray, np.ndarray, float]:
        """For the two log ratios minus their constants: weights (2,) of the path length, weights (2,) of the residual in units of DISAGREE
        standard deviations (one degree of freedom), and the information about the length, 1/m^2."""
        weight, (blue, green) = np.linalg.inv(self.noise), self.absorptions
        gain = weight @ self.absorptions
        information = float(self.absorptions @ gain)
        return gain / information, np.array([green, -blue]) * np.sqrt(np.linalg.det(weight) / information) / DISAGREE, information

    def _march(self, length, centre, rays, start, slants) -> tuple[np.ndarray, np.ndarray]:
        """Ranges (N,) along rays at which the path has that length, by one Newton step from start, and the path's derivative (N,) there."""
        here, slope = self.path.from_slants(centre[2] + start * rays[2], rays[2], *slants)
        return start + (length - here) / slope, slope
