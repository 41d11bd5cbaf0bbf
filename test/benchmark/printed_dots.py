# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Images of printed dots with ground truth: area-sampled discs, blurred at FINE times the pixel rate, then averaged into pixels.

Nothing here is shared with the detector: shapes are sampled, never computed by a formula of the blurred dot.
"""
from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import cv2
import numpy as np

FINE = 6  # samples per pixel in each direction
NAMES = ('plain', 'bulged', 'compressed', 'sheared', 'uneven light', 'glare', 'missing and merged', 'all at once')


@dataclass
class Scene:
    """One image and what is true in it; entry k of each array belongs to the same dot.

    clean: (H, W) float64 without noise and rounding; uv: (N, 2) px; row, column: (N,) grid numbers; diameter: (N,) px;
    amplitude: (N,) grey levels between ground and dot; present: (N,) bool, printed at all; covered: (N,) bool, glare on or near the dot;
    merged: (N,) bool, touches a neighbour; psf: blur's standard deviation, px.
    """

    name: str
    clean: np.ndarray
    uv: np.ndarray
    row: np.ndarray
    column: np.ndarray
    diameter: np.ndarray
    amplitude: np.ndarray
    present: np.ndarray
    covered: np.ndarray
    merged: np.ndarray
    psf: float
    rows: int = 23
    columns: int = 23
    extra: dict = field(default_factory=dict)

    @property
    def clear(self) -> np.ndarray:
        """(N,) bool: printed, not under glare, touching no other."""
        return self.present & ~self.covered & ~self.merged

    def frame(self, noise: float, rng: np.random.Generator) -> np.ndarray:
        """(H, W) uint8 image with Gaussian noise of this standard deviation in grey levels."""
        noisy = self.clean + noise * rng.standard_normal(self.clean.shape)
        return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def make_scene(name: str, seed: int = 0, *, size=(640, 480), pitch: float = 18.0, psf: float = 0.9, amplitude: float = 130.0,
               ground: float = 185.0, dark: bool = True, shift=(0.0, 0.0), diameters=(5.0, 9.0)) -> Scene:
    """One of the scenes in NAMES, with dot sizes and sub-pixel places drawn from the seed.

    size: (width, height) px; shift: (2,) px added to all dots; ValueError names the scenes if the name is unknown.
    """
    if name not in NAMES:
        raise ValueError(f'scene {name!r} is unknown: choose from {", ".join(NAMES)}')
    rng = np.random.default_rng([seed, NAMES.index(name)])
    everything = name == 'all at once'
    row, column = np.divmod(np.arange(23 * 23), 23)
    plane = (np.stack([column, row], 1) - 11.0) * pitch
    uv = _deform(plane, name, everything, pitch) + np.asarray(size) / 2 + rng.uniform(-0.5, 0.5, 2) + np.asarray(shift)
    uv += rng.normal(0, 0.15, uv.shape)
    diameter = rng.uniform(*diameters, len(uv)) * pitch / 18.0
    present, merged = np.ones(len(uv), bool), np.zeros(len(uv), bool)
    if name == 'missing and merged' or everything:
        uv, present, merged = _drop_and_merge(uv, diameter, rng)
    light = _light(size, 3.0 if name == 'uneven light' or everything else 1.0)
    coverage = _coverage(uv[present], diameter[present], size)
    contrast = amplitude / ground
    scale = light / light.max()
    spots = _spots(size, rng) if name == 'glare' or everything else np.zeros(size[::-1])
    fine_image = cv2.resize(scale, None, fx=FINE, fy=FINE, interpolation=cv2.INTER_LINEAR)
    fine_image *= ground * (1 - contrast * coverage) if dark else (ground - amplitude + amplitude * coverage)
    clean = _blur_and_sample(fine_image, psf) + spots
    at = np.clip(np.rint(uv).astype(int), 0, np.asarray(size) - 1)
    reach = cv2.dilate((spots > 2.0).astype(np.uint8), np.ones((13, 13), np.uint8))
    covered = reach[at[:, 1], at[:, 0]] > 0
    merged |= _touching(uv, diameter, present)
    return Scene(name, np.clip(clean, 0, 255), uv, row, column, diameter, amplitude * scale[at[:, 1], at[:, 0]], present, covered,
                 merged, psf)


def _deform(plane, name, everything, pitch):
    """(N, 2) places of the grid's dots about the image centre, px."""
    x, y = plane.T
    reach = 11.0 * pitch
    if name == 'bulged' or everything:
        gain = 1 + 0.12 * np.exp(-(x**2 + y**2) / (0.5 * reach) ** 2)
        x, y = x * gain, y * gain
    if name == 'compressed' or everything:
        # the spacing shrinks to 0.6 of the pitch in a band in the middle, smoothly
        width = 0.3 * reach
        x = x - 0.4 * width * np.tanh(x / width)
    if name == 'sheared' or everything:
        angle = np.deg2rad(20.0)
        x = x + 0.12 * y
        x, y = np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y
        x, y = 0.85 * x, 0.85 * y
    return np.stack([x, y], 1)


def _drop_and_merge(uv, diameter, rng):
    """Leave out 5 % of the dots and move 3 % so close to a neighbour that they touch."""
    count = len(uv)
    present = rng.random(count) > 0.05
    merged = np.zeros(count, bool)
    uv = uv.copy()
    for k in rng.choice(count, count * 3 // 100, replace=False):
        j = k + 1 if k % 23 < 22 else k - 1
        if merged[k] or merged[j] or not (present[k] and present[j]):
            continue
        step = uv[j] - uv[k]
        distance = np.hypot(*step)
        touching = (diameter[k] + diameter[j]) / 2 + 0.3
        uv[k] = uv[j] - step / distance * min(touching, distance)
        merged[[k, j]] = True
    return uv, present, merged


def _touching(uv, diameter, present):
    """(N,) bool: printed less than half a pixel from another dot's edge."""
    gap = np.hypot(*(uv[:, None] - uv).transpose(2, 0, 1)) - (diameter[:, None] + diameter) / 2
    gap[:, ~present] = np.inf
    np.fill_diagonal(gap, np.inf)
    return (gap.min(1) < 0.5) & present


def _light(size, ratio):
    """(H, W) light falling by this ratio from one corner to the opposite one, slightly curved."""
    x, y = np.meshgrid(np.linspace(0, 1, size[0]), np.linspace(0, 1, size[1]))
    along = (x + 0.6 * y) / 1.6
    return 1 / (1 + (ratio - 1) * along**1.3)


def _coverage(uv, diameter, size):
    """(H * FINE, W * FINE) share of each fine sample that lies in a dot."""
    width, height = size
    coverage = np.zeros((height * FINE, width * FINE))
    for (u, v), d in zip(uv, diameter):
        centre = (np.array([u, v]) + 0.5) * FINE - 0.5
        reach = int(d / 2 * FINE) + 3
        left, top = np.maximum(np.floor(centre).astype(int) - reach, 0)
        right, bottom = np.minimum(np.floor(centre).astype(int) + reach + 2, [width * FINE, height * FINE])
        if right <= left or bottom <= top:
            continue
        # four by four points in each fine sample
        across = (np.arange(left * 4, right * 4) + 0.5) / 4 - 0.5 - centre[0]
        down = (np.arange(top * 4, bottom * 4) + 0.5) / 4 - 0.5 - centre[1]
        inside = (across**2 + down[:, None] ** 2 < (d / 2 * FINE) ** 2).astype(np.float32)
        share = inside.reshape(bottom - top, 4, right - left, 4).mean((1, 3))
        here = coverage[top:bottom, left:right]
        np.maximum(here, share, out=here)
    return coverage


def _blur_and_sample(fine_image, psf):
    blurred = cv2.GaussianBlur(fine_image, (0, 0), psf * FINE)
    return cv2.resize(blurred, None, fx=1 / FINE, fy=1 / FINE, interpolation=cv2.INTER_AREA)


def _spots(size, rng, count=8):
    """(H, W) light of specular spots, grey levels; their cores saturate."""
    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    spots = np.zeros(size[::-1])
    for _ in range(count):
        u, v = rng.uniform(0.2, 0.8, 2) * size
        wide, narrow = rng.uniform(3, 7), rng.uniform(2, 4)
        spots += 400 * np.exp(-(((x - u) / wide) ** 2 + ((y - v) / narrow) ** 2))
    return spots


def position_bound(diameter, amplitude, psf: float, noise: float) -> np.ndarray:
    """Cramer-Rao bound on a dot's place (2-D RMS, px): shape known; place, amplitude and ground unknown.

    diameter, amplitude: (N,); the Fisher matrix is taken by finite differences of rendered dots, its mean over nine sub-pixel places;
    rounding to whole grey levels counts as noise of variance 1/12.
    """
    sizes = np.linspace(np.min(diameter), np.max(diameter) + 1e-6, 6)
    unit = np.array([_unit_bound(size, psf) for size in sizes])
    return np.interp(diameter, sizes, unit) * np.sqrt(noise**2 + 1 / 12) / amplitude


@lru_cache(maxsize=64)
def _unit_bound(diameter, psf, step=0.25):
    """The bound for one grey level of noise and amplitude one."""
    variances = []
    for place in [(a, b) for a in (0.0, 0.33, 0.67) for b in (0.0, 0.33, 0.67)]:
        centre = np.array([16.0, 16.0]) + place
        shots = [_single(centre + offset, diameter, psf) for offset in ((step, 0), (-step, 0), (0, step), (0, -step), (0, 0))]
        columns = [(shots[0] - shots[1]) / (2 * step), (shots[2] - shots[3]) / (2 * step), shots[4], np.ones_like(shots[4])]
        jacobian = np.stack([c.ravel() for c in columns], 1)
        variances.append(np.trace(np.linalg.inv(jacobian.T @ jacobian)[:2, :2]))
    return np.sqrt(np.mean(variances))


def _single(centre, diameter, psf):
    return _blur_and_sample(_coverage(centre[None], np.array([diameter]), (33, 33)), psf)
