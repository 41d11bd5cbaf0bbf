# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Elastic forces and area vectors of the cells between the dots, each cut along both diagonals into four triangles.

Arrays are flat, a cell has the number of its first dot (the cells of the last column do not exist: their area at rest is 0), and buffers
are reused: a frame needs this several times, in some sixty short array operations.
"""
from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import as_strided

from .mesh import GridMesh


class MembraneCells:
    """Geometry of a grid's cells. Triangle (i, j) of a cell, i, j = 0, 1, has its right angle at the dot in row i and column j.

    springs: (4, K) N/m, weights of the edges from each dot to the right, down, down and right, and from the dot on its right down and
    left, 0 where there is none; stiffness: N/m, the part of the shear stiffness that multiplies the area term of the energy.
    """

    def __init__(self, mesh: GridMesh, springs: np.ndarray, rest: np.ndarray, stiffness: float):
        self._columns, self._count = mesh.columns, mesh.size - mesh.columns - 1
        self._springs = springs
        self._sides = np.zeros((5, 2, mesh.size))  # to the right and down; x and y repeated after z for cross products
        self._squares = np.zeros((2, mesh.size))
        self._make_views()
        self._scratch, self._pull = np.empty((3, 2, 2, self._count)), np.empty((2, 2, 2, self._count))
        self._sign = np.array([[1.0, -1.0], [-1.0, 1.0]])[:, :, None]
        real = np.arange(self._count) % mesh.columns < mesh.columns - 1
        self._share = real / 12  # a third of half of each triangle; vectors are twice the area
        self._per_area = np.zeros((2, 2, self._count))
        squares = self._measure(rest, np.empty((3, 2, 2, self._count)))
        # G a/2 (A0/A)^3 / (4 A), and squares are 4 A^2
        self._per_area = np.where(real, 2 * stiffness * (squares / 4)**1.5, 0.0)

    def _make_views(self) -> None:
        """The cells' sides as views of the edges."""
        self._right, self._down = self._of_rows(self._sides[:, 0]), self._of_columns(self._sides[:, 1])
        self._right_square, self._down_square = self._of_rows(self._squares[0]), self._of_columns(self._squares[1])

    def __getstate__(self) -> dict:
        """All but the views."""
        return {name: value for name, value in vars(self).items() if name not in ('_right', '_down', '_right_square', '_down_square')}

    def __setstate__(self, state: dict) -> None:
        """Restore the views too."""
        vars(self).update(state)
        self._make_views()

    def _of_rows(self, values: np.ndarray) -> np.ndarray:
        """Values (..., K) of the edges to the right as (..., 2, 1, cells): of each cell's upper and lower side."""
        step = values.strides[-1]
        return as_strided(values, values.shape[:-1] + (2, 1, self._count), values.strides[:-1] + (self._columns * step, 0, step))

    def _of_columns(self, values: np.ndarray) -> np.ndarray:
        """Values (..., K) of the edges down as (..., 1, 2, cells): of each cell's left and right side."""
        step = values.strides[-1]
        return as_strided(values, values.shape[:-1] + (1, 2, self._count), values.strides[:-1] + (0, step, step))

    def _measure(self, x: np.ndarray, vector: np.ndarray) -> np.ndarray:
        """Squares (2, 2, cells) of twice the triangles' areas; fills vector (3, 2, 2, cells) with the doubled area vectors."""
        sides, scratch, right, down, columns = self._sides, self._scratch, self._right, self._down, self._columns
        np.subtract(x[:, 1:], x[:, :-1], out=sides[:3, 0, :-1])
        np.subtract(x[:, columns:], x[:, :-columns], out=sides[:3, 1, :-columns])
        sides[3:] = sides[:2]
        np.multiply(right[1:4], down[2:], out=vector)
        np.multiply(right[2:], down[1:4], out=scratch)
        vector -= scratch
        np.multiply(vector, vector, out=scratch)
        scratch[0] += scratch[1]
        return scratch[0] + scratch[2]

    def evaluate(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Elastic force on each dot (3, K), N, and each dot's area vector (3, K), m^2, at positions x (3, K), m."""
        vector = np.empty((3, 2, 2, self._count))
        squares = self._measure(x, vector)
        return self._pulls(x, self._tensions(squares)), self._shares(vector)

    def _shares(self, vector: np.ndarray) -> np.ndarray:
        """Area vectors (3, K) of the dots from the doubled ones of the triangles, vector (3, 2, 2, cells), which is overwritten."""
        count, columns = self._count, self._columns
        vector *= self._share
        whole = vector[:, 0] + vector[:, 1]
        np.subtract((whole[:, 0] + whole[:, 1])[:, None, None], vector, out=vector)  # without the triangle at the opposite dot
        out = np.zeros((3, count + columns + 1))
        out[:, :count] = vector[:, 1, 1]
        out[:, 1:-columns] += vector[:, 1, 0]
        out[:, columns:-1] += vector[:, 0, 1]
        out[:, columns + 1:] += vector[:, 0, 0]
        return out

    def _tensions(self, squares: np.ndarray) -> np.ndarray:
        """Edge weights (4, K), N/m: springs less each triangle's area term times the cotangent opposite to the edge."""
        squares *= squares
        rate = np.divide(self._per_area, squares, out=squares)
        np.multiply(self._right[:3], self._down[:3], out=self._scratch)
        inside = self._scratch[0]
        inside += self._scratch[1]
        inside += self._scratch[2]
        inside *= self._sign
        inside *= rate
        sides = self._sides[:3] * self._sides[:3]
        np.add(sides[0], sides[1], out=self._squares)
        self._squares += sides[2]
        beside_right, beside_down = self._pull
        np.multiply(rate, self._down_square, out=beside_right)
        np.multiply(rate, self._right_square, out=beside_down)
        self._pull -= inside
        out, count, columns = self._springs.copy(), self._count, self._columns
        upper, lower = beside_right[:, 0] + beside_right[:, 1]
        left, right = beside_down[0] + beside_down[1]
        out[0, :count] -= upper
        out[0, columns:-1] -= lower
        out[1, :count] -= left
        out[1, 1:-columns] -= right
        out[2, :count] -= inside[0, 1] + inside[1, 0]
        out[3, :count] -= inside[0, 0] + inside[1, 1]
        return out

    def _pulls(self, x: np.ndarray, tension: np.ndarray) -> np.ndarray:
        """Forces (3, K) on the dots from edges with weights tension (4, K)."""
        count, columns, force = self._count, self._columns, np.zeros_like(x)
        right, down = self._sides[:3, 0, :-1] * tension[0, :-1], self._sides[:3, 1, :-columns] * tension[1, :-columns]
        falling = (x[:, columns + 1:] - x[:, :count]) * tension[2, :count]
        rising = (x[:, columns:-1] - x[:, 1:-columns]) * tension[3, :count]
        force[:, :-1] += right
        force[:, 1:] -= right
        force[:, :-columns] += down
        force[:, columns:] -= down
        force[:, :count] += falling
        force[:, columns + 1:] -= falling
        force[:, 1:-columns] += rising
        force[:, columns:-1] -= rising
        return force
