# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A scene: one touchpad, the objects that touch it one after the other, and the pictures of that."""
from __future__ import annotations

import math

import numpy as np

from .camera import SimulatedCamera
from .contact import FrictionalContact
from .membrane import Membrane
from .motion import Motion
from .observe import Observation, Observer
from .pattern import DotPattern
from .rendering import Renderer
from .truth import SimulatedFrame

#: m: a tool that moves further than this between two frames is followed in several steps.
_LONGEST_STEP = 0.8e-3
_TOOL_SIZE = 0.006


class Scene:
    """A touchpad and what happens to it, in frames at a fixed rate.

    Attributes: camera; membrane (its radius, height, tension and rest pressure); rows, columns of dots; rate frames/s; duration s, after
    which it starts again; frames in one round.
    Friction makes a state depend on what was before, so states are worked out one after the other and kept; render may then be called with
    times in any order and gives the same frame for the same time and seed each time. The first call for a late time takes as long as all
    frames before it.
    """

    def __init__(self, motions: list[Motion], duration: float, rate: float, friction: float, membrane: Membrane, camera: SimulatedCamera,
                 pattern: DotPattern, renderer: Renderer):
        self.camera, self.membrane, self.rate = camera, membrane, rate
        self.rows, self.columns = pattern.rows, pattern.columns
        self.frames = max(int(round(duration * rate)), 1)
        self.duration = self.frames / rate
        self._motions, self._pattern, self._renderer = motions, pattern, renderer
        self._contact = FrictionalContact(membrane, friction)
        self._observer = Observer(membrane, pattern, camera, 1 / rate)
        self._known: list[Observation] = []

    def render(self, t: float) -> SimulatedFrame:
        """The frame nearest to time t s from the scene's start; the scene repeats after its duration, its noise does not."""
        number = math.floor(t * self.rate + 0.5)
        seen = self.observe(number)
        image = self._renderer.draw(seen.shape, seen.truth.dot_uv, seen.spread, self._pattern.radius, number)
        return SimulatedFrame(image, seen.truth)

    def render_clean(self, t: float) -> SimulatedFrame:
        """As render, without the sensor's noise."""
        seen = self.observe(math.floor(t * self.rate + 0.5))
        return SimulatedFrame(self._renderer.draw(seen.shape, seen.truth.dot_uv, seen.spread, self._pattern.radius, None), seen.truth)

    def observe(self, number: int) -> Observation:
        """State and truth of frame number (any; the scene repeats)."""
        number %= self.frames
        while len(self._known) <= number:
            self._known.append(self._next())
        return self._known[number]

    def _next(self) -> Observation:
        """The first frame that is not known yet."""
        end = len(self._known) / self.rate
        start = max(end - 1 / self.rate, 0.0)
        for motion in self._motions:
            if motion.covers(end):
                return self._follow(motion, max(start, motion.times[0]), end)
        self._contact.reset()
        return self._observer.untouched

    def _follow(self, motion: Motion, start: float, end: float) -> Observation:
        """Move one tool from the time start to the time end, in steps that are short enough."""
        first, last = motion.pose(start), motion.pose(end)
        way = np.linalg.norm(last.origin - first.origin) + _TOOL_SIZE * np.linalg.norm(last.turn - first.turn)
        steps = min(max(math.ceil(way / _LONGEST_STEP), 1), 40)
        before = first
        for part in range(1, steps + 1):
            now = motion.pose(start + (end - start) * part / steps)
            state = self._contact.step(motion.tool, before, now)
            before = now
        return self._observer.observe(state, motion.tool, first, last)
