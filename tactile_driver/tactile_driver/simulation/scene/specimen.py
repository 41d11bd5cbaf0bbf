# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""One simulated sensor with its tolerances, scripts of the motions of tools over it, and when the second of two cameras exposes."""
from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..optics.camera import SimulatedCamera
from ..optics.pattern import DotPattern
from ..optics.rendering import Renderer
from ..skin.surfaces import Skin
from ..skin.tools import Key


@dataclass(frozen=True)
class Timing:
    """When a scene's tools touch."""

    untouched: float = 1.5  # s: without contact at the start of each scene, for taking a reference
    starting: float = 4.0  # s: the same for scenes that start together with all nodes, on a possibly busy machine
    above: float = -0.0015  # m: height above the skin from which a tool approaches
    approach: float = 0.25  # s: duration of approach and retreat
    max_delay: float = 0.45  # of two exposures, in frame periods; below one half: exposures of the same number are the nearest ones


TIMING = Timing()

Act = tuple[str, list[Key]]


@dataclass(frozen=True)
class Specimen:
    """sensor: type; cameras, renderers: one or two each, in the same order; trigger_delay: s, delay of the
    second camera where a trigger starts both."""

    sensor: str
    skin: Skin
    pattern: DotPattern
    cameras: tuple[SimulatedCamera, ...]
    renderers: tuple[Renderer, ...]
    trigger_delay: float = 0.0


@dataclass(frozen=True)
class Shutters:
    """Exposures of the right camera relative to those of the left one.

    offset: s, mean delay of the right camera; swing: s, amplitude of the slow drift of this delay, one period per scene; jitter: s,
    standard deviation of single exposures; seed: of the jitter. The delay is limited to TIMING.max_delay of a frame period.
    """

    offset: float = 0.0
    swing: float = 0.0
    jitter: float = 0.0
    seed: int = 0

    def delays(self, frames: int, rate: float) -> np.ndarray:
        """(frames,) s: delay of the right exposure of each frame of a scene at rate frames/s; negative where it is the earlier one."""
        drift = self.offset + self.swing * np.sin(2 * np.pi * np.arange(frames) / frames)
        delay = drift + np.random.default_rng([self.seed, 5]).normal(0, self.jitter, frames)
        return np.clip(delay, -TIMING.max_delay / rate, TIMING.max_delay / rate)


@dataclass(frozen=True)
class Script:
    """build: function of (seed) or (seed, width in px) that makes a specimen; acts: (tool name, keys), in order; friction: coefficient;
    duration: s, lower limit; shutters: of two cameras that run free, None for triggered ones."""

    build: Callable[..., Specimen]
    acts: tuple[Act, ...] = ()
    friction: float = 0.35
    duration: float = 0.0
    shutters: Shutters | None = None


def act(tool: str, start: float, *waypoints: dict, x: float = 0.0, y: float = 0.0) -> Act:
    """A tool approaches from above to x, y, m, at the time start, s, moves through waypoints and retreats.

    waypoints: fields of Key, with t in s after start; a field that a waypoint omits keeps its value.
    """
    keys = [Key(start, x, y, press=0.0)]
    for waypoint in waypoints:
        keys.append(replace(keys[-1], **{**waypoint, 't': start + waypoint['t']}))
    first, last = (replace(key, press=TIMING.above) for key in (keys[0], keys[-1]))
    return tool, [replace(first, t=start - TIMING.approach), *keys, replace(last, t=last.t + TIMING.approach)]


def acting(tool: str, *waypoints: dict, **at: float) -> Callable[..., Act]:
    """act, as a function of its start."""
    return lambda start: act(tool, start, *waypoints, **at)


def press(tool: str, x: float, y: float, *depths: float, start: float, move: float = 0.3, hold: float = 0.2) -> Act:
    """A tool is pressed in at x, y, m, and stops at each of the depths, m; move, hold: duration of each step and stop, s."""
    waypoints, t = [], 0.0
    for depth in depths:
        waypoints += [{'t': t + move, 'press': depth}, {'t': t + move + hold}]
        t += move + hold
    return act(tool, start, *waypoints, {'t': t + move, 'press': 0.0}, x=x, y=y)


def session(tool: str, positions: list[tuple], *depths: float) -> list[Callable[..., Act]]:
    """A person with a stage presses a tool in at each of the positions (x, y), m, and holds it still at each of the depths, m."""
    return [partial(press, tool, x, y, *depths, move=0.6, hold=0.7) for x, y in positions]


def by_the_step(tool: str, positions: Sequence[tuple], *depths: float) -> tuple[Act, ...]:
    """A stage presses a tool in at each of the positions (x, y), m, or (x, y, depth), m, and stops there at each of the depths, m; at 2
    frames/s each stop is one frame."""
    return one_after_the_other([partial(press, tool, *position, *depths, move=0.25, hold=0.25) for position in positions],
                               untouched=1.75, pause=0.5)


def drag(tool: str, position: Sequence[float], depth: float, path: Sequence[float], *, start: float, duration: float = 1.5) -> Act:
    """A tool is pressed in by depth, m, at a position (x, y), m, and then moves along the skin by path (2,), m, within duration, s."""
    (x, y), (dx, dy) = position, path
    return act(tool, start, {'t': 0.4, 'press': depth}, {'t': 0.6}, {'t': 0.6 + duration, 'x': x + dx, 'y': y + dy},
               {'t': 0.8 + duration}, {'t': 1.2 + duration, 'press': 0.0}, x=x, y=y)


def one_of_two(tool: str, pose: tuple[float, float, float], depth: float, deeper: float, travel: float, *, start: float) -> Act:
    """A tool of two parts is pressed in by depth, m, at a pose (x, y, yaw), m and rad; then the part at x > 0 goes deeper, m, and moves by
    travel, m, away from the other."""
    x, y, yaw = pose
    apart = {'other_x': travel * math.cos(yaw), 'other_y': travel * math.sin(yaw)}
    name, keys = act(tool, start, {'t': 0.4, 'press': depth}, {'t': 0.6}, {'t': 0.9, 'other_press': deeper}, {'t': 1.1},
                     {'t': 2.1, **apart}, {'t': 2.3}, {'t': 2.7, 'press': 0.0, 'other_press': 0.0}, x=x, y=y)
    return name, [replace(key, yaw=yaw) for key in keys]


def one_after_the_other(acts: list[Callable[[float], Act]], untouched: float = TIMING.untouched, pause: float = 1.0) -> tuple[Act, ...]:
    """The acts in sequence. acts: functions of the keyword start, s; untouched: s, before the first act; pause: s, between two acts."""
    played, t = [], untouched + TIMING.approach
    for play in acts:
        played.append(play(start=t))
        t = played[-1][1][-1].t + pause + TIMING.approach
    return tuple(played)
