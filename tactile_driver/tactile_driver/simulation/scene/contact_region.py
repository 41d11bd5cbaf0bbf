# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The true contact region: between the nodes by their pressures' half level, at a tool's edge by the tool's own surface."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ..skin.contact import SkinState
from ..skin.grid import Skin, cross
from ..skin.motion import Pose
from ..skin.tools import Tool

_FINE = 4
#: of the nodes' spacing: the skin counts as lying on the tool within the first of these; the second makes a number of the gap.
_ON_TOOL, _GAP_SCALE = 0.0237, 0.0713


@dataclass
class Region:
    """outlines, holes: lists of (k, 3) m; area m^2 without holes; centroid (3,) m; normal (3,) unit outwards; fullness (n, n): share of its
    neighbourhood's contact pressure at each node, 1 inside and 0 outside."""

    outlines: list
    holes: list
    area: float
    centroid: np.ndarray
    normal: np.ndarray
    fullness: np.ndarray


def _between(count: int) -> np.ndarray:
    """Linear interpolation (fine, count) from count nodes to _FINE steps between them."""
    at = np.arange((count - 1) * _FINE + 1) / _FINE
    return np.maximum(1 - np.abs(at[:, None] - np.arange(count)), 0)


def fullness_of(skin: Skin, state: SkinState, tool: Tool) -> np.ndarray:
    """(n, n): each node's contact pressure over the pressure that is usual in the contact, 0 to 1.

    A flat face is pressed by the fluid alone; a round tip adds the skin's tension, the same everywhere, so the median is usual there.
    """
    areas = skin.area_vectors(state.shape)[skin.inner][state.touching]
    pressed = -np.einsum('ij,ij->i', state.force, areas) / np.maximum(np.einsum('ij,ij->i', areas, areas), 1e-30)
    usual = state.pressure if tool.tip_radius is None or not len(pressed) else max(np.median(pressed), state.pressure)
    inner = np.zeros(skin.inner.sum())
    inner[state.touching] = np.clip(pressed / usual, 0, 1)
    return np.pad(inner.reshape(skin.nodes - 2, -1), 1)


def find_region(skin: Skin, state: SkinState, tool: Tool, pose: Pose) -> Region | None:
    """The region that the tool touches in this state; None where that is nothing."""
    fullness = fullness_of(skin, state, tool)
    rows, columns = np.nonzero(fullness)
    if not len(rows):
        return None
    box = slice(max(rows.min() - 2, 0), rows.max() + 3), slice(max(columns.min() - 2, 0), columns.max() + 3)
    part = state.shape[box]
    up, across = _between(part.shape[0]), _between(part.shape[1])
    places = np.stack([up @ part[..., k] @ across.T for k in range(3)], axis=-1)
    gap = tool.distance(pose.to_tool(places))
    full = np.ascontiguousarray(up @ fullness[box] @ across.T)
    # A line of contact narrower than a cell presses on every other node only: close it along its way.
    full = cv2.morphologyEx(full, cv2.MORPH_CLOSE, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * _FINE + 1, 2 * _FINE + 1)))
    outside = np.maximum(0.5 - full, (gap / skin.spacing - _ON_TOOL) / _GAP_SCALE)
    return _measure(places, outside, fullness)


def _measure(places: np.ndarray, outside: np.ndarray, fullness: np.ndarray) -> Region | None:
    """Outlines and moments of where outside (a, b) is negative, on the skin's fine places (a, b, 3)."""
    slope = np.stack(np.gradient(outside), axis=-1)
    steep = np.sqrt((slope**2).sum(axis=-1)) + 1e-9
    cover = np.clip(0.5 - outside / steep, 0, 1)
    patches = cross(*np.gradient(places, axis=(1, 0)))
    sizes = np.sqrt((patches**2).sum(axis=-1)) * cover
    area = float(sizes.sum())
    if area <= 0:
        return None
    centroid = np.einsum('ab,abk->k', sizes, places) / area
    normal = np.einsum('ab,abk->k', cover, patches)
    outlines, holes = _contours(places, outside, slope, steep)
    return Region(outlines, holes, area, centroid, normal / np.linalg.norm(normal), fullness)


def _contours(places: np.ndarray, outside: np.ndarray, slope: np.ndarray, steep: np.ndarray) -> tuple[list, list]:
    """Closed lines (k, 3) m about and inside the region: border cells, each moved along the slope to where outside is zero."""
    lines, family = cv2.findContours((outside < 0).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    found = [], []
    for line, kin in zip(lines, [] if family is None else family[0]):
        if len(line) < 4:
            continue
        column, row = line[:, 0, 0], line[:, 0, 1]
        step = np.clip(-outside[row, column] / steep[row, column], 0, 1)[:, None] * slope[row, column] / steep[row, column, None]
        found[int(kin[3] >= 0)].append(_at(places, np.stack([row, column], axis=1) + step))
    return found


def _at(places: np.ndarray, where: np.ndarray) -> np.ndarray:
    """Places (k, 3) at rows and columns where (k, 2) of the fine grid (a, b, 3), linearly between its points."""
    top = np.array(places.shape[:2]) - 2
    low = np.clip(np.floor(where).astype(int), 0, top)
    part = (where - low)[:, :, None]
    r, c = low.T
    near = places[r, c] * (1 - part[:, 1]) + places[r, c + 1] * part[:, 1]
    far = places[r + 1, c] * (1 - part[:, 1]) + places[r + 1, c + 1] * part[:, 1]
    return near * (1 - part[:, 0]) + far * part[:, 0]
