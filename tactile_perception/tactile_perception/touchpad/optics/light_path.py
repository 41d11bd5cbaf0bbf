# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Length of the light's path in the water: from a ring light through a window to the membrane, and back to the camera.

Beer-Lambert: colour channel c is attenuated by exp(-absorption_c * length). Factors common to all channels (illumination, shading,
vignetting, exposure) cancel in the ratio of two channels; its logarithm is linear in the path length.
"""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..._core import path_lengths


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

    def lengths(self, places: np.ndarray, normals: np.ndarray, rays: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Path lengths (N,), m, in the water to positions places (N, 3), m, and back, and their derivatives (N,) along rays.

        normals: (N, 3) unit vectors out of the pad; rays: (N, 3) unit vectors from the camera centre through the positions, None: computed.
        The derivative neglects that of the irradiance weights: accurate to 1 %. Kernel: src/touchpad/optics/light_path.cpp.
        """
        return self._paths(places, normals, rays)[:2]

    def irradiance(self, places: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Light (N,) on a skin at places (N, 3), m, with unit normals (N, 3), in units of the lamps' power.

        Inverse square law, Lambert's cosine, ambient.
        """
        return self._paths(places, normals)[2]

    def _paths(self, places: np.ndarray, normals: np.ndarray, rays: np.ndarray | None = None) -> tuple[np.ndarray, ...]:
        """Lengths, derivatives, irradiance (N,)."""
        if rays is None:
            rays = rays_from(self.centre, places)
        return path_lengths(self.numbers, np.asarray(places, float), np.asarray(normals, float), rays)


def rays_from(centre: Sequence[float], places: np.ndarray) -> np.ndarray:
    """Unit rays (N, 3) from centre (3,), m, to places (N, 3), m."""
    away = places - np.asarray(centre)
    return away / np.sqrt(np.einsum('ij,ij->i', away, away))[:, None]
