# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Classification of dots as free, sticking or slipping: the methods by name, and their common interface."""
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
from ..core.errors import BadFrame
from .membrane import Membrane, MembraneMaterial
from .pose import RigidMotion

_NETWORK = Path(__file__).with_name('border_network.npz')  # fitted by test/benchmark/fit_contact_score.py


@lru_cache(maxsize=1)
def border_network() -> _core.touchpad.BorderNetwork:
    """Load the network that estimates the distance of a dot from the border of the contact."""
    with np.load(_NETWORK, allow_pickle=False) as stored:
        weights = {name: stored[name] for name in stored.files}
    return _core.touchpad.BorderNetwork(**weights | {'bias_3': float(weights['bias_3'])})


class AllDots(NamedTuple):
    """All K dots of the grid; unseen ones are interpolated.

    Attributes
    ----------
    xyz : ndarray, shape (K, 3)
        Positions in m.
    score, state : ndarray, shape (K,)
        As in DotClassification.
    force : ndarray, shape (K, 3)
        Forces on the sensor in N; their sum is the force of the wrench.
    """

    xyz: np.ndarray
    score: np.ndarray
    state: np.ndarray
    force: np.ndarray


@dataclass(frozen=True)
class DotClassification:
    """Classification of the N seen dots of one frame.

    Attributes
    ----------
    state : ndarray, shape (N,), uint8
        0 none, 1 sticking, 2 slipping.
    score : ndarray, shape (N,)
        Contact score; above 0.5 in contact.
    wrench : ndarray, shape (6,)
        Force (N) and moment (N m) at the origin of the sensor frame; NaN if unknown.
    displacements : ndarray, shape (N, 2)
        Displacement in m, along x and y, of the object over each dot since the previous frame; NaN if unknown.
    all_dots : AllDots or None
        None if the method neither interpolates unseen dots nor estimates forces.
    confidence : ndarray, shape (N,) or (0,)
        Probability of each state; NaN if unknown, empty if the method does not estimate it.
    objects : sequence of TouchingObject
        The objects in contact, with the probabilities of their motion modes.
    motion : RigidMotion or None
        Motion of the object over the interval; None if unknown.
    interval : float
        Interval of the motion in s; NaN if unknown.
    """

    state: np.ndarray
    score: np.ndarray
    wrench: np.ndarray
    displacements: np.ndarray
    all_dots: AllDots | None = None
    confidence: np.ndarray = field(default_factory=lambda: np.zeros(0))
    objects: Sequence[_core.touchpad.TouchingObject] = ()
    motion: RigidMotion | None = None
    interval: float = np.nan


def steps_from(dots: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Count the steps (K,) from each dot of a grid to the nearest of dots (K,) bool, along rows, columns and diagonals.

    Without any such dot the steps are more than the grid has.
    """
    return cv2.distanceTransform((~dots).astype(np.uint8).reshape(shape), cv2.DIST_C, 3).ravel()


class MembraneMethod:
    """Classification by the membrane's force balance.

    A network decides about contact from a dot's load and the curvature of the skin around it. Its score is half the distance from the
    border in pitches plus 1/2, limited to 0 (free) and 1 (well inside). A dot in contact either sticks to the object or lags behind it,
    that is, slips. Kernel: src/touchpad/dot_classifier.cpp.

    origin: (3,) m, camera centre.
    """

    def __init__(self, rows: int, columns: int, material: MembraneMaterial, origin: np.ndarray,
                 model: _core.touchpad.StickSlipModel | None = None):
        self._shape, self._material, self._origin = (rows, columns), material, np.asarray(origin, float)
        self._model = model or _core.touchpad.StickSlipModel()
        self._dots: _core.touchpad.DotClassifier | None = None
        self._stamp_s = np.nan

    def set_rest(self, rest_xyz: np.ndarray) -> None:
        """Set the reference positions (K, 3), m, of all dots; NaN if unknown. Raises BadArgument if less than half are known."""
        membrane = Membrane(rest_xyz, *self._shape, self._origin, self._material).core
        if self._dots is None:
            self._dots = _core.touchpad.DotClassifier(membrane, border_network(), self._model)
        else:
            self._dots.take_rest(membrane)

    def classify(self, ids: np.ndarray, xyz: np.ndarray, stamp_s: float) -> DotClassification:
        """Classify dots ids (N,) at positions xyz (N, 3), m, at stamp_s, s. Raises BadFrame for collinear dots, which span no surface."""
        seconds = stamp_s - self._stamp_s if stamp_s > self._stamp_s else 0.0
        found = self._dots.classify(ids, xyz, seconds)
        if found is None:
            raise BadFrame('the 3D positions of all dots are collinear; check the camera, or take a new reference')
        self._stamp_s = stamp_s
        return DotClassification(found.state, found.score, found.wrench, found.displacements,
                                 AllDots(found.xyz, found.all_scores, found.all_states, found.force), found.confidence, found.objects,
                                 found.motion, seconds)


class ContactMethod(Protocol):
    """Classifies the dots of one sensor, frame by frame."""

    def set_rest(self, rest_xyz: np.ndarray) -> None:
        """Set the reference positions (K, 3), m, of all dots; NaN if unknown."""

    def classify(self, ids: np.ndarray, xyz: np.ndarray, stamp_s: float) -> DotClassification:
        """Classify the dots ids (N,) at positions xyz (N, 3), m, at stamp_s, s."""


#: Name -> function of (rows, columns, material, camera centre, values of TOUCHPAD_PARAMETERS) that makes the method.
CONTACT_METHODS = PluginTable('tactile_perception.touchpad_methods', {
    'membrane': lambda rows, columns, material, origin, values: MembraneMethod(rows, columns, material, origin),
    'paper': 'tactile_perception.published.touchpad_contact_region:make_method',
})


def make_method(rows: int, columns: int, material: MembraneMaterial, origin: np.ndarray, values: Mapping) -> ContactMethod:
    """Make the method that values (of TOUCHPAD_PARAMETERS) select; origin: (3,) m, camera centre."""
    return CONTACT_METHODS[values['contact']](rows, columns, material, origin, values)
