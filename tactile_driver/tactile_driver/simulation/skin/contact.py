# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact of a skin with a rigid tool: no penetration, Coulomb friction at each touching node.

Solved by ADMM (alternating direction method of multipliers): the skin responds linearly through its compliance, and the contact law of a
node has a closed-form solution.
"""
from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .surfaces import Skin
from .tools import Pose, Tool


@dataclass(frozen=True)
class ContactSolver:
    """ADMM of skin and tool."""

    coupling: float = 0.47  # penalty over the skin's stiffness: near the geometric mean of its smallest and largest
    over_relaxation: float = 1.6
    sweeps: int = 10  # a linearisation
    near: float = 0.7  # node spacings: nodes nearer to the tool than this take part
    near_margin: float = 1.9  # with which a new set is selected, so that its inverse serves many frames


SOLVER = ContactSolver()


@dataclass
class SkinState:
    """A skin in contact.

    shape: (n, n, 3) m; pressure: Pa; touching: (m,) int64, indices of the inner nodes in contact; force: (m, 3) N, of the tool on the skin
    at these nodes.
    """

    shape: np.ndarray
    pressure: float
    touching: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    force: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))


class PlateContact:
    """A sheet under a plate that moves along z: it holds what it covers, and from its border to the clamp the sheet is straight.

    Forces are not computed: state.force is empty. The plate may be tilted.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.reset()

    def reset(self):
        """Return to the resting skin."""
        self.state = SkinState(self.skin.rest.copy(), self.skin.pressure)

    def step(self, tool: Tool, _before: Pose, now: Pose) -> SkinState:
        """Move the plate to the pose now. Returns the new state, which is also kept in state."""
        self.reset()
        shape, half, ends = self.state.shape, np.array(tool.plate), np.abs(self.skin.rest[..., :2]).max(axis=(0, 1))
        share = np.clip((ends - np.abs(shape[..., :2])) / (ends - half), 0, 1).min(axis=-1)
        normal = now.turn[:, 2]
        height = now.origin[2] - (shape[..., :2] - now.origin[:2]) @ normal[:2] / normal[2]
        if now.origin[2] < 0:
            shape[..., 2] = share * np.minimum(height, 0)
            self.state.touching = np.flatnonzero(((share == 1) & (height < 0)).ravel()[self.skin.inner])
        return self.state


class FrictionalContact:
    """Steps a skin from one tool pose to the next. friction: Coulomb's coefficient."""

    def __init__(self, skin: Skin, friction: float):
        self.skin, self.friction = skin, friction
        self._coupling = SOLVER.coupling * skin.stiffness
        self._inner = np.flatnonzero(skin.inner)
        self.reset()

    def reset(self):
        """Return to the resting skin."""
        self.state = SkinState(self.skin.rest.copy(), self.skin.pressure)
        self._near = np.zeros(0, np.int64)
        self._held = np.zeros((0, 3))
        self._moved = np.zeros((len(self._inner), 3))
        self._was_touching = np.zeros(len(self._inner), bool)
        self._rubbing = np.zeros(0)

    def step(self, tool: Tool, before: Pose, now: Pose) -> SkinState:
        """Move the tool from the pose before to the pose now. Returns the new state, which is also kept in state."""
        inner_shape = self.state.shape.reshape(-1, 3)[self._inner]
        gap = tool.distance(now.to_tool(inner_shape))
        if gap.min() > 0 and not self._was_touching.any():
            self.reset()
            return self.state
        self._choose_near(gap)
        sticks, on_tool = self._anchors(tool, before.to_tool(inner_shape[self._near]), now.to_tool(inner_shape[self._near]))
        self._rubbing, anchor = sticks * self.friction, now.to_sensor(on_tool)
        positions = inner_shape + self._moved
        for _ in range(self.skin.linearisations):
            last, (positions, pressure) = positions, self._solve_linearised(tool, now, positions, anchor)
            if np.abs(positions - last).max() < self.skin.settled * self.skin.spacing:
                break
        self._moved = positions - inner_shape
        self._keep(positions, pressure)
        return self.state

    def _anchors(self, tool: Tool, before: np.ndarray, now: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Which near nodes friction holds (k,), and where (k, 3), m, in the tool frame, if they move from before to now (k, 3), m, there.

        Nodes that touched are held where they are, others where the tool meets them. Without friction in the step of first contact, an
        oblique tool would slip by the length of that step.
        """
        touched, gap, later = self._was_touching[self._near], tool.distance(before), tool.distance(now)
        share = np.where(touched, 0.0, np.clip(gap / np.maximum(gap - later, 1e-12), 0, 1))
        return touched | (later < 0), before + share[:, None] * (now - before)

    def _choose_near(self, gap: np.ndarray):
        """Choose the nodes that take part and invert their compliance; both are kept while they cover all nodes that may touch."""
        needed = (gap < SOLVER.near * self.skin.spacing) | self._was_touching
        have = np.zeros_like(needed)
        have[self._near] = True
        if have[needed].all() and have.sum() < 2 * needed.sum() + 60:
            return
        held = np.zeros((len(needed), 3))
        held[self._near] = self._held
        self._near = np.flatnonzero((gap < SOLVER.near_margin * self.skin.spacing) | self._was_touching)
        self._held = held[self._near]
        block = self.skin.compliance_among(self._near)
        self._local = block
        self._answer = np.linalg.inv(block + np.eye(len(block)) / self._coupling)

    def _solve_linearised(self, tool: Tool, pose: Pose, positions: np.ndarray, anchor: np.ndarray) -> tuple[np.ndarray, float]:
        """Linearise skin, fluid and tool surface at positions (m, 3), m, and solve the contact. Returns new positions and pressure, Pa.

        The pressure is a function of the contact forces, which conserves the enclosed volume to first order.
        """
        skin, near, shape = self.skin, self._near, self.skin.with_rim(positions)
        slack, load = skin.slack_at(shape, near)
        push, lift, rise, free_pressure = skin.fluid(shape)
        gap, normal = tool.distance_and_normal(pose.to_tool(positions[near]))
        normal = normal @ pose.turn.T
        offset = gap - np.einsum('ij,ij->i', normal, positions[near])
        self._alternate(slack + free_pressure * lift[near], lift[near], rise, normal, offset, anchor)
        force = -self._coupling * self._held
        pressure = free_pressure - float((lift[near] * force).sum()) / rise
        load = load + pressure * push
        load[near] += force
        return skin.slack + skin.give(load), pressure

    def _alternate(self, free, lift, rise, normal, offset, anchor):
        """ADMM iterations for the scaled multipliers held (k, 3), m; the contact force is -coupling * held.

        free: (k, 3) m, positions without contact; lift: (k, 3) m/Pa, and rise, m^3/Pa: response of nodes and volume to the pressure;
        normal: (k, 3) and offset: (k,) m, of the tool's tangent planes; anchor: (k, 3) m, positions of sticking nodes.
        """
        response = self._answer @ lift
        response /= np.sqrt(rise - float((lift * response).sum()))
        held = self._held
        position = free - self._coupling * (self._local @ held - lift * ((lift * held).sum() / rise))
        for _ in range(SOLVER.sweeps):
            aim = position - held
            force = aim - free
            force = self._answer @ force + response * np.vdot(response, force)
            trial = SOLVER.over_relaxation * (aim - force / self._coupling) + (1 - SOLVER.over_relaxation) * position + held
            inside = np.maximum(-(np.einsum('ij,ij->i', normal, trial) + offset), 0)
            position = trial + inside[:, None] * normal
            slide = anchor - position
            slide -= np.einsum('ij,ij->i', normal, slide)[:, None] * normal
            length = np.sqrt(np.einsum('ij,ij->i', slide, slide))
            position += slide * np.minimum(1, self._rubbing * inside / np.maximum(length, 1e-15))[:, None]
            held = trial - position
        self._held = held

    def _keep(self, positions: np.ndarray, pressure: float):
        """Store the solution as the new state."""
        force = -self._coupling * self._held
        pressed = np.einsum('ij,ij->i', force, force) > 0
        self._was_touching[:] = False
        self._was_touching[self._near[pressed]] = True
        self.state = SkinState(self.skin.with_rim(positions), pressure, self._near[pressed], force[pressed])
