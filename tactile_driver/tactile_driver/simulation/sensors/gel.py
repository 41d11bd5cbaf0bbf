# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated gel with a camera under it: a clear elastic layer on a window, dark dots near its surface; and its scenes."""
from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np

from ..gel.contact import GelContact, GelState, Indenter
from ..gel.elements import Material
from ..optics.camera import mounted
from ..optics.led_light import SideLight
from ..optics.pattern import uneven
from ..optics.rendering import Imaging, Renderer
from ..skin.surfaces import Sheet
from ..truth import FramesInOrder, NON_CONTACT, NO_SLIP, SLIPPING, STICKING, SimulatedFrame, Touch, TruthFrame

#: The gel as made; chosen: silicone, the size and stiffness of a fingertip's.
MATERIAL = Material(thickness=4.0e-3, depth=0.4e-3, young=0.22e6, poisson=0.48)
#: px of the native image; m, from the camera to the surface, over whose axis the frame's origin is; chosen.
FOCAL, DISTANCE = 760.0, 0.0230
PITCH, ROWS, COLUMNS = 1.5e-3, 9, 12
_HALF = (0.012, 0.009)  # m, of the gel that the camera sees
_DOT = 0.24e-3  # m, radius; chosen
_STEP = 0.10e-3  # m, that an object moves in one step of contact; chosen: half of it changes forces by 1 %


@dataclass(frozen=True)
class GelScript:
    """keys: rows of t, s, x, y, m, and depth, m, under the surface, between which the object moves straight; friction: coefficient;
    grid: whether the dots form one."""

    indenter: Indenter
    keys: Sequence[tuple[float, float, float, float]]
    friction: float = 0.5
    grid: bool = True


class GelScene(FramesInOrder[TruthFrame]):
    """A gel and one object, in frames at a fixed rate; see scene.Scene, whose face it has."""

    def __init__(self, script: GelScript, rate: float, seed: int, width: int):
        rng = np.random.default_rng([seed, 17])
        self.sensor, self.rate = 'touchpad', rate
        self.camera = mounted((FOCAL, FOCAL), (321.0, 238.5), (0.0,) * 5, (0.0, 0.0, 0.0), (0.0, 0.0, DISTANCE), (640, 480), width)
        self.material = MATERIAL
        self.rows, self.columns = (ROWS, COLUMNS) if script.grid else (0, 0)
        self._keys = np.array(script.keys, float)
        self.frames = max(int(round((self._keys[-1, 0] + 0.5) * rate)), 1)
        self.duration = self.frames / rate
        self.places = dot_places(script.grid, rng)
        self._radius = uneven(_DOT, 0.05, len(self.places), rng)
        self._contact = GelContact(self.material, script.indenter, script.friction)
        self._known: list[TruthFrame] = []
        self._at = self._keys[0, 1:]
        sheet = Sheet(2 * _HALF[0], 2 * _HALF[1], 50.0, 1.3, 1e-4, 33)
        light = SideLight((165.0, 170.0, 160.0), 1.8, float(rng.uniform(0, 2 * np.pi)), _HALF)
        self._renderer = Renderer(sheet, self.camera, light, Imaging(blur=1.0, read_noise=1.2, shot_noise=0.02, ink=0.8), seed)
        self._shape = sheet.coarse(sheet.rest)

    def render(self, t: float) -> SimulatedFrame:
        """The frame nearest to time t, s, from the start; the scene repeats after its duration, its noise does not."""
        number = math.floor(t * self.rate + 0.5)
        truth = self.observe(number)
        _, slope = self.camera.project_with_slope(truth.dot_xyz)
        return SimulatedFrame(self._renderer.draw(self._shape, truth.dot_uv, slope[:, :, :2], self._radius, number), truth)

    def _next(self) -> TruthFrame:
        end = np.array([np.interp(len(self._known) / self.rate, self._keys[:, 0], column) for column in self._keys[:, 1:].T])
        first, steps = self._at, max(math.ceil(np.abs(end - self._at).max() / _STEP), 1)
        state, before = None, first
        for part in range(1, steps + 1):
            now = first + (end - first) * part / steps
            state = self._contact.step(now[:2], now[2], before[:2])
            before = now
        self._at = end
        return self._truth(state)

    def _truth(self, state: GelState | None) -> TruthFrame:
        places, ids = self.places.copy(), np.arange(len(self.places))
        if state is None:
            return TruthFrame(ids, self.camera.project(places), places, np.full(len(ids), NON_CONTACT, np.uint8))
        moves = self._contact.response.matrix(self.places[:, :2], state.places, 'dots')
        places += np.einsum('dipj,pj->di', moves, state.force)
        truth = TruthFrame(ids, self.camera.project(places), places, self._states(state))
        cell = self._contact.cell
        truth.area, truth.normal = len(state.places) * cell**2, np.array([0.0, 0.0, 1.0])
        truth.centroid = np.append(state.places.mean(axis=0), -state.depth)
        truth.outlines, truth.holes = _outlines(state.places, cell)
        total, torque = state.force.sum(axis=0), np.cross(np.pad(state.places, ((0, 0), (0, 1))), state.force).sum(axis=0)
        truth.wrench = np.concatenate([total, torque])
        truth.contacts = [Touch(np.append(state.middle, -state.depth), truth.normal, float(state.depth), float(-total[2]))]
        truth.slipping_fraction = float(state.slides.mean())
        truth.slip_state = NO_SLIP if truth.slipping_fraction < 0.05 else 1 if truth.slipping_fraction < 0.9 else 2
        return truth

    def _states(self, state: GelState) -> np.ndarray:
        """(K,) uint8, of the dots under cells that touch."""
        off = np.abs(self.places[:, None, :2] - state.places).max(axis=2)
        nearest = off.argmin(axis=1)
        found = np.where(state.slides[nearest], SLIPPING, STICKING)
        return np.where(off.min(axis=1) <= self._contact.cell / 2, found, NON_CONTACT).astype(np.uint8)


def dot_places(grid: bool, rng: np.random.Generator) -> np.ndarray:
    """(K, 3) m, of the dots at rest: an uneven grid, or as many at random, at least 0.7 pitches apart."""
    if grid:
        v, u = np.mgrid[:ROWS, :COLUMNS].reshape(2, -1)
        xy = (np.stack([u, v], axis=1) - (np.array([COLUMNS, ROWS]) - 1) / 2) * PITCH + rng.normal(0, 0.03 * PITCH, (u.size, 2))
    else:
        half, xy = (np.array([COLUMNS, ROWS]) - 1) / 2 * PITCH, np.zeros((0, 2))
        for place in rng.uniform(-half, half, (4000, 2)):
            if len(xy) < ROWS * COLUMNS and (np.hypot(*(xy - place).T) > 0.7 * PITCH).all():
                xy = np.vstack([xy, place])
    return np.column_stack([xy, np.full(len(xy), -MATERIAL.depth)])


def _outlines(places: np.ndarray, cell: float) -> tuple[list, list]:
    """Outlines and holes, lists of (n, 3) m, of the cells at places (M, 2) m."""
    at = np.round(places / cell).astype(int)
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

#: Name -> function of (rate, seed, width in px) that makes the scene.
GEL_SCENES: dict[str, Callable[[float, int, int], GelScene]] = {
    'gel_demo': partial(GelScene, _DEMO),
    'gel_random': partial(GelScene, GelScript(_BALL, _DEMO.keys, grid=False)),
}
