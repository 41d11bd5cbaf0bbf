# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Picture of all sensors of a hand, one tile per sensor. Needs no ROS."""
from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np

from . import colours

_WIDTH, _HEIGHT, _BAR = 480, 360, 32  # px, chosen
#: Background (blue, green, red), that of the RViz configurations.
BACK = 38, 32, 32
_BAR_COLOUR, _GREY = (60, 52, 48), (150, 150, 150)
_FONT = cv2.FONT_HERSHEY_SIMPLEX


#: Size (width, height), px, of the scene beside the sensor's own picture.
SCENE = _WIDTH, _HEIGHT


def tile(title: str, picture: np.ndarray | None, scene: np.ndarray | None = None) -> np.ndarray:
    """Tile (H, 2 W, 3) uint8 BGR: title, and the picture (h, w, 3) scaled to fit; None for a note that nothing came.

    scene: (360, 480, 3) at the right, as RViz shows the sensor; None for an empty half.
    """
    made = np.full((_BAR + _HEIGHT, 2 * _WIDTH, 3), BACK, np.uint8)
    if scene is not None:
        made[_BAR:, _WIDTH:] = scene
    made[:_BAR] = _BAR_COLOUR
    _write(made, title, (10, 22), 0.6, colours.bgr(colours.TEXT))
    if picture is None:
        _write(made, 'nothing came', (160, _BAR + _HEIGHT // 2), 0.7, _GREY)
        return made
    scale = min(_WIDTH / picture.shape[1], _HEIGHT / picture.shape[0])
    size = round(picture.shape[1] * scale), round(picture.shape[0] * scale)
    fitted = cv2.resize(picture, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_NEAREST)
    left, top = (_WIDTH - size[0]) // 2, _BAR + (_HEIGHT - size[1]) // 2
    made[top:top + size[1], left:left + size[0]] = fitted
    return made


def sheet(tiles: Sequence[np.ndarray]) -> np.ndarray:
    """Arrange tiles of equal size in a nearly square sheet."""
    columns = math.ceil(math.sqrt(len(tiles)))
    missing = [np.full_like(tiles[0], BACK)] * (-len(tiles) % columns)
    filled = [*tiles, *missing]
    return np.vstack([np.hstack(filled[k:k + columns]) for k in range(0, len(filled), columns)])


def _write(image: np.ndarray, text: str, place: tuple[int, int], size: float, colour: tuple[int, int, int]) -> None:
    cv2.putText(image, text, place, _FONT, size, colour, 1, cv2.LINE_AA)
