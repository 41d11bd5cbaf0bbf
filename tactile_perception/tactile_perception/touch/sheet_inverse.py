# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From a marker field to the presses that explain it: a start by matching against a list of fields, then Gauss-Newton.

Several presses at once are taken as the sum of the fields that each would make alone: near enough where they are not under each other.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .field import MarkerField
from .sheet_appearance import Press, appearance, appearance_derivatives, disc_appearance, disc_points, read_derivatives, read_press
from .sheet_library import SPREAD, SheetLibrary

RADIUS_SIGMA = 0.15    # of the log of the tip's radius, about the calibrated one
FIRST_SIGMA = 0.01     # the same in the first round, which only finds the place
DOUBT = 3.0            # sigmas: what is farther off counts less
NEAR = 2.5             # marker pitches from a press within which markers count as discs, farther away as points
STRIDE = np.array([5e-3, 5e-3, 4e-3, 0.3])  # largest step
ROUNDS = 5
CORRECTED = (1, 3)    # the rounds in which what discs show is worked out
SETTLED = 0.15         # sigmas: a step below is the last
SHALLOW = 1e-5         # m: least depth


@dataclass(frozen=True)
class FieldNoise:
    """Standard deviations: shift, m, and growth of a still field; share_shift and share_growth (1/m) of a marker's own displacement, m, by
    which the model is wrong.
    """

    shift: float
    growth: float
    share_shift: float
    share_growth: float


@dataclass(frozen=True)
class Inverse:
    """presses: found; covariance: (4 T, 4 T) of their vectors; misfit: mean squared residual over its variance (about 1)."""

    presses: list[Press]
    covariance: np.ndarray
    misfit: float


class Seen:
    """The markers of a field that are seen: rest (N, 2), eye (N, 3), value (N, 3) shift and growth with 0 where known (N, 3) is False."""

    def __init__(self, field: MarkerField):
        self.index = np.flatnonzero(field.seen & np.isfinite(field.eye).all(1))
        self.rest, self.eye = field.rest[self.index], field.eye[self.index]
        value = np.column_stack([field.shift[self.index], field.growth[self.index]])
        self.known = np.isfinite(value)
        self.value = np.where(self.known, value, 0.0)
        self.sigma = np.nan_to_num(field.sigma[self.index])


class SheetInverse:
    """Finds presses of a sheet. marker_radius: m; pitch: m, of the markers."""

    def __init__(self, library: SheetLibrary, noise: FieldNoise, marker_radius: float, pitch: float):
        self._library, self._noise, self._marker_radius, self._near = library, noise, marker_radius, NEAR * pitch
        self._most = np.array([*library.plan.reach, library.plan.depth, SPREAD]) * (1 - 1e-6)
        self._least = np.array([*-library.plan.reach, SHALLOW, -SPREAD])

    def solve(self, seen: Seen, start: list[Press]) -> Inverse:
        """The presses, as many as start, that explain what is seen best."""
        vectors = np.clip([press.vector for press in start], self._least, self._most)
        correction = np.zeros_like(seen.value)
        for turn in range(ROUNDS):
            prior = np.tile([0, 0, 0, (RADIUS_SIGMA if turn else FIRST_SIGMA)**-2], len(start))
            presses = _presses(vectors)
            parts = [read_derivatives(self._library, press, seen.rest) for press in presses]
            whole, slopes = sum(part[0] for part in parts), np.concatenate([part[1:] for part in parts])
            appears, slopes = appearance_derivatives(whole, slopes, seen.rest, seen.eye)
            if turn in CORRECTED:
                correction = self._disc_correction(presses, seen, appears)
            weight = self._weight(seen, whole[:, 0])
            residual = (seen.value - appears - correction) * weight
            jacobian = (slopes * weight).reshape(len(slopes), -1)
            trust = np.minimum(1, DOUBT / np.maximum(np.abs(residual), DOUBT)).ravel()
            residual = residual.ravel()
            information = (jacobian * trust) @ jacobian.T + np.diag(prior)
            gradient = (jacobian * trust) @ residual - prior * vectors.ravel()
            covariance = np.linalg.inv(information + 1e-9 * np.diag(np.diag(information)))
            step = covariance @ gradient
            vectors = self._within(vectors, step.reshape(-1, 4))
            if turn >= CORRECTED[0] and step @ gradient < SETTLED**2:
                break
        misfit = float(np.sum(trust * residual**2) / max(seen.known.sum(), 1))
        return Inverse(_presses(vectors), covariance, misfit)

    def predict(self, presses: list[Press], seen: Seen) -> tuple[np.ndarray, np.ndarray]:
        """Shift and growth (N, 3) that presses would show, markers near them as discs; and the displacement (N, 3), m."""
        whole = sum(read_press(self._library, press, seen.rest) for press in presses)
        appears = appearance(whole, seen.rest, seen.eye)
        return appears + self._disc_correction(presses, seen, appears), whole[:, 0]

    def weight(self, seen: Seen, moved: np.ndarray) -> np.ndarray:
        """(N, 3) one over the standard deviation of shift and growth, 0 where not known, of markers displaced by moved (N, 3), m."""
        return self._weight(seen, moved)

    def _weight(self, seen: Seen, moved: np.ndarray) -> np.ndarray:
        noise, amount = self._noise, np.sum(moved**2, axis=1)
        shift = 1 / np.sqrt(np.maximum(noise.shift, seen.sigma)**2 + noise.share_shift**2 * amount)
        growth = 1 / np.sqrt(noise.growth**2 + noise.share_growth**2 * amount)
        return np.stack([shift, shift, growth], axis=1) * seen.known

    def _disc_correction(self, presses: list[Press], seen: Seen, appears: np.ndarray) -> np.ndarray:
        """(N, 3): what markers near a press show more than appears (N, 3), what their middle points would."""
        correction = np.zeros_like(seen.value)
        apart = np.min([np.abs(seen.rest - press.place).max(1) for press in presses], axis=0)
        near = np.flatnonzero(apart < self._near)
        if len(near) and self._marker_radius > 0:
            rest = seen.rest[near]
            points = disc_points(rest, self._marker_radius)
            whole = sum(read_press(self._library, press, points) for press in presses)
            correction[near] = disc_appearance(whole, rest, seen.eye[near], self._marker_radius) - appears[near]
        return correction

    def _within(self, vectors: np.ndarray, step: np.ndarray) -> np.ndarray:
        step = step * np.minimum(1, np.min(STRIDE / np.maximum(np.abs(step), 1e-12), axis=1, keepdims=True))
        vectors = vectors + step
        return np.clip(vectors, self._least, self._most)


def _presses(vectors: np.ndarray) -> list[Press]:
    return [Press(vector[:2], float(vector[2]), float(vector[3])) for vector in vectors]
