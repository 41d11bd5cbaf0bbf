# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The ground truth of a frame, from the state of skin and tool: contact region, dots, touches, slip."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ..constants import SIMULATION
from ..optics.camera import SimulatedCamera
from ..optics.pattern import DotPattern
from ..skin.contact import SkinState
from ..skin.surfaces import Skin, cross
from ..skin.tools import Pose, Tool
from ..truth import NON_CONTACT, SLIPPING, STICKING, Touch, TruthFrame, slip_state_of


@dataclass
class Region:
    """A contact region.

    outlines, holes: lists of (k, 3) m; area: m^2, without holes; centroid: (3,) m; normal: (3,) unit, outwards; fullness: (n, n), relative
    contact pressure of the nodes, 1 inside and 0 outside; part_centroids: (parts, 3) m, of the contact of each part of the tool, NaN
    without contact.
    """

    outlines: list
    holes: list
    area: float
    centroid: np.ndarray
    normal: np.ndarray
    fullness: np.ndarray
    part_centroids: np.ndarray


def _between(count: int) -> np.ndarray:
    """Matrix (fine, count) of linear interpolation from count nodes to a grid with SIMULATION.cell_parts subdivisions."""
    nodes = np.arange((count - 1) * SIMULATION.cell_parts + 1) / SIMULATION.cell_parts
    return np.maximum(1 - np.abs(nodes[:, None] - np.arange(count)), 0)


def fullness_of(skin: Skin, state: SkinState, tool: Tool) -> np.ndarray:
    """Contact pressure (n, n) of the nodes relative to the typical pressure in the contact, clipped to 0 to 1.

    The fluid pressure is typical of a flat face. A round tip adds a uniform contribution of the skin's tension, so the median is typical.
    """
    areas = skin.area_vectors(state.shape)[skin.inner][state.touching]
    pressed = -np.einsum('ij,ij->i', state.force, areas) / np.maximum(np.einsum('ij,ij->i', areas, areas), 1e-30)
    typical = state.pressure if tool.tip_radius is None or not len(pressed) else max(np.median(pressed), state.pressure, 1e-30)
    inner = np.zeros(skin.inner.sum())
    inner[state.touching] = np.clip(pressed / typical, 0, 1)
    return np.pad(inner.reshape(skin.nodes - 2, -1), 1)


def find_region(skin: Skin, state: SkinState, tool: Tool, pose: Pose) -> Region | None:
    """The contact region of the tool in this state; None without contact."""
    fullness = fullness_of(skin, state, tool)
    rows, columns = np.nonzero(fullness)
    if not len(rows):
        return None
    box = slice(max(rows.min() - 2, 0), rows.max() + 3), slice(max(columns.min() - 2, 0), columns.max() + 3)
    part = state.shape[box]
    up, across = _between(part.shape[0]), _between(part.shape[1])
    positions = np.stack([up @ part[..., k] @ across.T for k in range(3)], axis=-1)
    gaps = tool.part_distances(pose.to_tool(positions))
    gap = gaps.min(axis=0)
    full = np.ascontiguousarray(up @ fullness[box] @ across.T)
    # A contact line narrower than a cell presses only on every other node: close the gaps.
    side = 2 * SIMULATION.cell_parts + 1
    full = cv2.morphologyEx(full, cv2.MORPH_CLOSE, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)))
    outside = np.maximum(0.5 - full, (gap / skin.spacing - SIMULATION.max_contact_gap) / SIMULATION.gap_scale)
    return _measure(positions, outside, fullness, gaps)


def _measure(positions: np.ndarray, outside: np.ndarray, fullness: np.ndarray, gaps: np.ndarray) -> Region | None:
    """Outlines and moments of the region where outside (a, b) is negative; positions: (a, b, 3) m, fine grid; gaps: (parts, a, b) m, to the
    parts of the tool. None for an empty region."""
    slope = np.stack(np.gradient(outside), axis=-1)
    steep = np.sqrt((slope**2).sum(axis=-1)) + 1e-9
    cover = np.clip(0.5 - outside / steep, 0, 1)
    patches = cross(*np.gradient(positions, axis=(1, 0)))
    sizes = np.sqrt((patches**2).sum(axis=-1)) * cover
    area = float(sizes.sum())
    if area <= 0:
        return None
    centroid = np.einsum('ab,abk->k', sizes, positions) / area
    centroids = centroid[None] if len(gaps) == 1 else _part_centroids(positions, sizes, gaps)
    normal = np.einsum('ab,abk->k', cover, patches)
    outlines, holes = _contours(positions, outside, slope, steep)
    return Region(outlines, holes, area, centroid, normal / np.linalg.norm(normal), fullness, centroids)


def _part_centroids(positions: np.ndarray, sizes: np.ndarray, gaps: np.ndarray) -> np.ndarray:
    """(parts, 3) m, centroids of the positions that each part is nearest to, NaN without any; sizes: (a, b) m^2, of contact."""
    of_part = sizes * (gaps == gaps.min(axis=0))
    area = of_part.sum(axis=(1, 2))[:, None]
    return np.where(area > 0, np.einsum('pab,abk->pk', of_part, positions) / np.maximum(area, 1e-30), np.nan)


def _contours(positions: np.ndarray, outside: np.ndarray, slope: np.ndarray, steep: np.ndarray) -> tuple[list, list]:
    """Outlines and holes (k, 3), m: border cells of the region, moved along the gradient to the zero of outside."""
    lines, family = cv2.findContours((outside < 0).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    found = [], []
    for line, kin in zip(lines, [] if family is None else family[0]):
        if len(line) < 4:
            continue
        column, row = line[:, 0, 0], line[:, 0, 1]
        step = np.clip(-outside[row, column] / steep[row, column], 0, 1)[:, None] * slope[row, column] / steep[row, column, None]
        border = np.stack([row, column]) + step.T
        found[int(kin[3] >= 0)].append(_interpolated(positions, border))
    return found


def _interpolated(positions: np.ndarray, at: np.ndarray) -> np.ndarray:
    """positions (a, b, 3) interpolated bilinearly at rows and columns at (2, k), which are clipped to the grid."""
    last = np.array(positions.shape[:2])[:, None] - 1
    at = np.clip(at, 0, last)
    row, column = np.minimum(at.astype(int), last - 1)
    down, right = (at - [row, column])[..., None]
    upper = positions[row, column] * (1 - right) + positions[row, column + 1] * right
    lower = positions[row + 1, column] * (1 - right) + positions[row + 1, column + 1] * right
    return upper * (1 - down) + lower * down


@dataclass
class Observation:
    """One time. shape: from Skin.coarse, m; spread: (K, 2, 2) px/m, affine maps of the dots to the image; truth."""

    shape: np.ndarray
    spread: np.ndarray
    truth: TruthFrame


class Observer:
    """Observes dots and contact of one skin through one camera; interval: s, between frames."""

    def __init__(self, skin: Skin, pattern: DotPattern, camera: SimulatedCamera, interval: float):
        self.skin, self.pattern, self.camera, self.interval = skin, pattern, camera, interval
        self._before = None
        self._first: Pose | None = None  # of the tool, in the first frame of its contact
        positions, uv, spread = pattern.seen(skin.rest, camera)
        truth = TruthFrame(pattern.numbers, uv, positions, np.full(len(uv), NON_CONTACT, np.uint8), pressure=skin.pressure,
                           dot_gap=np.full(len(uv), np.inf))
        self.untouched = Observation(skin.coarse(skin.rest), spread, truth)  # of all frames without contact

    def lifted(self) -> Observation:
        """Observation without contact; the next contact is a new one."""
        self._before = self._first = None
        return self.untouched

    def observe(self, state: SkinState, tool: Tool, before: Pose, now: Pose) -> Observation:
        """Observation of a state under a tool that moved from the pose before (one frame ago) to the pose now."""
        region = find_region(self.skin, state, tool, now) if len(state.touching) else None
        if region is None:
            return self.lifted()
        positions, uv, spread = self.pattern.seen(state.shape, self.camera, lambda p: off_tool(p, tool, now))
        nodes = state.shape.reshape(-1, 3)[self.skin.inner][state.touching]
        gap = tool.distance(now.to_tool(positions))
        near = np.abs(gap) < SIMULATION.max_contact_gap * self.skin.spacing
        touching = (self.pattern.sampler.linear @ region.fullness.ravel() > 0.5) & near
        slide_of_dots, slide_of_nodes = self._slides_over_tool(positions, touching, nodes, state, tool, now)
        states = np.where(touching, STICKING, NON_CONTACT).astype(np.uint8)
        states[np.linalg.norm(slide_of_dots, axis=1) > SIMULATION.slip_speed * self.interval] = SLIPPING
        truth = TruthFrame(self.pattern.numbers, uv, positions, states, region.outlines, region.holes, region.area, region.centroid,
                           region.normal, dot_gap=gap)
        truth.contacts = self._touches(state, nodes, region, tool, now)
        self._set_slip(truth, nodes, slide_of_nodes @ now.turn.T)
        truth.motion = _motion(before, now)
        self._first = self._first or now
        truth.pose = _motion(self._first, now)
        truth.wrench = np.concatenate([state.force.sum(axis=0), np.cross(nodes, state.force).sum(axis=0)])
        truth.pressure = state.pressure
        return Observation(self.skin.coarse(state.shape), spread.astype(np.float32), truth)

    def observe_plate(self, state: SkinState, now: Pose) -> Observation:
        """Observation of a sheet whose dots are all held by a plate, which is reported as one contact at its centre, without force."""
        if not len(state.touching):
            return self.untouched
        positions, uv, spread = self.pattern.seen(state.shape, self.camera)
        truth = TruthFrame(self.pattern.numbers, uv, positions, np.full(len(uv), STICKING, np.uint8), centroid=now.origin,
                           normal=now.turn[:, 2], wrench=np.full(6, np.nan))
        truth.contacts = [Touch(now.origin, now.turn[:, 2], float(-now.origin[2]), np.nan)]
        return Observation(self.skin.coarse(state.shape), spread.astype(np.float32), truth)

    def _slides_over_tool(self, positions, touching, nodes, state: SkinState, tool: Tool, pose: Pose) -> tuple[np.ndarray, np.ndarray]:
        """Displacements (K, 3) of the dots and (m, 3) of the touching nodes along the tool since the last frame, m, in the tool frame; NaN
        for points that do not touch or did not touch before."""
        dots_on_tool, nodes_on_tool = np.full((len(positions), 3), np.nan), np.full((self.skin.inner.sum(), 3), np.nan)
        dots_on_tool[touching] = pose.to_tool(positions[touching])
        nodes_on_tool[state.touching] = pose.to_tool(nodes)
        last = self._before or (np.full_like(dots_on_tool, np.nan), np.full_like(nodes_on_tool, np.nan))
        self._before = dots_on_tool, nodes_on_tool
        return _slide_along(tool, last[0], dots_on_tool), _slide_along(tool, last[1], nodes_on_tool)[state.touching]

    def _set_slip(self, truth: TruthFrame, nodes: np.ndarray, slide: np.ndarray):
        """Set the slip fields of truth; nodes: (m, 3) m, touching; slide: (m, 3) m, their displacements along the tool, sensor frame."""
        slipping = np.linalg.norm(slide, axis=1) > SIMULATION.slip_speed * self.interval
        truth.slipping_fraction = fraction = float(slipping.sum() / max(np.isfinite(slide[:, 0]).sum(), 1))
        truth.slip_state = slip_state_of(fraction)
        truth.velocity = np.zeros(6)
        if slipping.sum() >= 3:
            radius = np.sqrt(truth.area / np.pi)
            truth.velocity, truth.rotation_center = _twist_in_plane(nodes[slipping], -slide[slipping] / self.interval, truth.normal, radius)

    def _touches(self, state: SkinState, nodes: np.ndarray, region: Region, tool: Tool, pose: Pose) -> list[Touch]:
        """One Touch per touching part of the tool."""
        part_of_node = tool.part_distances(pose.to_tool(nodes)).argmin(axis=0)
        areas = self.skin.area_vectors(state.shape)[self.skin.inner][state.touching]
        touches = []
        for part in np.unique(part_of_node):
            mine = part_of_node == part
            normal = region.normal if len(tool.parts) == 1 else areas[mine].sum(axis=0)
            normal = normal / np.linalg.norm(normal)
            centre = pose.to_sensor(np.asarray(tool.positions[part]))
            central = tool.tip_radius is None or tool.central
            position = region.part_centroids[part] if central else centre - [0, 0, tool.tip_radius]
            if np.isnan(position[0]):  # its pressure is everywhere below half of the typical one
                load = np.linalg.norm(state.force[mine], axis=1)
                position = load @ nodes[mine] / load.sum()
            touching = self.skin.touching_height(tool.parts[part], pose.turn, centre[0], centre[1])
            touches.append(Touch(position, normal, float(touching - centre[2]), float(-(state.force[mine] @ normal).sum())))
        return touches


def off_tool(positions: np.ndarray, tool: Tool, pose: Pose) -> np.ndarray:
    """Points (K, 3), m; those that interpolation placed inside the tool are moved to its surface, in place."""
    gap = tool.distance(pose.to_tool(positions))
    inside = np.flatnonzero(gap < 0)
    if len(inside):
        depth, normal = tool.distance_and_normal(pose.to_tool(positions[inside]))
        positions[inside] -= depth[:, None] * (normal @ pose.turn.T)
    return positions


def _slide_along(tool: Tool, before: np.ndarray, now: np.ndarray) -> np.ndarray:
    """Tangential displacements (k, 3), m, between points before and now (k, 3) in the tool frame; NaN where either is NaN."""
    slide = now - before
    common = np.flatnonzero(np.isfinite(slide[:, 0]))
    if len(common):
        normal = tool.distance_and_normal(now[common])[1]
        slide[common] -= np.einsum('ij,ij->i', slide[common], normal)[:, None] * normal
    return slide


def _motion(before: Pose, now: Pose) -> np.ndarray:
    """Displacement (6,) of the object at the sensor frame's origin, m, and its rotation vector, rad."""
    turn = now.turn @ before.turn.T
    return np.concatenate([now.origin - turn @ before.origin, cv2.Rodrigues(turn)[0].ravel()])


def _twist_in_plane(positions: np.ndarray, velocity: np.ndarray, normal: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Least-squares twist (6,) at the sensor frame's origin of velocities (k, 3) at points (k, 3) of a plane; and its centre.

    The centre (3,), m, is NaN if rotation moves the rim of a contact of this radius, m, slower than 5 % of the translation.
    """
    middle, drift = positions.mean(axis=0), velocity - (velocity @ normal)[:, None] * normal
    mean = drift.mean(axis=0)
    around = np.cross(normal, positions - middle)
    spin = float((around * (drift - mean)).sum() / (around**2).sum())
    centre = np.full(3, np.nan)
    if abs(spin) * radius > 0.05 * np.linalg.norm(mean):
        centre = middle + np.cross(normal, mean) / spin
    return np.concatenate([mean - spin * np.cross(normal, middle), spin * normal]), centre
