# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Rotations as matrices, rotation vectors and quaternions."""
from __future__ import annotations

import math

import numpy as np


def rotation_vector(rotation: np.ndarray) -> np.ndarray:
    """(3,) axis times angle (rad, at most pi) of a rotation matrix (3, 3), exact for angles near 0 and near pi too."""
    skew = 0.5 * np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    sine = np.linalg.norm(skew)
    cosine = 0.5 * (np.trace(rotation) - 1)
    angle = np.arctan2(sine, cosine)
    if cosine > -0.5:
        return skew / np.sinc(angle / np.pi)
    # Near half a turn the axis is that of the symmetric part, cos I + (1 - cos) axis axis^T.
    square = 0.5 * (rotation + rotation.T) - cosine * np.eye(3)
    axis = square[np.argmax(np.diag(square))]
    return axis * (angle / np.linalg.norm(axis) * (-1 if axis @ skew < 0 else 1))


def rotation_matrix(vector: np.ndarray) -> np.ndarray:
    """Rotation (3, 3) by a vector (3,) of axis times angle, rad (Rodrigues)."""
    angle = np.linalg.norm(vector)
    x, y, z = vector
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0.0]])
    half = np.sinc(angle / 2 / np.pi)
    return np.eye(3) + np.sinc(angle / np.pi) * cross + 0.5 * half**2 * cross @ cross


def quaternion(rotation: np.ndarray) -> np.ndarray:
    """(4,) unit quaternion x, y, z, w, w >= 0, of a rotation matrix (3, 3)."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation.tolist()
    squares = [1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz, 1 + xx + yy + zz]  # of each part, times four
    largest = squares.index(max(squares))
    products = ((squares[0], xy + yx, xz + zx, zy - yz), (xy + yx, squares[1], yz + zy, xz - zx),
                (xz + zx, yz + zy, squares[2], yx - xy), (zy - yz, xz - zx, yx - xy, squares[3]))[largest]
    answer = np.array(products) / (2 * math.sqrt(squares[largest]))
    return answer if answer[3] >= 0 else -answer


def matrix_of_quaternion(quaternion: np.ndarray) -> np.ndarray:
    """Rotation (3, 3) of a unit quaternion (4,) x, y, z, w."""
    x, y, z, w = quaternion
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
