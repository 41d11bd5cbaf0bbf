# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Origin of a lattice on the printed grid: its first row and column, and whether that is certain (kernel anchor_lattice:
src/dots/index/grid_anchor.cpp).

One image determines it when all printed rows and columns are seen. If an outer row is missing, it either left the image (its position lies
outside) or the indices of the last frame continue (motion below half a pitch). A shift by exactly one pitch with an occluded outer row is
unobservable; such frames are rejected.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from tactile_perception import _core

_NAMES = ('rows', 'columns')
_REASONS = ('', 'no {name} with enough dots', '{seen} {name} of dots seen, {printed} configured: is it another pattern?',
            'only {seen} of {printed} {name} seen; the border and the last frame disagree on which',
            'only {seen} of {printed} {name} seen, and which is ambiguous')  # by the kernel's fault
_NO_DOTS = np.zeros((0, 2)), np.zeros(0, np.int64)


@dataclass
class Anchor:
    """id: (N,) int64, row * columns + column on the printed grid, -1 for none; reason: empty, or why no dot has one."""

    id: np.ndarray
    reason: str


def anchor_lattice(uv: np.ndarray, rc: np.ndarray, member: np.ndarray, shape: tuple[int, int], pitch: float,
                   previous: tuple[np.ndarray, np.ndarray] | None = None, image_size: tuple[int, int] | None = None) -> Anchor:
    """Indices of dots at uv (N, 2) px on a printed grid of shape (rows, columns).

    rc: (N, 2) int64, relative rows and columns, valid where member (N,) bool; pitch: px; previous: uv (M, 2) px and id (M,) int64 of the
    last certain frame; image_size: (width, height) px.
    """
    width, height = image_size or (0, 0)
    id, fault, axis, seen = _core.anchor_lattice(uv, rc, member, *(previous or _NO_DOTS), rows=shape[0], columns=shape[1], pitch=pitch,
                                                 width=width, height=height)
    return Anchor(id, _REASONS[fault].format(name=_NAMES[axis], seen=seen, printed=shape[axis]))
