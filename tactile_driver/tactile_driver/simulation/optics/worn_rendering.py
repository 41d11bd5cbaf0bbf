# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Renders a skin with worn print and surface under light that decreases to one side."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from .camera import SimulatedCamera
from .pattern import DotPattern
from .rendering import Imaging, Renderer
from ..skin.surfaces import Skin
from .wear import Wear, WornPrint, WornSkin, glare


@dataclass(frozen=True)
class SideLight:
    """Light on a matt skin that decreases exponentially along a direction in the x-y plane.

    level: grey levels of the skin between the dots, B, G, R, where it is brightest; ratio: brightest over darkest; angle: of the
    direction, rad; half: half size (x, y) of the skin, m.
    """

    level: tuple
    ratio: float
    angle: float
    half: tuple

    def seen_by(self, camera: SimulatedCamera, blur: float) -> SideLight:
        """Itself: a matt skin looks the same from every direction."""
        return self

    def look(self, shape: np.ndarray, normals: np.ndarray, uv: np.ndarray) -> tuple[np.ndarray, tuple]:
        """Light (n, n, 3) BGR, grey levels, of the nodes of shape (n, n, 3), m, times the cosine of the tilt; no highlights."""
        direction = np.array([np.cos(self.angle), np.sin(self.angle)])
        way = shape[..., :2] @ direction / (np.abs(direction) @ np.array(self.half))
        level = np.abs(normals[..., 2]) * np.exp((np.clip(way, -1, 1) - 1) / 2 * np.log(self.ratio))
        spots = np.zeros((0, 2)), np.zeros((0, 2, 2)), np.zeros(0)
        return (level[..., None] * np.array(self.level)).astype(np.float32), spots


class WornRenderer(Renderer):
    """As Renderer; wear: of pattern and skin."""

    def __init__(self, skin: Skin, camera: SimulatedCamera, lighting, imaging: Imaging, seed: int, pattern: DotPattern, wear: Wear):
        super().__init__(skin, camera, lighting, imaging, seed)
        radius = float(np.median(pattern.radius))
        self._print = WornPrint(wear, len(pattern.radius))
        self._skin = WornSkin(wear, radius / (skin.spacing * (skin.nodes - 1)))
        uv, spread = pattern.seen(skin.rest, camera)[1:]
        pixels = radius * float(np.sqrt(np.median(np.abs(np.linalg.det(spread)))))
        self._glare = glare(wear, camera.width, camera.height, pixels)[..., None]

    def _printed(self, cover, which, off, spread, radius, steps):
        inverse = np.linalg.inv(spread.astype(float)) / radius[:, None, None]
        return cover * self._print.left(which, off, inverse, steps, self.imaging.blur * self.camera.scale)

    def _cover(self, uv, spread, radius):
        cover = super()._cover(uv, spread, radius)
        size = self.camera.width, self.camera.height
        finer = np.float32((len(self._skin.light) - 1) / self._last)
        self._fine_place = cv2.resize(self._place, size, interpolation=cv2.INTER_LINEAR) * finer
        return np.maximum(cover, self._seen(self._skin.grit))

    def _add_spots(self, picture, place, form, peak):
        picture *= self._seen(self._skin.light)[..., None]
        super()._add_spots(picture, place, form, peak)
        picture += self._glare * self._inside[..., None]

    def _seen(self, worn: np.ndarray) -> np.ndarray:
        """Image (height, width) of a map over the skin, for the shape of the last call of _cover."""
        seen = cv2.remap(worn, self._fine_place, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return cv2.GaussianBlur(seen, (0, 0), max(self.imaging.blur * self.camera.scale, 0.1))
