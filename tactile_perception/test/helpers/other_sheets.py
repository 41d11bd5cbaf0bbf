# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Simulated sheets of dots as people own them: a rim and lamps in view, lamps that switch, see-through ground with things that move behind
it, two layers of dots, 120 to 1,080 rows of pixels. No formula of a detector's is in them."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np


@dataclass(frozen=True)
class Sheet:
    """rows: of pixels (4:3); dots: rows and columns of a grid, or a number at random; size: px of a dot; sign: 1 bright, -1 dark."""

    rows: int = 480
    dots: tuple[int, int] | int = (10, 14)
    size: float = 9.0
    sign: int = -1
    contrast: float = 70.0
    rim: bool = False
    lamps: int = 0
    switching: bool = False
    behind: bool = False
    layers: bool = False
    colour: bool = False
    worn: float = 0.0
    noise: float = 2.0


SHEETS = {
    'plain': Sheet(),
    'rim': Sheet(dots=(7, 5), size=16.0, rim=True),
    'lamps': Sheet(dots=165, size=9.0, sign=1, lamps=8),
    'lamps_switch': Sheet(rows=120, dots=80, size=4.0, sign=1, lamps=5, switching=True),
    'see_through': Sheet(dots=31, size=14.0, behind=True),
    'two_layers': Sheet(dots=90, size=12.0, layers=True),
    'stripes': Sheet(rows=720, dots=(8, 8), size=26.0, sign=1, colour=True),
    'tiny': Sheet(rows=240, dots=(18, 24), size=3.2, contrast=90.0),
    'large': Sheet(rows=1080, dots=(9, 12), size=30.0, sign=1, rim=True, lamps=4),
    'worn': Sheet(dots=120, size=12.0, sign=1, worn=0.3),
}


class Film:
    """Images of a sheet and the true positions of its dots, frame by frame: a press that moves dots by up to a third of their distance."""

    def __init__(self, sheet: Sheet, seed: int = 0):
        self.sheet, self._rng = sheet, np.random.default_rng(seed)
        self._shape = sheet.rows, sheet.rows * 4 // 3
        self._middle = np.array(self._shape[::-1]) / 2
        self._reach = 0.40 * sheet.rows if sheet.rim else 0.46 * sheet.rows
        self._rest = self._places()
        self._sizes = sheet.size * self._rng.uniform(0.92, 1.08, len(self._rest))
        if sheet.layers:
            self._sizes[::2] *= 0.6
        self._strength = self._rng.uniform(0.85, 1.15, len(self._rest))
        self._lamps = self._middle + self._rng.uniform(-0.4, 0.4, (sheet.lamps, 2)) * self._shape[::-1]
        self._lamp_sizes = self._rng.uniform(0.02, 0.05, sheet.lamps) * sheet.rows
        self._texture = [cv2.GaussianBlur(self._rng.normal(0, 1, self._shape), (0, 0), sheet.rows * s) * sheet.rows * s * 25 for s in
                         ((0.008, 0.03) if sheet.behind else ())]
        self._ink = cv2.GaussianBlur(self._rng.normal(0, 1, self._shape), (0, 0), 1.2)

    def _places(self):
        dots = self.sheet.dots
        if isinstance(dots, tuple):
            row, column = np.divmod(np.arange(dots[0] * dots[1]), dots[1])
            pitch = 2 * self._reach / max(dots)
            p = np.stack([column - (dots[1] - 1) / 2, row - (dots[0] - 1) / 2], 1) + self._rng.normal(0, 0.015, (len(row), 2))
            p *= 1 - 0.002 * (p**2).sum(axis=1, keepdims=True) / max(dots)  # a lens
            return self._middle + pitch * 0.95 * p
        found = np.zeros((0, 2))
        apart = 0.75 * np.sqrt(4 * self._reach**2 / dots)
        for _ in range(20000):
            position = self._middle + self._rng.uniform(-1, 1, 2) * self._reach
            if len(found) < dots and (not len(found) or np.hypot(*(found - position).T).min() > max(apart, 1.6 * self.sheet.size)):
                found = np.vstack([found, position])
        return found

    @property
    def rest(self) -> np.ndarray:
        """(N, 2) px, positions of the untouched dots."""
        return self._rest

    def frame(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """(image, (N, 2) px positions) at frame k; nothing touches before frame 8. Positions of hidden dots are NaN."""
        sheet, (rows, columns) = self.sheet, self._shape
        press = 0.3 * np.sqrt(4 * self._reach**2 / len(self._rest)) * np.sin(max(k - 8, 0) / 12)
        away = self._rest - self._middle - 0.1 * rows
        uv = self._rest + press * np.exp(-(away**2).sum(axis=1, keepdims=True) / (0.3 * rows)**2) * np.array([0.8, 0.6])
        y, x = np.mgrid[:rows, :columns]
        ground = 120 + 30 * (x / columns - 0.5) + 20 * (y / rows - 0.5)
        for which, texture in enumerate(self._texture):
            ground = ground + np.roll(texture, (3 * k * (which + 1) * rows // 480, 2 * k * rows // 480), (0, 1))
        fine = max(1, round(16 / sheet.size))
        inside = np.zeros((rows * fine, columns * fine), np.float32)
        for (u, v), size, strength in zip(uv, self._sizes, self._strength):
            centre = int(((u + 0.5) * fine - 0.5) * 16), int(((v + 0.5) * fine - 0.5) * 16)
            cv2.circle(inside, centre, int(size * fine * 8), float(strength), -1, cv2.LINE_AA, 4)
        ink = cv2.resize(inside, (columns, rows), interpolation=cv2.INTER_AREA)
        if sheet.worn:
            ink = ink * (self._ink > np.quantile(self._ink, sheet.worn))
        image = ground + sheet.sign * sheet.contrast * cv2.GaussianBlur(ink, (0, 0), 0.7)
        hidden = np.zeros(self._shape, np.uint8)
        if sheet.rim:
            far = np.hypot(x - self._middle[0], y - self._middle[1])
            image = np.where(far < 0.47 * rows, image, 25 + 10 * np.sin(far / rows * 60))
            hidden[far > 0.46 * rows] = 1
        for index, (lamp, size) in enumerate(zip(self._lamps, self._lamp_sizes)):
            if sheet.switching and (k // 5 + index) % 2:
                continue
            glow = np.exp(-((x - lamp[0])**2 + (y - lamp[1])**2) / (2 * size**2))
            image = image + 600 * glow**2 + 60 * glow
            hidden[glow > 0.33] = 1  # a bright dot is saturated there
        image = image[..., None] + np.zeros(3)
        if sheet.colour:
            stripes = 40 * np.sin(x / columns * 25)
            image += np.stack([stripes, -stripes, 0 * x], axis=2)
            image[..., 0] -= 0.9 * sheet.sign * sheet.contrast * cv2.GaussianBlur(ink, (0, 0), 0.7)
        image = np.clip(np.rint(image + self._rng.normal(0, sheet.noise, image.shape)), 0, 255).astype(np.uint8)
        at = np.clip(np.rint(uv).astype(int), 0, np.array(self._shape[::-1]) - 1)
        seen = ~hidden.astype(bool)[at[:, 1], at[:, 0]]
        margin = 0.7 * sheet.size
        seen &= ((uv > margin) & (uv < np.array(self._shape[::-1]) - 1 - margin)).all(axis=1)
        return image, np.where(seen[:, None], uv, np.nan)


def score(found: np.ndarray, true: np.ndarray, size: float) -> tuple[float, float]:
    """(share of the seen dots that are found, share of the found that are none), within half a dot; found (M, 2), true (N, 2) px."""
    seen = true[np.isfinite(true).all(axis=1)]
    if not len(found):
        return 0.0, 0.0
    away = np.hypot(*(found[:, None] - seen).transpose(2, 0, 1))
    return float((away.min(axis=0) < size / 2).mean()), float((away.min(axis=1) > size / 2).mean())
