# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The picture of the pad's inside: light on a coarse grid, dots with exact soft edges, noise of the sensor."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from .camera import SimulatedCamera
from .membrane import Membrane
from .optics import Illumination, Lighting, vignette

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
        self.membrane, self.camera, self.imaging = membrane, camera, imaging
        self._seed = seed
        self._illumination = Illumination(camera, lighting)
        self._spread = np.sqrt((imaging.blur * camera.width / 640)**2 + _PIXEL_VARIANCE)
        self._set_up_cells()
        self._pad = self._pad_cover()
        size = camera.width * camera.height * 3
        self._noise_bank = np.random.default_rng([seed, 1]).standard_normal(2 * size, dtype=np.float32)

    def draw(self, shape: np.ndarray, uv: np.ndarray, spread: np.ndarray, radius: np.ndarray, number: int | None) -> np.ndarray:
        """The picture (height, width, 3) uint8 BGR of the skin's shape (n, n, 3), m.

        uv (K, 2) px and spread (K, 2, 2) px/m of the dots as DotPattern.seen has them, their radius (K,), m; number: the frame's, for its
        noise; None for a picture without noise.
        """
        light, spots = self._cell_light(shape)
        picture = cv2.resize(light, (self.camera.width, self.camera.height), interpolation=cv2.INTER_LINEAR)
        passed = self._passed(uv, spread, radius)
        picture = cv2.multiply(picture, cv2.merge([passed, passed, passed]), dst=picture)
        self._add_spots(picture, *spots)
        return self._expose(picture, number)

    def _expose(self, picture: np.ndarray, number: int | None) -> np.ndarray:
        """Shot and read noise, saturation and eight bits."""
        if number is not None:
            start = int(np.random.default_rng([self._seed, 2, number]).integers(0, picture.size))
            noise = self._noise_bank[start:start + picture.size].reshape(picture.shape)
            deviation = picture * np.float32(self.imaging.shot_noise)
            deviation += np.float32(self.imaging.read_noise**2)
            cv2.sqrt(deviation, deviation)
            cv2.multiply(deviation, noise, dst=deviation)
            picture = cv2.add(picture, deviation, dst=deviation)
        return cv2.convertScaleAbs(picture, alpha=1.0, beta=self.imaging.housing)

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
        normals = self.membrane.area_vectors(shape).astype(np.float32).reshape(shape.shape)
        normals /= np.sqrt(np.einsum('...i,...i->...', normals, normals))[..., None]
        light, spots = self._illumination.look(shape.astype(np.float32), normals, seen)
        return _look_up(light, place, cv2.INTER_CUBIC) * self._fall_off, spots

    def _passed(self, uv: np.ndarray, spread: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Share (height, width) of each pixel's light that the housing and the dots leave, as the blurred lens sees it."""
        camera, soft = self.camera, np.sqrt(5) * self._spread
        # The smooth step below has the lens spot's variance when it is sqrt(5) deviations wide to each side.
        scale = np.sqrt(np.abs(np.linalg.det(spread)))
        half = int(np.ceil((np.linalg.svd(spread, compute_uv=False)[:, 0] * radius).max() + soft))
        reach = np.arange(-half, half + 1)
        corner = np.round(uv).astype(int)
        off = (corner - uv).astype(np.float32)
        x, y = off[:, 0, None] + reach.astype(np.float32), off[:, 1, None] + reach.astype(np.float32)
        inverse = np.linalg.inv(spread)
        form = (inverse.transpose(0, 2, 1) @ inverse * (scale / (2 * soft))[:, None, None]**2).astype(np.float32)
        cover = (2 * form[:, 0, 1, None] * y)[:, :, None] * x[:, None, :]
        cover += (form[:, 0, 0, None] * x * x)[:, None, :]
        cover += (form[:, 1, 1, None] * y * y)[:, :, None]
        np.sqrt(np.maximum(cover, 0, out=cover), out=cover)
        np.subtract((0.5 + radius * scale / (2 * soft)).astype(np.float32)[:, None, None], cover, out=cover)
        np.clip(cover, 0, 1, out=cover)
        cover *= cover * (3 - 2 * cover)
        wide = camera.width + 2 * half
        column, row = np.clip(corner[:, 0], 0, camera.width - 1), np.clip(corner[:, 1], 0, camera.height - 1)
        index = ((row[:, None] + reach + half) * wide)[:, :, None] + (column[:, None] + reach + half)[:, None, :]
        total = np.bincount(index.ravel(), cover.ravel(), wide * (camera.height + 2 * half)).reshape(-1, wide)
        total = np.minimum(total[half:-half, half:-half], 1).astype(np.float32)
        total *= -self.imaging.ink
        total += 1
        return cv2.multiply(total, self._pad, dst=total)

    def _add_spots(self, picture: np.ndarray, place: np.ndarray, form: np.ndarray, peak: np.ndarray):
        """Add the lamps' mirror images to the picture, in place."""
        half = 24
        for (u, v), f, strength in zip(place, form, peak):
            if not (0 <= u < self.camera.width and 0 <= v < self.camera.height) or strength < 0.5:
                continue
            left, top = max(int(u) - half, 0), max(int(v) - half, 0)
            patch = picture[top:int(v) + half + 1, left:int(u) + half + 1]
            x, y = np.arange(patch.shape[1]) + left - u, np.arange(patch.shape[0])[:, None] + top - v
            shine = strength * np.exp(-0.5 * (f[0, 0] * x * x + 2 * f[0, 1] * x * y + f[1, 1] * y * y))
            patch += (shine * self._pad[top:int(v) + half + 1, left:int(u) + half + 1])[..., None].astype(np.float32)

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
