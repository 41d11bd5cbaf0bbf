# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Range of each dot from the colour around it: absorption in the red water along the light's path (Beer-Lambert)."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .colour import RING, RingColours, log_ratios
from .glare import PROBABILITY, SeenGlare, no_glare
from ..._core import water_lengths, water_ranges
from ...common.camera import CameraModel
from ...common.dots import DotTracks
from ...common.geometry import Cap
from ...errors import BadArgument
from .light_path import LightPath

IN_PLACE = 0.7  # px; chosen: a dot that has moved by more lies differently in the blocks of pixels that share a stored colour
LARGEST_BLED = 3e-4  # m; chosen: larger errors are not colour bleeding


@dataclass(frozen=True)
class RestLight:
    """Untouched dots: ranges (N,), m; normals (N, 3); bled: (N,) m, range error by colour bleeding, None without."""

    ranges: np.ndarray
    normals: np.ndarray
    bled: np.ndarray | None = None

    def take(self, ids: np.ndarray) -> RestLight:
        """The same of dots ids (M,)."""
        return RestLight(self.ranges[ids], self.normals[ids], None if self.bled is None else self.bled[ids])


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
        """Ranges and normals at untouched positions xyz (N, 3), m."""
        ranges = np.sqrt(np.square(xyz - np.array(self.path.centre)).sum(axis=1))
        return RestLight(ranges, (xyz - [0, 0, self.cap.centre_z]) / self.cap.curvature_radius)

    def solve(self, colours: RingColours, rays: np.ndarray, rest: RestLight, tracks: DotTracks,
              glare: SeenGlare | None = None) -> tuple[np.ndarray, np.ndarray]:
        """As depths, from the colours (N,) around the dots, their unit rays (N, 3), and rest (N,).

        glare: as for path_lengths. Kernel: src/touchpad/optics/water_ranges.cpp.
        """
        length, sigma = self.path_lengths(colours, glare)
        ranges, slope = water_ranges(
            self.path.numbers, length, rays=rays, id=tracks.id, rest_ranges=rest.ranges, rest_normals=rest.normals, rows=tracks.rows,
            columns=tracks.columns, ring_share=self.ring_share)
        ranges -= self.ring_offset
        if rest.bled is not None:
            ranges -= rest.bled * np.exp(-np.square(tracks.duv).sum(1) / (2 * IN_PLACE**2))
        return ranges, sigma / slope

    def bled(self, image: np.ndarray, tracks: DotTracks, camera: CameraModel,
             glare: SeenGlare | None = None) -> np.ndarray | None:
        """Range error (N,), m, of the tracks by colour bleeding and by what glare remains, from an untouched image (H, W, 3).

        It depends on a dot's place among lamps and blocks of pixels that share a colour, and is constant while the dot stays there. None
        for colour at full resolution without glare, as for path_lengths.
        """
        if self.ring_share <= RING and glare is None:
            return None
        rest = self.at_rest(self.cap.meet(camera.centre, camera.rays(tracks.uv)))
        error = self.solve(log_ratios(image, tracks.uv, self.ring), camera.rays(tracks.uv), rest, tracks, glare)[0] - rest.ranges
        return np.where(np.abs(error) < LARGEST_BLED, error, 0.0)

    def path_lengths(self, colours: RingColours, glare: SeenGlare | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Path lengths (N,), m, by weighted least squares from both log ratios, and their standard deviations, m.

        glare: as seen in this frame, None for a pad without. Unexplained glare and sharp edges make the two ratios disagree and blue/red
        vary around the ring: both widen the standard deviation. Kernel: src/touchpad/optics/glare.cpp.
        """
        excess, sigma, size, colour = glare or no_glare(len(colours.count))
        return water_lengths(
            colours.ratios, colours.count, colours.patchiness, excess, sigma, colour, constants=self.constants,
            absorptions=self.absorptions, noise=np.ravel(self.noise), probability=PROBABILITY, size=size)
