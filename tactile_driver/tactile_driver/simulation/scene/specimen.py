# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""One simulated sensor as it was built, and what a scene does to it."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from ..optics.camera import SimulatedCamera
from ..optics.pattern import DotPattern
from ..optics.rendering import Renderer
from ..skin.grid import Skin
from ..skin.motion import Key

Act = tuple[str, list[Key]]

#: s: each scene begins with nothing touching for this long, for whoever takes a reference.
UNTOUCHED = 1.5
#: s: the same where everything is started at once, on a machine that may be busy.
STARTING = 4.0
#: m and s: a tool comes from this far above the skin, in this time, and leaves to there.
_ABOVE, _COMING = -0.0015, 0.25


@dataclass(frozen=True)
class Specimen:
    """sensor: type; cameras and renderers: one or two, in the same order; trigger_delay: s, by which the second camera is late."""

    sensor: str
    skin: Skin
    pattern: DotPattern
    cameras: tuple[SimulatedCamera, ...]
    renderers: tuple[Renderer, ...]
    trigger_delay: float = 0.0


@dataclass(frozen=True)
class Script:
    """build: makes a specimen of (seed) or (seed, width px); acts: tool name and keys, one after the other;
    friction: coefficient; duration: s, the least."""

    build: Callable[..., Specimen]
    acts: tuple[Act, ...] = ()
    friction: float = 0.35
    duration: float = 0.0


def act(tool: str, start: float, *places: dict, x: float = 0.0, y: float = 0.0) -> Act:
    """A tool that comes from above to x, y m at the time start, s, goes through places (Key's fields; t: s after the start) and leaves.

    What a place does not name stays as it was.
    """
    keys = [Key(start, x, y, press=0.0)]
    for place in places:
        keys.append(replace(keys[-1], **{**place, 't': start + place['t']}))
    first, last = (replace(key, press=_ABOVE) for key in (keys[0], keys[-1]))
    return tool, [replace(first, t=start - _COMING), *keys, replace(last, t=last.t + _COMING)]


def press(tool: str, x: float, y: float, *depths: float, start: float, move: float = 0.3, hold: float = 0.2) -> Act:
    """A tool that goes down at x, y, m, and stops at each of the depths, m; move, hold: s for each step and stop."""
    places, t = [], 0.0
    for depth in depths:
        places += [{'t': t + move, 'press': depth}, {'t': t + move + hold}]
        t += move + hold
    return act(tool, start, *places, {'t': t + move, 'press': 0.0}, x=x, y=y)


def drag(tool: str, x: float, y: float, depth: float, way_x: float, way_y: float, *, start: float, duration: float = 1.5) -> Act:
    """A tool that goes depth m down at x, y, m, and then (way_x, way_y) m along the skin in duration s."""
    return act(tool, start, {'t': 0.4, 'press': depth}, {'t': 0.6}, {'t': 0.6 + duration, 'x': x + way_x, 'y': y + way_y},
               {'t': 0.8 + duration}, {'t': 1.2 + duration, 'press': 0.0}, x=x, y=y)


def one_after_the_other(acts: list[Callable[[float], Act]], untouched: float = UNTOUCHED, pause: float = 1.0) -> tuple[Act, ...]:
    """The acts, each a function of its start, s, by keyword; each pause s after the one before has gone; untouched: s before the first."""
    played, t = [], untouched + _COMING
    for play in acts:
        played.append(play(start=t))
        t = played[-1][1][-1].t + pause + _COMING
    return tuple(played)
