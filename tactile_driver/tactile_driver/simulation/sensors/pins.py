# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated pad of pins, as TacTip's: white pins under a soft skin, whose tips a camera sees; and its scenes.

The skin is the surface of the simulated gel. A pin is rigid and stands on it: its tip moves with the place where it stands, and by its
length as the skin tilts there.
"""
from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from ..gel.contact import GelState, Indenter
from ..gel.elements import Response
from ..truth import SimulatedFrame, TruthFrame
from .gel import GelScene, GelScript

#: m, distance of neighbouring pins, and their length; rings of pins around the one in the middle: 127 pins. Chosen.
SPACING, LENGTH, RINGS = 1.35e-3, 1.0e-3, 6
_TILT = 1e-5  # m, over which the skin's slope is taken
_BALL = Indenter(0.005)


def pins(rng: np.random.Generator) -> np.ndarray:
    """(127, 3) m, tips of the pins at rest, in rings of hexagons."""
    a, b = np.mgrid[-RINGS:RINGS + 1, -RINGS:RINGS + 1].reshape(2, -1)
    a, b = a[np.abs(a + b) <= RINGS], b[np.abs(a + b) <= RINGS]
    xy = SPACING * np.stack([a + b / 2, b * np.sqrt(0.75)], axis=1)
    return np.column_stack([xy + rng.normal(0, 0.01 * SPACING, xy.shape), np.full(len(xy), -LENGTH)])


def pin_tips(response: Response, rest: np.ndarray, state: GelState) -> np.ndarray:
    """(N, 3) m, tips of pins with tips at rest (N, 3) under the forces of a state."""
    xy = rest[:, :2]
    tips = rest + np.einsum('dipj,pj->di', response.matrix(xy, state.places, 'surface'), state.force)
    for axis, step in enumerate(_TILT * np.eye(2)):
        rise = response.matrix(xy + step, state.places, 'surface')[:, 2] - response.matrix(xy - step, state.places, 'surface')[:, 2]
        tips[:, axis] += LENGTH * np.einsum('dpj,pj->d', rise, state.force) / (2 * _TILT)
    return tips


class PinScene(GelScene):
    """Pins and one ball, in frames at a fixed rate; see GelScene."""

    def __init__(self, script: GelScript, rate: float, seed: int, width: int):
        super().__init__(script, rate, seed, width)
        rng = np.random.default_rng([seed, 18])
        self.rows, self.columns, self.places = 0, 0, pins(rng)
        self._radius = 0.24e-3 * rng.uniform(0.95, 1.05, len(self.places))

    def render(self, t: float) -> SimulatedFrame:
        """See GelScene; pins are white on a dark skin."""
        seen = super().render(t)
        return SimulatedFrame(255 - seen.image, seen.truth)

    def _truth(self, state: GelState | None) -> TruthFrame:
        truth = super()._truth(state)
        if state is not None:
            truth.dot_xyz = pin_tips(self._contact.response, self.places, state)
            truth.dot_uv = self.camera.project(truth.dot_xyz)
        return truth


def presses(places: np.ndarray, depths: tuple[float, ...]) -> GelScript:
    """A ball pressed to each of the depths, m, at each of the places (N, 2), m, in turn; two a second at each depth."""
    keys, t = [], 1.0
    for x, y in places:
        for depth in (-2e-4, *depths, -2e-4):
            keys.append((t, x, y, depth))
            t += 0.25
    return GelScript(_BALL, keys)


def _grid() -> np.ndarray:
    v, u = np.mgrid[-2:3, -2:3].reshape(2, -1)
    return 1.5e-3 * np.stack([u, v], axis=1)


#: Name -> function of (rate, seed, width in px) that makes the scene.
PIN_SCENES: dict[str, Callable[[float, int, int], PinScene]] = {
    'pins_calib': partial(PinScene, presses(_grid(), (3e-4, 6e-4, 9e-4, 1.2e-3))),
    'pins_demo': partial(PinScene, presses(np.array([(-1.1, 0.6), (0.4, -1.7), (2.2, 2.0), (0.2, 0.3)]) * 1e-3, (4e-4, 8e-4, 1.1e-3))),
}
