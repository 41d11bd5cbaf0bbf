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
        x = np.ascontiguousarray(places.T)
        if rays is None:
            out = x - np.asarray(self.centre)[:, None]
            rays = (out / np.sqrt((out**2).sum(0))).T
        along = np.ascontiguousarray(rays.T)
        slant, change = self.slants(x, np.ascontiguousarray(normals.T), along)
        return self.from_slants(x[2], along[2], slant, change)

    def from_slants(self, z: np.ndarray, upwards: np.ndarray, slant: np.ndarray, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As lengths, from heights z (N,), m, the rays' z components upwards (N,), and what slants gives for these places."""
        depth, both = z - self.window_z, 1 / upwards + slant
        return depth * both, upwards * both + depth * change

    def slants(self, places: np.ndarray, normals: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean (N,) of 1 / cos(angle to the z axis) of the light that arrives at places (3, N), m, with normals (3, N), weighted by
        irradiance (inverse square, facing surface); its slope (N,), 1/m, along rays (3, N)."""
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
        """x and y (LAMPS, 1), m, of the lamps."""
        angle = np.arange(LAMPS)[:, None] * (2 * np.pi / LAMPS)
        x, y = self.centre[0] + self.lamp_radius * np.cos(angle), self.centre[1] + self.lamp_radius * np.sin(angle)
        return x.astype(dtype), y.astype(dtype)
