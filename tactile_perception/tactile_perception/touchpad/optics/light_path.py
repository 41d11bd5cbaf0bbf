# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Length of the light's path in the water: from a ring light through a window to the membrane, and back to the camera.

Beer-Lambert: colour channel c is attenuated by exp(-absorption_c * length). Factors common to all channels (illumination, shading,
vignetting, exposure) cancel in the ratio of two channels; its logarithm is linear in the path length.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

LAMPS = 8  # points that integrate the uniform ring light, to 1e-4 of a length (test_light_path)


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

    def lengths(self, places: np.ndarray, normals: np.ndarray, rays: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Path lengths (N,), m, in the water to positions places (N, 3), m, and back, and their derivatives (N,) along rays.

        normals: (N, 3) unit vectors out of the pad; rays: (N, 3) unit vectors from the camera centre through the positions, None: computed.
        The derivative neglects that of the irradiance weights: accurate to 1 %.
        """
        x = np.ascontiguousarray(places.T)
        if rays is None:
            out = x - np.asarray(self.centre)[:, None]
            rays = (out / np.sqrt((out**2).sum(0))).T
        along = np.ascontiguousarray(rays.T)
        slant, change = self.slants(x, np.ascontiguousarray(normals.T), along)
        return self.from_slants(x[2], along[2], slant, change)

    def from_slants(self, z: np.ndarray, upwards: np.ndarray, slant: np.ndarray, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As lengths, from heights z (N,), m, the rays' z components upwards (N,), and slant, change (N,) of slants."""
        depth, both = z - self.window_z, 1 / upwards + slant
        return depth * both, upwards * both + depth * change

    def slants(self, places: np.ndarray, normals: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean (N,) of 1 / cos(angle to the z axis) of the light incident at places (3, N), m, with normals (3, N), weighted by irradiance
        (inverse square, Lambert's cosine), and its derivative (N,), 1/m, along rays (3, N)."""
        lamp_x, lamp_y = self._lamps(places.dtype)
        dx, dy, dz = places[0] - lamp_x, places[1] - lamp_y, places[2] - places.dtype.type(self.lamp_z)
        square = dx * dx
        square += dy * dy
        square += dz * dz
        distance = np.sqrt(square)
        weight = dx * normals[0]
        weight += dy * normals[1]
        weight += dz * normals[2]
        weight /= distance
        np.maximum(weight, 0, out=weight)
        weight += max(self.ambient, 0.0) + 1e-6
        weight /= square
        dx *= rays[0]
        dy *= rays[1]
        dx += dy
        dx += dz * rays[2]
        dx /= distance
        dx *= weight
        distance *= weight
        total = weight.sum(0) * dz
        slant = distance.sum(0) / total
        return slant, dx.sum(0) / total - slant * rays[2] / dz

    def _lamps(self, dtype) -> tuple[np.ndarray, np.ndarray]:
        """x and y (LAMPS, 1), m, of the points on the ring light."""
        angle = np.arange(LAMPS)[:, None] * (2 * np.pi / LAMPS)
        x, y = self.centre[0] + self.lamp_radius * np.cos(angle), self.centre[1] + self.lamp_radius * np.sin(angle)
        return x.astype(dtype), y.astype(dtype)
