# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A worn marker sheet with one camera, with markers of any size, number and layout; and its scenes."""
from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from ...errors import BadArgument
from .marker_sheet import built_camera
from ..optics.pattern import DotPattern, uneven
from ..optics.rendering import Imaging
from ..optics.wear import Wear
from ..optics.worn_rendering import SideLight, WornRenderer
from ..scene.specimen import Act, Script, Specimen, drag, one_after_the_other, press
from ..skin.surfaces import Sheet

_HALF = (0.030, 0.0225)
_FOCAL, _DISTANCE = 508.0, 0.0585
_BRIGHTEST = 200.0  # grey levels of the brighter of ink and skin where the light is brightest; chosen
_TIP = 'ball_6mm'
#: Least distance of two markers, in marker diameters; chosen.
_NEAREST = 1.25
#: Random positions tried per marker; chosen.
_TRIES = 300


@dataclass(frozen=True)
class Print:
    """Appearance of the markers.

    diameter: px, in the image of 640 x 480; count: approximate number; layout: name in LAYOUTS; bright: bright markers on a dark sheet,
    else dark markers on a bright sheet; contrast: brighter over darker; uneven: relative standard deviation of the sizes; light: ratio of
    the brightest to the darkest part of the sheet; blur: px, standard deviation; wear: 0 to 1 (Wear.of).
    """

    diameter: float = 24.0
    count: int = 150
    layout: str = 'grid'
    bright: bool = True
    contrast: float = 3.5
    uneven: float = 0.06
    light: float = 3.0
    blur: float = 1.0
    wear: float = 1.0


def worn_sheet(seed: int, width: int = 640, print_: Print = Print()) -> Specimen:
    """A sheet with one camera.

    seed: of manufacturing tolerances, wear and noise; width: of the image, px. Raises BadArgument for an unknown layout.
    """
    rng = np.random.default_rng([seed, 15])
    sheet = Sheet(2 * _HALF[0], 2 * _HALF[1], 48.0, 1.3, 1.5e-4, 65)
    camera = built_camera(rng, _FOCAL, (318.0, 241.0), (-0.085, 0.013, 3e-4, -2e-4, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, _DISTANCE),
                          (640, 480), width)
    pattern = _pattern(sheet, print_, rng)
    level, other = _BRIGHTEST * np.array([1.0, 1 / print_.contrast])[::1 if not print_.bright else -1]
    lights = SideLight(tuple(level * rng.uniform(0.75, 1.0, 3)), print_.light, rng.uniform(0, 2 * np.pi), _HALF)
    imaging = Imaging(blur=print_.blur, read_noise=1.2, shot_noise=0.02, ink=1 - other / level, housing=2.0, cosine=3.0, stop=0.1)
    renderer = WornRenderer(sheet, camera, lights, imaging, seed, pattern, Wear.of(print_.wear, seed))
    return Specimen('areal_single', sheet, pattern, (camera,), (renderer,))


def _pattern(sheet: Sheet, print_: Print, rng: np.random.Generator) -> DotPattern:
    if print_.layout not in LAYOUTS:
        raise BadArgument(f'simulation: layout {print_.layout!r} is unknown; choose one of {", ".join(LAYOUTS)}')
    radius = print_.diameter / 2 * _DISTANCE / _FOCAL
    xy, rows, columns = LAYOUTS[print_.layout](print_.count, 2 * _NEAREST * radius, np.array(_HALF) - 1.4 * radius, rng)
    places = np.column_stack([xy, np.zeros(len(xy))])
    return DotPattern(sheet, places, uneven(radius, print_.uneven, len(places), rng), np.arange(len(places)), rows, columns)


def _grid(count: int, nearest: float, half: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, int, int]:
    """Positions (K, 2), m, rows and columns of a grid of equal pitches, at least nearest, m, within -half to half (x, y), m."""
    pitch = max(np.sqrt(4 * half[0] * half[1] / count), nearest)
    columns, rows = (max(int(1 + 2 * h / pitch), 2) for h in half)
    v, u = np.mgrid[:rows, :columns].reshape(2, -1)
    xy = (np.stack([u, v], axis=1) - (np.array([columns, rows]) - 1) / 2) * pitch
    return xy + rng.normal(0, 0.01 * pitch, xy.shape), rows, columns


def _hexagonal(count: int, nearest: float, half: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, int, int]:
    """As _grid, with every second row shifted by half a pitch; rows and columns are 0."""
    pitch = max(np.sqrt(4 * half[0] * half[1] / count * 2 / np.sqrt(3)), nearest)
    v, u = np.mgrid[-60:61, -60:61].reshape(2, -1)
    xy = np.stack([(u + (v % 2) / 2) * pitch, v * pitch * np.sqrt(3) / 2], axis=1)
    xy = xy[(np.abs(xy) <= half).all(axis=1)]
    return xy + rng.normal(0, 0.01 * pitch, xy.shape), 0, 0


def _random(count: int, nearest: float, half: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, int, int]:
    """As _grid, at random positions; fewer than count if there is no room for more; rows and columns are 0."""
    xy = np.zeros((0, 2))
    for _ in range(_TRIES * count):
        place = rng.uniform(-half, half)
        if len(xy) < count and (np.hypot(*(xy - place).T) > nearest).all():
            xy = np.vstack([xy, place])
    return xy, 0, 0


LAYOUTS = {'grid': _grid, 'hexagonal': _hexagonal, 'random': _random}


def _demo() -> tuple[Act, ...]:
    """Presses at the centre and at a side, and a drag."""
    return one_after_the_other([partial(press, _TIP, 0.004, -0.003, 0.003, 0.008), partial(press, _TIP, -0.016, 0.008, 0.004, 0.008),
                                partial(drag, _TIP, -0.012, -0.006, 0.006, 0.022, 0.008)])


def _script(print_: Print) -> Script:
    return Script(partial(worn_sheet, print_=print_), _demo())


WORN_SHEET_SCENES: dict[str, Script] = {
    'worn_grid': _script(Print()),
    'worn_hexagonal': _script(Print(layout='hexagonal')),
    'worn_random_dark': _script(Print(layout='random', bright=False, count=110)),
}
