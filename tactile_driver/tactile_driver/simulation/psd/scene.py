# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Scenes of the simulated PSD finger: objects press, tap and slide; ambient light drifts, flickers and is switched."""
from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ...errors import BadArgument
from .finger import COVER_RADIUS, Design, Electronics, FingerSpecimen
from ..truth import Touch


# s, ages of what the cover remembers of a contact, alike: a compliance that grows with the logarithm of time, as of filled rubbers. Chosen
_AGES_S = np.geomspace(0.003, 0.2, 10)


@dataclass(frozen=True)
class Act:
    """One contact from start to end, s, that moves from begins to ends, both (phi, theta), rad; depth: m, reached within rise, s, and
    released within rise before the end."""

    start: float
    end: float
    begins: tuple[float, float]
    ends: tuple[float, float]
    depth: float
    rise: float = 0.02

    def at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Unit normals (N, 3) and depths (N,), m, 0 without contact, at times (N,), s."""
        part = np.clip((t - self.start) / (self.end - self.start), 0, 1)
        phi, theta = (a + (b - a) * part for a, b in zip(self.begins, self.ends))
        normal = np.stack([np.cos(phi) * np.sin(theta), np.sin(phi) * np.sin(theta), np.cos(theta)], axis=1)
        edge = np.clip(np.minimum(t - self.start, self.end - t) / self.rise, 0, 1)
        return normal, self.depth * 0.5 * (1 - np.cos(math.pi * edge))


@dataclass(frozen=True)
class Ambient:
    """Ambient light, as the sum of the outputs, V. level; drift: amplitude, with its period, s; flicker: amplitude at 100 Hz, the flicker
    of lamps at 50 Hz mains; steps: (time in s, change in V), each within rise, s; shade: part that an object near the finger hides."""

    level: float = 0.3
    drift: float = 0.0
    period: float = 30.0
    flicker: float = 0.01
    steps: tuple[tuple[float, float], ...] = ()
    rise: float = 0.0
    shade: float = 0.0

    def at(self, t: np.ndarray) -> np.ndarray:
        """Ambient light (N,), V, at times (N,), s."""
        light = self.level + self.drift * np.sin(2 * math.pi * t / self.period) + self.flicker * np.sin(200 * math.pi * t)
        for when, change in self.steps:
            light = light + change * np.clip((t - when) / max(self.rise, 1e-9), 0, 1)
        return light


@dataclass(frozen=True)
class PsdScript:
    """acts: contacts, in sequence or simultaneous; duration: s; ambient: the ambient light."""

    acts: list[Act]
    duration: float
    ambient: Ambient = field(default_factory=Ambient)


@dataclass(frozen=True)
class PsdTruth:
    """Ground truth of N samples. touching: (N,) number of touching objects; normal (N, 3), force (N,), N, and depth (N,), m, of the first
    one, NaN without contact."""

    touching: np.ndarray
    normal: np.ndarray
    force: np.ndarray
    depth: np.ndarray

    def touches(self, k: int) -> list[Touch]:
        """The first contact of sample k in a list; empty without contact."""
        if not self.touching[k]:
            return []
        return [Touch(COVER_RADIUS * self.normal[k], self.normal[k], float(self.depth[k]), float(self.force[k]))]


class PsdScene:
    """Plays a script on a specimen at rate samples/s; seed: of specimen and noise. Raises BadArgument for a rate that is not positive and
    finite."""

    sensor = 'psd_finger'

    def __init__(self, script: PsdScript, rate: float, seed: int = 0, electronics: Electronics = Electronics(), design: Design = Design()):
        if not 0 < rate < math.inf:
            raise BadArgument(f'simulation: rate is {rate!r}; give samples per second, more than 0')
        self.specimen, self.electronics, self.rate = FingerSpecimen(seed, design), electronics, rate
        self.script, self._rng = script, np.random.default_rng([7, seed])

    @property
    def samples(self) -> int:
        """Number of samples of the whole scene."""
        return round(self.script.duration * self.rate)

    def play(self, first: int, count: int, lit: np.ndarray | None = None) -> tuple[np.ndarray, PsdTruth]:
        """Counts (count, 4) uint16 and truth of the samples first to first + count - 1; the scene repeats. lit: (count,) bool, whether the
        finger's own light is on, None for always."""
        t = (first + np.arange(count)) / self.rate
        within = t % self.script.duration
        near = np.zeros(count, bool)
        for act in self.script.acts:
            near |= (within > act.start) & (within < act.end)
        room = self.script.ambient.at(within) * (1 - self.script.ambient.shade * near)
        volts = self.specimen.dark + room[:, None] * self.specimen.electrodes(self.specimen.stray)
        truth = PsdTruth(np.zeros(count, int), np.full((count, 3), np.nan), np.full(count, np.nan), np.full(count, np.nan))
        for act in self.script.acts:
            some = np.flatnonzero((within > act.start) & (within < act.end))
            if len(some):
                normal, depth = act.at(within[some])
                volts[some] += self.specimen.light(*self._shown(act, within[some])) * (1.0 if lit is None else lit[some, None])
                self._note(truth, some, normal, depth)
        return self.electronics.counts(volts * self.specimen.gains, self._rng), truth

    def _shown(self, act: Act, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Unit normals (N, 3) and depths (N,), m, that the cover shows at times (N,), s: it remembers a part of what was there before, the
        longer ago the less."""
        normal, depth = act.at(t)
        past = t - _AGES_S[:, None]
        places, depths = act.at(past.ravel())
        places = np.where((past > act.start)[..., None], places.reshape(*past.shape, 3), normal)
        creep = self.specimen.material.creep
        shown = (1 - creep) * normal + creep * places.mean(0)
        return shown / np.linalg.norm(shown, axis=1, keepdims=True), (1 - creep) * depth + creep * depths.reshape(past.shape).mean(0)

    def _note(self, truth: PsdTruth, some: np.ndarray, normal: np.ndarray, depth: np.ndarray) -> None:
        touches = depth >= self.specimen.material.gap
        first = touches & (truth.touching[some] == 0)
        truth.touching[some] += touches
        for known, value in ((truth.normal, normal), (truth.depth, depth), (truth.force, self.specimen.force(depth))):
            known[some[first]] = value[first]


def _press(start: float, phi: float, theta: float, depth: float, last: float = 0.3, rise: float = 0.02) -> Act:
    place = math.radians(phi), math.radians(theta)
    return Act(start, start + last, place, place, depth, rise)


def _calibration() -> PsdScript:
    """About a hundred presses at the pole and on rings, each at one of three depths."""
    places = [(0.0, 0.0)] * 3
    for ring, theta in enumerate(range(10, 71, 10)):
        around = min(6 + 2 * (theta // 10 - 1) + 4, 18)
        places += [(360.0 * (k + 0.37 * ring) / around, float(theta)) for k in range(around)]
    acts = [_press(0.5 + 0.45 * k, phi, theta, (2.4e-4, 3.0e-4, 3.6e-4)[k % 3]) for k, (phi, theta) in enumerate(places)]
    return PsdScript(acts, acts[-1].end + 0.5)


def _taps() -> PsdScript:
    """Taps of 78 ms at 3.2 Hz (paper psd_finger, section 6.3)."""
    acts = [_press(0.5 + k / 3.2, 40.0 * k, 20.0 + 4 * (k % 8), 3.0e-4, 0.1, 0.05) for k in range(16)]
    return PsdScript(acts, acts[-1].end + 0.5)


def _grid(depth: float = 2.8e-4, ambient: Ambient = Ambient()) -> PsdScript:
    """The pole and six azimuths at four polar angles (paper psd_finger, section 6.2): 25 places, other than those of the calibration."""
    places = [(0.0, 0.0)] + [(phi + 11.0, theta) for theta in (15.0, 30.0, 45.0, 60.0) for phi in range(0, 360, 60)]
    acts = [_press(0.5 + 0.45 * k, phi, theta, depth) for k, (phi, theta) in enumerate(places)]
    return PsdScript(acts, acts[-1].end + 0.5, ambient)


def _bright() -> PsdScript:
    """The grid in a bright room."""
    return _grid(ambient=Ambient(1.3, 0.15, 9.0, 0.07, shade=0.06))


def _lamp() -> PsdScript:
    """A lamp is switched on while an object rests on the finger, and off during the next touch."""
    acts = [_press(0.5, 40, 50, 3.0e-4, 2.0), _press(3.5, 200, 35, 2.6e-4, 2.0)]
    return PsdScript(acts, 6.5, Ambient(0.35, steps=((1.5, 0.6), (4.5, -0.6)), rise=0.02, shade=0.05))


def _swing() -> PsdScript:
    """An object slides back and forth through the pole, at up to 900 degrees a second."""
    way = [(0.8, math.radians(side * 55)) for side in (-1, 1, -1, 1, -1)]
    acts = [Act(0.5 + 0.12 * k, 0.62 + 0.12 * k, *pair, 3.2e-4, 0.004) for k, pair in enumerate(zip(way, way[1:]))]
    return PsdScript(acts, 1.5)


def _demo() -> PsdScript:
    way = [(0, 0), (30, 40), (120, 55), (200, 30), (290, 60), (360, 10)]
    acts = [_press(1.0 + 0.6 * k, phi, theta, 3.0e-4, 0.4) for k, (phi, theta) in enumerate(way)]
    slide = Act(5.0, 9.0, (0.0, math.radians(55)), (4 * math.pi, math.radians(10)), 3.2e-4, 0.05)
    return PsdScript([*acts, slide], 10.0, Ambient(drift=0.05))


def _slide() -> PsdScript:
    across = Act(0.5, 3.0, (0.3, math.radians(-62)), (0.3, math.radians(62)), 3.2e-4, 0.05)
    return PsdScript([across], 3.5)


def _light() -> PsdScript:
    steps = ((4.0, 0.25), (7.0, -0.25), (10.0, 0.8), (13.0, 0.4), (16.0, -1.2))
    return PsdScript([], 20.0, Ambient(0.4, 0.15, 12.0, 0.02, steps))


def _two() -> PsdScript:
    """One object, then a second one on the opposite side."""
    return PsdScript([_press(0.5, 45, 40, 3.0e-4, 2.0), _press(1.2, 225, 40, 3.0e-4, 0.8)], 3.0)


PSD_SCENES: dict[str, Callable[[], PsdScript]] = {
    'demo': _demo, 'rest': lambda: PsdScript([], 10.0), 'calibration': _calibration, 'grid': _grid, 'taps': _taps, 'slide': _slide,
    'light': _light, 'two': _two, 'bright': _bright, 'weak': lambda: _grid(1.9e-4), 'lamp': _lamp, 'swing': _swing}


def open_psd_scene(name: str, rate: float, seed: int = 0, design: Design = Design()) -> PsdScene:
    """The scene of that name at rate samples/s, on a finger of that design.

    Raises BadArgument for an unknown name (the message lists the known ones) or rate.
    """
    if name not in PSD_SCENES:
        raise BadArgument(f'simulation: scene {name!r} is unknown; choose one of {", ".join(sorted(PSD_SCENES))}')
    return PsdScene(PSD_SCENES[name](), rate, seed, design=design)
