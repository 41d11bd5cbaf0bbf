# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The light: lamps behind the pad, red water, the skin's white inside, the lens."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .camera import SimulatedCamera


@dataclass(frozen=True)
class Lighting:
    """Lamps and water.

    absorption: 1/m per channel B, G, R (Beer and Lambert); gain: grey levels per channel; ambient: share of diffuse light;
    lamp_radius, lamp_depth: m, of the circle of lamps about the axis, below the rim; lamps: how many; window: z of the pad's floor, m;
    gloss: mirror strength of the skin in grey levels; gloss_width: rad.
    """

    absorption: tuple = (78.0, 62.0, 13.0)
    gain: tuple = (330.0, 345.0, 395.0)
    ambient: float = 0.22
    lamp_radius: float = 0.024
    lamp_depth: float = 0.034
    lamps: int = 6
    window: float = -0.0035
    gloss: float = 260.0
    gloss_width: float = 0.011


def lamp_places(lighting: Lighting) -> np.ndarray:
    """(L, 3) m."""
    angle = 2 * np.pi * (np.arange(lighting.lamps) + 0.25) / lighting.lamps
    return np.stack([lighting.lamp_radius * np.cos(angle), lighting.lamp_radius * np.sin(angle), np.full_like(angle, -lighting.lamp_depth)], axis=1)


def _way_in_water(start: np.ndarray, end: np.ndarray, window: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Length (...), m, inside the water of the way from end (..., 3) to start (3,), its whole length, and unit vectors to start."""
    arm = start - end
    length = np.sqrt((arm**2).sum(axis=-1))
    share = (end[..., 2] - window) / (end[..., 2] - start[2])
    return length * share, length, arm / length[..., None]


def shade(places: np.ndarray, normals: np.ndarray, camera: SimulatedCamera, lighting: Lighting) -> np.ndarray:
    """Light (..., 3) BGR, grey levels, that the skin at places (..., 3), m, with unit normals (..., 3) outwards sends into the camera."""
    absorption = np.asarray(lighting.absorption, np.float32)
    back, _, _ = _way_in_water(camera.centre, places, lighting.window)
    total = np.zeros(places.shape, np.float32)
    for lamp in lamp_places(lighting):
        there, distance, toward = _way_in_water(lamp, places, lighting.window)
        facing = -np.einsum('...i,...i->...', toward, normals)
        lit = np.clip(facing, 0, None) * (lighting.lamp_depth / distance)**2
        total += lit[..., None] * np.exp(-(there + back)[..., None] * absorption)
    diffuse = lighting.ambient * np.exp(-(1.6 * back)[..., None] * absorption)
    return (total / lighting.lamps * 1.6 + diffuse) * np.asarray(lighting.gain, np.float32)


def mirror(places: np.ndarray, normals: np.ndarray, camera: SimulatedCamera, lighting: Lighting) -> np.ndarray:
    """Light (...), grey levels, of the lamps' mirror images on the skin; colourless, since it passes at the surface of the floor and skin."""
    _, _, to_camera = _way_in_water(camera.centre, places, lighting.window)
    out = np.zeros(places.shape[:-1], np.float32)
    for lamp in lamp_places(lighting):
        _, _, to_lamp = _way_in_water(lamp, places, lighting.window)
        half = to_camera + to_lamp
        half /= np.sqrt((half**2).sum(axis=-1))[..., None]
        off = 2 * (1 + np.einsum('...i,...i->...', half, normals))
        out += np.exp(-off / (2 * lighting.gloss_width**2))
    return out * lighting.gloss


def vignette(camera: SimulatedCamera, columns: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """The lens's fall-off (rows, columns) towards the corners: cos^4 and a little more from its stops."""
    fx, fy = camera.matrix[0, 0], camera.matrix[1, 1]
    a, b = np.meshgrid((columns - camera.matrix[0, 2]) / fx, (rows - camera.matrix[1, 2]) / fy)
    r2 = a * a + b * b
    return (1 / (1 + r2)**2 * (1 - 0.35 * r2)).astype(np.float32)
