# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A rigid ball or a flat stamp on the gel: pressure without pull, and friction by Coulomb's law, step by step."""
from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..constants import SIMULATION
from .elements import Material, Response


@dataclass(frozen=True)
class Indenter:
    """radius: m, of a ball; 0: a flat stamp. half: m, half sides (x, y) of the stamp."""

    radius: float = 0.006
    half: tuple[float, float] = (0.0, 0.0)

    def height(self, off: np.ndarray) -> np.ndarray:
        """(N,) m, of its underside over its foremost point, at positions off (N, 2) m from its middle; inf beside it."""
        if self.radius:
            square = (off**2).sum(axis=1)
            return np.where(square < self.radius**2, self.radius - np.sqrt(np.maximum(self.radius**2 - square, 0)), np.inf)
        return np.where((np.abs(off) <= self.half).all(axis=1), 0.0, np.inf)


@dataclass
class GelState:
    """Forces on the cells of the surface.

    positions: (M, 2) m, of the cells on the undeformed surface; force: (M, 3) N, of the object on the gel; slides: (M,) bool; middle:
    (2,) m and depth, m, of the object; shift: (2,) m, mean displacement of the cells along the surface.
    """

    positions: np.ndarray
    force: np.ndarray
    slides: np.ndarray
    middle: np.ndarray
    depth: float
    shift: np.ndarray


@dataclass
class GelContact:
    """Follows one object over the gel. cell: m, side of a square cell of the surface; friction: coefficient.

    The object touches the cells that are under it after the surface has moved along with it, by the mean displacement of the last step.
    """

    material: Material
    indenter: Indenter
    friction: float
    cell: float = 0.35e-3
    _shift: np.ndarray = field(default_factory=lambda: np.zeros(2))
    _held: dict = field(default_factory=dict)  # cell -> (force along the surface (2,), displacement (2,) of the surface less the object's)

    def __post_init__(self):
        self._reach, self._table = -1, np.zeros((0, 9))
        self.response = Response(self.material, self.cell / np.sqrt(np.pi))

    def reset(self) -> None:
        """Nothing touches."""
        self._held, self._shift = {}, np.zeros(2)

    def step(self, middle: np.ndarray, depth: float, before: np.ndarray) -> GelState | None:
        """The state with the object's middle at (2,) m, after it was at before (2,) m; depth: m, of its foremost point under the surface,
        negative above. None without contact."""
        positions, gap = self._candidates(middle - self._shift, depth)
        if not len(positions):
            self.reset()
            return None
        index = np.round(positions / self.cell).astype(int)
        flexible, cells = self._flexibility(index), [tuple(c) for c in index]
        carried = np.array([self._held.get(c, (np.zeros(2),))[0] for c in cells])
        moved = np.array([self._held[c][1] if c in self._held else np.full(2, np.nan) for c in cells])
        along, press, slides = carried, np.zeros(len(positions)), np.zeros(len(positions), bool)
        for _ in range(SIMULATION.friction_rounds):
            lift = np.einsum('ipj,pj->i', flexible[:, 2, :, :2], along)
            press = _pressed(flexible[:, 2, :, 2], lift - gap, press > 0 if press.any() else np.ones(len(press), bool))
            along, slides, surface = self._rub(flexible, press, carried, moved, middle - before)
        touching = press > 0
        self._held = {cell: (along[k], surface[k]) for k, cell in enumerate(cells) if touching[k]}
        force = np.column_stack([along, -press])
        self._shift = surface[touching].mean(axis=0)
        return GelState(positions[touching], force[touching], slides[touching], np.asarray(middle, float), depth, self._shift)

    def _flexibility(self, index: np.ndarray) -> np.ndarray:
        """(M, 3, M, 3) m/N, displacements of cells (M, 2) under unit forces on each other; it depends on their offsets alone."""
        offset = index[:, None] - index
        reach = int(np.abs(offset).max())
        if reach > self._reach:
            steps = np.arange(-2 * reach, 2 * reach + 1) * self.cell
            grid = np.stack(np.meshgrid(steps, steps, indexing='ij'), axis=-1).reshape(-1, 2)
            self._reach, self._table = 2 * reach, self.response.matrix(grid, np.zeros((1, 2)), 'surface').reshape(-1, 9)
        row = (offset + self._reach) @ [2 * self._reach + 1, 1]
        return self._table[row].reshape(*row.shape, 3, 3).transpose(0, 2, 1, 3)

    def _candidates(self, middle, depth) -> tuple[np.ndarray, np.ndarray]:
        """Cells (M, 2) m that the undeformed surface would have inside the object, and how deep (M,), as negative heights, m."""
        if depth <= 0:
            return np.zeros((0, 2)), np.zeros(0)
        reach = np.sqrt(2 * self.indenter.radius * depth) if self.indenter.radius else max(self.indenter.half)
        low, high = (np.floor((np.asarray(middle) + s * reach) / self.cell).astype(int) for s in (-1, 1))
        j, i = np.mgrid[low[1]:high[1] + 2, low[0]:high[0] + 2].reshape(2, -1)
        positions = np.stack([i, j], axis=1) * self.cell
        height = self.indenter.height(positions - middle) - depth
        return positions[height < 0], height[height < 0]

    def _rub(self, flexible, press, carried, moved, travel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Forces along the surface (M, 2) N, which cells slide (M,), and displacements of the surface (M, 2) m.

        A cell that touched before and sticks keeps its position on the object; a new one sticks where it is now. carried, moved: from
        the last step, NaN where new; travel: (2,) m, of the object since.
        """
        count, limit = len(press), self.friction * press
        touching = press > 0
        pushed = np.einsum('ijp,p->ij', flexible[:, :2, :, 2], -press)
        bend = flexible[:, :2, :, :2].reshape(2 * count, 2 * count)
        new = np.isnan(moved[:, 0])
        along, slides = np.where(touching[:, None], carried, 0.0), np.zeros(count, bool)
        for _ in range(SIMULATION.sticking_rounds):
            stick = touching & ~slides
            free = np.where(slides[:, None], along, 0.0)
            surface = pushed + (bend @ free.ravel()).reshape(count, 2)
            rows = np.repeat(stick & ~new, 2)
            trial = free.copy()
            if rows.any():
                wanted = np.where(new[:, None], 0.0, moved + travel) - surface
                trial.ravel()[rows] = np.linalg.solve(bend[np.ix_(rows, rows)], wanted.ravel()[rows])
            size = np.sqrt((trial**2).sum(axis=1))
            over = touching & (size > limit * (1 + 1e-9))
            along = np.where(over[:, None], trial * (limit / np.maximum(size, 1e-30))[:, None], trial)
            if not (over & ~slides).any():
                break
            slides |= over
        return along, slides, pushed + (bend @ along.ravel()).reshape(count, 2)


def _pressed(flexible: np.ndarray, deep: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Forces (M,) >= 0, N, that press each position at least deep (M,), m, and end where it would not touch; flexible: (M, M) m/N; inside:
    (M,) bool, those that are tried first."""
    force = np.zeros(len(deep))
    for _ in range(100):
        at = np.flatnonzero(inside)
        force[:] = 0
        force[at] = np.linalg.solve(flexible[np.ix_(at, at)], deep[at])
        pulled, pierced = force < 0, ~inside & (flexible @ force < deep - 1e-9)
        if not pulled.any() and not pierced.any():
            break
        inside = (inside & ~pulled) | pierced
    return np.maximum(force, 0)
