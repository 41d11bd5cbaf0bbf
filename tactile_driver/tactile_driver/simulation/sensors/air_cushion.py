# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated air cushion and its scenes: a dome 30 cm wide and 12 cm high, a wide-angle camera inside, printed circles, low light."""
from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from ..optics.camera import CameraDesign
from ..optics.light import Lamps
from ..optics.pattern import DotPattern, LargeDots, uneven
from ..optics.rendering import Imaging, Renderer
from ..scene.specimen import TIMING, Act, Script, Specimen, act, drag, one_after_the_other, press, session
from ..skin.surfaces import Membrane


@dataclass(frozen=True)
class AirCushion:
    """An air cushion with a skin, as made: lengths in m, pressures in Pa."""

    rim: float = 0.150  # radius
    height: float = 0.120
    blown_up: float = 1400.0  # gauge pressure inside
    air: float = 101325.0  # atmospheric pressure
    rows: int = 17
    columns: int = 17
    pitch: float = 0.0140  # of the circles
    circle: float = 0.0046  # radius
    printed: float = 0.118  # largest distance of a circle from the top, along the skin
    step: float = 0.25  # node spacings that a tip moves at most in one step of contact; with 0.95 markers are up to 0.42 mm off
    settled: float = 0.001  # with the usual 0.005 and 6, the skin under a tip at rest kept moving
    linearisations: int = 20  # the same
    speed: float = 0.08  # m/s of the zones' stage: at 20 frames/s, circles overlap themselves from frame to frame


DOME = AirCushion()

#: m: radius of the sphere of which the dome is a cap.
_BALL = (DOME.rim**2 + DOME.height**2) / (2 * DOME.height)
#: The skin's nodes are 5 mm apart: deeper than about 24 mm the small tip slips through between them.
_TIP, _SMALL_TIP = 'ball_30mm', 'ball_8mm'
_IMAGING = Imaging(blur=1.0, read_noise=2.6, shot_noise=0.06, ink=(-5.4, -5.7, -5.6), housing=1.5, cosine=1.5, stop=0.0)
_LAMPS = Lamps(tuple((0.022 * np.cos(a), 0.022 * np.sin(a), -0.036) for a in (0.4, 2.5, 4.6)), (46.0, 38.0, 42.0), 0.150, 45.0,
               (0.105, 0.100, 0.098), exposure=1.4)


def _on_dome(positions: np.ndarray) -> np.ndarray:
    """Points (K, 3), m, on the resting dome at offsets (K, 2), m, from its top along the skin."""
    distance = np.linalg.norm(positions, axis=1)
    sideways = np.sinc(distance / _BALL / np.pi)[:, None] * positions
    return np.column_stack([sideways, DOME.height - _BALL + _BALL * np.cos(distance / _BALL)])


def _regular(membrane: Membrane, rng: np.random.Generator) -> DotPattern:
    """A grid of circles without its corners."""
    v, u = np.mgrid[:DOME.rows, :DOME.columns].reshape(2, -1)
    positions = np.stack([u - (DOME.columns - 1) / 2, v - (DOME.rows - 1) / 2], axis=1) * DOME.pitch
    numbers = np.flatnonzero(np.linalg.norm(positions, axis=1) <= DOME.printed)
    positions = positions[numbers] + rng.normal(0, 0.25e-3, (len(numbers), 2)) + rng.normal(0, 0.8e-3, 2)
    return LargeDots(membrane, _on_dome(positions), uneven(DOME.circle, 0.03, len(positions), rng), numbers, DOME.rows, DOME.columns)


def _random(membrane: Membrane, rng: np.random.Generator) -> DotPattern:
    """Circles at random positions, at least 2.5 radii apart."""
    positions = np.zeros((0, 2))
    for position in rng.uniform(-DOME.printed, DOME.printed, (6000, 2)):
        if np.linalg.norm(position) <= DOME.printed and (np.linalg.norm(positions - position, axis=1) > 2.5 * DOME.circle).all():
            positions = np.vstack([positions, position])
    return LargeDots(membrane, _on_dome(positions), uneven(DOME.circle, 0.03, len(positions), rng), np.arange(len(positions)))


def air_cushion(seed: int, width: int = 640, pattern=_regular) -> Specimen:
    """A cushion. seed: of manufacturing tolerances and noise; width: of the image, px; pattern: function of (membrane, rng) that makes the
    circles."""
    rng = np.random.default_rng([seed, 13])
    pressure = DOME.blown_up * (1 + rng.normal(0, 0.03))
    volume = np.pi * DOME.height**2 * (3 * _BALL - DOME.height) / 3
    membrane = Membrane(_BALL, DOME.height, pressure * _BALL / 2, 61, volume / (DOME.air + pressure))
    membrane.longest_step, membrane.settled, membrane.linearisations = DOME.step, DOME.settled, DOME.linearisations
    camera = CameraDesign((233.0, 233.0), (322.0, 238.0), (-0.055, 0.0055, 3e-4, 2e-4, 0.0), (0.002, -0.004, 0.003),
                          (0.0, 0.0, 0.042)).built(rng).mounted(width)
    renderer = Renderer(membrane, camera, _LAMPS, _IMAGING, seed)
    return Specimen('air_cushion', membrane, pattern(membrane, rng), (camera,), (renderer,))


def _positions(count: int, reach: float, rng: np.random.Generator) -> list[tuple]:
    """Random positions (x, y), m, stratified over a disc of radius reach, m."""
    distance, angle = reach * np.sqrt((np.arange(count) + rng.uniform(0, 1, count)) / count), rng.uniform(0, 2 * np.pi, count)
    return list(zip(distance * np.cos(angle), distance * np.sin(angle)))


def _presses(tool: str, positions: list, deepest: float, count: int, rng: np.random.Generator) -> list:
    """Acts of a tool that is pressed in at each of the positions (x, y), m, to count increasing depths up to deepest, m."""
    return [partial(press, tool, x, y, *np.sort((np.arange(count) + rng.uniform(0.2, 1.0, count)) * deepest / count).tolist(), move=0.4)
            for x, y in positions]


def _calibration(rng: np.random.Generator) -> list:
    """Presses of one indenter over the whole dome to all depths, and drags."""
    acts = _presses(_TIP, _positions(45, 0.075, rng), 0.042, 3, rng)
    return acts + [partial(drag, _TIP, position, 0.020, (0.030 * np.cos(a), 0.030 * np.sin(a)), duration=3.0)
                   for position, a in zip(_positions(6, 0.040, rng), rng.uniform(0, 2 * np.pi, 6))]


def _test(rng: np.random.Generator) -> list:
    """Presses at other positions, with indenters of half to twice the calibrated size."""
    return [act for tool in (_TIP, 'ball_15mm', 'ball_22mm', 'ball_42mm', 'ball_60mm')
            for act in _presses(tool, _positions(4, 0.068, rng), 0.040, 3, rng)]


def _steadily(tool: str, x: float, y: float, *depths: float, start: float) -> Act:
    """A stage presses a tool in at x, y, m, at one speed, and stops at each of the depths, m."""
    positions, t = [], 0.0
    for before, depth in pairwise((0.0, *depths)):
        t += (depth - before) / DOME.speed
        positions += [{'t': t, 'press': depth}, {'t': t + 0.1}]
        t += 0.1
    return act(tool, start, *positions, {'t': t + depths[-1] / DOME.speed, 'press': 0.0}, x=x, y=y)


def _zones(*depths: float, tool: str = _TIP, reach: float = 0.070) -> tuple[Act, ...]:
    """Presses of a tool at ten zones within the reach, m, from the top, to depths, m."""
    positions = _positions(10, reach, np.random.default_rng(7))
    return one_after_the_other([partial(_steadily, tool, x, y, *depths) for x, y in positions], pause=0.05)


_random_cushion = partial(air_cushion, pattern=_random)
#: Scenes of both prints.
_OF_BOTH = {
    # presses with several indenters, a drag, two fists
    'demo': one_after_the_other([
        partial(press, _TIP, 0.010, -0.015, 0.015, 0.035, move=0.6), partial(press, 'ball_60mm', -0.045, 0.020, 0.012, 0.030, move=0.6),
        partial(press, 'ball_15mm', 0.040, 0.045, 0.010, 0.025, move=0.6),
        partial(drag, _TIP, (-0.030, -0.035), 0.022, (0.060, 0.015), duration=2.5),
        partial(press, 'fists_70mm', 0.0, 0.010, 0.010, 0.022, move=0.6)], untouched=TIMING.starting),
    'calibration': one_after_the_other(_calibration(np.random.default_rng(5)), pause=0.3),
    **{f'{name}zones{of}': _zones(*depths, tool=tool, reach=reach) for name, tool, reach, scenes in (
        ('', _TIP, 0.070, {'_calibration': (0.008, 0.016, 0.024, 0.032), '': (0.012, 0.020, 0.028)}),
        ('near_', _SMALL_TIP, 0.035, {'_calibration': (0.005, 0.010, 0.015, 0.020), '': (0.0075, 0.0125, 0.0175)}))
       for of, depths in scenes.items()},
}

AIR_CUSHION_SCENES: dict[str, Script] = {f'air_cushion_{name}': Script(air_cushion, acts) for name, acts in {
    **_OF_BOTH,
    'press': one_after_the_other([partial(press, _TIP, 0.030, -0.020, 0.015, 0.035, move=0.5)]),
    # two fists, 3 to 5 pitches apart
    'two': one_after_the_other([partial(press, f'fists_{mm}mm', x, y, 0.012, 0.024, move=0.5)
                                for mm, x, y in ((70, 0.0, 0.0), (56, 0.010, -0.020), (42, -0.015, 0.015))], pause=0.5),
    'test': one_after_the_other(_test(np.random.default_rng(6)), pause=0.3),
    'session': one_after_the_other(session(_TIP, _positions(12, 0.075, np.random.default_rng(8)), 0.010, 0.020, 0.040)),
}.items()} | {f'air_cushion_random_{name}': Script(_random_cushion, acts) for name, acts in _OF_BOTH.items()} | {
    'air_cushion_rest': Script(air_cushion, duration=10.0)}
