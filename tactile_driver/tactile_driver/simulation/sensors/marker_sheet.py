# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Parts shared by the simulated marker sheets with one and two cameras: green discs on a dark sheet, and paths of fingertips."""
from __future__ import annotations

from functools import partial

import numpy as np

from ..constants import SIMULATION
from ..optics.pattern import LargeDots, uneven
from ..scene.specimen import Act, drag, one_after_the_other, press
from ..skin.surfaces import Sheet

#: Light from a marker relative to the light from the surrounding sheet, B, G, R.
_MARKER = (6.5, 16.0, 5.6)
INK = tuple(1 - share for share in _MARKER)
#: Reflectance of the sheet, B, G, R.
SHEET_COLOUR = (0.062, 0.066, 0.060)


def markers(sheet: Sheet, rows: int, columns: int, pitch: tuple, radius: float, rng: np.random.Generator) -> LargeDots:
    """A grid of discs centred on the sheet; pitch: (x, y), m; radius: m; with random errors of position, size and direction."""
    v, u = np.mgrid[:rows, :columns].reshape(2, -1)
    x, y = (u - (columns - 1) / 2) * pitch[0], (v - (rows - 1) / 2) * pitch[1]
    turn = rng.normal(0, 0.003)
    positions = np.stack([x - turn * y, y + turn * x, np.zeros_like(x)], axis=1)
    positions[:, :2] += rng.normal(0, 0.010 * pitch[1], (len(positions), 2)) + rng.normal(0, 0.15e-3, 2)
    return LargeDots(sheet, positions, uneven(radius, 0.035, len(positions), rng), np.arange(len(positions)), rows, columns)


def presses(tool: str, positions: list, half: tuple, deepest: float, count: int, rng: np.random.Generator) -> list:
    """Acts of a tool that is pressed in at each of the positions (x, y), m, to count increasing depths up to deepest, m.

    half: half size (x, y) of the sheet, m; near the border the depth is limited to 0.85 of the distance to it.
    """
    acts = []
    for x, y in positions:
        limit = min(deepest, 0.85 * min(half[0] - abs(x), half[1] - abs(y)))
        depths = np.sort((np.arange(count) + rng.uniform(0.1, 1.0, count)) * limit / count)
        acts.append(partial(press, tool, x, y, *depths.tolist()))
    return acts


def stage_presses(tool: str, positions: list, depths: tuple, half: tuple, times: int, rng: np.random.Generator) -> tuple[Act, ...]:
    """A stage presses a tool in at each of the positions (x, y), m, several times, with the stage's error, and stops at each of the
    depths, m, that presses allows; as specimen.by_the_step."""
    acts = []
    for x, y in np.repeat(positions, times, axis=0) + rng.normal(0, SIMULATION.stage_sigma, (len(positions) * times, 2)):
        limit = 0.85 * min(half[0] - abs(x), half[1] - abs(y))
        acts.append(partial(press, tool, x, y, *(depth for depth in depths if depth <= limit), move=0.25, hold=0.25))
    return one_after_the_other(acts, untouched=1.75, pause=0.5)


def drags(tool: str, count: int, half: tuple, depths: tuple, length: float, rng: np.random.Generator) -> list:
    """Acts of a tool that is pressed in at random near the centre of a sheet of half size half (x, y), m, to a random depth in depths
    (smallest, largest), m, and then moves by a length, m, in a random direction."""
    acts = []
    for _ in range(count):
        position = rng.uniform(-0.35, 0.35, 2) * half
        angle = rng.uniform(0, 2 * np.pi)
        acts.append(partial(drag, tool, position, rng.uniform(*depths), (length * np.cos(angle), length * np.sin(angle))))
    return acts


def grid(half: tuple, columns: int, rows: int) -> list:
    """Positions (x, y), m, on a regular grid between -half and half (x, y), m."""
    return [(x, y) for y in np.linspace(-half[1], half[1], rows) for x in np.linspace(-half[0], half[0], columns)]


def on_markers(at: tuple, of: tuple, columns: int, rows: int, pitch: tuple) -> list:
    """Positions (x, y), m, of the markers in the columns at and the rows of; columns, rows, pitch (x, y), m: of the print."""
    return [((column - (columns - 1) / 2) * pitch[0], (row - (rows - 1) / 2) * pitch[1]) for row in of for column in at]


def scattered(half: tuple, count: int, rng: np.random.Generator) -> list:
    """Random positions (x, y), m, between -half and half (x, y), m."""
    return list(rng.uniform(-1, 1, (count, 2)) * half)
