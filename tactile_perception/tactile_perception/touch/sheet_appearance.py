# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""How the markers of a pressed sheet appear in the viewing plane: fields of presses, read at the markers and seen from the eye."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .sheet_library import LibraryPlan, SheetLibrary
from .sheet_model_mesh import locate

_DISC = np.sqrt(0.5) * np.array([[1.0, 0], [0, 1], [-1, 0], [0, -1]])  # points whose mean is that of a disc, up to cubic terms
_BASIS = np.array([[[0.5, -1, 0.5], [0.5, 1, -1], [0, 0, 0.5]], [[-1, 1, 0], [1, -2, 0], [0, 1, 0]], [[1, 0, 0], [-2, 0, 0], [1, 0, 0]]])


@dataclass(frozen=True)
class Press:
    """A round tip on the sheet: place (2,) m, depth m as if it were alone, log of its radius over the calibrated one; dragged (2,) m, how
    far it has taken the sheet under it along since it touched (place is where that was before).
    """

    place: np.ndarray
    depth: float
    log_radius: float = 0.0
    dragged: tuple[float, float] = (0.0, 0.0)

    @property
    def vector(self) -> np.ndarray:
        """(6,) place, depth, log radius, dragged."""
        return np.array([*self.place, self.depth, self.log_radius, *self.dragged])


def read_press(library: SheetLibrary, press: Press, rest: np.ndarray) -> np.ndarray:
    """What a press does to the sheet at rest (K, 2), m: (K, 3, 3), displacement and its derivatives by x and by y."""
    deformed = read_field(library.fields(press.place, press.depth, press.log_radius)[0], library.plan, press.place, rest)
    if any(press.dragged):
        deformed[..., :2] -= deformed[..., 2:] * (np.asarray(press.dragged) / press.depth)
    return deformed


def read_field(field: np.ndarray, plan: LibraryPlan, place: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Displacement and its derivatives by x and by y, (K, 3, 3), at rest (K, 2), m, of the field with coefficients (side * side, 3) on
    uniform B-splines, of a press at place.
    """
    node, (x, y), _ = _weights(plan, place, rest)
    return np.matmul(_products(x, y, ((0, 0), (1, 0), (0, 1))), field[node])


def read_derivatives(library: SheetLibrary, press: Press, rest: np.ndarray) -> np.ndarray:
    """(7, K, 3, 3): as read_press, then the derivatives of that by the press's vector.

    What is dragged along fades towards the clamp as depth does: both follow the same equation, nearly.
    """
    straight = _read_straight(library, press, rest)
    along = np.zeros((2,) + straight.shape[1:])
    along[0, ..., 0] = along[1, ..., 1] = straight[0, ..., 2] / -press.depth
    if any(press.dragged):
        straight[:3, ..., :2] -= straight[:3, ..., 2:] * (np.asarray(press.dragged) / press.depth)
    return np.concatenate([straight, along])


def _read_straight(library: SheetLibrary, press: Press, rest: np.ndarray) -> np.ndarray:
    """(5, K, 3, 3): as read_press of a press that has dragged nothing, and its derivatives by place, depth and log radius."""
    node, (x, y), carried = _weights(library.plan, press.place, rest)
    fields = library.fields(press.place, press.depth, press.log_radius)
    local = fields.transpose(1, 0, 2).reshape(-1, 15)[node]
    first = np.matmul(_products(x, y, ((0, 0), (1, 0), (0, 1))), local).reshape(-1, 3, 5, 3).transpose(2, 0, 1, 3).copy()
    xx, xy, yy = np.moveaxis(np.matmul(_products(x, y, ((2, 0), (1, 1), (0, 2))), local[..., :3]), 1, 0)
    (by_x, by_y), base = carried, first[0]
    first[1] += by_x[0][:, None, None] * np.stack([base[:, 1], xx, xy], axis=1)
    first[1, :, 1] += by_x[1][:, None] * base[:, 1]
    first[2] += by_y[0][:, None, None] * np.stack([base[:, 2], xy, yy], axis=1)
    first[2, :, 2] += by_y[1][:, None] * base[:, 2]
    return first


def _products(x: np.ndarray, y: np.ndarray, orders: tuple) -> np.ndarray:
    """(K, len(orders), 9) products of the weights x, y (3, K, 3) of the given derivatives along x and along y."""
    products = x[[order[0] for order in orders]][..., :, None] * y[[order[1] for order in orders]][..., None, :]
    return np.moveaxis(products.reshape(len(orders), -1, 9), 0, 1)


def _weights(plan: LibraryPlan, place: np.ndarray, rest: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes (K, 9) of the B-splines at rest; weights (2, 3, K, 3) along x and y: value, first and second derivative, 1/m, 1/m^2; and how
    the sheet's coordinates go along with the press, (2, 2, K): share and its derivative by place, 1/m.
    """
    xi, cubic = locate(rest.T, place, plan.half, plan.scale)
    sign = np.where(xi >= 0, 1.0, -1.0)
    slope = 1 / (plan.scale + 3 * cubic * xi**2)
    bend = -6 * cubic * xi * sign * slope**3 * sign
    span = (xi + 1) * plan.n
    first = np.minimum(span.astype(int), 2 * plan.n - 1)
    f = span - first
    value, by_span, second = _BASIS @ np.stack([np.ones_like(f), f, f * f]).reshape(3, -1)
    shape = (3, *f.shape)
    value, by_span, second = (np.moveaxis(part.reshape(shape), 0, -1) for part in (value, by_span, second))
    by_place = plan.n * slope[..., None]
    weights = np.stack([value, by_span * by_place, second * by_place**2 + by_span * (plan.n * bend)[..., None]], axis=1)
    three = np.arange(3)
    node = ((first[0][:, None] + three) * (2 * plan.n + 2))[:, :, None] + (first[1][:, None] + three)[:, None, :]
    return node.reshape(-1, 9), weights, np.stack([np.abs(xi)**3 - 1, 3 * xi**2 * sign * slope], axis=1)


def appearance(deformed: np.ndarray, rest: np.ndarray, eye: np.ndarray) -> np.ndarray:
    """Shift, m, and growth (..., K, 3) in the plane z = 0 of points at rest (K, 2), m, seen from eye (K, 3), m.

    deformed: (..., K, 3, 3) displacement and derivatives, as of read_fields. Growth is the log of the ratio of the areas.
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


def appearance_derivatives(deformed: np.ndarray, derivatives: np.ndarray, rest: np.ndarray, eye: np.ndarray,
                           steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """appearance (K, 3) of deformed (K, 3, 3) and its derivatives (P, K, 3) by parameters, given those of deformed, (P, K, 3, 3), by
    differences over steps (P,) of the parameters."""
    steps = steps[:, None, None]
    moved = appearance(np.concatenate([deformed[None], deformed + steps[..., None] * derivatives]), rest, eye)
    return moved[0], (moved[1:] - moved[0]) / steps


def disc_points(rest: np.ndarray, radius: float) -> np.ndarray:
    """(K * 4, 2) points, m, that stand for discs of radius, m, at rest (K, 2)."""
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
