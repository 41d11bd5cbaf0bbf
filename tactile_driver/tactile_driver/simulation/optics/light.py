# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Illumination: of the touchpad by LEDs behind the pad, through red water that absorbs, with the white inside of its skin; of a matt skin
by a few LEDs in a sensor that is empty and dark inside, uneven; and vignetting."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .camera import SimulatedCamera


@dataclass(frozen=True)
class Lighting:
    """LEDs and water.

    absorption: 1/m per channel B, G, R (Beer-Lambert law); gain: grey levels per channel; ambient: fraction of diffuse light;
    lamp_radius, lamp_depth: m, radius of the circle of LEDs and its distance below the rim; lamps: number of LEDs; window: z of the pad's
    floor, m; power: of all LEDs together; gloss: specular reflection of the skin, grey levels; gloss_width: rad; largest_spot: largest
    standard deviation of a highlight, px of the native image; sheen: wide reflection of each LED by the wet skin, over a white skin's light
    (glare); sheen_width: rad; sheen_water: share of the water's absorption that the sheen's light undergoes, 0 for white glare.
    """

    absorption: tuple = (78.0, 62.0, 13.0)
    gain: tuple = (365.0, 380.0, 395.0)
    ambient: float = 0.22
    lamp_radius: float = 0.024
    lamp_depth: float = 0.034
    lamps: int = 4
    window: float = -0.0035
    power: float = 1.6
    gloss: float = 300.0
    gloss_width: float = 0.007
    largest_spot: float = 8.0
    sheen: float = 0.0
    sheen_width: float = 0.04
    sheen_water: float = 1.0

    def look(self, shape: np.ndarray, normals: np.ndarray, uv: np.ndarray, camera: SimulatedCamera, blur: float
             ) -> tuple[np.ndarray, tuple]:
        """Diffuse light (n, n, 3) BGR, grey levels, of the nodes, and the specular highlights.

        shape: (n, n, 3) m; normals: (n, n, 3) outward, unit; both float32; uv: (n, n, 2), pixels of the nodes; blur: px, standard deviation
        of the lens blur. The highlights are position (M, 2) px, form (M, 2, 2) 1/px^2 and peak (M,), grey levels: the light at q px from it
        is peak * exp(-q form q / 2).
        """
        angle = 2 * np.pi * (np.arange(self.lamps) + 0.25) / self.lamps
        lamps = np.column_stack([self.lamp_radius * np.cos(angle), self.lamp_radius * np.sin(angle), np.full(self.lamps, -self.lamp_depth)])
        wet, length, toward = _paths(np.concatenate([camera.centre[None], lamps]), shape, self.window)
        half = toward[1:] + toward[0]
        half /= np.sqrt(np.einsum('...i,...i->...', half, half))[..., None]
        off = half + normals  # zero where the normal bisects the directions to LED and camera
        light = (self._diffuse(wet, length, toward, normals) + self._sheen(wet, off)) * np.asarray(self.gain, np.float32)
        return light, self._mirror(off, uv, self.largest_spot * camera.scale, blur)

    def _sheen(self, wet: np.ndarray, off: np.ndarray) -> np.ndarray | float:
        """Wide lobes of reflection (Blinn's halfway vector, Gaussian lobe) (n, n, 3), over the gain; 0 for none."""
        if not self.sheen:
            return 0.0
        lobe = np.exp(-np.einsum('...i,...i->...', off, off) / (2 * self.sheen_width**2)) * np.float32(self.sheen)
        path = (wet[1:] + wet[0]) * np.float32(self.sheen_water)
        return np.stack([(lobe * np.exp(-a * path)).sum(axis=0) for a in np.float32(self.absorption)], axis=-1)

    def _diffuse(self, wet: np.ndarray, length: np.ndarray, toward: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Beer-Lambert law from LED over skin to camera, Lambert's cosine law, inverse square law, and scattered light; over the gain."""
        facing = np.maximum(-np.einsum('l...i,...i->l...', toward[1:], normals), 0)
        facing *= (self.lamp_depth / length[1:])**2 * (self.power / self.lamps)
        path = wet[1:] + wet[0]
        return np.stack([(facing * np.exp(-a * path)).sum(axis=0) + self.ambient * np.exp(-1.6 * a * wet[0])
                         for a in np.float32(self.absorption)], axis=-1)

    def _mirror(self, off: np.ndarray, uv: np.ndarray, largest_spot: float, blur: float) -> tuple:
        """Specular highlights of the LEDs, each a Gaussian ellipse about the zero of off (lamps, n, n, 3), which is found from the nearest
        node to first order."""
        size = np.einsum('...i,...i->...', off, off)
        inner = size[:, 1:-1, 1:-1]
        lamp, row, column = np.nonzero((inner < 0.01) & (inner <= np.minimum(np.minimum(size[:, :-2, 1:-1], size[:, 2:, 1:-1]),
                                                                             np.minimum(size[:, 1:-1, :-2], size[:, 1:-1, 2:]))))
        row, column = row + 1, column + 1

        def slope_of(at: Callable) -> np.ndarray:
            """(M, k, 2) by a node, along columns and rows."""
            return np.stack([at(row, column + 1) - at(row, column - 1), at(row + 1, column) - at(row - 1, column)], axis=-1) / 2
        slope, pixel = slope_of(lambda r, c: off[lamp, r, c]), slope_of(lambda r, c: uv[r, c])
        here = off[lamp, row, column][..., None]
        square = slope.transpose(0, 2, 1) @ slope + 1e-8 * np.eye(2)
        step = np.clip(-np.linalg.solve(square, slope.transpose(0, 2, 1) @ here), -0.8, 0.8)
        residual = ((here + slope @ step)**2).sum(axis=(1, 2))
        per_pixel = slope @ np.linalg.inv(pixel)
        sharp = np.linalg.inv(per_pixel.transpose(0, 2, 1) @ per_pixel / self.gloss_width**2 + np.eye(2) / largest_spot**2)
        blurred = sharp + blur**2 * np.eye(2)
        peak = self.gloss * np.exp(-residual / (2 * self.gloss_width**2)) * np.sqrt(np.linalg.det(sharp) / np.linalg.det(blurred))
        return uv[row, column] + (pixel @ step)[..., 0], np.linalg.inv(blurred), peak


def _paths(starts: np.ndarray, ends: np.ndarray, window: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Light paths from ends (..., 3) to starts (L, 3), m: length in water and total length (L, ...), m; unit directions (L, ..., 3)."""
    arm = starts.reshape((-1,) + (1,) * (ends.ndim - 1) + (3,)).astype(np.float32) - ends
    length = np.sqrt(np.einsum('...i,...i->...', arm, arm))
    share = (ends[..., 2] - np.float32(window)) / -arm[..., 2]
    return length * share, length, arm / length[..., None]


def vignette(camera: SimulatedCamera, columns: np.ndarray, rows: np.ndarray, power: float, stop: float) -> np.ndarray:
    """Vignetting (rows, columns): the power of the cosine (4: cosine fourth law), and stop: loss at the lens stops per squared slope."""
    fx, fy = camera.matrix[0, 0], camera.matrix[1, 1]
    a, b = np.meshgrid((columns - camera.matrix[0, 2]) / fx, (rows - camera.matrix[1, 2]) / fy)
    r2 = a * a + b * b
    return ((1 + r2)**(-power / 2) * (1 - stop * r2)).astype(np.float32)


_NO_SPOTS = np.zeros((0, 2)), np.zeros((0, 2, 2)), np.zeros(0)


@dataclass(frozen=True)
class Lamps:
    """LEDs in air behind a matt skin.

    positions: ((x, y, z), ...) m; powers: grey levels of a white skin lit by each LED at normal incidence from the distance reach, m;
    scattered: grey levels of a white skin under scattered light; colour: reflectance of the skin between the dots, B, G, R, 0 to 1;
    exposure: factor on all light.
    """

    positions: tuple
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
        for position, power in zip(np.array(self.positions, np.float32), self.powers):
            arm = position - shape
            square = np.einsum('...i,...i->...', arm, arm)
            facing = np.maximum(-np.einsum('...i,...i->...', arm, normals), 0)
            level += np.float32(power * self.reach**2) * facing / square**1.5
        return level[..., None] * (np.array(self.colour, np.float32) * np.float32(self.exposure)), _NO_SPOTS
