# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From a state of skin and tool to the truth of a frame."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from .contact_region import Region, find_region
from ..optics.camera import SimulatedCamera
from ..optics.pattern import DotPattern
from ..skin.contact import SkinState
from ..skin.grid import Skin
from ..skin.motion import Pose
from ..skin.tools import Tool
from ..truth import GROSS, INCIPIENT, NON_CONTACT, NO_SLIP, SLIPPING, STICKING, Touch, TruthFrame

#: m/s: a point that moves slower than this over the tool sticks (10 um from frame to frame at 30 frames a second).
SLIP_SPEED = 0.3e-3
#: of the nodes' spacing: a dot nearer to the tool than this, inside the region, touches it.
_DOT_ON_TOOL = 0.0237


@dataclass
class Observation:
    """One instant: the skin's shape as Skin.coarse has it, m; the dots' paint in the picture, spread (K, 2, 2) px/m; truth."""

    shape: np.ndarray
    spread: np.ndarray
    truth: TruthFrame


class Observer:
    """Sees dots and contact of one skin through one camera; interval: s between frames."""

    def __init__(self, skin: Skin, pattern: DotPattern, camera: SimulatedCamera, interval: float):
        self.skin, self.pattern, self.camera, self.interval = skin, pattern, camera, interval
        self._ids = pattern.numbers
        self.untouched = self._observe_untouched()
        self._before = None

    def _observe_untouched(self) -> Observation:
        """The resting skin: one observation for all frames without contact."""
        places, uv, spread = self.pattern.seen(self.skin.rest, self.camera)
        truth = TruthFrame(self._ids, uv, places, np.full(len(uv), NON_CONTACT, np.uint8), pressure=self.skin.pressure)
        return Observation(self.skin.coarse(self.skin.rest), spread, truth)

    def observe(self, state: SkinState, tool: Tool, before: Pose, now: Pose) -> Observation:
        """The truth of a state under a tool that moved from the pose before (a frame ago) to the pose now."""
        region = find_region(self.skin, state, tool, now) if len(state.touching) else None
        if region is None:
            self._before = None
            return self.untouched
        places, uv, spread = self.pattern.seen(state.shape, self.camera, lambda p: off_tool(p, tool, now))
        nodes = state.shape.reshape(-1, 3)[self.skin.inner][state.touching]
        touching = self._touching_dots(places, region, tool, now)
        way_of_dots, way_of_nodes = self._ways_over_tool(places, touching, nodes, state, tool, now)
        states = self._states(touching, way_of_dots)
        truth = TruthFrame(self._ids, uv, places, states, region.outlines, region.holes, region.area, region.centroid, region.normal)
        truth.contacts = self._touches(state, nodes, region, tool, now)
        self._tell_slip(truth, nodes, way_of_nodes @ now.turn.T)
        truth.motion = _motion(before, now)
        truth.wrench = np.concatenate([state.force.sum(axis=0), np.cross(nodes, state.force).sum(axis=0)])
        truth.pressure = state.pressure
        return Observation(self.skin.coarse(state.shape), spread.astype(np.float32), truth)

    def _touching_dots(self, places: np.ndarray, region: Region, tool: Tool, pose: Pose) -> np.ndarray:
        """(K,) bool: the dot lies in the region and on the tool."""
        full = self.pattern.sampler.linear @ region.fullness.ravel()
        return (full > 0.5) & (np.abs(tool.distance(pose.to_tool(places))) < _DOT_ON_TOOL * self.skin.spacing)

    def _ways_over_tool(self, places, touching, nodes, state: SkinState, tool: Tool, pose: Pose) -> tuple[np.ndarray, np.ndarray]:
        """Ways (K, 3) of dots and (m, 3) of touching nodes along the tool since the last frame, in its frame, m; NaN for those that do not
        touch or have only just met it."""
        dots_on_tool, nodes_on_tool = np.full((len(places), 3), np.nan), np.full((self.skin.inner.sum(), 3), np.nan)
        dots_on_tool[touching] = pose.to_tool(places[touching])
        nodes_on_tool[state.touching] = pose.to_tool(nodes)
        last = self._before or (np.full_like(dots_on_tool, np.nan), np.full_like(nodes_on_tool, np.nan))
        self._before = dots_on_tool, nodes_on_tool
        return _way_along(tool, last[0], dots_on_tool), _way_along(tool, last[1], nodes_on_tool)[state.touching]

    def _states(self, touching: np.ndarray, way: np.ndarray) -> np.ndarray:
        """Dot states (K,) uint8."""
        states = np.where(touching, STICKING, NON_CONTACT).astype(np.uint8)
        states[np.linalg.norm(way, axis=1) > SLIP_SPEED * self.interval] = SLIPPING
        return states

    def _tell_slip(self, truth: TruthFrame, nodes: np.ndarray, way: np.ndarray):
        """Fill in slip from the ways (m, 3), m, of the touching nodes (m, 3) over the tool, in the sensor frame."""
        slipping = np.linalg.norm(way, axis=1) > SLIP_SPEED * self.interval
        truth.slipping_fraction = fraction = float(slipping.sum() / max(np.isfinite(way[:, 0]).sum(), 1))
        truth.slip_state = NO_SLIP if fraction < 0.05 else INCIPIENT if fraction < 0.9 else GROSS
        truth.velocity = np.zeros(6)
        if slipping.sum() >= 3:
            radius = np.sqrt(truth.area / np.pi)
            truth.velocity, truth.rotation_center = _twist_in_plane(nodes[slipping], -way[slipping] / self.interval, truth.normal, radius)

    def _touches(self, state: SkinState, nodes: np.ndarray, region: Region, tool: Tool, pose: Pose) -> list[Touch]:
        """One Touch for each part of the tool that touches."""
        part_of_node = tool.part_distances(pose.to_tool(nodes)).argmin(axis=0)
        areas = self.skin.area_vectors(state.shape)[self.skin.inner][state.touching]
        touches = []
        for part in np.unique(part_of_node):
            mine = part_of_node == part
            normal = region.normal if len(tool.parts) == 1 else areas[mine].sum(axis=0)
            normal = normal / np.linalg.norm(normal)
            centre = pose.to_sensor(np.asarray(tool.places[part]))
            position = region.centroid if tool.tip_radius is None else centre - [0, 0, tool.tip_radius]
            touching = self.skin.touching_height(tool.parts[part], pose.turn, centre[0], centre[1])
            touches.append(Touch(position, normal, float(touching - centre[2]), float(-(state.force[mine] @ normal).sum())))
        return touches


def off_tool(places: np.ndarray, tool: Tool, pose: Pose) -> np.ndarray:
    """Places (K, 3), m, those that interpolation between nodes has put inside the tool moved to its surface."""
    gap = tool.distance(pose.to_tool(places))
    inside = np.flatnonzero(gap < 0)
    if len(inside):
        depth, normal = tool.distance_and_normal(pose.to_tool(places[inside]))
        places[inside] -= depth[:, None] * (normal @ pose.turn.T)
    return places


def _way_along(tool: Tool, before: np.ndarray, now: np.ndarray) -> np.ndarray:
    """Ways (k, 3), m, along the tool's surface between places (k, 3) in the tool's frame; NaN where either is."""
    way = now - before
    both = np.flatnonzero(np.isfinite(way[:, 0]))
    if len(both):
        normal = tool.distance_and_normal(now[both])[1]
        way[both] -= np.einsum('ij,ij->i', way[both], normal)[:, None] * normal
    return way


def _motion(before: Pose, now: Pose) -> np.ndarray:
    """(6,) what the object has moved, m, at the sensor frame's origin, and turned, rad."""
    turn = now.turn @ before.turn.T
    return np.concatenate([now.origin - turn @ before.origin, cv2.Rodrigues(turn)[0].ravel()])


def _twist_in_plane(places: np.ndarray, velocity: np.ndarray, normal: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Twist (6,) at the sensor frame's origin of velocities (k, 3) at places (k, 3) in a plane (least squares); and where it stands still.

    That centre is NaN where the turn moves the rim of a contact of this radius, m, at less than a twentieth of the translation's speed.
    """
    middle, drift = places.mean(axis=0), velocity - (velocity @ normal)[:, None] * normal
    mean = drift.mean(axis=0)
    around = np.cross(normal, places - middle)
    spin = float((around * (drift - mean)).sum() / (around**2).sum())
    centre = np.full(3, np.nan)
    if abs(spin) * radius > 0.05 * np.linalg.norm(mean):
        centre = middle + np.cross(normal, mean) / spin
    return np.concatenate([mean - spin * np.cross(normal, middle), spin * normal]), centre
