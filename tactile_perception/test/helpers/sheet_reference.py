# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the kernels of sheets do, in NumPy: slow and obvious."""
import numpy as np
from tactile_perception.press.sheet.mechanics import locate, uniform
from tactile_perception.press.sheet.library import DEPTH_POWER, MIRROR, ODD_TERMS, SPREAD, WRENCH_NUMBERS


def looked_up(library, press):
    """Splines (side * side, 3), m, and the wrench (9,) of a press."""
    plan = library.plan
    near = np.arctanh(np.stack([np.clip(press.place, -plan.reach, plan.reach), plan.reach]) / plan.half)
    angle = np.arccos(near[0] / near[1])
    polynomial = np.cos(angle[:, None] * np.arange(2 * plan.order))
    level = (press.depth / plan.depth) ** (1 / DEPTH_POWER) * plan.levels
    f, first = level % 1, int(level)
    spline = np.array([(1 - f)**3, 3 * f**3 - 6 * f**2 + 4, -3 * f**3 + 3 * f**2 + 3 * f + 1, f**3]) / 6
    e, (x, y) = press.log_radius / SPREAD, press.drag
    whole, wrench = 0.0, np.zeros(9)
    for part, numbers in zip(library.classes, WRENCH_NUMBERS):
        mixed = 0.0
        for term, share in enumerate((1, e, e * e, x, y, x * x, x * y, y * y, x**3, x * x * y, x * y * y, y**3)):
            along, across = (polynomial[axis, part.odd[axis] ^ ODD_TERMS[axis][term]::2] for axis in (0, 1))
            mixed = mixed + share * np.einsum('i,j,l,ijlm->m', along, across, spline, part.coefficients[:, :, term, first:first + 4])
        field = np.einsum('m,mabc->abc', mixed[:len(part.modes)], part.modes)
        for axis in (0, 1):
            field = np.concatenate([field, np.flip(field, axis) * MIRROR[axis] * (-1 if part.odd[axis] else 1)], axis=axis)
        whole = whole + uniform(field)
        wrench[numbers] = mixed[len(part.modes):]
    return whole.reshape(-1, 3), wrench


def read_field(field, plan, place, rest):
    """Displacement, m, and its derivatives by x and y, (K, 3, 3), at rest (K, 2), m, of splines (side * side, 3) of a press at place."""
    xi, cubic = locate(rest.T, np.asarray(place, float), plan.half, plan.scale)
    slope = plan.n / (plan.scale + 3 * cubic * xi * xi)
    span = (xi + 1) * plan.n
    first = np.minimum(span.astype(int), 2 * plan.n - 1)
    f = span - first
    value = np.array([0.5 * (1 - f)**2, 0.5 + f * (1 - f), 0.5 * f * f])
    tilt = np.array([f - 1, 1 - 2 * f, f]) * slope
    grid = np.asarray(field, float).reshape(2 * plan.n + 2, -1, 3)
    read = np.zeros((len(rest), 3, 3))
    for i in range(3):
        for j in range(3):
            node = grid[first[0] + i, first[1] + j]
            for order, weight in enumerate((value[i, 0] * value[j, 1], tilt[i, 0] * value[j, 1], value[i, 0] * tilt[j, 1])):
                read[:, order] += weight[:, None] * node
    return read


def appearance(deformed, rest, eye):
    """Shift, m, and growth (K, 3) of points at rest (K, 2), m, seen from eye (K, 3), m; deformed (K, 3, 3)."""
    moved, by = deformed[:, 0], deformed[:, 1:]
    scale = eye[:, 2] / (eye[:, 2] - moved[:, 2])
    offset = rest + moved[:, :2] - eye[:, :2]
    jacobian = by[..., :2] + np.eye(2) + offset[:, None] * (by[..., 2:] / (eye[:, 2] - moved[:, 2])[:, None, None])
    growth = np.log(np.maximum(np.linalg.det(jacobian) * scale**2, 1e-3))
    return np.column_stack([moved[:, :2] + offset * (scale - 1)[:, None], growth])


def disc(radius, count=1000):
    """(count, 2) points, m, all over a disc: a sunflower's."""
    steps = np.arange(count) + 0.5
    angle, out = steps * np.pi * (3 - np.sqrt(5)), radius * np.sqrt(steps / count)
    return np.stack([out * np.cos(angle), out * np.sin(angle)], axis=1)
