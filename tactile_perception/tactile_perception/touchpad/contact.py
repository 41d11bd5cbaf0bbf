# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From dot positions to loads, contact scores and states of the dots: the methods by name, behind one interface."""
from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .. import _core
from .._core import lie_on_a_line
from ..common.contour import label_score
from ..common.dot_grid import to_grid
from ..errors import BadArgument, BadFrame
from .membrane import Membrane, MembraneMaterial
from .published import PaperRegion

# Loads below are over the fluid's pressure; a dot in contact has more than 0.5.
_UNLOADED = 0.3  # load below which every dot counts as free; chosen
_LOADED = 0.5  # load above which a dot counts as loaded; chosen
_FILL_LOAD = 0.25  # unseen dots are placed by the balance where they or neighbours carry more than this; chosen


@dataclass(frozen=True)
class DotLoads:
    """Loads on all K dots of the grid in one frame, in the order of their numbers; unseen dots are interpolated.

    xyz: (K, 3) m, sensor frame; seen: (K,) bool; normal: (K, 3) outward; force: (K, 3) N, object on sensor, 0 on the outermost dots, which
    have no balance; load: (K,) normal pressure of the object over the fluid's: 0 free, 1 under a flat face.
    """

    xyz: np.ndarray
    seen: np.ndarray
    normal: np.ndarray
    force: np.ndarray
    load: np.ndarray

    @property
    def none(self) -> bool:
        """Whether no dot carries a significant load."""
        return bool(np.abs(self.load).max() < _UNLOADED)

    def carried(self, rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
        """Forces (K, 3), N, of the object on loaded dots and, fading out, on those around, to which errors of the ranges move a part of a
        border's load, 0 on others; and their sum and moment about the sensor's origin (6,), N and N m.
        Kernel: src/touchpad/contact/carried_loads.cpp."""
        return _core.carried_loads(self.xyz, self.force, self.load, rows=rows, columns=columns, loaded=_LOADED)


class LoadEstimator:
    """Loads on a rows x columns grid of dots in a membrane of this material; origin: (3,) m, camera centre."""

    def __init__(self, rows: int, columns: int, material: MembraneMaterial, origin: np.ndarray):
        self.shape, self._material, self._origin = (rows, columns), material, np.asarray(origin, float)
        self.membrane: Membrane | None = None

    def set_rest(self, rest_xyz: np.ndarray) -> None:
        """Set the dots' rest positions (K, 3), m; NaN: unknown. Raises BadArgument if less than half are known."""
        self.membrane = self.membrane.with_rest(rest_xyz) if self.membrane else Membrane(rest_xyz, *self.shape, self._material)

    def loads(self, ids: np.ndarray, xyz: np.ndarray) -> DotLoads:
        """Loads from positions xyz (N, 3), m, of the seen dots ids (N,). Unseen dots are interpolated; near a load they are placed by one
        step towards the balance. Raises BadArgument for ids outside the grid. Kernel: src/touchpad/contact/seen_loads.cpp.
        """
        membrane, (rows, columns) = self.membrane, self.shape
        if len(ids) and not 0 <= ids.min() <= ids.max() < rows * columns:
            raise BadArgument(f'loads: dot numbers {ids.min()} to {ids.max()} are outside the grid of {rows * columns} dots; '
                              'check parameters rows and columns')
        return DotLoads(*_core.membrane_loads(
            ids, np.asarray(xyz, float), membrane.rest, membrane.forces.triangles, membrane.forces.rest_residual, self._origin, rows=rows,
            columns=columns, rest_pressure=self._material.rest_pressure, settled=_FILL_LOAD))


def contact_score(membrane: Membrane, state: DotLoads) -> np.ndarray:
    """Score (K,) of each dot: half its distance from the contact's border, pitches, plus 1/2, cut to 0, free, and 1, well inside.

    Above 0.5 the dot is in contact. First a score by the dot's load over that further inside, reduced at a patch's edge by its height above
    a paraboloid fitted to the patch; more height is allowed to a heavier dot, and where the free skin beside it rises more steeply. Then
    the distance from the border, by loads, scores and bends of the skin around the dot: src/touchpad/contact/edge_distance.cpp.
    The outermost dots of the grid have no balance and score 0 at first; a single dot scores 0.5 at most, unless it carries a large load, or
    the largest, and one is left with those around it: an error of one range adds none. One that alone sticks out of a straight border
    scores at most a parabola along it.
    """
    mesh = membrane.mesh
    seen = {'rows': mesh.rows, 'columns': mesh.columns, 'pitch': membrane.pitch}
    score = _core.contact_score(state.load, state.xyz, state.normal, **seen)
    return _core.edge_distance(score, state.load, state.xyz, state.normal, **seen)


NON_CONTACT, STICKING, SLIPPING = 0, 1, 2
_SMOOTHING = 0.2  # weight of a new value in the running mean of noise; chosen
_CALMEST = 5  # the quantile 1/5 of the motions is used as noise, of which it is 0.668 standard deviations (2D Gaussian: sqrt(-2 ln 0.8))
# How many numbers describe an object, and which of them tell whether its motion is known, whether it slips grossly, rests after that, was
# not found in the last frame, and its motion in a frame, m: see the kernel.
_NUMBERS, _MOVES, _GROSS, _RESTS, _LOST, _TWIST = 27, 1, 2, 14, 26, 5
_LONGEST = 30  # frames for which an object in gross slip is taken to move on as before; chosen: a second
# Parts of its speed: largest motion of its dots as it turns, largest along the sensor's axis as it is not lifted, and smallest over dots
# that it does not take along. Chosen.
_TURNS, _STEEP, _FREE = 0.1, 0.3, 0.3


class StickSlipTracker:
    """Classifies the dots of a rows x columns grid frame by frame; origin: (3,) m, camera centre.

    tolerance: m, lag of a sticking dot behind the object in a frame; noise: m, standard deviation of a dot's motion across its ray, an
    initial value: it is measured while nothing touches. friction: coefficient in the last slip, NaN before the first.
    """

    def __init__(self, rows: int, columns: int, origin: np.ndarray, tolerance: float = 10e-6, noise: float = 2e-6):
        self.shape, self.origin = (rows, columns), np.asarray(origin, float)
        self.tolerance, self.noise = tolerance, noise
        self.depth_noise = 2 * tolerance
        self.reset()

    def reset(self):
        """Forget all frames."""
        size = self.shape[0] * self.shape[1]
        self._last = np.zeros((size, 3)), np.zeros(size, bool), np.zeros(size)  # places, seen, scores
        self._forget_objects()
        self.friction = np.nan

    def _forget_objects(self) -> None:
        self._held, self._objects = np.zeros(len(self._last[1]), np.int64), np.zeros((0, _NUMBERS))
        self._age, self._moved = np.zeros(len(self._held), np.int64), np.zeros((len(self._held), 3))

    def update(self, state: DotLoads, score: np.ndarray) -> np.ndarray:
        """States (K,) uint8 in this frame; score (K,): above 0.5 in contact."""
        if not (score > .5).any():
            self.observe_free(state.xyz, state.seen)
            return np.zeros(len(score), np.uint8)
        states, self._held, self._objects, self.depth_noise, self.friction = _core.stick_slip(
            self._last, (state.xyz, score, state.seen, state.normal, state.force), self._held, self._objects, self.origin,
            rows=self.shape[0], columns=self.shape[1], tolerance=self.tolerance, noise=self.noise, depth_noise=self.depth_noise,
            friction=self.friction)
        self._moved = state.xyz - self._last[0]
        self._last = state.xyz, state.seen, score
        self._age = np.where(self._held > 0, self._age + 1, 0)
        for dots, thing in self._held_objects():
            self._age[dots] = self._age[dots].max() if thing[_GROSS] or thing[_RESTS] else 0
        return states

    def _held_objects(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """The dots (K,) bool that hold each object, and its numbers."""
        return [(self._held == number, thing) for number, thing in enumerate(self._objects, 1)]

    def slides(self) -> np.ndarray:
        """(K, 2) m: way in the last frame over each dot of an object in gross slip that neither turns nor is lifted, as it last moved with
        its dots, _LONGEST frames before at most; NaN: unknown. Standard deviation: a third, since it may have changed its speed."""
        ways = np.full((len(self._held), 2), np.nan)
        for dots, thing in self._held_objects():
            if thing[_GROSS] and thing[_MOVES] and self._age[dots].max() <= _LONGEST:
                ways[dots] = self._way(dots, thing[_TWIST:_TWIST + 6])
        return ways

    def _way(self, dots: np.ndarray, twist: np.ndarray) -> np.ndarray:
        """(2,) m: way over dots (K,) bool of an object that moves by twist (6,); NaN if it turns or rises, or if the dots move along."""
        place, speed = self._last[0][dots, :2], math.hypot(*twist[:2])
        way = twist[:2] - self._moved[dots, :2].mean(axis=0)
        turns = abs(twist[5]) * math.sqrt(place.var(axis=0).sum()) > _TURNS * speed
        lifted = abs(twist[2]) > _STEEP * speed
        return np.full(2, np.nan) if turns or lifted or not math.hypot(*way) > _FREE * speed else way

    def observe_free(self, xyz: np.ndarray, seen: np.ndarray) -> None:
        """A frame without contact: dots at xyz (K, 3) m; seen: (K,) bool. Forgets the objects, but in the first such frame, and updates
        the noise from the motions."""
        both = seen & self._last[1]
        if not len(self._objects) and both.any():
            moved = _across_rays(self._last[0], xyz, self.origin)[both]
            # a low quantile: a touch below the detection limit moves many dots
            here = np.partition(moved, len(moved) // _CALMEST)[len(moved) // _CALMEST] / 0.668
            if here > 0:
                self.noise += (_SMOOTHING if here < self.noise else _SMOOTHING / 4) * (here - self.noise)
        self._last = xyz, seen, np.zeros(len(seen))
        if self._objects[:, _LOST].all():
            self._forget_objects()
        self._objects[:, _LOST] = 1


def _across_rays(before: np.ndarray, after: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """Lengths (N,), m, of the motions from before to after (N, 3) m across the rays from origin (3,)."""
    rays = (before + after) / 2 - origin
    moved = after - before
    along = np.einsum('ij,ij->i', moved, rays)
    square = np.einsum('ij,ij->i', moved, moved) - along * along / np.einsum('ij,ij->i', rays, rays)
    return np.sqrt(np.maximum(square, 0))


_THINNEST = 1e-3  # width over length of the dots' places, below which they lie on a line; chosen


class AllDots(NamedTuple):
    """All K dots of the grid, unseen ones interpolated. xyz: (K, 3) m; score, state: (K,); force: (K, 3) N on the sensor, which sum up to
    the wrench's force."""

    xyz: np.ndarray
    score: np.ndarray
    state: np.ndarray
    force: np.ndarray


@dataclass(frozen=True)
class DotClassification:
    """Classification of the N seen dots of one frame.

    state: (N,) uint8, 0 none, 1 sticking, 2 slipping; score: (N,), above 0.5 in contact; force: (N, 3) N on the sensor, None if the
    method estimates no forces; wrench: (6,) N and N m at the sensor's origin, NaN if unknown; all_dots: None if the method does not
    interpolate unseen dots; slides: (N, 2) m, way over each dot since the last frame of an object in gross slip, as it moved when it last
    held dots, NaN: unknown, None if the method does not follow objects.
    """

    state: np.ndarray
    score: np.ndarray
    force: np.ndarray | None
    wrench: np.ndarray
    all_dots: AllDots | None = None
    slides: np.ndarray | None = None


class MembraneMethod:
    """By the membrane's force balance; origin: (3,) m, camera centre."""

    def __init__(self, rows: int, columns: int, material: MembraneMaterial, origin: np.ndarray):
        self._shape = rows, columns
        self._estimator = LoadEstimator(rows, columns, material, origin)
        self._states = StickSlipTracker(rows, columns, origin)

    def set_rest(self, rest_xyz: np.ndarray) -> None:
        """Set the dots' rest positions (K, 3), m."""
        self._estimator.set_rest(rest_xyz)

    def classify(self, ids: np.ndarray, xyz: np.ndarray, stamp_s: float) -> DotClassification:
        """Classify dots ids (N,) at xyz (N, 3), m. Raises BadFrame for dots on a line, which span no membrane."""
        if len(ids) > 2 and lie_on_a_line(np.asarray(xyz, float), thinnest=_THINNEST):
            raise BadFrame('the 3D positions of all dots lie on a line; check the camera, or take a new reference')
        loads = self._estimator.loads(ids, xyz)
        if loads.none:
            return self._untouched(loads.xyz, loads.seen, ids)
        score = contact_score(self._estimator.membrane, loads)
        state = self._states.update(loads, score)
        force, wrench = loads.carried(*self._shape) if (score > 0.5).any() else (np.zeros_like(loads.force), np.zeros(6))
        every = AllDots(loads.xyz, score, state, force)
        return DotClassification(state[ids], score[ids], loads.force[ids], wrench, every, self._states.slides()[ids])

    def _untouched(self, xyz: np.ndarray, seen: np.ndarray, ids: np.ndarray) -> DotClassification:
        """Result of a frame without loads; xyz: (K, 3) m; seen: (K,) bool."""
        self._states.observe_free(xyz, seen)
        every = AllDots(xyz, np.zeros(len(xyz)), np.zeros(len(xyz), np.uint8), np.zeros(xyz.shape))
        return DotClassification(every.state[ids], every.score[ids], every.force[ids], np.zeros(6), every)


class PaperMethod:
    """By the movements of dots (paper touchpad_contact_region, eqs 2, 7, 9 to 14); estimates no forces."""

    def __init__(self, rows: int, columns: int, d_max: float, delta_d: float):
        self._shape = rows, columns
        self._region = PaperRegion(rows, columns, d_max, delta_d)
        self._rest = np.full((rows * columns, 3), np.nan)

    def set_rest(self, rest_xyz: np.ndarray) -> None:
        """Set the dots' rest positions (K, 3), m."""
        self._rest = rest_xyz

    def classify(self, ids: np.ndarray, xyz: np.ndarray, stamp_s: float) -> DotClassification:
        """Classify dots ids (N,) at xyz (N, 3), m, at stamp_s."""
        state = self._region.process(ids, xyz, self._rest[ids], stamp_s).state
        score = label_score(to_grid(ids, (state > 0).astype(float), *self._shape)).ravel()[ids]
        return DotClassification(state, score, None, np.full(6, np.nan))


CONTACT_METHODS = {
    'membrane': lambda rows, columns, material, origin, values: MembraneMethod(rows, columns, material, origin),
    'paper': lambda rows, columns, material, origin, values: PaperMethod(rows, columns, values['paper.d_max'], values['paper.delta_d']),
}


def make_method(rows: int, columns: int, material: MembraneMaterial, origin: np.ndarray, values: Mapping) -> MembraneMethod | PaperMethod:
    """The method that values (of REGION_PARAMETERS) select; origin: (3,) m, camera centre."""
    return CONTACT_METHODS[values['contact']](rows, columns, material, origin, values)
