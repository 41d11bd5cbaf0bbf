# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Images of 23 x 23 printed dots with ground truth: area-sampled discs, blurred at FINE times the pixel rate, then averaged into pixels.

Nothing here is shared with the detector: shapes are sampled, never computed by a formula of the blurred dot.
"""
from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

FINE = 6  # samples per pixel in each direction
PSF, GROUND, AMPLITUDE, DIAMETERS = 0.9, 185.0, 130.0, (5.0, 9.0)  # blur's deviation, px; grey levels; px at a pitch of 18 px
NAMES = ('plain', 'bulged', 'compressed', 'sheared', 'uneven light', 'glare', 'missing and merged', 'all at once')


@dataclass
class Scene:
    """One image and what is true in it; entry k of each array belongs to the same dot.

    clean: (H, W) float64 without noise and rounding; uv: (N, 2) px; diameter: (N,) px; amplitude: (N,) grey levels between ground and dot;
    present: (N,) bool, printed at all; clear: (N,) bool, printed, not under or near glare, touching no other.
    """

    clean: np.ndarray
    uv: np.ndarray
    diameter: np.ndarray
    amplitude: np.ndarray
    present: np.ndarray
    clear: np.ndarray

    def frame(self, noise: float, rng: np.random.Generator) -> np.ndarray:
        """(H, W) uint8 image with Gaussian noise of this standard deviation in grey levels."""
        noisy = self.clean + noise * rng.standard_normal(self.clean.shape)
        return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def make_scene(name: str, seed: int = 0, *, size: tuple[int, int] = (640, 480), pitch: float = 18.0) -> Scene:
    """One of the scenes in NAMES, with dot sizes and sub-pixel positions drawn from the seed; size: (width, height) px."""
    rng = np.random.default_rng([seed, NAMES.index(name)])
    effects = NAMES if name == 'all at once' else (name,)
    row, column = np.divmod(np.arange(23 * 23), 23)
    uv = _deformed((np.stack([column, row], 1) - 11.0) * pitch, effects, pitch) + np.asarray(size) / 2 + rng.uniform(-0.5, 0.5, 2)
    uv += rng.normal(0, 0.15, uv.shape)
    diameter = rng.uniform(*DIAMETERS, len(uv)) * pitch / 18.0
    present, merged = np.ones(len(uv), bool), np.zeros(len(uv), bool)
    if 'missing and merged' in effects:
        uv, present, merged = _drop_and_merge(uv, diameter, rng)
    light = _light(size, 3.0 if 'uneven light' in effects else 1.0)
    spots = _spots(size, rng) if 'glare' in effects else np.zeros(size[::-1])
    fine = cv2.resize(light / light.max(), None, fx=FINE, fy=FINE, interpolation=cv2.INTER_LINEAR)
    fine *= GROUND * (1 - AMPLITUDE / GROUND * _coverage(uv[present], diameter[present], size))
    at = np.clip(np.rint(uv).astype(int), 0, np.asarray(size) - 1)
    covered = cv2.dilate((spots > 2.0).astype(np.uint8), np.ones((13, 13), np.uint8))[at[:, 1], at[:, 0]] > 0
    gap = np.hypot(*(uv[:, None] - uv).transpose(2, 0, 1)) - (diameter[:, None] + diameter) / 2
    gap[:, ~present] = np.inf
    np.fill_diagonal(gap, np.inf)
    merged |= (gap.min(1) < 0.5) & present
    return Scene(np.clip(_blur_and_sample(fine) + spots, 0, 255), uv, diameter, AMPLITUDE * (light / light.max())[at[:, 1], at[:, 0]],
                 present, present & ~covered & ~merged)


def _deformed(plane: np.ndarray, effects: tuple[str, ...], pitch: float) -> np.ndarray:
    """(N, 2) positions of the grid's dots about the image centre, px."""
    x, y = plane.T
    reach = 11.0 * pitch
    if 'bulged' in effects:
        gain = 1 + 0.12 * np.exp(-(x**2 + y**2) / (0.5 * reach) ** 2)
        x, y = x * gain, y * gain
    if 'compressed' in effects:
        # the spacing shrinks to 0.6 of the pitch in a band in the middle, smoothly
        width = 0.3 * reach
        x = x - 0.4 * width * np.tanh(x / width)
    if 'sheared' in effects:
        angle = np.deg2rad(20.0)
        x = x + 0.12 * y
        x, y = 0.85 * (np.cos(angle) * x - np.sin(angle) * y), 0.85 * (np.sin(angle) * x + np.cos(angle) * y)
    return np.stack([x, y], 1)


def _drop_and_merge(uv: np.ndarray, diameter: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Leave out 5 % of the dots and move 3 % so close to a neighbour that they touch: positions, present, merged."""
    count, uv = len(uv), uv.copy()
    present, merged = rng.random(count) > 0.05, np.zeros(count, bool)
    for k in rng.choice(count, count * 3 // 100, replace=False):
        j = k + 1 if k % 23 < 22 else k - 1
        if not (merged[k] or merged[j]) and present[k] and present[j]:
            step = uv[j] - uv[k]
            distance = np.hypot(*step)
            uv[k] = uv[j] - step / distance * min((diameter[k] + diameter[j]) / 2 + 0.3, distance)
            merged[[k, j]] = True
    return uv, present, merged


def _light(size: tuple[int, int], ratio: float) -> np.ndarray:
    """(H, W) light falling by this ratio from one corner to the opposite one, slightly curved."""
    x, y = np.meshgrid(np.linspace(0, 1, size[0]), np.linspace(0, 1, size[1]))
    return 1 / (1 + (ratio - 1) * ((x + 0.6 * y) / 1.6)**1.3)


def _coverage(uv: np.ndarray, diameter: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """(H * FINE, W * FINE) share of each fine sample that lies in a dot, by four by four points in it."""
    coverage = np.zeros((size[1] * FINE, size[0] * FINE))
    for position, d in zip(uv, diameter):
        centre, reach = (position + 0.5) * FINE - 0.5, int(d / 2 * FINE) + 3
        left, top = np.maximum(np.floor(centre).astype(int) - reach, 0)
        right, bottom = np.minimum(np.floor(centre).astype(int) + reach + 2, np.multiply(size, FINE))
        if right > left and bottom > top:
            across, down = ((np.arange(low * 4, high * 4) + 0.5) / 4 - 0.5 - c
                            for low, high, c in ((left, right, centre[0]), (top, bottom, centre[1])))
            inside = (across**2 + down[:, None]**2 < (d / 2 * FINE)**2).astype(np.float32)
            here = coverage[top:bottom, left:right]
            np.maximum(here, inside.reshape(bottom - top, 4, right - left, 4).mean((1, 3)), out=here)
    return coverage


def _blur_and_sample(fine: np.ndarray) -> np.ndarray:
    return cv2.resize(cv2.GaussianBlur(fine, (0, 0), PSF * FINE), None, fx=1 / FINE, fy=1 / FINE, interpolation=cv2.INTER_AREA)


def _spots(size: tuple[int, int], rng: np.random.Generator) -> np.ndarray:
    """(H, W) light of eight specular spots, grey levels; their cores saturate."""
    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    spots = np.zeros(size[::-1])
    for _ in range(8):
        u, v = rng.uniform(0.2, 0.8, 2) * size
        wide, narrow = rng.uniform(3, 7), rng.uniform(2, 4)
        spots += 400 * np.exp(-(((x - u) / wide) ** 2 + ((y - v) / narrow) ** 2))
    return spots


def position_bound(diameter: np.ndarray, amplitude: np.ndarray, noise: float) -> np.ndarray:
    """Cramer-Rao bound on the positions of dots (2-D RMS, px): shape known; position, amplitude and ground unknown.

    diameter, amplitude: (N,); the Fisher matrix is taken by finite differences of rendered dots, its mean over nine sub-pixel positions;
    rounding to whole grey levels counts as noise of variance 1/12.
    """
    sizes = np.linspace(np.min(diameter), np.max(diameter) + 1e-6, 6)
    return np.interp(diameter, sizes, [_unit_bound(size) for size in sizes]) * np.sqrt(noise**2 + 1 / 12) / amplitude


@lru_cache(maxsize=64)
def _unit_bound(diameter: float, step: float = 0.25) -> float:
    """The bound for one grey level of noise and amplitude one."""
    variances = []
    for position in np.stack(np.meshgrid((0.0, 0.33, 0.67), (0.0, 0.33, 0.67), indexing='ij'), axis=-1).reshape(-1, 2):
        shots = [_blur_and_sample(_coverage((16.0 + position + offset)[None], np.array([diameter]), (33, 33)))
                 for offset in np.array([(step, 0), (-step, 0), (0, step), (0, -step), (0, 0)])]
        columns = [(shots[0] - shots[1]) / (2 * step), (shots[2] - shots[3]) / (2 * step), shots[4], np.ones_like(shots[4])]
        jacobian = np.stack([c.ravel() for c in columns], 1)
        variances.append(np.trace(np.linalg.inv(jacobian.T @ jacobian)[:2, :2]))
    return np.sqrt(np.mean(variances))
