# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Simulated devices whose taxels measure force vectors: a bed of springs under Coulomb friction, and imperfect electronics behind it."""
from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..constants import SIMULATION


@dataclass(frozen=True)
class Specimen:
    """What devices of one kind differ in and how imperfect they are.

    press, pull: N/m^3, stiffness of the springs along the normal and across it; spread: m, standard deviation over which the layer
    spreads a force over taxels, 0 for none; units: per N across and along the normal, of the numbers; unequal: relative standard
    deviation of the gains; crossed: of a force that shows on another axis; noise: N, of a number; drift: N after a second, of its random
    walk; late: part of a force that shows late, after late_s; dead: number of taxels that show a constant.
    """

    press: float
    pull: float
    spread: float
    units: tuple[float, float] = (1.0, 1.0)
    unequal: float = 0.02
    crossed: float = 0.01
    noise: float = 0.0015
    drift: float = 0.001
    late: float = 0.01
    late_s: float = 1.0
    dead: int = 0


@dataclass(frozen=True)
class Shape:
    """positions, normals, along: (N, 3), of the taxels, along: direction of their first number; nodes, facing: (K, 3), points of the
    surface and their normals; owner: (K,) taxel of each node; cell: m^2, area of a node; top: m, highest z."""

    positions: np.ndarray
    normals: np.ndarray
    along: np.ndarray
    nodes: np.ndarray
    facing: np.ndarray
    owner: np.ndarray
    cell: float

    @property
    def top(self) -> float:
        """Highest z of the surface, m."""
        return float(self.nodes[:, 2].max())

    @cached_property
    def axes(self) -> np.ndarray:
        """Directions (N, 3, 3) of a force that gives a positive first, second and third number: a press is positive."""
        return np.stack([self.along, np.cross(self.normals, self.along), -self.normals], axis=1)


def flat_grid(side: int, pitch: float, fine: int) -> Shape:
    """A square of side x side taxels, each of fine x fine nodes that leave no gap."""
    centres = (np.arange(side) - (side - 1) / 2) * pitch
    within = (np.arange(side * fine) - (side * fine - 1) / 2) * (pitch / fine)
    x, y = (grid.ravel() for grid in np.meshgrid(centres, centres))
    u, v = (grid.ravel() for grid in np.meshgrid(within, within))
    column, row = ((np.floor(each / pitch + side / 2)).astype(int) for each in (u, v))
    return _level(np.column_stack([x, y, 0 * x]), np.column_stack([u, v, 0 * u]), row * side + column, (pitch / fine)**2)


def pillars(side: int, pitch: float, radius: float, crown: float, fine: int) -> Shape:
    """A square of side x side pillars with flat round tops, of which the middle ones are up to crown m higher."""
    centres = (np.arange(side) - (side - 1) / 2) * pitch
    disc = (np.arange(fine) - (fine - 1) / 2) * (2 * radius / fine)
    u, v = (grid.ravel() for grid in np.meshgrid(disc, disc))
    inside = np.hypot(u, v) < radius
    x, y = (grid.ravel() for grid in np.meshgrid(centres, centres))
    z = -crown * np.hypot(x, y) / np.hypot(x, y).max()
    positions = np.column_stack([x, y, z])
    nodes = positions[:, None] + np.column_stack([u, v, 0 * u])[inside]
    return _level(positions, nodes.reshape(-1, 3), np.repeat(np.arange(side * side), inside.sum()), (2 * radius / fine)**2)


def _level(positions: np.ndarray, nodes: np.ndarray, owner: np.ndarray, cell: float) -> Shape:
    up, ahead = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    return Shape(positions, np.tile(up, (len(positions), 1)), np.tile(ahead, (len(positions), 1)), nodes, np.tile(up, (len(nodes), 1)),
                 owner, cell)


def fingertip(radius: float, rings: tuple[int, ...], reach: float, count: int) -> Shape:
    """A cap of a sphere about the origin, down to the polar angle reach, rad: rings of taxels, count nodes along a spiral."""
    polar, turn = [0.0], [0.0]
    for number, taxels in enumerate(rings, 1):
        polar += [reach * number / (len(rings) + 0.5)] * taxels
        turn += [2 * math.pi * (k + 0.5 * (number % 2)) / taxels for k in range(taxels)]
    normals = _on_sphere(np.array(polar), np.array(turn))
    z = 1 - (np.arange(count) + 0.5) / count * (1 - math.cos(reach))
    facing = _on_sphere(np.arccos(z), np.arange(count) * math.pi * (3 - math.sqrt(5)))
    along = np.cross([0.0, 1.0, 0.0], normals)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    owner = np.argmax(facing @ normals.T, axis=1)
    return Shape(radius * normals, normals, along, radius * facing, facing, owner,
                 2 * math.pi * radius**2 * (1 - math.cos(reach)) / count)


def _on_sphere(polar: np.ndarray, turn: np.ndarray) -> np.ndarray:
    return np.column_stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)])


#: Name of a device -> its shape and specimen. The first sends counts, the others newtons.
DEVICES = {
    'uskin': (flat_grid(4, 0.0047, 6), Specimen(6e7, 2e7, 0.0018, (1500.0, 2200.0))),
    'fingertip': (fingertip(0.010, (6, 12, 14), 1.1, 1500), Specimen(9e7, 3e7, 0.0010)),
    'pillars': (pillars(3, 0.007, 0.0025, 2e-4, 8), Specimen(1.2e8, 4e7, 0.0, noise=0.004, dead=0)),
}


class SpringBed:
    """Springs on the nodes of a shape that an object presses and drags: each holds the object until its force reaches the friction.

    friction: coefficient; rough: relative standard deviation of the friction of a patch of the surface, which changes over grain, m,
    of slip.
    """

    def __init__(self, shape: Shape, specimen: Specimen, friction: float, rng: np.random.Generator, rough: float = 0.10,
                 grain: float = 2e-4):
        self._shape, self._specimen, self._rng = shape, specimen, rng
        self._friction, self._rough, self._grain = friction, rough, grain
        count = len(shape.nodes)
        self.patch = shape.owner * SIMULATION.patches + rng.integers(0, SIMULATION.patches, count)
        self._texture = rng.normal(size=len(shape.positions) * SIMULATION.patches)
        self.pressed = np.zeros(count)  # N
        self.pulled = np.zeros((count, 3))  # m, of the springs
        self.slid = np.zeros(count)  # m, in the last step

    @property
    def forces(self) -> np.ndarray:
        """Force on each node, (K, 3) N."""
        return self._specimen.pull * self._shape.cell * self.pulled - self.pressed[:, None] * self._shape.facing

    def move(self, depth: np.ndarray, motion: np.ndarray) -> None:
        """A step of the object: depth (K,) m of each node in it, motion (K, 3) m of the object at each node."""
        shape, pull = self._shape, self._specimen.pull * self._shape.cell
        held = self.pressed > 0
        if depth.max() <= 0 and not held.any():
            self.slid[:] = 0.0
            return
        self.pressed = self._specimen.press * shape.cell * np.maximum(depth, 0.0)
        across = motion - np.sum(motion * shape.facing, axis=1, keepdims=True) * shape.facing
        wanted = (self.pulled + across) * (held & (self.pressed > 0))[:, None]
        reach = self._friction * (1 + self._rough * self._texture[self.patch]) * self.pressed / pull
        size = np.linalg.norm(wanted, axis=1)
        self.slid = np.maximum(size - reach, 0.0) * (self.pressed > 0)
        self.pulled = wanted * np.minimum(1.0, reach / np.maximum(size, SIMULATION.min_spread))[:, None]
        path = np.bincount(self.patch, self.slid, len(self._texture)) / np.maximum(np.bincount(self.patch, self.pressed > 0,
                                                                                               len(self._texture)), 1)
        kept = np.exp(-path / self._grain)
        self._texture = kept * self._texture + np.sqrt(1 - kept**2) * self._rng.normal(size=len(kept))


class Electronics:
    """Numbers of a device from the forces on its nodes."""

    def __init__(self, shape: Shape, specimen: Specimen, rng: np.random.Generator):
        self._specimen, self._rng, count = specimen, rng, len(shape.positions)
        weight = np.eye(count)[:, shape.owner]
        if specimen.spread:
            away = np.linalg.norm(shape.positions[:, None] - shape.nodes[None], axis=2)
            weight = np.exp(-0.5 * (away / specimen.spread)**2)
        self._weight = weight / weight.sum(axis=0)
        units = np.array([specimen.units[0], specimen.units[0], specimen.units[1]])
        gains = np.eye(3) * (1 + specimen.unequal * rng.normal(size=(count, 3, 1))) + specimen.crossed * rng.normal(size=(count, 3, 3))
        self._response = units[:, None] * (gains @ shape.axes)
        self._units = units
        self._offset, self._late = 0.3 * rng.normal(size=(count, 3)), np.zeros((count, 3))
        self.dead = rng.choice(count, specimen.dead, replace=False)

    def read(self, forces: np.ndarray, interval: float) -> np.ndarray:
        """Numbers (N, 3), float32, interval s after the last ones, of forces (K, 3) N on the nodes."""
        it, felt = self._specimen, self._weight @ forces
        share = 1 - math.exp(-interval / it.late_s)
        self._late += share * (felt - self._late)
        shown = np.einsum('nij,nj->ni', self._response, (1 - it.late) * felt + it.late * self._late)
        self._offset += it.drift * math.sqrt(interval) * self._rng.normal(size=self._offset.shape)
        numbers = shown + self._units * (self._offset + it.noise * self._rng.normal(size=shown.shape))
        numbers[self.dead] = self._units * 0.1
        return numbers.astype(np.float32)
