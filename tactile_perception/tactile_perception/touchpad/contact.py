# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Classification of dots as free, sticking or slipping: the methods by name, behind one interface."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple, Protocol

import cv2
import numpy as np

from tactile_driver.plugins import PluginTable

from .. import _core
from ..common.geometry import lie_on_a_line
from ..common.statistics import normal_cdf
from ..errors import BadFrame
from .membrane import Membrane, MembraneMaterial
from .pose import RigidMotion

_BORDER_NOISE = 0.2  # pitches, of the network's distances from the border: measured on random scenes (docs/stick_slip.md)
_WRONG = 0.06  # share of the dots that the model of stick and slip is sure of and wrong about: measured on random scenes, as above
_THINNEST = 1e-3  # width over length of the dots' places, below which they lie on a line; chosen
_LOADED = 0.5  # load from which a dot's force counts in full; chosen
# Dots around such a one whose forces count in full, and from which on they do not count; the share falls evenly between, which leaves less
# noise than a sharp border. Chosen on simulated faces, rings, balls and edges: errors of the force are 2.7 to 2.9 % for all between 2 to 3
# and 4 to 6, 7.0 % with the next dots alone; under glare 8.5 to 9.6 and 12.8 %.
_FULL, BEYOND = 2, 6
_NETWORK = Path(__file__).with_name('border_network.npz')  # fitted by test/benchmark/fit_contact_score.py


@lru_cache(maxsize=1)
def border_network() -> _core.BorderNetwork:
    """The network that tells how far a dot is from a contact's border."""
    with np.load(_NETWORK, allow_pickle=False) as stored:
        weights = {name: stored[name] for name in stored.files}
    return _core.BorderNetwork(**weights | {'bias_3': float(weights['bias_3'])})


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

    state: (N,) uint8, 0 none, 1 sticking, 2 slipping; score: (N,), above 0.5 in contact; wrench: (6,) N and N m at the sensor's origin,
    NaN if unknown; ways: (N, 2) m, of the object over each dot since the last frame, along x and y, NaN: unknown; all_dots: None if the
    method does not interpolate unseen dots and estimates no forces; confidence: (N,) probability of each state, NaN: unknown, empty if the
    method states none; objects: those that touch, with the probabilities of what they do; motion: of the object over interval, s, None and
    NaN where unknown.
    """

    state: np.ndarray
    score: np.ndarray
    wrench: np.ndarray
    ways: np.ndarray
    all_dots: AllDots | None = None
    confidence: np.ndarray = field(default_factory=lambda: np.zeros(0))
    objects: Sequence[_core.TouchingObject] = ()
    motion: RigidMotion | None = None
    interval: float = np.nan


def state_confidence(score: np.ndarray, state: np.ndarray, slipping: np.ndarray) -> np.ndarray:
    """(N,) probability of each state. score (N,): half the dot's distance from the border, pitches, plus 1/2; slipping (N,): probability
    that it slips if it touches, NaN: unknown."""
    reported = normal_cdf(np.abs(2 * score - 1) / _BORDER_NOISE)
    slipping = _WRONG + (1 - 2 * _WRONG) * slipping
    return np.where(state == 0, reported, reported * np.where(state == 2, slipping, 1 - slipping))


def steps_from(dots: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """(K,) steps from each dot of a grid of that shape, along rows, columns and diagonals, to the nearest of dots (K,) bool; more
    than the grid has where there is none."""
    return cv2.distanceTransform((~dots).astype(np.uint8).reshape(shape), cv2.DIST_C, 3).ravel()


def carried(loads: _core.DotLoads, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Force (K, 3), N, on the dots that carry a load and, by their shares, on those around, 0 on others; its wrench (6,), N and N m, about
    the origin. Errors of the ranges beside an edge move its load between the dots there and free dots around, but hardly change the sum."""
    share = np.interp(steps_from(loads.load > _LOADED, shape), (_FULL, BEYOND), (1, 0))
    force = loads.force * share[:, None]
    moment = (loads.xyz.T @ force).tolist()
    turns = [moment[a][b] - moment[b][a] for a, b in ((1, 2), (2, 0), (0, 1))]
    return force, np.concatenate([share @ loads.force, turns])


class MembraneMethod:
    """By the membrane's force balance; origin: (3,) m, camera centre. Kernels: src/touchpad/contact.cpp, stick_slip.cpp.

    A dot is in contact by its loads and the bends of the skin around it: a network tells half its distance from the border, pitches, plus
    1/2, cut to 0, free, and 1, well inside. In contact it sticks to the object or lags behind it and slips.
    """

    def __init__(self, rows: int, columns: int, material: MembraneMaterial, origin: np.ndarray,
                 model: _core.StickSlipModel | None = None):
        self._shape, self._material, self._origin = (rows, columns), material, np.asarray(origin, float)
        self._membrane: Membrane | None = None
        self._dots = _core.StickSlip(rows, columns, self._origin, model or _core.StickSlipModel())
        self._stamp_s = np.nan

    def set_rest(self, rest_xyz: np.ndarray) -> None:
        """Set the dots' rest positions (K, 3), m; NaN: unknown. Raises BadArgument if less than half are known."""
        if self._membrane is None:
            self._membrane = Membrane(rest_xyz, *self._shape, self._origin, self._material)
        else:
            self._membrane.set_rest(rest_xyz)
        rest = self._membrane.core.rest.reshape(*self._shape, 3)
        self._pitch = float(np.median(np.linalg.norm(np.diff(rest, axis=1), axis=2)))

    def classify(self, ids: np.ndarray, xyz: np.ndarray, stamp_s: float) -> DotClassification:
        """Classify dots ids (N,) at xyz (N, 3), m. Raises BadFrame for dots on a line, which span no membrane."""
        xyz = np.asarray(xyz, float)
        if len(ids) > 2 and lie_on_a_line(xyz, thinnest=_THINNEST):
            raise BadFrame('the 3D positions of all dots lie on a line; check the camera, or take a new reference')
        seconds = stamp_s - self._stamp_s if stamp_s > self._stamp_s else 0.0
        loads = self._membrane.core.loads(ids, xyz)
        score = border_network().scores(loads, rows=self._shape[0], columns=self._shape[1], pitch=self._pitch)
        state = self._dots.update(loads, score, seconds)
        self._stamp_s = stamp_s
        force, wrench = carried(loads, self._shape) if state.any() else (np.zeros((len(state), 3)), np.zeros(6))
        confidence = state_confidence(score[ids], state[ids], self._dots.slipping[ids])
        rotation, translation = self._dots.motion()
        return DotClassification(
            state[ids], score[ids], wrench, self._dots.ways().take(ids, axis=0), AllDots(loads.xyz, score, state, force), confidence,
            self._dots.objects, None if np.isnan(translation[0]) else RigidMotion(rotation, translation), seconds)


class ContactMethod(Protocol):
    """Classifies the dots of one sensor, frame by frame."""

    def set_rest(self, rest_xyz: np.ndarray) -> None:
        """Set the reference positions (K, 3), m, of all dots; NaN: unknown."""

    def classify(self, ids: np.ndarray, xyz: np.ndarray, stamp_s: float) -> DotClassification:
        """Classify dots ids (N,) at positions xyz (N, 3), m, at stamp_s, s."""


#: Name -> function of (rows, columns, material, camera centre, values of TOUCHPAD_PARAMETERS) that makes the method.
CONTACT_METHODS = PluginTable('tactile_perception.touchpad_methods', {
    'membrane': lambda rows, columns, material, origin, values: MembraneMethod(rows, columns, material, origin),
    'paper': 'tactile_perception.published.touchpad_contact_region:make_method',
})


def make_method(rows: int, columns: int, material: MembraneMaterial, origin: np.ndarray, values: Mapping) -> ContactMethod:
    """The method that values (of TOUCHPAD_PARAMETERS) select; origin: (3,) m, camera centre."""
    return CONTACT_METHODS[values['contact']](rows, columns, material, origin, values)
