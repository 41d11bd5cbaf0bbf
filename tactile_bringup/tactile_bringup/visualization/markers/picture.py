# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Renders markers as a picture, by the rules of RViz that matter, for machines without RViz."""
from __future__ import annotations

from collections.abc import Iterable

import cv2
import numpy as np
from visualization_msgs.msg import Marker

from ..orbit_view import OrbitView, view_of
from ..tiles import BACK

_SHIFT = 4  # OpenCV's fixed-point coordinates: 4 fractional bits, 1/16 px


def marker_picture(markers: Iterable[Marker], size: tuple[int, int]) -> np.ndarray | None:
    """Render the added markers as (height, width, 3) uint8 BGR, from the view of the sensors' RViz files; None without markers.

    size: (width, height), px. Surfaces are drawn first, from the farthest triangle to the nearest, then spheres, lines and arrows.
    """
    added = sorted((m for m in markers if m.action == Marker.ADD), key=lambda m: m.type != Marker.TRIANGLE_LIST)
    points = [_points(marker) for marker in added if marker.points]
    points += [np.array([(m.pose.position.x, m.pose.position.y, m.pose.position.z)]) for m in added if m.text and points]
    if not points:
        return None
    view, picture = view_of(np.vstack(points), size), np.full((size[1], size[0], 3), BACK, np.uint8)
    for marker in added:
        layer = picture.copy()
        _DRAWN.get(marker.type, _nothing)(layer, marker, view)
        one_each = marker.colors and len(marker.colors) == len(marker.points)  # a triangle with one colour is opaque in RViz
        opacity = marker.colors[0].a if one_each else marker.color.a
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
    if len(marker.colors) == 3 * len(corners):
        shades = 255 * np.array([(c.b, c.g, c.r) for c in marker.colors]).reshape(-1, 3, 3).mean(axis=1)
        _faces(picture, corners, shades.tolist(), view)
    else:
        _faces(picture, corners, _colours(marker, len(corners)), view)


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


def _text(picture: np.ndarray, marker: Marker, view: OrbitView) -> None:
    at = marker.pose.position
    (place,), (depth,) = view.project(np.array([(at.x, at.y, at.z)]), picture.shape[1::-1])
    letters = 0.5 * marker.scale.z * picture.shape[0] / (np.tan(np.pi / 8) * depth)  # px
    lines, size = marker.text.split('\n'), letters / 30  # OpenCV's letters are some 30 px high at size 1
    left = place[0] - 0.5 * max(cv2.getTextSize(line, cv2.FONT_HERSHEY_SIMPLEX, size, 1)[0][0] for line in lines)
    for k, line in enumerate(lines, 1):
        corner = round(left), round(place[1] + letters * (k - 0.5 * len(lines)))
        cv2.putText(picture, line, corner, cv2.FONT_HERSHEY_SIMPLEX, size, _bgr(marker.color), 1, cv2.LINE_AA)


def _nothing(picture: np.ndarray, marker: Marker, view: OrbitView) -> None:
    """Draw nothing: single spheres are omitted."""


_DRAWN = {Marker.TRIANGLE_LIST: _triangles, Marker.SPHERE_LIST: _spheres, Marker.LINE_LIST: _lines, Marker.LINE_STRIP: _lines,
          Marker.ARROW: _arrow, Marker.TEXT_VIEW_FACING: _text}
