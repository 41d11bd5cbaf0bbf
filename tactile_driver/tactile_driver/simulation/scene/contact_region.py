# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The true contact region, bounded by half the contact pressure between the nodes and by the surface at the edge of a tool."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ..skin.contact import SkinState
from ..skin.grid import Skin, cross
from ..skin.motion import Pose
from ..skin.tools import Tool

#: Subdivisions of a cell; chosen.
_FINE = 4
#: In node spacings: the largest gap that counts as contact, and the scale that makes the gap dimensionless; chosen.
_ON_TOOL, _GAP_SCALE = 0.0237, 0.0713


@dataclass
class Region:
    """outlines, holes: lists of (k, 3) m; area: m^2, without holes; centroid: (3,) m; normal: (3,) unit, outwards; fullness: (n, n),
    relative contact pressure of the nodes, 1 inside and 0 outside; part_centroids: (parts, 3) m, of what each part of the tool touches,
    NaN of one that does not."""

    outlines: list
    holes: list
    area: float
    centroid: np.ndarray
    normal: np.ndarray
    fullness: np.ndarray
    part_centroids: np.ndarray


def _between(count: int) -> np.ndarray:
    """Matrix (fine, count) of linear interpolation from count nodes to a grid with _FINE subdivisions."""
    at = np.arange((count - 1) * _FINE + 1) / _FINE
    return np.maximum(1 - np.abs(at[:, None] - np.arange(count)), 0)


def fullness_of(skin: Skin, state: SkinState, tool: Tool) -> np.ndarray:
    """Contact pressure (n, n) of the nodes relative to the typical pressure in the contact, clipped to 0 to 1.

    The fluid pressure is typical of a flat face. A round tip adds a uniform contribution of the skin's tension, so the median is typical.
    """
    areas = skin.area_vectors(state.shape)[skin.inner][state.touching]
    pressed = -np.einsum('ij,ij->i', state.force, areas) / np.maximum(np.einsum('ij,ij->i', areas, areas), 1e-30)
    usual = state.pressure if tool.tip_radius is None or not len(pressed) else max(np.median(pressed), state.pressure, 1e-30)
    inner = np.zeros(skin.inner.sum())
    inner[state.touching] = np.clip(pressed / usual, 0, 1)
    return np.pad(inner.reshape(skin.nodes - 2, -1), 1)


def find_region(skin: Skin, state: SkinState, tool: Tool, pose: Pose) -> Region | None:
    """The contact region of the tool in this state; None without contact."""
    fullness = fullness_of(skin, state, tool)
    rows, columns = np.nonzero(fullness)
    if not len(rows):
        return None
    box = slice(max(rows.min() - 2, 0), rows.max() + 3), slice(max(columns.min() - 2, 0), columns.max() + 3)
    part = state.shape[box]
    up, across = _between(part.shape[0]), _between(part.shape[1])
    places = np.stack([up @ part[..., k] @ across.T for k in range(3)], axis=-1)
    gaps = tool.part_distances(pose.to_tool(places))
    gap = gaps.min(axis=0)
    full = np.ascontiguousarray(up @ fullness[box] @ across.T)
    # A contact line narrower than a cell presses only on every other node: close the gaps.
    full = cv2.morphologyEx(full, cv2.MORPH_CLOSE, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * _FINE + 1, 2 * _FINE + 1)))
    outside = np.maximum(0.5 - full, (gap / skin.spacing - _ON_TOOL) / _GAP_SCALE)
    return _measure(places, outside, fullness, gaps)


def _measure(places: np.ndarray, outside: np.ndarray, fullness: np.ndarray, gaps: np.ndarray) -> Region | None:
    """Outlines and moments of the region where outside (a, b) is negative; places: (a, b, 3) m, fine grid; gaps: (parts, a, b) m, to the
    parts of the tool. None for an empty region."""
    slope = np.stack(np.gradient(outside), axis=-1)
    steep = np.sqrt((slope**2).sum(axis=-1)) + 1e-9
    cover = np.clip(0.5 - outside / steep, 0, 1)
    patches = cross(*np.gradient(places, axis=(1, 0)))
    sizes = np.sqrt((patches**2).sum(axis=-1)) * cover
    area = float(sizes.sum())
    if area <= 0:
        return None
    centroid = np.einsum('ab,abk->k', sizes, places) / area
    centroids = centroid[None] if len(gaps) == 1 else _part_centroids(places, sizes, gaps)
    normal = np.einsum('ab,abk->k', cover, patches)
    outlines, holes = _contours(places, outside, slope, steep)
    return Region(outlines, holes, area, centroid, normal / np.linalg.norm(normal), fullness, centroids)


def _part_centroids(places: np.ndarray, sizes: np.ndarray, gaps: np.ndarray) -> np.ndarray:
    """(parts, 3) m, of the places that each part is nearest to, NaN of one that has none; sizes: (a, b) m^2, of contact."""
    of_part = sizes * (gaps == gaps.min(axis=0))
    area = of_part.sum(axis=(1, 2))[:, None]
    return np.where(area > 0, np.einsum('pab,abk->pk', of_part, places) / np.maximum(area, 1e-30), np.nan)


def _contours(places: np.ndarray, outside: np.ndarray, slope: np.ndarray, steep: np.ndarray) -> tuple[list, list]:
    """Outlines and holes (k, 3), m: border cells of the region, moved along the gradient to the zero of outside."""
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
    """Points (k, 3) of the fine grid (a, b, 3) at (row, column) coordinates where (k, 2), by bilinear interpolation."""
    top = np.array(places.shape[:2]) - 2
    low = np.clip(np.floor(where).astype(int), 0, top)
    part = (where - low)[:, :, None]
    r, c = low.T
    near = places[r, c] * (1 - part[:, 1]) + places[r, c + 1] * part[:, 1]
    far = places[r + 1, c] * (1 - part[:, 1]) + places[r + 1, c + 1] * part[:, 1]
    return near * (1 - part[:, 0]) + far * part[:, 0]
