# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Renders markers as a picture, similar to RViz, for machines without RViz."""
from __future__ import annotations

from collections.abc import Iterable

import cv2
import numpy as np
from visualization_msgs.msg import Marker

from .. import mesh
from ..orbit_view import OrbitView, view_of
from ..tiles import BACK

_SURFACES = (Marker.TRIANGLE_LIST, Marker.CUBE_LIST)
_SHIFT = 4  # OpenCV's fixed-point coordinates: 4 fractional bits, 1/16 px


def marker_picture(markers: Iterable[Marker], size: tuple[int, int]) -> np.ndarray | None:
    """Render the added markers as (height, width, 3) uint8 BGR, from the view of the sensors' RViz files; None without markers.

    size: (width, height), px. Surfaces are drawn first, from the farthest triangle to the nearest, then spheres, lines and arrows.
    """
    added = sorted((m for m in markers if m.action == Marker.ADD), key=lambda m: (m.type not in _SURFACES, m.ns))
    points = [_points(marker) for marker in added if marker.points]
    if not points:
        return None
    view, picture = view_of(np.vstack(points), size), np.full((size[1], size[0], 3), BACK, np.uint8)
    for marker in added:
        layer = picture.copy()
        _DRAWN.get(marker.type, _nothing)(layer, marker, view)
        opacity = marker.colors[0].a if marker.colors else marker.color.a
        cv2.addWeighted(layer, opacity, picture, 1 - opacity, 0.0, dst=picture)
    return picture


def _points(marker: Marker) -> np.ndarray:
    return np.array([(p.x, p.y, p.z) for p in marker.points], float).reshape(-1, 3)


def _bgr(colour) -> tuple[int, int, int]:
    return tuple(round(255 * part) for part in (colour.b, colour.g, colour.r))


def _colours(marker: Marker, count: int) -> list[tuple[int, int, int]]:
    """Colours of count elements: one each, or the marker's own for all."""
    return [_bgr(colour) for colour in marker.colors] if len(marker.colors) == count else [_bgr(marker.color)] * count


def _placed(picture: np.ndarray, points: np.ndarray, view: OrbitView) -> tuple[np.ndarray, np.ndarray]:
    places, depth = view.project(points, picture.shape[1::-1])
    return np.round(places * (1 << _SHIFT)).astype(np.int64).clip(-2**30, 2**30).astype(np.int32), depth


def _faces(picture: np.ndarray, corners: np.ndarray, colours: list, view: OrbitView) -> None:
    """Fill the faces with corners (N, n, 3), m, from the farthest to the nearest."""
    places, depth = _placed(picture, corners.reshape(-1, 3), view)
    places, depth = places.reshape(corners.shape[0], -1, 2), depth.reshape(corners.shape[0], -1).mean(axis=1)
    area = np.abs(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])).max(axis=1)
    for k in (k for k in np.argsort(-depth) if area[k] > 0):  # degenerate at a pole, where two corners coincide
        cv2.fillConvexPoly(picture, places[k], colours[k], cv2.LINE_AA, _SHIFT)


def _triangles(picture: np.ndarray, marker: Marker, view: OrbitView) -> None:
    corners = _points(marker).reshape(-1, 3, 3)
    colours = _colours(marker, len(corners))
    if not marker.colors:  # RViz itself lights triangles without colours of their own
        lit = mesh.light(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
        colours = [tuple(float(part * light) for part in colour) for colour, light in zip(colours, lit)]
    _faces(picture, corners, colours, view)


def _cubes(picture: np.ndarray, marker: Marker, view: OrbitView) -> None:
    """Draw the upper faces."""
    half = 0.5 * np.array([(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]) * (marker.scale.x, marker.scale.y, marker.scale.z)
    _faces(picture, _points(marker)[:, None] + half, _colours(marker, len(marker.points)), view)


def _spheres(picture: np.ndarray, marker: Marker, view: OrbitView) -> None:
    places, depth = _placed(picture, _points(marker), view)
    radius = np.maximum(1.5, 0.25 * marker.scale.x * picture.shape[0] / (np.tan(np.pi / 8) * depth))
    colours = _colours(marker, len(places))
    for k in np.argsort(-depth):
        cv2.circle(picture, places[k].tolist(), round(float(radius[k]) * (1 << _SHIFT)), colours[k], -1, cv2.LINE_AA, _SHIFT)


def _lines(picture: np.ndarray, marker: Marker, view: OrbitView) -> None:
    places, _ = _placed(picture, _points(marker), view)
    ends = places.reshape(-1, 2, 2) if marker.type == Marker.LINE_LIST else places[None]
    cv2.polylines(picture, list(ends), False, _bgr(marker.color), 2, cv2.LINE_AA, _SHIFT)


def _arrow(picture: np.ndarray, marker: Marker, view: OrbitView) -> None:
    (start, end), _ = _placed(picture, _points(marker), view)
    start, end = ((place / (1 << _SHIFT)).round().astype(int).tolist() for place in (start, end))
    cv2.arrowedLine(picture, start, end, _bgr(marker.color), 2, cv2.LINE_AA, tipLength=0.25)


def _nothing(picture: np.ndarray, marker: Marker, view: OrbitView) -> None:
    """Draw nothing: text and single spheres are omitted."""


_DRAWN = {Marker.TRIANGLE_LIST: _triangles, Marker.CUBE_LIST: _cubes, Marker.SPHERE_LIST: _spheres, Marker.LINE_LIST: _lines,
          Marker.LINE_STRIP: _lines, Marker.ARROW: _arrow}
