# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated PSD finger, and its scenes: objects press, tap and slide; ambient light drifts, flickers and is switched."""
from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import BadArgument, by_name
from .constants import SIMULATION
from .truth import Touch

# The model covers what determines the four voltages. An object presses the cover towards the waveguide. Before contact the cover reflects
# leaking light; in contact a patch of finite size scatters light. The tapered, irregular fibre plate leads the light of each point of the
# patch to the detector, where four electrodes share the current.


# Points (radius, angle) of the unit disc that stand for a patch.
_PATCH = [(0.0, 0.0)] + [(0.55, k * math.pi / 3) for k in range(6)] + [(0.92, (k + 0.5) * math.pi / 6) for k in range(12)]


@dataclass(frozen=True)
class Material:
    """gap: m, between cover and waveguide; soft, hard: stiffness, N/m before and N/m^1.5 after they touch; leak: V, reflected light when
    they just touch; scatter: V, of a patch of 1 mm^2 at the pole; glow: m, radius of the reflecting area of the cover; creep: part of its
    position and depth that a contact shows late."""

    gap: float = 1.1e-4
    soft: float = 1200.0
    hard: float = 1.1e6
    leak: float = 0.30
    scatter: float = 0.85
    glow: float = 2.4e-3
    creep: float = 0.03


class FingerSpecimen:
    """One finger; seed: of its irregularities."""

    def __init__(self, seed: int = 0):
        rng = np.random.default_rng([20260, seed])
        self.material = Material()
        self._reach = 0.66 * (1 + 0.03 * rng.standard_normal())  # radius of the rim's image, in half widths of the detector
        self._squeeze = 0.10 + 0.03 * rng.standard_normal()  # how much more the plate magnifies at the rim
        self._oval = rng.normal(0, 0.015, (3, 2))
        self._twist = rng.normal(0, 0.015)
        self._waves = rng.normal(0, 2.2, (SIMULATION.distortion_waves, 2))
        self._phases = rng.uniform(0, 2 * math.pi, (SIMULATION.distortion_waves, 2))
        self._heights = rng.normal(0, 0.0022, (SIMULATION.distortion_waves, 2))
        self._turn, self._shift = rng.normal(0, 0.015), rng.normal(0, 0.03, 2)
        self._lamps = rng.normal(0, 0.06, 2)
        self.gains = 1 + rng.normal(0, 0.006, 4)
        self.dark = 0.03 + rng.normal(0, 0.004, 4)
        self.stray = rng.normal(0, 0.15, 2)

    def force(self, depth: np.ndarray) -> np.ndarray:
        """Force, N, for the indentation depth of the cover, m: linear up to the gap, then with the power 1.5 (Hertz contact)."""
        into = np.maximum(depth - self.material.gap, 0)
        return self.material.soft * np.clip(depth, 0, self.material.gap) + self.material.hard * into**1.5

    def plate(self, normal: np.ndarray) -> np.ndarray:
        """Positions (..., 2) on the detector, in half widths, of the fibres from unit directions (..., 3)."""
        polar, around = _angles(normal)
        far = 2 * polar / math.pi
        radius = self._reach * far * (1 + self._squeeze * far * far)
        for order, (c, s) in enumerate(self._oval, 1):
            radius = radius * (1 + far * (c * np.cos(order * around) + s * np.sin(order * around)))
        turned = around + self._twist * far + self._turn
        end = np.stack([radius * np.cos(turned), radius * np.sin(turned)], axis=-1)
        argument = end @ self._waves.T
        return end + (np.sin(argument[..., None] + self._phases) * self._heights).sum(-2) + self._shift

    def transmission(self, normal: np.ndarray) -> np.ndarray:
        """Fraction (...) of light transmitted by the fibres from unit directions (..., 3): less for bent fibres."""
        polar, around = _angles(normal)
        ring = 1 + polar * (self._lamps[0] * np.cos(4 * around) + self._lamps[1] * np.sin(3 * around))
        return ring * np.cos(np.minimum(polar, 1.4)) / (1 + (polar / 1.05) ** 6)

    def light(self, normal: np.ndarray, depth: np.ndarray) -> np.ndarray:
        """Voltages (N, 4), V, for an object pressed in by depth (N,), m, along unit normals (N, 3)."""
        near = np.clip(depth / self.material.gap, 0, 1)
        into = np.maximum(depth - self.material.gap, 0)
        spot = np.sqrt(2 * SIMULATION.cover_radius * into)
        brightness = self.material.scatter * (math.pi * spot**2 * 1e6) ** 0.75
        glowing = self.material.leak * near**2.6
        return self._patch(normal, spot, brightness) + self._patch(normal, np.full(len(normal), self.material.glow), glowing)

    def _patch(self, normal: np.ndarray, radius: np.ndarray, brightness: np.ndarray) -> np.ndarray:
        """Voltages (N, 4), V, of round patches around unit normals (N, 3), of radius (N,), m, and brightness (N,), V."""
        first = np.cross(normal, np.where(np.abs(normal[:, :1]) < 0.8, [[1.0, 0, 0]], [[0, 1.0, 0]]))
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        second = np.cross(normal, first)
        share, angle = np.array(_PATCH).T
        tilt = share * (radius / SIMULATION.cover_radius)[:, None]
        offset = np.cos(angle)[:, None] * first[:, None] + np.sin(angle)[:, None] * second[:, None]
        points = np.cos(tilt)[..., None] * normal[:, None] + np.sin(tilt)[..., None] * offset
        led = self.transmission(points) * (brightness / len(_PATCH))[:, None]
        return (self.electrodes(self.plate(points)) * led[..., None]).sum(1)

    def electrodes(self, position: np.ndarray) -> np.ndarray:
        """Fractions (..., 4) of the electrodes x1, y1, x2, y2 for light at positions (..., 2), half widths; nearer corners take more."""
        u, w = position[..., 0], position[..., 1]
        u, w = u * (1 + 0.01 * w * w), w * (1 + 0.01 * u * u)
        left, right, low, high = (1 - u) / 2, (1 + u) / 2, (1 - w) / 2, (1 + w) / 2
        return np.stack([left * low, right * low, right * high, left * high], axis=-1)


def _angles(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Polar angle and azimuth (...), rad, of directions (..., 3)."""
    return np.arctan2(np.hypot(normal[..., 0], normal[..., 1]), normal[..., 2]), np.arctan2(normal[..., 1], normal[..., 0])


@dataclass(frozen=True)
class Electronics:
    """noise: V, of each output; shot: V, shot noise variance per volt; limit: V, saturation of the amplifiers; full_scale: V; bits: of the
    converter."""

    noise: float = 0.011
    shot: float = 1.0e-5
    limit: float = 4.95
    full_scale: float = 5.0
    bits: int = 12

    def counts(self, volts: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Counts (N, 4) uint16 of voltages (N, 4), V, with noise from rng."""
        noisy = volts + rng.standard_normal(volts.shape) * np.sqrt(self.noise**2 + self.shot * np.maximum(volts, 0))
        return np.clip(np.clip(noisy, 0, self.limit) / self.full_scale * 2**self.bits, 0, 2**self.bits - 1).astype(np.uint16)


# s, ages of the contact of which the cover keeps equal parts: a compliance that grows with the logarithm of time, as of filled rubbers
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
        return [Touch(SIMULATION.cover_radius * self.normal[k], self.normal[k], float(self.depth[k]), float(self.force[k]))]


class PsdScene:
    """Plays a script on a specimen at rate samples/s; seed: of specimen and noise. Raises BadArgument for a rate that is not positive and
    finite."""

    sensor = 'psd_finger'

    def __init__(self, script: PsdScript, rate: float, seed: int = 0):
        if not 0 < rate < math.inf:
            raise BadArgument(f'simulation: rate is {rate!r}; give samples per second, more than 0')
        self.specimen, self.electronics, self.rate = FingerSpecimen(seed), Electronics(), rate
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
        near = np.any([(within > act.start) & (within < act.end) for act in self.script.acts] or [np.zeros(count, bool)], axis=0)
        room = self.script.ambient.at(within) * (1 - self.script.ambient.shade * near)
        volts = self.specimen.dark + room[:, None] * self.specimen.electrodes(self.specimen.stray)
        truth = PsdTruth(np.zeros(count, int), np.full((count, 3), np.nan), np.full(count, np.nan), np.full(count, np.nan))
        for act in self.script.acts:
            some = np.flatnonzero((within > act.start) & (within < act.end))
            if len(some):
                normal, depth = act.at(within[some])
                volts[some] += self.specimen.light(*self._shown(act, within[some])) * (1.0 if lit is None else lit[some, None])
                touches = depth >= self.specimen.material.gap
                first = touches & (truth.touching[some] == 0)
                truth.touching[some] += touches
                for known, value in ((truth.normal, normal), (truth.depth, depth), (truth.force, self.specimen.force(depth))):
                    known[some[first]] = value[first]
        return self.electronics.counts(volts * self.specimen.gains, self._rng), truth

    def _shown(self, act: Act, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Unit normals (N, 3) and depths (N,), m, that the cover shows at times (N,), s, with what remains of earlier contact."""
        normal, depth = act.at(t)
        past = t - _AGES_S[:, None]
        positions, depths = act.at(past.ravel())
        positions = np.where((past > act.start)[..., None], positions.reshape(*past.shape, 3), normal)
        creep = self.specimen.material.creep
        shown = (1 - creep) * normal + creep * positions.mean(0)
        return shown / np.linalg.norm(shown, axis=1, keepdims=True), (1 - creep) * depth + creep * depths.reshape(past.shape).mean(0)


def _press(start: float, phi: float, theta: float, depth: float, last: float = 0.3, rise: float = 0.02) -> Act:
    position = math.radians(phi), math.radians(theta)
    return Act(start, start + last, position, position, depth, rise)


def _presses(positions: Iterable[tuple[float, float]], depths: Sequence[float], start: float, period: float, last: float = 0.3,
             rise: float = 0.02) -> PsdScript:
    """Presses at positions (phi, theta), degrees, each at the next of the depths, m, in turn; start, period: s."""
    acts = [_press(start + period * k, *position, depths[k % len(depths)], last, rise) for k, position in enumerate(positions)]
    return PsdScript(acts, acts[-1].end + 0.5)


def _rings() -> Iterator[tuple[float, float]]:
    """About a hundred positions: the pole, three times, and rings about it."""
    yield from [(0.0, 0.0)] * 3
    for ring, theta in enumerate(range(10, 71, 10)):
        around = min(6 + 2 * (theta // 10 - 1) + 4, 18)
        yield from ((360.0 * (k + 0.37 * ring) / around, float(theta)) for k in range(around))


_DEPTHS = (2.4e-4, 3.0e-4, 3.6e-4)
#: The pole and six azimuths at four polar angles (paper psd_finger, section 6.2): 25 positions, other than those of the calibration.
_GRID = [(0.0, 0.0)] + [(phi + 11.0, theta) for theta in (15.0, 30.0, 45.0, 60.0) for phi in range(0, 360, 60)]
_PATH = [(0, 0), (30, 40), (120, 55), (200, 30), (290, 60), (360, 10)]
_SPIRAL = Act(5.0, 9.0, (0.0, math.radians(55)), (4 * math.pi, math.radians(10)), 3.2e-4, 0.05)
_TILTS = [(40.0 * k, 20.0 + 4 * (k % 8)) for k in range(16)]

PSD_SCENES: dict[str, Callable[[], PsdScript]] = {
    'demo': lambda: PsdScript([*_presses(_PATH, [3.0e-4], 1.0, 0.6, 0.4).acts, _SPIRAL], 10.0, Ambient(drift=0.05)),
    'rest': lambda: PsdScript([], 10.0),
    'calibration': lambda: _presses(_rings(), _DEPTHS, 0.5, 0.45),
    # as a person presses with a stage, at sixty positions
    'session': lambda: _presses([(137.5 * k, 70 * math.sqrt(k / 60)) for k in range(60)], _DEPTHS, 1.0, 1.2, 0.6, 0.05),
    'grid': lambda: _presses(_GRID, [2.8e-4], 0.5, 0.45),
    # taps at 3.2 Hz and 0.88 Hz (paper psd_finger, section 6.3), felt for 78 ms and 250 ms
    'taps': lambda: _presses(_TILTS, [3.0e-4], 0.5, 1 / 3.2, 0.1, 0.05),
    'slow_taps': lambda: _presses(_TILTS[:8], [3.0e-4], 0.5, 1 / 0.88, 0.272, 0.05),
    'slide': lambda: PsdScript([Act(0.5, 3.0, (0.3, math.radians(-62)), (0.3, math.radians(62)), 3.2e-4, 0.05)], 3.5),
    'light': lambda: PsdScript([], 20.0, Ambient(0.4, 0.15, 12.0, 0.02, ((4.0, 0.25), (7.0, -0.25), (10.0, 0.8), (13.0, 0.4),
                                                                       (16.0, -1.2)))),
    # one object, then a second one on the opposite side
    'two': lambda: PsdScript([_press(0.5, 45, 40, 3.0e-4, 2.0), _press(1.2, 225, 40, 3.0e-4, 0.8)], 3.0),
    # the grid in a bright room
    'bright': lambda: replace(_presses(_GRID, [2.8e-4], 0.5, 0.45), ambient=Ambient(1.3, 0.15, 9.0, 0.07, shade=0.06))}


def open_psd_scene(name: str, rate: float, seed: int = 0) -> PsdScene:
    """The scene of that name at rate samples/s.

    Raises BadArgument for an unknown name (the message lists the known ones) or rate.
    """
    return PsdScene(by_name(PSD_SCENES, name, 'simulation: scene')(), rate, seed)
