# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The demo's numbers of each frame, their statistics, and the lines of text that show both. No ROS here."""
from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from ..visualization.colours import STATE_NAMES

_NAN = float('nan')
_RECENT = 90  # frames, 3 s at 30 Hz
_LONGEST_LATENCY_S = 60.0  # chosen: older stamps are those of a recording, of which no latency is known


@dataclass(frozen=True)
class Reading:
    """The results of one frame; unknown is NaN or empty.

    stamp_s: of exposure; latency_s: from exposure to receipt of the last result; dots: number; displacement: largest, px; states: numbers
    of untouched, sticking, slipping dots, () without a contact region; area: m^2; depth: m, deepest contact; force: N; touches: number of
    contacts; motion: (6,) translation, m, and rotation vector, rad, of the object over motion_interval, s; slip: name of the state;
    slipping: slipping fraction of the contact, 0 to 1.
    """

    stamp_s: float
    latency_s: float = _NAN
    dots: int = 0
    displacement: float = _NAN
    states: tuple[int, ...] = ()
    area: float = _NAN
    depth: float = _NAN
    force: float = _NAN
    touches: int = 0
    motion: tuple[float, ...] = (_NAN,) * 6
    motion_interval: float = _NAN
    slip: str = ''
    slipping: float = _NAN


class Summary:
    """Rate, latency and maxima of the readings so far, as lines of text. refused: number of messages that failed their check."""

    def __init__(self):
        self.frames = self.refused = 0
        self.first_s = self.last_s = _NAN
        self.largest: dict[str, float] = {}
        self._latencies: list[float] = []
        self._stamps: deque[float] = deque(maxlen=_RECENT)

    def add(self, reading: Reading) -> None:
        """Add one frame."""
        if not self.frames:
            self.first_s = reading.stamp_s
        self.frames, self.last_s = self.frames + 1, reading.stamp_s
        self._stamps.append(reading.stamp_s)
        self._latencies.append(reading.latency_s)
        for name in ('displacement', 'area', 'depth', 'force'):
            value = getattr(reading, name)
            if value > self.largest.get(name, 0.0):
                self.largest[name] = value

    @property
    def rate(self) -> float:
        """Frames per second over the last 90 frames, by their stamps; NaN before the third."""
        span = self._stamps[-1] - self._stamps[0] if len(self._stamps) > 2 else 0.0
        return (len(self._stamps) - 1) / span if span > 0 else _NAN

    def latency_ms(self, percent: float, lately: bool = True) -> float:
        """Percentile of the latency, ms, over the last 90 frames or over all."""
        kept = self._latencies[-_RECENT:] if lately else self._latencies
        kept = [x for x in kept if abs(x) < _LONGEST_LATENCY_S]  # NaN is not
        return 1e3 * float(np.percentile(kept, percent)) if kept else _NAN

    def panel(self, reading: Reading) -> list[str]:
        """Five lines for a terminal, to be overwritten by those of the next frame."""
        return [f'time      {reading.stamp_s - self.first_s:6.1f} s   {number(self.rate, ".1f")} Hz   '
                f'latency {number(self.latency_ms(50), ".0f")} ms (95 %: {number(self.latency_ms(95), ".0f")} ms)',
                f'dots      {reading.dots:4d}   {states_line(reading.states)}',
                f'contact   {contact_line(reading)}', f'motion    {motion_line(reading)}', f'slip      {slip_line(reading)}']

    def line(self, reading: Reading) -> str:
        """One line for a log."""
        parts = [f'{reading.stamp_s - self.first_s:5.1f} s', f'{reading.dots} dots', states_line(reading.states), contact_line(reading)]
        if reading.touches:
            parts += [motion_line(reading), slip_line(reading)]
        return ' | '.join(p for p in [*parts, f'{number(self.rate, ".0f")} Hz, {number(self.latency_ms(50), ".0f")} ms'] if p)

    def report(self) -> list[str]:
        """The last lines: frames, rate, latency, maxima, refused messages."""
        units = {'displacement': ('px', 1.0, '.1f'), 'area': ('mm^2', 1e6, '.0f'), 'depth': ('mm', 1e3, '.1f'), 'force': ('N', 1.0, '.1f')}
        largest = [f'{name} {factor * self.largest[name]:{form}} {unit}'
                   for name, (unit, factor, form) in units.items() if name in self.largest]
        mean = (self.frames - 1) / (self.last_s - self.first_s) if self.last_s > self.first_s else _NAN
        return [f'{self.frames} frames, {number(mean, ".1f")} Hz, latency {number(self.latency_ms(50, False), ".0f")} ms '
                f'(95 %: {number(self.latency_ms(95, False), ".0f")} ms)', 'largest ' + (', '.join(largest) or 'values unknown'),
                *([f'refused messages: {self.refused}, see above'] if self.refused else [])]


def number(value: float, form: str) -> str:
    """The value formatted, or '-' when unknown."""
    return format(value, form) if math.isfinite(value) else '-'


def states_line(states: tuple[int, ...]) -> str:
    """Number of dots in each state."""
    return ', '.join(f'{count} {name}' for name, count in zip(STATE_NAMES, states))


def contact_line(reading: Reading) -> str:
    """Number of contacts, area, depth, force; without a contact region the largest displacement of a dot."""
    if not reading.states:
        return f'largest displacement {number(reading.displacement, ".1f")} px'
    if not reading.touches:
        return 'no contact'
    return (f'{reading.touches} touch{"es" if reading.touches > 1 else ""}, {number(1e6 * reading.area, ".0f")} mm^2, '
            f'{number(1e3 * reading.depth, ".2f")} mm deep, {number(reading.force, ".2f")} N')


def motion_line(reading: Reading) -> str:
    """Speed and turning rate of the object."""
    if not reading.motion_interval > 0 or not np.isfinite(reading.motion).all():
        return 'unknown'
    speed = np.array(reading.motion) / reading.motion_interval
    x, y, z = 1e3 * speed[:3]
    return f'({x:+.1f}, {y:+.1f}, {z:+.1f}) mm/s, turning {np.degrees(np.linalg.norm(speed[3:])):.0f} deg/s'


def slip_line(reading: Reading) -> str:
    """Slip state and slipping fraction of the contact."""
    if not reading.slip:
        return '-'
    return reading.slip + (f', {100 * reading.slipping:.0f} % of the contact' if reading.slipping > 0 else '')
