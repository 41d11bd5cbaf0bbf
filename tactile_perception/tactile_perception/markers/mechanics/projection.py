# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Projection of the markers of a pressed sheet onto the viewing plane, and its derivatives."""
from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from .mesh import locate
from .reduced_model import LibraryPlan, SheetLibrary

_DISC = np.sqrt(0.5) * np.array([[1.0, 0], [0, 1], [-1, 0], [0, -1]])  # quadrature points of a unit disc, exact to cubic terms


@dataclass(frozen=True)
class Press:
    """A round tip on the sheet. place: (2,) m, of first contact; depth: m, as if it were alone; log_radius: log of its radius over the
    calibrated one; dragged: (2,) m, lateral displacement of the sheet under it since first contact.
    """

    place: np.ndarray
    depth: float
    log_radius: float = 0.0
    dragged: tuple[float, float] = (0.0, 0.0)

    @property
    def vector(self) -> np.ndarray:
        """(6,) place, depth, log radius, dragged."""
        return np.array([*self.place, self.depth, self.log_radius, *self.dragged])


def read_press(library: SheetLibrary, press: Press, rest: np.ndarray, fields: np.ndarray | None = None) -> np.ndarray:
    """(K, 3, 3): displacement of the sheet, m, at rest (K, 2), m, and its derivatives by x and y; fields: of the press, if computed
    already."""
    fields = fields_of(library, press) if fields is None else fields
    deformed = read_field(fields[:, 0], library.plan, press.place, rest)
    if any(press.dragged):
        deformed[..., :2] -= deformed[..., 2:] * (np.asarray(press.dragged) / press.depth)
    return deformed


def fields_of(library: SheetLibrary, press: Press) -> np.ndarray:
    """The library's fields of a press."""
    return library.fields(press.place, press.depth, press.log_radius)


def read_field(field: np.ndarray, plan: LibraryPlan, place: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Displacement and its derivatives by x and by y, (K, 3, 3), at rest (K, 2), m, of the field with coefficients (side * side, 3) on
    uniform B-splines, of a press at place.
    """
    node, weights, _ = _weights(plan, place, rest)
    return _by_marker(_products(weights, 3)) @ field.take(node, axis=0)


def read_derivatives(library: SheetLibrary, press: Press, rest: np.ndarray, fields: np.ndarray | None = None) -> np.ndarray:
    """(K, 3, 3, 7): as read_press, then the derivatives of that by the press's vector.

    A drag falls off towards the clamp as depth does: to first order both solve the same equation.
    """
    node, weights, carried = _weights(library.plan, press.place, rest)
    local = (fields_of(library, press) if fields is None else fields).reshape(-1, 15).take(node, axis=0)
    products = _products(weights, 6)
    moving = np.empty((2, 3, *products.shape[1:]))  # derivatives of the products by the place
    for axis, along in ((0, [1, 3, 4]), (1, [2, 4, 5])):
        np.multiply(products[along], carried[axis, 0], out=moving[axis])
        moving[axis, 1 + axis] += products[along[0]] * carried[axis, 1]
    read = np.empty((len(rest), 3, 3, 7))
    read[..., :5] = (_by_marker(products[:3]) @ local).reshape(-1, 3, 5, 3).transpose(0, 1, 3, 2)
    read[..., 1:3] += (_by_marker(moving.reshape(6, *products.shape[1:])) @ local[..., :3]).reshape(-1, 2, 3, 3).transpose(0, 2, 3, 1)
    read[..., 5:] = 0.0
    read[:, :, 0, 5] = read[:, :, 1, 6] = read[:, :, 2, 0] / -press.depth
    if any(press.dragged):
        for axis in (0, 1):
            read[:, :, axis, :3] -= read[:, :, 2, :3] * (press.dragged[axis] / press.depth)
    return read


_ORDERS = [0, 1, 0, 2, 1, 0], [0, 0, 1, 0, 1, 2]  # along x and along y: value, by x, by y, by xx, xy, yy


def _products(weights: np.ndarray, count: int) -> np.ndarray:
    """(count, 9, K) products of weights (3, 3, 2, K) along x and along y, of the first count of _ORDERS."""
    x, y = (weights.take(orders[:count], axis=0)[:, :, axis] for axis, orders in enumerate(_ORDERS))
    return (x[:, :, None] * y[:, None]).reshape(count, 9, -1)


def _by_marker(products: np.ndarray) -> np.ndarray:
    """(K, count, 9) contiguous, from (count, 9, K)."""
    orders, functions, markers = products.shape
    return np.ascontiguousarray(products.reshape(orders * functions, markers).T).reshape(markers, orders, functions)


def _weights(plan: LibraryPlan, place: np.ndarray, rest: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes (K, 9) of the B-splines at rest; weights (3, 3, 2, K): value, first and second derivative, 1/m, 1/m^2, of three splines along
    x and y; and derivatives of the mesh coordinates by the place pressed, (2, 2, K): relative, and their own by x or y, 1/m.
    """
    xi, cubic = locate(rest.T, place, plan.half, plan.scale)
    square, distance = xi * xi, np.abs(xi)
    slope = 1 / (plan.scale + 3 * cubic * square)
    by_place = plan.n * slope
    bend = -6 * cubic * xi * slope * slope * by_place
    span = (xi + 1) * plan.n
    first = np.minimum(span.astype(int), 2 * plan.n - 1)
    f = span - first
    left, curve = 1 - f, by_place * by_place
    weights = np.empty((3, 3, *xi.shape))
    weights[0, 0], weights[0, 2] = 0.5 * left * left, 0.5 * f * f
    weights[0, 1] = 1 - weights[0, 0] - weights[0, 2]
    weights[1, 0], weights[1, 2] = -left * by_place, f * by_place
    weights[2, 0], weights[2, 2] = curve - left * bend, curve + f * bend
    weights[1:, 1] = -(weights[1:, 0] + weights[1:, 2])
    node = (first[0] * (2 * plan.n + 2) + first[1])[:, None] + _near_nodes(2 * plan.n + 2)
    carried = np.empty((2, 2, xi.shape[1]))
    carried[:, 0], carried[:, 1] = square * distance - 1, 3 * distance * xi * slope
    return node, weights, carried


@lru_cache(maxsize=8)
def _near_nodes(side: int) -> np.ndarray:
    """(9,) indices of the nonzero splines on the first span along x and y, of side splines along each."""
    three = np.arange(3)
    return (three[:, None] * side + three).ravel()


def appearance(deformed: np.ndarray, rest: np.ndarray, eye: np.ndarray) -> np.ndarray:
    """Shift, m, and growth (..., K, 3) in the plane z = 0 of points at rest (K, 2), m, seen from eye (K, 3), m.

    deformed: (..., K, 3, 3) displacement and derivatives, as of read_field. Growth is the log of the ratio of the areas.
    """
    moved, by_x, by_y = deformed[..., 0, :], deformed[..., 1, :], deformed[..., 2, :]
    nearer = 1 / (eye[:, 2] - moved[..., 2])
    scale = eye[:, 2] * nearer
    offset = rest + moved[..., :2] - eye[:, :2]
    seen = np.empty(moved.shape)
    seen[..., :2] = moved[..., :2] + offset * (scale - 1)[..., None]
    along_x = by_x[..., :2] + [1, 0] + offset * (by_x[..., 2] * nearer)[..., None]
    along_y = by_y[..., :2] + [0, 1] + offset * (by_y[..., 2] * nearer)[..., None]
    area = along_x[..., 0] * along_y[..., 1] - along_x[..., 1] * along_y[..., 0]
    seen[..., 2] = np.log(np.maximum(area * scale**2, 1e-3))
    return seen


def appearance_slopes(deformed: np.ndarray, rest: np.ndarray, eye: np.ndarray) -> np.ndarray:
    """(K, 3, 9) derivatives of appearance (K, 3) by deformed (K, 3, 3)."""
    moved, by_x, by_y = deformed[:, 0], deformed[:, 1], deformed[:, 2]
    nearer = 1 / (eye[:, 2] - moved[:, 2])
    scale = eye[:, 2] * nearer
    offset = rest + moved[:, :2] - eye[:, :2]
    drawn = offset * nearer[:, None]
    along_x = by_x[:, :2] + [1, 0] + drawn * by_x[:, 2:]
    along_y = by_y[:, :2] + [0, 1] + drawn * by_y[:, 2:]
    area = along_x[:, 0] * along_y[:, 1] - along_x[:, 1] * along_y[:, 0]
    across = np.stack([along_y[:, 1], -along_y[:, 0], -along_x[:, 1], along_x[:, 0]], axis=1) / area[:, None]
    slopes = np.zeros((len(rest), 3, 3, 3))
    slopes[:, 0, 0, 0] = slopes[:, 1, 0, 1] = scale
    slopes[:, :2, 0, 2] = drawn * scale[:, None]
    slopes[:, 2, 1, :2], slopes[:, 2, 2, :2] = across[:, :2], across[:, 2:]
    slopes[:, 2, 1, 2], slopes[:, 2, 2, 2] = np.sum(across[:, :2] * drawn, axis=1), np.sum(across[:, 2:] * drawn, axis=1)
    tilt_x, tilt_y = by_x[:, 2] * nearer, by_y[:, 2] * nearer
    slopes[:, 2, 0, :2] = across[:, :2] * tilt_x[:, None] + across[:, 2:] * tilt_y[:, None]
    slopes[:, 2, 0, 2] = slopes[:, 2, 1, 2] * tilt_x + slopes[:, 2, 2, 2] * tilt_y + 2 * nearer
    return slopes.reshape(-1, 3, 9)


def disc_points(rest: np.ndarray, radius: float) -> np.ndarray:
    """(K * 4, 2) quadrature points, m, of discs of radius, m, at rest (K, 2)."""
    return (rest[:, None] + radius * _DISC).reshape(-1, 2)


def disc_appearance(deformed: np.ndarray, rest: np.ndarray, eye: np.ndarray, radius: float) -> np.ndarray:
    """As appearance, of discs of radius, m, at rest (K, 2): centroid and area as imaged; deformed (..., K * 4, 3, 3) at disc_points."""
    points = disc_points(rest, radius)
    seen = appearance(deformed, points, np.repeat(eye, len(_DISC), axis=0))
    parts = seen.shape[:-2] + (-1, len(_DISC))
    area = np.exp(seen[..., 2]).reshape(parts)
    shift = (seen[..., :2] + points - np.repeat(rest, len(_DISC), axis=0)).reshape(*parts, 2)
    centroid = np.sum(shift * area[..., None], axis=-2) / np.sum(area, axis=-1)[..., None]
    return np.concatenate([centroid, np.log(np.mean(area, axis=-1))[..., None]], axis=-1)
