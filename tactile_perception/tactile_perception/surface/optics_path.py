# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""How far light travels through the water: from a ring of lamps through a window to the membrane, and back to the camera.

Beer and Lambert: a colour channel c fades by exp(-absorption_c * length). Brightness that all channels share (lamps, shading,
vignetting, exposure) cancels in the ratio of two channels; what stays is a difference of absorptions times one length per place.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

LAMPS = 8  # the ring is even: eight points integrate it to 1e-4 of a length


@dataclass(frozen=True)
class LightPath:
    """Where the water begins and where the light comes from, in the sensor frame.

    window_z: m, plane where the water begins; lamp_z, lamp_radius: m, ring of lamps around the camera's axis;
    ambient: share of light that comes from all sides (0: only the lamps' own direction counts); centre: (3,) camera's centre, m.
    """

    window_z: float
    lamp_z: float
    lamp_radius: float
    ambient: float
    centre: tuple[float, float, float]

    def lengths(self, places: np.ndarray, normals: np.ndarray, rays: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Lengths (N,), m, in the water to and from places (N, 3), m, and their slopes (N,) along rays.

        normals: (N, 3) unit vectors out of the pad; rays: (N, 3) unit vectors from the camera's centre through the places (worked out
        where not given). The slope holds the lamps' weights still: good to 1 %.
        """
        out = places - np.asarray(self.centre)
        rays = out / np.sqrt((out**2).sum(1, keepdims=True)) if rays is None else rays
        depth = places[:, 2] - self.window_z
        slant, change = self._lamp_slant(places, normals, rays)
        both = 1 / rays[:, 2] + slant
        return depth * both, rays[:, 2] * both + depth * change

    def _lamp_slant(self, places: np.ndarray, normals: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean of 1 / cos(angle to the z axis) of arriving light, weighted by irradiance (inverse square, facing surface); its slope."""
        angle = np.arange(LAMPS)[:, None] * (2 * np.pi / LAMPS)
        (x, y, z), (nx, ny, nz), (rx, ry, rz) = (np.ascontiguousarray(vectors.T) for vectors in (places, normals, rays))
        dx = x - (self.centre[0] + self.lamp_radius * np.cos(angle))
        dy = y - (self.centre[1] + self.lamp_radius * np.sin(angle))
        dz = z - self.lamp_z
        square = dx * dx + dy * dy + dz * dz
        distance = np.sqrt(square)
        facing = (dx * nx + dy * ny + dz * nz) / distance
        weight = (np.maximum(facing, 0.0) + max(self.ambient, 0.0) + 1e-6) / square
        along = (dx * rx + dy * ry + dz * rz) / distance
        total = weight.sum(0) * dz
        slant = (weight * distance).sum(0) / total
        return slant, (weight * along).sum(0) / total - slant * rz / dz
