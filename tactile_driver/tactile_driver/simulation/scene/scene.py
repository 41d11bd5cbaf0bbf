# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A scene: one sensor, the objects that touch it one after the other, and the rendered images."""
from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..constants import SIMULATION
from ..skin.contact import FrictionalContact, PlateContact
from ..skin.tools import Motion
from ..truth import FramesInOrder, SimulatedFrame, TruthFrame
from .observe import Observation, Observer, off_tool
from .specimen import Shutters, Specimen

#: One instant in one camera, as Renderer.draw takes it: shape, from Skin.coarse, m; uv: (K, 2) px, of the dots; spread: (K, 2, 2) px/m,
#: their affine maps.
Glance = tuple[np.ndarray, np.ndarray, np.ndarray]


class Scene(FramesInOrder[Observation]):
    """A sensor and the objects that touch it, in frames at a fixed rate.

    Attributes: sensor: type; camera; membrane: the skin; rows, columns: of dots; rate: frames/s; duration: s, of one round, then the scene
    repeats; frames: per round.
    With friction a state depends on the states before it, so states are computed in order and kept. render accepts times in any
    order and returns the same frame for the same time and seed. The first call for a late time computes all frames before it.
    """

    def __init__(self, specimen: Specimen, motions: list[Motion], duration: float, rate: float, friction: float):
        self.sensor, self.camera, self.membrane = specimen.sensor, specimen.cameras[0], specimen.skin
        self.rows, self.columns, self.rate = specimen.pattern.rows, specimen.pattern.columns, rate
        self.frames = max(int(round(duration * rate)), 1)
        self.duration = self.frames / rate
        self._motions, self._pattern, self._renderer = motions, specimen.pattern, specimen.renderers[0]
        plate = any(motion.tool.plate for motion in motions)
        for renderer in specimen.renderers if plate else ():
            renderer.open_frame()
        self._contact = PlateContact(specimen.skin) if plate else FrictionalContact(specimen.skin, friction)
        self._observer = Observer(specimen.skin, specimen.pattern, self.camera, 1 / rate)
        self._known: list[Observation] = []
        self._followed = 0.0

    def render(self, t: float) -> SimulatedFrame:
        """The frame nearest to time t, s, from the start; the scene repeats after its duration, its noise does not."""
        number = math.floor(t * self.rate + 0.5)
        seen = self.observe(number)
        image = self._renderer.draw(seen.shape, seen.truth.dot_uv, seen.spread, self._pattern.radius, number)
        return SimulatedFrame(image, seen.truth)

    def _next(self) -> Observation:
        """Compute the next frame."""
        end = len(self._known) / self.rate
        motion = self._move_to(end)
        if motion is None:
            return self._observer.lifted()
        if motion.tool.plate:
            return self._observer.observe_plate(self._contact.state, motion.pose(end))
        before, now = motion.pose(max(end - 1 / self.rate, motion.times[0])), motion.pose(end)
        seen = self._observer.observe(self._contact.state, motion.tool, before, now)
        if motion.tool.tip_radius is None or len(motion.tool.parts) > 1:
            return seen
        return replace(seen, truth=replace(seen.truth, tip=now.origin - [0, 0, motion.tool.tip_radius]))

    def _move_to(self, end: float) -> Motion | None:
        """Advance the contact to the time end, s. Returns the motion at that time, None without one."""
        start, self._followed = self._followed, end
        motion = next((motion for motion in self._motions if motion.covers(end)), None)
        if motion is None:
            self._contact.reset()
        else:
            self._follow(motion, max(start, motion.times[0]), end)
        return motion

    def _follow(self, motion: Motion, start: float, end: float):
        """Move one tool from the time start to the time end, s, in at most 40 steps, each of at most the skin's longest_step, and along
        the skin its longest_slide."""
        first, last = motion.pose(start), motion.pose(end)
        travel = (np.linalg.norm(last.origin - first.origin) + np.linalg.norm(last.other - first.other)) / self.membrane.spacing
        travel += SIMULATION.rotation_travel * np.linalg.norm(last.turn - first.turn)
        slide = np.linalg.norm((last.origin - first.origin)[:2]) / self.membrane.spacing
        steps = min(max(math.ceil(travel / self.membrane.longest_step), math.ceil(slide / self.membrane.longest_slide), 1), 40)
        before = first
        for part in range(1, steps + 1):
            now = motion.pose(start + (end - start) * part / steps)
            self._contact.step(motion.tool, before, now)
            before = now


class TwoCameraScene(Scene):
    """A scene seen by two cameras, which expose at different times.

    shutters: None for triggered ones. Other attributes: cameras: (left, right).
    """

    def __init__(self, specimen: Specimen, motions: list[Motion], duration: float, rate: float, friction: float,
                 shutters: Shutters | None = None):
        super().__init__(specimen, motions, duration, rate, friction)
        self.cameras = specimen.cameras
        self._delays = (shutters or Shutters(specimen.trigger_delay)).delays(self.frames, rate)
        self._renderers = specimen.renderers
        self._right_untouched = self._glance(None)
        self._known_right: list[Glance] = []

    def render(self, t: float) -> tuple[np.ndarray, np.ndarray, TruthFrame]:
        """Left and right image (height, width, 3) uint8 BGR of the frame nearest to time t, s, and its truth.

        The truth refers to the left exposure, and its dot_uv to the left camera.
        """
        number = math.floor(t * self.rate + 0.5)
        seen = self.observe(number)
        views = (seen.shape, seen.truth.dot_uv, seen.spread), self._known_right[number % self.frames]
        left, right = (renderer.draw(*view, self._pattern.radius, number) for renderer, view in zip(self._renderers, views))
        return left, right, seen.truth

    def right_delay(self, number: int) -> float:
        """Time, s, from the left to the right exposure of the frame number; negative where the right one is earlier."""
        return float(self._delays[number % self.frames])

    def right_dot_uv(self, number: int) -> np.ndarray:
        """Pixels (K, 2) of the dots in the right image of the frame number."""
        self.observe(number)
        return self._known_right[number % self.frames][1]

    def _next(self) -> Observation:
        """Compute the next frame: both views, in the order of their exposures."""
        number = len(self._known)
        if self.right_delay(number) < 0:
            self._look_right(number)
            return super()._next()
        seen = super()._next()
        self._look_right(number)
        return seen

    def _look_right(self, number: int) -> None:
        """Compute the right view of a frame."""
        motion = self._move_to(number / self.rate + self.right_delay(number))
        pressed = motion is not None and len(self._contact.state.touching) > 0
        self._known_right.append(self._glance(motion) if pressed else self._right_untouched)

    def _glance(self, motion: Motion | None) -> Glance:
        """The present view of the right camera; motion: of the touching tool, None without one."""
        shape = self._contact.state.shape
        correct = None if motion is None else (lambda positions: off_tool(positions, motion.tool, motion.pose(self._followed)))
        _, uv, spread = self._pattern.seen(shape, self.cameras[1], correct)
        return self.membrane.coarse(shape), uv, spread.astype(np.float32)
