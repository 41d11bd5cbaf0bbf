# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated gel with a camera under it: a clear elastic layer on a window, dark dots near its surface; or, as TacTip's, white pins under
a soft skin, whose tips the camera sees; and their scenes.

The skin over pins is the surface of the gel. A pin is rigid and stands on it: its tip moves with the position where it stands, and by its
length as the skin tilts there.
"""
from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import cv2
import numpy as np

from ..gel.contact import GelContact, GelState, Indenter
from ..gel.elements import Material, Response
from ..optics.camera import CameraDesign
from ..optics.light import Lamps
from ..optics.pattern import uneven
from ..optics.rendering import Imaging, Renderer
from ..skin.surfaces import Rubber, Sheet
from ..truth import NON_CONTACT, SLIPPING, STICKING, FramesInOrder, SimulatedFrame, Touch, TruthFrame, slip_state_of


@dataclass(frozen=True)
class Gel:
    """A gel with dots or pins, the size of a fingertip's, as made: lengths in m."""

    focal: float = 760.0  # px of the native image
    distance: float = 0.0230  # from the camera to the surface, over whose axis the frame's origin is
    pitch: float = 1.5e-3  # of dots
    rows: int = 9
    columns: int = 12
    half: tuple[float, ...] = (0.012, 0.009)  # of the gel that the camera sees
    dot: float = 0.24e-3  # radius
    step: float = 0.10e-3  # that an object moves in one step of contact; half of it changes forces by 1 %
    spacing: float = 1.35e-3  # of neighbouring pins
    length: float = 1.0e-3  # of pins
    rings: int = 6  # of pins around the one in the middle: 127 pins
    tilt: float = 1e-5  # over which the skin's slope is taken


GEL = Gel()

#: The gel as made; silicone, the size and stiffness of a fingertip's.
MATERIAL = Material(thickness=4.0e-3, depth=0.4e-3, young=0.22e6, poisson=0.48)


@dataclass(frozen=True)
class GelScript:
    """keys: rows of t, s, x, y, m, and depth, m, under the surface, between which the object moves straight; friction: coefficient;
    printed: 'grid' or 'random' dots, or 'pins'."""

    indenter: Indenter
    keys: Sequence[tuple[float, float, float, float]]
    friction: float = 0.5
    printed: str = 'grid'


class GelScene(FramesInOrder[TruthFrame]):
    """A gel and one object, in frames at a fixed rate; see scene.Scene, whose face it has."""

    _where = 'dots'  # what moves with the dots

    def __init__(self, script: GelScript, rate: float, seed: int, width: int):
        rng = np.random.default_rng([seed, 17])
        self.rate = rate
        design = CameraDesign((GEL.focal, GEL.focal), (321.0, 238.5), (0.0,) * 5, (0.0, 0.0, 0.0), (0.0, 0.0, GEL.distance))
        self.camera = design.mounted(width)
        self._pins = script.printed == 'pins'
        self.sensor = 'pins' if self._pins else 'gel'
        self.rows, self.columns = (GEL.rows, GEL.columns) if script.printed == 'grid' else (0, 0)
        self._keys = np.array(script.keys, float)
        self.frames = max(int(round((self._keys[-1, 0] + 0.5) * rate)), 1)
        self.duration = self.frames / rate
        self.positions = pins(rng) if self._pins else dot_positions(script.printed == 'grid', rng)
        self._radius = uneven(GEL.dot, 0.05, len(self.positions), rng)
        self._contact = GelContact(MATERIAL, script.indenter, script.friction)
        self._known: list[TruthFrame] = []
        self._at = self._keys[0, 1:]
        sheet = Sheet(2 * GEL.half[0], 2 * GEL.half[1], Rubber(50.0, 1.3, 1e-4), 33)
        angle = rng.uniform(0, 2 * np.pi)  # of an LED beside the gel; the brightest position is twice as bright as the darkest
        light = Lamps(((0.03 * np.cos(angle), 0.03 * np.sin(angle), -0.03),), (100.0,), 0.042, 55.0, (0.97, 1.0, 0.94), exposure=1.0)
        self._renderer = Renderer(sheet, self.camera, light, Imaging(blur=1.0, read_noise=1.2, shot_noise=0.02, ink=0.8), seed)
        self._shape = sheet.coarse(sheet.rest)

    def render(self, t: float) -> SimulatedFrame:
        """The frame nearest to time t, s, from the start; the scene repeats after its duration, its noise does not."""
        number = math.floor(t * self.rate + 0.5)
        truth = self.observe(number)
        _, slope = self.camera.project_with_slope(truth.dot_xyz)
        image = self._renderer.draw(self._shape, truth.dot_uv, slope[:, :, :2], self._radius, number)
        return SimulatedFrame(255 - image if self._pins else image, truth)  # pins are white on a dark skin

    def _next(self) -> TruthFrame:
        end = np.array([np.interp(len(self._known) / self.rate, self._keys[:, 0], column) for column in self._keys[:, 1:].T])
        first, steps = self._at, max(math.ceil(np.abs(end - self._at).max() / GEL.step), 1)
        state, before = None, first
        for part in range(1, steps + 1):
            now = first + (end - first) * part / steps
            state = self._contact.step(now[:2], now[2], before[:2])
            before = now
        self._at = end
        return self._truth(state)

    def _truth(self, state: GelState | None) -> TruthFrame:
        ids, response = np.arange(len(self.positions)), self._contact.response
        if state is None:
            return TruthFrame(ids, self.camera.project(self.positions), self.positions, np.full(len(ids), NON_CONTACT, np.uint8))
        positions = pin_tips(response, self.positions, state) if self._pins else \
            self.positions + moved(response, self.positions[:, :2], state, self._where)
        truth = TruthFrame(ids, self.camera.project(positions), positions, self._states(state))
        cell, touched = self._contact.cell, np.pad(state.positions + state.shift, ((0, 0), (0, 1)))
        truth.area, truth.normal = len(touched) * cell**2, np.array([0.0, 0.0, 1.0])
        truth.centroid = touched.mean(axis=0) - [0.0, 0.0, state.depth]
        shift = np.append(state.shift, 0.0)
        truth.outlines, truth.holes = ([line + shift for line in lines] for lines in _outlines(state.positions, cell))
        total, torque = state.force.sum(axis=0), np.cross(touched, state.force).sum(axis=0)
        truth.wrench = np.concatenate([total, torque])
        truth.contacts = [Touch(np.append(state.middle, -state.depth), truth.normal, float(state.depth), float(-total[2]))]
        truth.slipping_fraction = float(state.slides.mean())
        truth.slip_state = slip_state_of(truth.slipping_fraction)
        return truth

    def _states(self, state: GelState) -> np.ndarray:
        """(K,) uint8, of the dots under cells that touch."""
        off = np.abs(self.positions[:, None, :2] - state.positions).max(axis=2)
        nearest = off.argmin(axis=1)
        found = np.where(state.slides[nearest], SLIPPING, STICKING)
        return np.where(off.min(axis=1) <= self._contact.cell / 2, found, NON_CONTACT).astype(np.uint8)


def moved(response: Response, points: np.ndarray, state: GelState, where: str) -> np.ndarray:
    """(N, 3) m, by which points (N, 2), m, 'surface' or 'dots', move under the forces of a state."""
    return np.einsum('dipj,pj->di', response.matrix(points, state.positions, where), state.force)


def pins(rng: np.random.Generator) -> np.ndarray:
    """(127, 3) m, tips of the pins at rest, in rings of hexagons."""
    a, b = np.mgrid[-GEL.rings:GEL.rings + 1, -GEL.rings:GEL.rings + 1].reshape(2, -1)
    a, b = a[np.abs(a + b) <= GEL.rings], b[np.abs(a + b) <= GEL.rings]
    xy = GEL.spacing * np.stack([a + b / 2, b * np.sqrt(0.75)], axis=1)
    return np.column_stack([xy + rng.normal(0, 0.01 * GEL.spacing, xy.shape), np.full(len(xy), -GEL.length)])


def pin_tips(response: Response, rest: np.ndarray, state: GelState) -> np.ndarray:
    """(N, 3) m, tips of pins with tips at rest (N, 3) under the forces of a state."""
    xy = rest[:, :2]
    tips = rest + moved(response, xy, state, 'surface')
    for axis, step in enumerate(GEL.tilt * np.eye(2)):
        rise = moved(response, xy + step, state, 'surface') - moved(response, xy - step, state, 'surface')
        tips[:, axis] += GEL.length * rise[:, 2] / (2 * GEL.tilt)
    return tips


def dot_positions(grid: bool, rng: np.random.Generator) -> np.ndarray:
    """(K, 3) m, of the dots at rest: an uneven grid, or as many at random, at least 0.7 pitches apart."""
    if grid:
        v, u = np.mgrid[:GEL.rows, :GEL.columns].reshape(2, -1)
        xy = (np.stack([u, v], axis=1) - (np.array([GEL.columns, GEL.rows]) - 1) / 2) * GEL.pitch
        xy += rng.normal(0, 0.03 * GEL.pitch, (u.size, 2))
    else:
        half, xy = (np.array([GEL.columns, GEL.rows]) - 1) / 2 * GEL.pitch, np.zeros((0, 2))
        for position in rng.uniform(-half, half, (4000, 2)):
            if len(xy) < GEL.rows * GEL.columns and (np.hypot(*(xy - position).T) > 0.7 * GEL.pitch).all():
                xy = np.vstack([xy, position])
    return np.column_stack([xy, np.full(len(xy), -MATERIAL.depth)])


def _outlines(positions: np.ndarray, cell: float) -> tuple[list, list]:
    """Outlines and holes, lists of (n, 3) m, of the cells at positions (M, 2) m."""
    at = np.round(positions / cell).astype(int)
    low = at.min(axis=0) - 2
    picture = np.zeros((at - low).max(axis=0)[::-1] + 3, np.uint8)
    picture[tuple((at - low).T[::-1])] = 1
    fine = 4
    picture = cv2.resize(picture, None, fx=fine, fy=fine, interpolation=cv2.INTER_NEAREST)
    lines, family = cv2.findContours(picture, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
    found = [], []
    for line, kin in zip(lines, family[0]):
        xy = ((line[:, 0] + 0.5) / fine - 0.5 + low) * cell
        found[int(kin[3] >= 0)].append(np.pad(xy, ((0, 0), (0, 1))))
    return found


_BALL = Indenter(0.006)
_DEMO = GelScript(_BALL, [(1.5, -0.002, 0.001, -2e-4), (2.0, -0.002, 0.001, 6e-4), (2.5, -0.002, 0.001, 9e-4), (3.0, -0.002, 0.001, 9e-4),
                          (4.0, -0.0012, 0.0013, 9e-4), (4.3, -0.0012, 0.0013, 9e-4), (4.8, -0.0012, 0.0013, -2e-4)])


def _presses(positions: Sequence[tuple[float, float]], *depths: float) -> GelScript:
    """A ball pressed into pins to each of the depths, m, at each of the positions, mm, in turn; a quarter of a second at each depth."""
    stops = [(1e-3 * x, 1e-3 * y, depth) for x, y in positions for depth in (-2e-4, *depths, -2e-4)]
    return GelScript(Indenter(0.005), [(1 + 0.25 * k, *stop) for k, stop in enumerate(stops)], printed='pins')


#: Name -> function of (rate, seed, width in px) that makes the scene.
GEL_SCENES: dict[str, Callable[[float, int, int], GelScene]] = {name: partial(GelScene, script) for name, script in {
    'gel_demo': _DEMO,
    'gel_random': replace(_DEMO, printed='random'),
    'pins_calib': _presses([(x, y) for y in (-3, -1.5, 0, 1.5, 3) for x in (-3, -1.5, 0, 1.5, 3)], 3e-4, 6e-4, 9e-4, 1.2e-3),
    'pins_demo': _presses([(-1.1, 0.6), (0.4, -1.7), (2.2, 2.0), (0.2, 0.3)], 4e-4, 8e-4, 1.1e-3),
}.items()}
