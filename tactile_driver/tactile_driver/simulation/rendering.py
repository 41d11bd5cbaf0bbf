# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The picture of the pad's inside: light on a coarse grid, dots with exact soft edges, noise of the sensor."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from .camera import SimulatedCamera
from .membrane import Membrane
from .optics import Lighting, mirror, shade, vignette

#: px: light is computed once for each cell of this size; it changes slowly, only dots and the rim are sharp.
_CELL = 4
_INVERSE_STEPS = 5
_PIXEL_VARIANCE = 1 / 12


@dataclass(frozen=True)
class Imaging:
    """The camera's imperfections, for the native 640 px width.

    blur: px, standard deviation of the lens's spot; read_noise: grey levels; shot_noise: grey levels squared per grey level; ink: share of
    light that a dot swallows; housing: grey level of what surrounds the pad.
    """

    blur: float = 0.8
    read_noise: float = 0.8
    shot_noise: float = 0.016
    ink: float = 0.86
    housing: float = 3.0


class Renderer:
    """Draws shapes of one membrane. seed: of the noise, which is another for each frame number."""

    def __init__(self, membrane: Membrane, camera: SimulatedCamera, lighting: Lighting, imaging: Imaging, seed: int):
        self.membrane, self.camera, self.lighting, self.imaging = membrane, camera, lighting, imaging
        self._seed = seed
        self._spread = np.sqrt((imaging.blur * camera.width / 640)**2 + _PIXEL_VARIANCE)
        self._set_up_cells()
        self._pad = self._pad_cover()
        size = camera.width * camera.height * 3
        self._noise_bank = np.random.default_rng([seed, 1]).standard_normal(2 * size, dtype=np.float32)

    def draw(self, shape: np.ndarray, dots: tuple, number: int | None) -> np.ndarray:
        """The picture (height, width, 3) uint8 BGR of the skin's shape (n, n, 3), m; dots as DotPattern.seen and their radii give them:
        (uv (K, 2), spread (K, 2, 2), radius (K,)); number of the frame for its noise, None for a picture without noise."""
        light, gloss = self._cell_light(shape)
        size = (self.camera.width, self.camera.height)
        picture = cv2.resize(light, size, interpolation=cv2.INTER_LINEAR)
        passed = self._pad * (1 - self.imaging.ink * self._dot_cover(*dots))
        picture = cv2.multiply(picture, cv2.merge([passed, passed, passed]))
        shine = cv2.resize(gloss, size, interpolation=cv2.INTER_CUBIC) * self._pad + self.imaging.housing
        picture = cv2.add(picture, cv2.merge([shine, shine, shine]))
        return self._expose(picture, number)

    def _expose(self, picture: np.ndarray, number: int | None) -> np.ndarray:
        """Shot and read noise, saturation and eight bits."""
        if number is None:
            return cv2.add(picture, 0.0, dtype=cv2.CV_8U)
        start = int(np.random.default_rng([self._seed, 2, number]).integers(0, picture.size))
        noise = self._noise_bank[start:start + picture.size].reshape(picture.shape)
        variance = cv2.max(picture, 0.0)
        variance = cv2.addWeighted(variance, self.imaging.shot_noise, variance, 0, self.imaging.read_noise**2)
        return cv2.add(picture, cv2.multiply(cv2.sqrt(variance), noise), dtype=cv2.CV_8U)

    def _set_up_cells(self):
        """Cell centres, and for the resting pad which grid place of the skin each cell sees and how that moves with the picture."""
        camera, n = self.camera, self.membrane.nodes
        columns = np.arange(_CELL / 2 - 0.5, camera.width, _CELL)
        rows = np.arange(_CELL / 2 - 0.5, camera.height, _CELL)
        self._goal = np.stack(np.meshgrid(columns, rows), axis=-1).astype(np.float32)
        self._fall_off = vignette(camera, columns, rows)[..., None]
        hit = self.membrane.seen_at_rest(camera.centre, camera.rays(self._goal.reshape(-1, 2)))
        square = self.membrane.square_of_dome(hit).reshape(self._goal.shape)
        self._rest_place = ((np.clip(square, -1, 1) + 1) * (n - 1) / 2).astype(np.float32)
        down, across = np.gradient(self._rest_place, _CELL, axis=(0, 1))
        self._steer = np.stack([across, down], axis=-1)

    def _cell_light(self, shape: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Diffuse light (h, w, 3) and mirror light (h, w), grey levels, of the cells."""
        seen = self.camera.project(shape).astype(np.float32)
        place = self._rest_place
        for _ in range(_INVERSE_STEPS):
            off = self._goal - _look_up(seen, place)
            place = place + (self._steer @ off[..., None])[..., 0]
            np.clip(place, 0, self.membrane.nodes - 1, out=place)
        normals = self.membrane.area_vectors(shape)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        normals = normals.reshape(shape.shape)
        light = shade(shape, normals, self.camera, self.lighting).astype(np.float32)
        light = _look_up(light, place, cv2.INTER_CUBIC) * self._fall_off
        gloss = mirror(_look_up(shape.astype(np.float32), place, cv2.INTER_CUBIC), _look_up(normals.astype(np.float32), place, cv2.INTER_CUBIC),
                       self.camera, self.lighting)
        return light, gloss

    def _dot_cover(self, uv: np.ndarray, spread: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Share (height, width) of each pixel that dots cover, as the blurred lens sees it."""
        camera, soft = self.camera, np.sqrt(5) * self._spread
        largest = np.linalg.norm(spread, axis=(1, 2)).max() * radius.max()
        half = int(np.ceil(0.8 * largest + soft))
        reach = np.arange(-half, half + 1)
        corner = np.round(uv).astype(int)
        off = (corner - uv).astype(np.float32)
        x, y = (off[:, 0, None] + reach)[:, None, :], (off[:, 1, None] + reach)[:, :, None]
        inverse = np.linalg.inv(spread)
        form = (inverse.transpose(0, 2, 1) @ inverse).astype(np.float32)[:, :, :, None, None]
        fx, fy = form[:, 0, 0] * x + form[:, 0, 1] * y, form[:, 1, 0] * x + form[:, 1, 1] * y
        square = np.maximum(fx * x + fy * y, 1e-20)
        edge = (square - radius.astype(np.float32)[:, None, None] * np.sqrt(square)) / np.sqrt(fx * fx + fy * fy + 1e-20)
        cover = np.clip(0.5 - edge / np.float32(2 * soft), 0, 1)
        cover *= cover * (3 - 2 * cover)
        column, row = (corner[:, 0, None] + reach)[:, None, :], (corner[:, 1, None] + reach)[:, :, None]
        inside = (column >= 0) & (column < camera.width) & (row >= 0) & (row < camera.height)
        index = np.where(inside, row * camera.width + column, 0)
        total = np.bincount(index.ravel(), (cover * inside).ravel(), camera.width * camera.height)
        return np.minimum(total, 1).astype(np.float32).reshape(camera.height, camera.width)

    def _pad_cover(self) -> np.ndarray:
        """Share (height, width) of each pixel that shows the pad and not its housing."""
        camera, fine = self.camera, 4
        angle = np.linspace(0, 2 * np.pi, 720, endpoint=False)
        rim = self.membrane.rest[0, self.membrane.nodes // 2, 1]
        circle = camera.project(np.stack([rim * np.cos(angle), rim * np.sin(angle), np.zeros_like(angle)], axis=1))
        cover = np.zeros((camera.height * fine, camera.width * fine), np.float32)
        points = np.round(((circle + 0.5) * fine - 0.5) * 16).astype(np.int32)
        cv2.fillPoly(cover, [points.reshape(-1, 1, 2)], 1.0, cv2.LINE_8, 4)
        cover = cv2.resize(cover, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
        return cv2.GaussianBlur(cover, (0, 0), self.imaging.blur * camera.width / 640)


def _look_up(grid: np.ndarray, place: np.ndarray, how: int = cv2.INTER_LINEAR) -> np.ndarray:
    """Values (h, w, c) of a grid (n, n, c) float32 at grid places (h, w, 2)."""
    return cv2.remap(grid, place, None, how, borderMode=cv2.BORDER_REPLICATE)
