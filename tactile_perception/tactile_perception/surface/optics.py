# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""How far each dot is from the camera, from the colour that the red water leaves (Beer-Lambert along the light's path)."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..camera import CameraModel
from ..dots.dots import DotTracks
from ..errors import BadArgument
from .cap import Cap
from .optics_colour import POINTS, RING, RingColours, log_ratios
from .optics_grid import bend, normals, smooth, to_grid
from .optics_path import LightPath

PATCHY = 2.5    # times the noise of ring points: blue that varies more around a ring than that is glare or an edge
DISAGREE = 2.5  # standard deviations by which two ratios may disagree before their disagreement widens sigma


@dataclass(frozen=True)
class WaterModel:
    """Colour -> range. Made by optics_fit.fit_rest (untouched pad alone) or improved by calibration.touchpad.fit_touchpad.

    path: the light's way; constants: (2,) log blue/red and green/red at no water; absorptions: (2,) 1/m, how much more blue and green
    fade than red; noise: (2, 2) covariance of the two log ratios with all ring points; ring: radius of the sampling ring, px;
    ring_offset: m, by which a mean over that ring exceeds the range in its centre on the cap at rest; scale_sigma: relative standard
    deviation of (range - range at rest) that all dots share; offset_sigma: m, of a range shift that all share.
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

    def __post_init__(self):
        numbers = np.concatenate([np.ravel(v) for v in (self.constants, self.absorptions, self.noise, self.ring, self.path.window_z)])
        if not np.isfinite(numbers).all() or not (np.asarray(self.absorptions) > 0).all() or self.ring < 2:
            raise BadArgument(f'water model: need finite numbers, positive absorptions and a ring of 2 px or more, got {self}')

    def depths(self, image: np.ndarray, tracks: DotTracks, camera: CameraModel) -> tuple[np.ndarray, np.ndarray]:
        """Ranges (N,) of the dots, m along the unit ray from the camera's centre, and their standard deviations (N,), m.

        image: (H, W, 3) uint8 BGR; sigma leaves out what all dots share (scale_sigma, offset_sigma). Both are NaN where the colour cannot
        be read. Raises BadFrame for an image without colour.
        """
        return self.solve(log_ratios(image, tracks.uv, self.ring), tracks, camera)

    def solve(self, colours: RingColours, tracks: DotTracks, camera: CameraModel) -> tuple[np.ndarray, np.ndarray]:
        """As depths, from the colours (N,) around the dots."""
        length, sigma = self.path_lengths(colours)
        rays, rest_rays = camera.rays(tracks.uv), camera.rays(tracks.rest_uv)
        rest = self.cap.ranges(camera.centre, rest_rays)
        rest_normals = (camera.centre + rest[:, None] * rest_rays - [0, 0, self.cap.centre_z]) / self.cap.curvature_radius
        first, _ = self._march(length, camera.centre, rays, rest, rest_normals)
        facing = self._facing(first - rest, rest, rays, camera.centre, tracks, rest_normals)
        second, slope = self._march(length, camera.centre, rays, first, facing)
        shift = second - rest
        return rest + shift - self._ring_bias(shift, tracks) - self.ring_offset, sigma / slope

    def path_lengths(self, colours: RingColours) -> tuple[np.ndarray, np.ndarray]:
        """Path lengths (N,), m, that explain both log ratios best, and their standard deviations, m: wider where glare shows.

        Glare makes the two ratios disagree, and blue uneven around the ring; so does a sharp edge of the surface.
        """
        weight = np.linalg.inv(self.noise)
        gain = weight @ self.absorptions
        information = float(self.absorptions @ gain)
        count, short = colours.count, self.constants - colours.ratios
        length = short @ gain / information
        rest = short - length[:, None] * self.absorptions
        disagreement = np.sqrt(np.maximum(np.einsum('ni,ij,nj->n', rest, weight, rest) * count / POINTS, 0))
        widen = np.maximum(1.0, disagreement / DISAGREE) ** 2
        patches = np.maximum(colours.patchiness - PATCHY * POINTS * self.noise[0, 0], 0) / self.absorptions[0]**2
        return length, np.sqrt(widen**2 * POINTS / np.maximum(count, 1) / information + patches)

    def _march(self, length, centre, rays, start, facing) -> tuple[np.ndarray, np.ndarray]:
        """Ranges (N,) along rays where the path has that length, by one Newton step from start; and the path's slope (N,) there."""
        here, slope = self.path.lengths(centre + start[:, None] * rays, facing, rays)
        return start + (length - here) / slope, slope

    def _facing(self, shift, rest, rays, centre, tracks, rest_normals) -> np.ndarray:
        """Normals (N, 3) of the present surface, from ranges smoothed over neighbours; those at rest where there is no grid."""
        if tracks.rows < 3 or tracks.columns < 3:
            return rest_normals
        even = smooth(to_grid(shift, tracks.id, tracks.rows, tracks.columns)).ravel()[tracks.id]
        places = centre + (rest + np.where(np.isfinite(even), even, 0))[:, None] * rays
        grid = to_grid(places, tracks.id, tracks.rows, tracks.columns)
        return normals(grid, to_grid(rest_normals, tracks.id, tracks.rows, tracks.columns)).reshape(-1, 3)[tracks.id]

    def _ring_bias(self, shift: np.ndarray, tracks: DotTracks) -> np.ndarray:
        """What a mean over a ring adds to the value in its centre, radius^2 / 4 times the Laplacian: of the shift since rest.

        The shift is smoothed first: otherwise its noise, not its shape, would be bent.
        """
        if tracks.rows < 3 or tracks.columns < 3:
            return np.zeros_like(shift)
        even = smooth(to_grid(shift, tracks.id, tracks.rows, tracks.columns))
        return bend(even).ravel()[tracks.id] * (RING**2 / 4)
