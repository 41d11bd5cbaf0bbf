# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Wear of printed markers and of the skin: chips, speckle, dirt, weave, glare. All constants are chosen."""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

#: Samples along the side of a marker's map, and half width of the map in marker radii.
_SIDE, _REACH = 48, 1.15
#: Samples along the side of the skin's map: a marker of a twentieth of the sheet has fifty.
_SKIN = 1024
_CHIP = (0.18, 0.5)  # least and largest radius of a chip, in marker radii
_BITES = 60  # largest number of chips
_SPECK_LEVEL = 0.55  # standard deviations of the field above which a speckle is a hole: 29 % of the area
_FINER = 3  # samples of the print along a pixel's side


@dataclass(frozen=True)
class Wear:
    """The amount of wear.

    missing: chipped fraction of a marker's area; speckle: fraction of ink lost in the speckles, 0 to 1; grain: size of the speckles, in
    marker radii; dirt: fraction of the skin under dark dirt; grit: number of bright grains on the skin, with semi-axes up to a quarter of
    the marker radius; weave: relative standard deviation of the skin's brightness; glare: number of soft reflections fixed in the image;
    seed: of the random numbers.
    """

    missing: float = 0.0
    speckle: float = 0.0
    grain: float = 0.2
    dirt: float = 0.0
    grit: int = 0
    weave: float = 0.0
    glare: int = 0
    seed: int = 0

    @classmethod
    def of(cls, amount: float, seed: int = 0) -> Wear:
        """Wear from amount 0 (as printed) to 1: a quarter chipped off, speckles nearly bare, dirt, grit, coarse weave, glare."""
        rng = np.random.default_rng([seed, 31])
        return cls(0.25 * amount, 0.9 * amount, rng.uniform(0.12, 0.35), 0.03 * amount, int(60 * amount), 0.12 * amount,
                   int(round(5 * amount)), seed)

    def generator(self, part: int) -> np.random.Generator:
        """Random generator for one kind of wear."""
        return np.random.default_rng([self.seed, 32, part])


class WornPrint:
    """The ink left on count markers."""

    def __init__(self, wear: Wear, count: int):
        rng = wear.generator(0)
        grain = wear.grain * _SIDE / (2 * _REACH) / 2
        self._left = np.stack([_chipped(wear.missing, rng) * (1 - wear.speckle * (_field(_SIDE, grain, rng) > _SPECK_LEVEL))
                               for _ in range(count)]).astype(np.float32)

    def left(self, which: np.ndarray, off: np.ndarray, inverse: np.ndarray, steps: np.ndarray, blur: float) -> np.ndarray:
        """Fraction (k, s, s) of ink left at pixel steps (s,) around pixels at the offsets off (k, 2), px, from the centres of markers.

        which: (k,) indices of the markers; inverse: (k, 2, 2), from px to marker radii; blur: px, standard deviation of the lens blur.
        """
        fine = (np.arange(_FINER) - (_FINER - 1) / 2) / _FINER
        at = (steps[:, None] + fine).ravel()
        picture = np.empty((len(which), len(steps), len(steps)), np.float32)
        for k, (marker, place, turn) in enumerate(zip(which, off, inverse)):
            x, y = np.meshgrid(place[0] + at, place[1] + at)
            a, b = ((turn[i, 0] * x + turn[i, 1] * y) / _REACH * _SIDE / 2 + (_SIDE - 1) / 2 for i in (0, 1))
            at_map = a.astype(np.float32), b.astype(np.float32)
            seen = cv2.remap(self._left[marker], *at_map, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
            picture[k] = cv2.resize(cv2.GaussianBlur(seen, (0, 0), _FINER * blur), (len(steps),) * 2, interpolation=cv2.INTER_AREA)
        return picture


class WornSkin:
    """Maps over the whole skin: coverage by bright grit, 0 to 1, and the light factor of dirt and weave; marker: radius of a marker, as a
    fraction of the skin's side."""

    def __init__(self, wear: Wear, marker: float):
        self._wear, self._marker = wear, marker * _SKIN

    @cached_property
    def grit(self) -> np.ndarray:
        """(n, n) float32, coverage by bright grains."""
        rng, grit = self._wear.generator(1), np.zeros((_SKIN, _SKIN), np.float32)
        for x, y in rng.uniform(0, _SKIN, (self._wear.grit, 2)):
            size = rng.uniform(0.06, 0.25, 2) * self._marker
            cv2.ellipse(grit, ((x, y), tuple(2 * size), rng.uniform(0, 180)), float(rng.uniform(0.4, 1.0)), -1)
        return cv2.GaussianBlur(grit, (0, 0), 0.7)

    @cached_property
    def light(self) -> np.ndarray:
        """(n, n) float32, factor on the light from the skin and its print."""
        wear, rng = self._wear, self._wear.generator(2)
        dirty = _field(_SKIN, 0.25 * self._marker, rng)
        dirt = dirty > np.quantile(dirty, 1 - wear.dirt) if wear.dirt else np.zeros((_SKIN, _SKIN), bool)
        woven = 0.7 * _field(_SKIN, 0.1 * self._marker, rng) + 0.7 * _field(_SKIN, 1.0 * self._marker, rng)
        passed = 1 - 0.6 * cv2.GaussianBlur(dirt.astype(np.float32), (0, 0), 1.0)
        return (np.clip(1 + wear.weave * woven, 0.3, 2) * passed).astype(np.float32)


def glare(wear: Wear, width: int, height: int, marker: float) -> np.ndarray:
    """Reflections (height, width), float32, grey levels, in the image; marker: marker radius, px.

    They are streaks and clouds; none is as large and as sharp as a marker.
    """
    rng, picture = wear.generator(3), np.zeros((height, width), np.float32)
    for u, v in rng.uniform(0.05, 0.95, (wear.glare, 2)) * (width, height):
        cloud = np.zeros_like(picture)
        length, across = rng.uniform(2.5, 6) * marker, rng.uniform(0.12, 0.4) * marker
        if rng.random() < 0.5:
            across = length * rng.uniform(0.6, 1.0)
        cv2.ellipse(cloud, ((u, v), (2 * length, 2 * across), rng.uniform(0, 180)), float(rng.uniform(40, 140)), -1)
        picture += cv2.GaussianBlur(cloud, (0, 0), 0.35 * min(length, max(across, 0.3 * marker)) + 0.5)
    return picture


def _chipped(missing: float, rng: np.random.Generator) -> np.ndarray:
    """(n, n): 1 where ink is left, 0 in the chips; missing: mean chipped fraction of the disc."""
    y, x = (np.mgrid[:_SIDE, :_SIDE] - (_SIDE - 1) / 2) * (2 * _REACH / _SIDE)
    disc, left = np.hypot(x, y) <= 1, np.ones((_SIDE, _SIDE))
    wanted = missing * rng.uniform(0.4, 1.6)
    for _ in range(_BITES):
        gone = 1 - left[disc].mean()
        if gone >= wanted:
            break
        before = left.copy()
        angle, away, radius = rng.uniform(0, 2 * np.pi), np.sqrt(rng.uniform(0, 1.2)), rng.uniform(*_CHIP)
        left[np.hypot(x - away * np.cos(angle), y - away * np.sin(angle)) < radius] = 0
        if 1 - left[disc].mean() > 2 * wanted - gone:  # further from the wanted fraction than without this chip
            left = before
    return left


def _field(side: int, size: float, rng: np.random.Generator) -> np.ndarray:
    """Gaussian random field (side, side) of mean 0 and standard deviation 1; size: standard deviation of its kernel, samples."""
    field = cv2.GaussianBlur(rng.standard_normal((side, side)).astype(np.float32), (0, 0), max(size, 0.3))
    return (field - field.mean()) / field.std()
