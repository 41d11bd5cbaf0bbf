# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Illumination of the touchpad: LEDs behind the pad, absorption in red water, the white inside of the skin, vignetting."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .camera import SimulatedCamera


@dataclass(frozen=True)
class Lighting:
    """LEDs and water. The defaults are chosen.

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

    def seen_by(self, camera: SimulatedCamera, blur: float) -> Illumination:
        """The light from the skin to the camera; blur: px, standard deviation of the lens blur."""
        return Illumination(camera, self, blur)


def lamp_places(lighting: Lighting) -> np.ndarray:
    """Positions (L, 3), m, of the LEDs in the sensor frame."""
    angle = 2 * np.pi * (np.arange(lighting.lamps) + 0.25) / lighting.lamps
    radius, depth = lighting.lamp_radius, lighting.lamp_depth
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full_like(angle, -depth)], axis=1)


def _ways(starts: np.ndarray, ends: np.ndarray, window: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Light paths from ends (..., 3) to starts (L, 3), m: length in water and total length (L, ...), m; unit directions (L, ..., 3)."""
    arm = starts.reshape((-1,) + (1,) * (ends.ndim - 1) + (3,)).astype(np.float32) - ends
    length = np.sqrt(np.einsum('...i,...i->...', arm, arm))
    share = (ends[..., 2] - np.float32(window)) / -arm[..., 2]
    return length * share, length, arm / length[..., None]


class Illumination:
    """Light from the skin to one camera under one Lighting; blur: px, standard deviation of the lens blur."""

    def __init__(self, camera: SimulatedCamera, lighting: Lighting, blur: float):
        self._lighting, self._blur = lighting, blur
        self._largest_spot = lighting.largest_spot * camera.scale
        self._sources = np.concatenate([camera.centre[None], lamp_places(lighting)])
        self._absorption = np.asarray(lighting.absorption, np.float32)
        self._gain = np.asarray(lighting.gain, np.float32)

    def look(self, shape: np.ndarray, normals: np.ndarray, uv: np.ndarray) -> tuple[np.ndarray, tuple]:
        """Diffuse light (n, n, 3) BGR, grey levels, of the nodes, and the specular highlights.

        shape: (n, n, 3) m; normals: (n, n, 3) outward, unit; both float32; uv: (n, n, 2), pixels of the nodes. The highlights are
        (place (M, 2) px, form (M, 2, 2) 1/px^2, peak (M,) grey levels): the light at q px from place is peak * exp(-q form q / 2).
        """
        wet, length, toward = _ways(self._sources, shape, self._lighting.window)
        light = self._diffuse(wet, length, toward, normals)
        if self._lighting.sheen > 0:
            light += self._sheen(wet, toward, normals)
        return light, self._mirror(toward, normals, uv)

    def _sheen(self, wet: np.ndarray, toward: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Wide lobes of reflection (Blinn's half-way vector, Gaussian lobe), grey levels (n, n, 3)."""
        lighting = self._lighting
        off = toward[1:] + toward[0]
        off /= np.sqrt(np.einsum('...i,...i->...', off, off))[..., None]
        off += normals
        lobe = np.exp(-np.einsum('...i,...i->...', off, off) / (2 * lighting.sheen_width**2)) * np.float32(lighting.sheen)
        way = (wet[1:] + wet[0]) * np.float32(lighting.sheen_water)
        return np.stack([(lobe * np.exp(-a * way)).sum(axis=0) for a in self._absorption], axis=-1) * self._gain

    def _diffuse(self, wet: np.ndarray, length: np.ndarray, toward: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Beer-Lambert law from LED over skin to camera, Lambert's cosine law, inverse square law, and scattered light."""
        lighting = self._lighting
        facing = np.maximum(-np.einsum('l...i,...i->l...', toward[1:], normals), 0)
        facing *= (lighting.lamp_depth / length[1:])**2 * (lighting.power / lighting.lamps)
        way = wet[1:] + wet[0]
        colours = [(facing * np.exp(-a * way)).sum(axis=0) + lighting.ambient * np.exp(-1.6 * a * wet[0]) for a in self._absorption]
        return np.stack(colours, axis=-1) * self._gain

    def _mirror(self, toward: np.ndarray, normals: np.ndarray, uv: np.ndarray) -> tuple:
        """Specular highlights of the LEDs, each a Gaussian ellipse where the normal bisects the directions to LED and camera.

        There off = half-way vector + normal is zero; its zero is found from the nearest node to first order.
        """
        off = toward[1:] + toward[0]
        off /= np.sqrt(np.einsum('...i,...i->...', off, off))[..., None]
        off += normals
        size = np.einsum('...i,...i->...', off, off)
        middle = size[:, 1:-1, 1:-1]
        least = (middle < 0.01)
        for rows, columns in (((0, -2), (1, -1)), ((2, None), (1, -1)), ((1, -1), (0, -2)), ((1, -1), (2, None))):
            least &= middle <= size[:, slice(*rows), slice(*columns)]
        lamp, row, column = np.nonzero(least)
        row, column = row + 1, column + 1
        across = off[lamp, row, column + 1] - off[lamp, row, column - 1]
        slope = np.stack([across, off[lamp, row + 1, column] - off[lamp, row - 1, column]], axis=-1) / 2
        pixel = np.stack([uv[row, column + 1] - uv[row, column - 1], uv[row + 1, column] - uv[row - 1, column]], -1) / 2
        here = off[lamp, row, column][..., None]
        square = slope.transpose(0, 2, 1) @ slope + 1e-8 * np.eye(2)
        step = np.clip(-np.linalg.solve(square, slope.transpose(0, 2, 1) @ here), -0.8, 0.8)
        rest = ((here + slope @ step)**2).sum(axis=(1, 2))
        per_pixel = slope @ np.linalg.inv(pixel)
        width = self._lighting.gloss_width
        sharp = np.linalg.inv(per_pixel.transpose(0, 2, 1) @ per_pixel / width**2 + np.eye(2) / self._largest_spot**2)
        blurred = sharp + self._blur**2 * np.eye(2)
        peak = self._lighting.gloss * np.exp(-rest / (2 * width**2)) * np.sqrt(np.linalg.det(sharp) / np.linalg.det(blurred))
        return uv[row, column] + (pixel @ step)[..., 0], np.linalg.inv(blurred), peak


def vignette(camera: SimulatedCamera, columns: np.ndarray, rows: np.ndarray, power: float, stop: float) -> np.ndarray:
    """Vignetting (rows, columns): the power of the cosine (4: cosine fourth law), and stop: loss at the lens stops per squared slope."""
    fx, fy = camera.matrix[0, 0], camera.matrix[1, 1]
    a, b = np.meshgrid((columns - camera.matrix[0, 2]) / fx, (rows - camera.matrix[1, 2]) / fy)
    r2 = a * a + b * b
    return ((1 + r2)**(-power / 2) * (1 - stop * r2)).astype(np.float32)
