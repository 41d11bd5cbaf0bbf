# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the simulated marker sheets with one and two cameras share: green discs on a dark sheet, and how fingertips go over it."""
from __future__ import annotations

from functools import partial

import numpy as np

from ..optics.camera import SimulatedCamera, mounted
from ..optics.pattern import DotPattern, uneven
from ..scene.specimen import drag, press
from ..skin.sheet import Sheet

#: light from a marker, over that from the sheet about it, B, G, R.
_MARKER = (6.5, 16.0, 5.6)
INK = tuple(1 - share for share in _MARKER)
SHEET_COLOUR = (0.062, 0.066, 0.060)


def markers(sheet: Sheet, rows: int, columns: int, pitch: tuple, radius: float, rng: np.random.Generator) -> DotPattern:
    """A grid of discs about the sheet's middle, pitch (x, y), m, and radius, m; printed a bit off in place, size and direction."""
    v, u = np.mgrid[:rows, :columns].reshape(2, -1)
    x, y = (u - (columns - 1) / 2) * pitch[0], (v - (rows - 1) / 2) * pitch[1]
    turn = rng.normal(0, 0.003)
    places = np.stack([x - turn * y, y + turn * x, np.zeros_like(x)], axis=1)
    places[:, :2] += rng.normal(0, 0.010 * pitch[1], (len(places), 2)) + rng.normal(0, 0.15e-3, 2)
    return DotPattern(sheet, places, uneven(radius, 0.035, len(places), rng), np.arange(len(places)), rows, columns)


def built_camera(rng: np.random.Generator, focal: float, centre: tuple, distortion: tuple, turn: tuple, place: tuple, native: tuple,
                 width: int) -> SimulatedCamera:
    """A camera as camera.mounted has it, off by what a maker's tolerances allow."""
    focal *= 1 + rng.normal(0, 0.004)
    return mounted((focal, focal * (1 + rng.normal(0, 0.001))), np.add(centre, rng.normal(0, 2.0, 2)), distortion,
                   np.add(turn, rng.normal(0, 0.003, 3)), np.add(place, rng.normal(0, 0.15e-3, 3)), native, width)


def presses(tool: str, places: list, half: tuple, deepest: float, count: int, rng: np.random.Generator) -> list:
    """Acts of a tool that goes down at each of the places (x, y), m, through count depths up to deepest, m.

    half: (x, y), m, of the sheet; near its border the tool goes less deep, at most to 0.85 of the distance.
    """
    acts = []
    for x, y in places:
        limit = min(deepest, 0.85 * min(half[0] - abs(x), half[1] - abs(y)))
        depths = np.sort((np.arange(count) + rng.uniform(0.1, 1.0, count)) * limit / count)
        acts.append(partial(press, tool, x, y, *depths.tolist()))
    return acts


def drags(tool: str, count: int, half: tuple, depths: tuple, way: float, rng: np.random.Generator) -> list:
    """Acts of a tool that goes down through one of depths (least, largest), m, in the inner part of a sheet of half (x, y), m, and then
    way m along it in some direction."""
    acts = []
    for _ in range(count):
        x, y = rng.uniform(-0.35, 0.35, 2) * half
        angle = rng.uniform(0, 2 * np.pi)
        acts.append(partial(drag, tool, x, y, rng.uniform(*depths), way * np.cos(angle), way * np.sin(angle)))
    return acts


def grid(half: tuple, columns: int, rows: int) -> list:
    """Places (x, y), m, in rows and columns between -half and half (x, y), m."""
    return [(x, y) for y in np.linspace(-half[1], half[1], rows) for x in np.linspace(-half[0], half[0], columns)]


def scattered(half: tuple, count: int, rng: np.random.Generator) -> list:
    """Places (x, y), m, at random between -half and half (x, y), m."""
    return list(rng.uniform(-1, 1, (count, 2)) * half)
