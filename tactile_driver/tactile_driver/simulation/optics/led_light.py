# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Uneven illumination of a matt skin by a few LEDs in a sensor that is empty and dark inside."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_NO_SPOTS = np.zeros((0, 2)), np.zeros((0, 2, 2)), np.zeros(0)


@dataclass(frozen=True)
class Lamps:
    """LEDs in air behind a matt skin.

    places: ((x, y, z), ...) m; powers: grey levels of a white skin lit by each LED at normal incidence from the distance reach, m;
    scattered: grey levels of a white skin under scattered light; colour: reflectance of the skin between the dots, B, G, R, 0 to 1;
    exposure: factor on all light.
    """

    places: tuple
    powers: tuple
    reach: float
    scattered: float
    colour: tuple
    exposure: float = 0.8

    def look(self, shape: np.ndarray, normals: np.ndarray, *_seen) -> tuple[np.ndarray, tuple]:
        """Light (n, n, 3) BGR, grey levels, of the nodes of shape (n, n, 3), m, with outward unit normals (n, n, 3); and no highlights: a
        matt skin looks the same from every direction.

        Model: Lambert's cosine law and the inverse square law.
        """
        level = np.full(shape.shape[:2], self.scattered, np.float32)
        for place, power in zip(np.array(self.places, np.float32), self.powers):
            arm = place - shape
            square = np.einsum('...i,...i->...', arm, arm)
            facing = np.maximum(-np.einsum('...i,...i->...', arm, normals), 0)
            level += np.float32(power * self.reach**2) * facing / square**1.5
        return level[..., None] * (np.array(self.colour, np.float32) * np.float32(self.exposure)), _NO_SPOTS
