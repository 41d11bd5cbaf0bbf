# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""How far each dot is from the camera, from the colour that the red water leaves (Beer-Lambert along the light's path)."""
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

PATCHY = 2.5    # times the noise of ring points: blue that varies more around a ring than that is glare or an edge
IN_PLACE = 0.7  # px: dots that have gone further lie otherwise among the blocks of pixels that share a stored colour
LARGEST_BLED = 3e-4  # m
DISAGREE = 2.5  # standard deviations by which two ratios may disagree before their disagreement widens sigma


@dataclass(frozen=True)
class RestLight:
    """Untouched dots: ranges (N,), m; normals (3, N); what LightPath.slants gives there (N,); by how much, m, each dot's range was read too
    long (N,) because colour had bled from it, as far as that is known. Single precision."""

    ranges: np.ndarray
    normals: np.ndarray
    slants: np.ndarray
    changes: np.ndarray
    bled: np.ndarray | None = None

    def take(self, ids: np.ndarray) -> RestLight:
        """Of those with these numbers (M,)."""
        bled = None if self.bled is None else self.bled[ids]
        return RestLight(self.ranges[ids], self.normals.take(ids, axis=1), self.slants[ids], self.changes[ids], bled)


@dataclass(frozen=True)
class WaterModel:
    """Colour -> range. Made by optics.identification.fit_rest (untouched pad alone) or improved by calibration.touchpad.fit_touchpad.

    path: the light's way; constants: (2,) log blue/red and green/red at no water; absorptions: (2,) 1/m, how much more blue and green
    fade than red; noise: (2, 2) covariance of the two log ratios with all ring points; ring: radius of the sampling ring, px;
    ring_offset: m, by which a mean over that ring exceeds the range in its centre on the cap at rest; scale_sigma: relative standard
    deviation of (range - range at rest) that all dots share; offset_sigma: m, of a range shift that all share; ring_share: radius of the
    ring over the dots' pitch.
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

        image: (H, W, 3) uint8 BGR; sigma leaves out what all dots share (scale_sigma, offset_sigma). Both are NaN where the colour cannot
        be read. Raises BadFrame for an image without colour.
        """
        rest = self.at_rest(self.cap.meet(camera.centre, camera.rays(tracks.rest_uv)))
        return self.solve(log_ratios(image, tracks.uv, self.ring), camera.rays(tracks.uv), rest, tracks)

    def at_rest(self, xyz: np.ndarray) -> RestLight:
        """What is known of the light at untouched places xyz (N, 3), m."""
        places = np.ascontiguousarray(xyz.T, np.float32)
        away, normals = places - np.float32(self.path.centre)[:, None], places.copy()
        normals[2] -= self.cap.centre_z
        normals /= np.float32(self.cap.curvature_radius)
        ranges = np.sqrt(dot(away, away))
        return RestLight(ranges, normals, *self.path.slants(places, normals, away / ranges))

    def solve(self, colours: RingColours, rays: np.ndarray, rest: RestLight, tracks: DotTracks,
              shape: SurfaceShape | None = None) -> tuple[np.ndarray, np.ndarray]:
        """As depths, from the colours (N,) around the dots, their unit rays (N, 3), and rest (N,), what is known of them untouched.

        shape: of the surface in the last frame, to go on from. Single precision inside: 2 nm of a range.
        """
        length, sigma = self.path_lengths(colours)
        length, rays, centre = np.float32(length), np.ascontiguousarray(rays.T, np.float32), np.float32(self.path.centre)[:, None]
        first, _ = self._march(length, centre, rays, rest.ranges, (rest.slants, rest.changes))
        facing, bend = (shape or SurfaceShape()).at(first, rays, centre, rest, tracks)
        second, slope = self._march(length, centre, rays, first, self.path.slants(centre + first * rays, facing, rays))
        ranges = second - bend * np.float32(self.ring_share**2 / 4) - self.ring_offset
        if rest.bled is not None:
            ranges -= rest.bled * np.exp(-np.square(tracks.duv).sum(1) / (2 * IN_PLACE**2))
        return ranges, sigma / slope

    def bled(self, image: np.ndarray, tracks: DotTracks, camera: CameraModel) -> np.ndarray | None:
        """By how much, m, the range of each of the tracks (N,) is read too long in an untouched image (H, W, 3), where colour bleeds; None
        where it does not, as all there is then is noise.

        How a dot bleeds hangs on where it lies among the blocks that share a colour, so each one has its own error while it stays there.
        """
        if self.ring_share <= RING:
            return None
        rest = self.at_rest(self.cap.meet(camera.centre, camera.rays(tracks.uv)))
        error = self.solve(log_ratios(image, tracks.uv, self.ring), camera.rays(tracks.uv), rest, tracks)[0] - rest.ranges
        return np.where(np.abs(error) < LARGEST_BLED, error, np.float32(0))

    def path_lengths(self, colours: RingColours) -> tuple[np.ndarray, np.ndarray]:
        """Path lengths (N,), m, that explain both log ratios best, and their standard deviations, m: wider where glare shows.

        Glare makes the two ratios disagree, and blue uneven around the ring; so does a sharp edge of the surface.
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
        """Of two log ratios short of those at no water: the length (2,) that explains both best; in units of DISAGREE standard deviations
        what it leaves over (2,) (of two numbers less one, one is left); the information about the length, 1/m^2."""
        weight, (blue, green) = np.linalg.inv(self.noise), self.absorptions
        gain = weight @ self.absorptions
        information = float(self.absorptions @ gain)
        return gain / information, np.array([green, -blue]) * np.sqrt(np.linalg.det(weight) / information) / DISAGREE, information

    def _march(self, length, centre, rays, start, slants) -> tuple[np.ndarray, np.ndarray]:
        """Ranges (N,) along rays where the path has that length, by one Newton step from start; and the path's slope (N,) there."""
        here, slope = self.path.from_slants(centre[2] + start * rays[2], rays[2], *slants)
        return start + (length - here) / slope, slope
