# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Renders the inside of a skin: light on a coarse grid, dots with exact blurred edges, sensor noise."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ..skin.surfaces import Skin
from .camera import SimulatedCamera
from .light import vignette


@dataclass(frozen=True)
class Rendering:
    """Resolution of images."""

    cell: int = 4  # px: light is computed once per cell, because only dots, highlights and the rim are sharp
    wide_cell: int = 8  # px, of the map from the image to the skin, which varies even more slowly
    inverse_steps: int = 5  # iterations that invert this map
    pixel_variance: float = 1 / 12  # px^2: of a uniform distribution over a pixel
    step_width: float = 5**0.5  # sigma: a smooth step 3 t^2 - 2 t^3 of this half width has the variance of the blur


RENDERING = Rendering()


@dataclass(frozen=True)
class Imaging:
    """Imperfections of the camera, in the native image.

    blur: px, standard deviation of the lens blur; read_noise: grey levels; shot_noise: grey levels squared per grey level; ink: fraction of
    light absorbed by a dot, B, G, R or one for all, below 0 if the dot is brighter than the skin; housing: grey level around the skin;
    cosine, stop: parameters of the vignetting (light.vignette); reflections: lamps that the window mirrors, which stay in place,
    (u, v, standard deviation, all px, peak in grey levels) each; drift: amplitude of a slow change of the gain; drift_period: frames.
    """

    blur: float = 0.8
    read_noise: float = 0.8
    shot_noise: float = 0.016
    ink: float | tuple = 0.86
    housing: float = 3.0
    cosine: float = 4.0
    stop: float = 0.35
    reflections: tuple = ()
    drift: float = 0.0
    drift_period: int = 600


class Renderer:
    """Renders shapes of one skin. lighting: Lighting or Lamps; seed: of the noise, which differs from frame to frame."""

    def __init__(self, skin: Skin, camera: SimulatedCamera, lighting, imaging: Imaging, seed: int):
        self.skin, self.camera, self.imaging, self._lighting, self._seed = skin, camera, imaging, lighting, seed
        self._spread = np.sqrt((imaging.blur * camera.scale)**2 + RENDERING.pixel_variance)
        self._set_up_cells()
        self._inside = self._skin_cover()
        self._reflections = self._fixed_spots()
        shape = (camera.height, camera.width, 3)
        self._noise_bank = np.random.default_rng([seed, 1]).standard_normal(2 * np.prod(shape), dtype=np.float32)
        self._light, self._work = np.empty(shape, np.float32), np.empty(shape, np.float32)
        self._drawn = None, None

    def open_frame(self) -> None:
        """Let the frame hide nothing: a plate pushes the whole sheet in front of it, and it would cut the outer markers."""
        self._inside[:] = 1

    def draw(self, shape: np.ndarray, uv: np.ndarray, spread: np.ndarray, radius: np.ndarray, number: int | None) -> np.ndarray:
        """The image (height, width, 3) uint8 BGR of a skin; shape: from Skin.coarse, m.

        uv (K, 2), px, and spread (K, 2, 2), px/m: dots as returned by DotPattern.seen; radius: (K,) m; number: of the frame, selects its
        noise; None for an image without noise. The arrays of the last call are known by identity: an untouched skin is drawn once.
        """
        if self._drawn[0] is not shape or self._drawn[1] is not uv:
            self._draw_light(shape, uv, spread, radius)
            self._drawn = shape, uv
        gain = 1 + self.imaging.drift * np.sin(2 * np.pi * (number or 0) / self.imaging.drift_period)
        return self._expose(self._light * np.float32(gain) if self.imaging.drift else self._light, number)

    def _draw_light(self, shape: np.ndarray, uv: np.ndarray, spread: np.ndarray, radius: np.ndarray) -> None:
        """Render the light without noise and drift."""
        light, spots = self._cell_light(shape)
        cover = self._cover(uv, spread, radius)
        cv2.resize(light, (self.camera.width, self.camera.height), dst=self._light, interpolation=cv2.INTER_LINEAR)
        cv2.multiply(self._light, cv2.merge(self._passed(cover), self._work), dst=self._light)
        self._add_spots(self._light, *spots)
        if self.imaging.reflections:
            self._light += self._reflections

    def _expose(self, light: np.ndarray, number: int | None) -> np.ndarray:
        """Add shot and read noise to the light, then saturate and quantise it to 8 bits."""
        if number is not None:
            work, start = self._work, int(np.random.default_rng([self._seed, 2, number]).integers(0, light.size))
            np.multiply(light, np.float32(self.imaging.shot_noise), out=work)
            work += np.float32(self.imaging.read_noise**2)
            cv2.sqrt(work, work)
            cv2.multiply(work, self._noise_bank[start:start + light.size].reshape(light.shape), dst=work)
            light = cv2.add(light, work, dst=work)
        return cv2.convertScaleAbs(light, alpha=1.0, beta=self.imaging.housing)

    def _set_up_cells(self):
        """For the resting skin: the grid coordinates seen by each wide cell, and their gradient over the image."""
        camera = self.camera
        self._last = len(self.skin.coarse(self.skin.rest)) - 1
        columns, rows = (np.arange(RENDERING.wide_cell / 2 - 0.5, size, RENDERING.wide_cell) for size in (camera.width, camera.height))
        self._goal = np.stack(np.meshgrid(columns, rows), axis=-1).astype(np.float32)
        hit = self.skin.seen_at_rest(camera.centre, camera.rays(self._goal.reshape(-1, 2)))
        square = np.clip(self.skin.square_of(hit).reshape(self._goal.shape), -1, 1)
        self._rest_position = ((square + 1) * self._last / 2).astype(np.float32)
        self._steer_down, self._steer_across = np.gradient(self._rest_position, RENDERING.wide_cell, axis=(0, 1))
        columns, rows = (np.arange(RENDERING.cell / 2 - 0.5, size, RENDERING.cell) for size in (camera.width, camera.height))
        self._fall_off = vignette(camera, columns, rows, self.imaging.cosine, self.imaging.stop)[..., None]

    def _cell_light(self, shape: np.ndarray) -> tuple[np.ndarray, tuple]:
        """Diffuse light (h, w, 3), grey levels, of the cells; and the specular highlights."""
        seen = self.camera.project(shape).astype(np.float32)
        position = self._rest_position
        for _ in range(RENDERING.inverse_steps):
            error = self._goal - _look_up(seen, position)
            position = position + error[..., :1] * self._steer_across + error[..., 1:] * self._steer_down
            np.clip(position, 0, self._last, out=position)
        normals = self.skin.area_vectors(shape).reshape(shape.shape)
        normals /= np.sqrt(np.einsum('...i,...i->...', normals, normals))[..., None]
        light, spots = self._lighting.look(shape, normals, seen, self.camera, self._spread)
        position = cv2.resize(position, self._fall_off.shape[1::-1], interpolation=cv2.INTER_LINEAR)
        return _look_up(light, position, cv2.INTER_CUBIC) * self._fall_off, spots

    def _passed(self, cover: np.ndarray) -> list[np.ndarray]:
        """Transmitted fraction (height, width) of the light of each channel, given the coverage by dots (height, width)."""
        cover = cv2.multiply(cover, self._inside)
        return [cv2.scaleAdd(cover, -ink, self._inside) for ink in np.broadcast_to(self.imaging.ink, 3).tolist()]

    def _cover(self, uv: np.ndarray, spread: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Fraction (height, width) of each pixel covered by dots, lens blur included."""
        camera = self.camera
        size = np.einsum('kij,kij->k', spread, spread)
        largest = np.sqrt((size + np.sqrt(np.maximum(size**2 - 4 * np.linalg.det(spread)**2, 0))) / 2)
        # A pixel k steps from the pixel at the dot's centre is at least k - 1/2 px from the centre.
        reach = np.round(largest * radius + RENDERING.step_width * self._spread).astype(int)
        corner = np.round(uv).astype(int)
        total = np.zeros((camera.height, camera.width), np.float32)
        visible = ((corner + reach[:, None] >= 0) & (corner - reach[:, None] < total.shape[::-1])).all(axis=1)
        for half in np.unique(reach[visible]):
            some = np.flatnonzero(visible & (reach == half))
            steps = np.arange(-half, half + 1)
            patches = self._dot_patches(corner[some] - uv[some], spread[some], radius[some], steps.astype(np.float32))
            for (u, v), patch in zip(corner[some].tolist(), patches):
                left, top = max(u - half, 0), max(v - half, 0)
                box = total[top:v + half + 1, left:u + half + 1]
                box += patch[top - v + half:, left - u + half:][:box.shape[0], :box.shape[1]]
        return np.minimum(total, 1, out=total)

    def _dot_patches(self, off: np.ndarray, spread: np.ndarray, radius: np.ndarray, steps: np.ndarray) -> np.ndarray:
        """Coverage (k, s, s), 0 to 1, of dots at pixel steps (s,) around pixels at the offsets off (k, 2), px, from the dots' centres.

        The edge is a smooth step across the ellipse with the variance of the lens blur.
        """
        scale = np.sqrt(np.abs(np.linalg.det(spread))) / (2 * RENDERING.step_width * self._spread)
        inverse = np.linalg.inv(spread) * scale[:, None, None]
        form = (inverse.transpose(0, 2, 1) @ inverse).astype(np.float32)
        x, y = off[:, 0, None].astype(np.float32) + steps, off[:, 1, None].astype(np.float32) + steps
        cover = (2 * form[:, 0, 1, None] * y)[:, :, None] * x[:, None, :]
        cover += (form[:, 0, 0, None] * x * x)[:, None, :]
        cover += (form[:, 1, 1, None] * y * y)[:, :, None]
        np.sqrt(np.maximum(cover, 0, out=cover), out=cover)
        np.subtract((0.5 + radius * scale).astype(np.float32)[:, None, None], cover, out=cover)
        np.clip(cover, 0, 1, out=cover)
        cover *= cover * (3 - 2 * cover)
        return cover

    def _add_spots(self, picture: np.ndarray, position: np.ndarray, form: np.ndarray, peak: np.ndarray):
        """Add the specular highlights to the image, in place."""
        for (u, v), f, strength in zip(position, form, peak):
            if not (0 <= u < self.camera.width and 0 <= v < self.camera.height) or strength < 0.5:
                continue
            half_x, half_y = (int(np.ceil(3.2 * np.sqrt(f[k, k] / np.linalg.det(f)))) for k in (1, 0))
            left, top = max(int(u) - half_x, 0), max(int(v) - half_y, 0)
            box = slice(top, int(v) + half_y + 1), slice(left, int(u) + half_x + 1)
            patch = picture[box]
            x, y = np.arange(patch.shape[1]) + left - u, np.arange(patch.shape[0])[:, None] + top - v
            shine = strength * np.exp(-0.5 * (f[0, 0] * x * x + 2 * f[0, 1] * x * y + f[1, 1] * y * y))
            patch += (shine * self._inside[box])[..., None].astype(np.float32)

    def _fixed_spots(self) -> np.ndarray:
        """White light (height, width, 1), grey levels, of the window's reflections."""
        camera = self.camera
        v, u = np.mgrid[:camera.height, :camera.width].astype(np.float32)
        total = np.zeros((camera.height, camera.width, 1), np.float32)
        for *position, size, peak in self.imaging.reflections:
            du, dv = (axis - ((at + 0.5) * camera.scale - 0.5) for axis, at in zip((u, v), position))
            total[..., 0] += np.float32(peak) * np.exp(-(du * du + dv * dv) / (2 * (size * camera.scale)**2))
        return total

    def _skin_cover(self) -> np.ndarray:
        """Fraction (height, width) of each pixel that shows the skin and not the housing."""
        camera, fine = self.camera, 4
        border = camera.project(self.skin.rim(720))
        cover = np.zeros((camera.height * fine, camera.width * fine), np.float32)
        points = np.round(((border + 0.5) * fine - 0.5) * 16).astype(np.int32)
        cv2.fillPoly(cover, [points.reshape(-1, 1, 2)], 1.0, cv2.LINE_8, 4)
        cover = cv2.resize(cover, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
        return cv2.GaussianBlur(cover, (0, 0), self.imaging.blur * camera.scale)


def _look_up(grid: np.ndarray, position: np.ndarray, how: int = cv2.INTER_LINEAR) -> np.ndarray:
    """Values (h, w, c) of a grid (n, n, c) float32 interpolated at grid coordinates (h, w, 2)."""
    return cv2.remap(grid, position, None, how, borderMode=cv2.BORDER_REPLICATE)
