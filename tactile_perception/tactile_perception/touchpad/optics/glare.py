# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Glare: light of the lamps that the skin mirrors to the camera, on top of the light that it scatters.

Glare spoils the colour and adds brightness. The untouched pad shows where: its scattered light is smooth over the image, glare stands out.
From there its colour and its strength are known. In use, the skin's last shape tells the light that each dot should scatter. More light is
glare or an error of that shape: src/touchpad/optics/glare.cpp weighs both, and widens the range's standard
deviation where they cannot be told apart.
"""
from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from .light_path import LightPath
from ..._core import skin_light
from ...common.statistics import SIGMA_PER_MAD, robust_sigma

BRIGHT = 3.0  # standard deviations above the smooth light from which a place has glare; chosen
LEAST_BRIGHT = 0.01  # the same, at least, of ln(red); chosen: glare of less changes a range by less than 0.1 mm
# Share of the pad, and of its dots, with glare from which glare is modelled; chosen: pads without have 0.002 and up to 0.01.
COMMON, COMMON_AT_DOTS = 0.01, 0.03
_ROUNDS, _FINAL = 30, 20  # rounds of reweighting, and from which on bright places have no weight; chosen
RED = 0.15, 0.1  # absorption of red over that of blue minus red, and its standard deviation: dyes that look red absorb red least; chosen
SHADING = 0.015  # standard deviation of ln(red) by errors of the surface's shape; chosen
PROBABILITY = 0.3  # of glare at a dot of a pad that shows some; chosen: it appears where the untouched pad has none, too
LEAST_COLOUR = 0.01  # of glare over scattered light; chosen: less, or more than its inverse, is noise
MOST_DYED = 5.0  # largest that the water takes from a log ratio; chosen: more leaves no light
_AGREE = 0.4  # share of the dots that tell a frame's gain: those that agree best; chosen


@dataclass(frozen=True)
class Glare:
    """colour: (2,) blue/red and green/red of glare over those of the scattered light; size: root mean square share, red glare over
    scattered red, of places with glare; field: (7,) ln(red) less ln(irradiance) over the image, as of smooth_light; dry: the glare does
    not pass the water, and colour is that over scattered light before the water has dyed it."""

    colour: np.ndarray
    size: float
    field: np.ndarray
    dry: bool = False


class SeenGlare(NamedTuple):
    """Of N dots of one frame. excess: ln(red) over that expected without glare, sigma: its standard deviation; size: of
    Glare; colour: (N, 2) of the glare over the light that each dot scatters."""

    excess: np.ndarray
    sigma: np.ndarray
    size: float
    colour: np.ndarray


@lru_cache(maxsize=8)
def no_glare(count: int) -> SeenGlare:
    """Of count dots whose glare is unknown: they are taken to have none."""
    return SeenGlare(*np.full((2, count), np.nan), 1.0, np.ones((count, 2)))


def terms(rays: np.ndarray) -> np.ndarray:
    """Terms (N, 7) of a polynomial over the image for unit rays (N, 3): degree 2, and degree 4 along the radius (vignetting)."""
    x, y = (rays[:, :2] / rays[:, 2:]).T / 0.4  # about 1 at the image's border
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y, (x * x + y * y)**2], axis=1)


def smooth_light(rays: np.ndarray, brightness: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The light without glare: coefficients (7,) of a polynomial, what brightness (N,) exceeds it by, and where that is glare (N,) bool.

    brightness: ln of the light at unit rays (N, 3), less that of the expected irradiance. Least squares, reweighted on one side.
    """
    known = np.isfinite(brightness) & np.isfinite(rays).all(axis=1)
    every = terms(rays)
    design, light, weight = every[known], brightness[known], np.ones(known.sum())
    for number in range(_ROUNDS):
        weighted = (design * np.square(weight)[:, None]).T
        field = np.linalg.lstsq(weighted @ design, weighted @ light, rcond=None)[0]
        excess = light - design @ field
        below = -excess[excess < 0]
        limit = max(BRIGHT * SIGMA_PER_MAD * float(np.median(below)), LEAST_BRIGHT) if len(below) else LEAST_BRIGHT
        weight = np.where(excess > limit, 0.0 if number > _FINAL else (limit / np.maximum(excess, limit))**2, 1.0)
    excess = brightness - every @ field
    return field, excess, excess > limit


def learn_glare(rays: np.ndarray, brightness: np.ndarray, tinted: np.ndarray, dyed: np.ndarray,
                common: float = COMMON) -> Glare | None:
    """The glare of an untouched pad, None where there is next to none.

    rays: (N, 3) unit, to places all over the pad; brightness: (N,) ln(red) less ln(irradiance); tinted: (N, 2) log ratios less those of the
    water; dyed: (N, 2) what the water takes from the log ratios of scattered light; common: share of the places with glare
    below which it is None. Glare has passed the water, or it has not: that by which its colour is more even.
    """
    field, excess, bright = smooth_light(rays, brightness)
    bright &= np.isfinite(tinted).all(axis=1)
    if bright.mean() < common:
        return None
    share = np.expm1(excess[bright])
    colour = ((1 + share)[:, None] * np.exp(tinted[bright]) - 1) / share[:, None]  # inverse of a mixture's log ratio
    most = share > np.median(share)  # smaller shares tell the colour less well
    tint = np.log(np.clip(colour[most], LEAST_COLOUR, 1 / LEAST_COLOUR))
    before = tint - dyed[bright][most]
    uneven = [robust_sigma(some - np.median(some, axis=0), axis=0) for some in (before, tint)]
    dry = bool((uneven[0] < uneven[1]).all())
    found = np.exp(np.median(before, axis=0)) if dry else np.clip(np.median(colour[most], axis=0), 0, 1 / LEAST_COLOUR)
    return Glare(found, float(np.sqrt(np.mean(share**2))), field, dry)


class GlaringPad:
    """A pad with glare, frame by frame. absorptions: (2,) 1/m, of blue and green minus that of red."""

    def __init__(self, glare: Glare, path: LightPath, absorptions: np.ndarray, rows: int, columns: int):
        self._glare, self._path, self._absorptions, self._shape = glare, path, np.asarray(absorptions), (rows, columns)
        self._rest: np.ndarray | None = None

    def set_rest(self, places: np.ndarray, normals: np.ndarray) -> None:
        """Take the untouched places (K, 3), m, of all dots of the grid, and unit normals (K, 3) there; NaN where unknown."""
        self._normals = np.ascontiguousarray(normals)
        self._rest = self._light(places)[1]

    def seen(self, brightness: np.ndarray, rays: np.ndarray, ids: np.ndarray, places: np.ndarray) -> SeenGlare:
        """Glare at dots ids (N,) seen with ln(red) brightness (N,) along unit rays (N, 3), of a skin through places (K, 3), m."""
        irradiance, lengths = (part[ids] for part in self._light(places))
        longer = lengths - self._rest[ids]
        expected = terms(rays) @ self._glare.field + np.log(irradiance) - RED[0] * self._absorptions[0] * longer
        excess = brightness - expected
        excess -= _gain(excess)
        sigma = np.hypot(SHADING, RED[1] * self._absorptions[0] * longer)
        return SeenGlare(excess, sigma, self._glare.size, self._colour(lengths))

    def _colour(self, lengths: np.ndarray) -> np.ndarray:
        """Colour (N, 2) of the glare over light that has gone lengths (N,), m, through the water."""
        if self._glare.dry:
            return self._glare.colour * np.exp(np.clip(self._absorptions * lengths[:, None], 0, MOST_DYED))
        return np.tile(self._glare.colour, (len(lengths), 1))

    def _light(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Irradiance (K,), and lengths (K,), m, of light's paths. Kernel: src/touchpad/optics/glare.cpp."""
        return skin_light(self._path.numbers, np.ascontiguousarray(places), self._normals, rows=self._shape[0], columns=self._shape[1])


def _gain(over: np.ndarray) -> float:
    """The frame's gain: mean of the values over (N,) that agree best, in the shortest interval with _AGREE of them."""
    known = np.sort(over[np.isfinite(over)])
    some = max(int(_AGREE * len(known)), 1)
    if len(known) < some + 1:
        return 0.0
    start = int(np.argmin(known[some:] - known[:-some]))
    return float(known[start:start + some + 1].mean())
