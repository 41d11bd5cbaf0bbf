# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Inversion of the sheet model: Gauss-Newton for the presses that explain a marker field, with robust weights and priors.

The field of several presses is the sum of the fields of each alone, less an interaction term: the sheet between them is tauter. The error
of this approximation is noise of the markers that more than one press displaces.
"""
from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from .projection import Press, appearance, appearance_slopes, disc_appearance, disc_points, fields_of, read_derivatives, read_press
from .reduced_model import SPREAD, SheetLibrary
from ..view.marker_field import MarkerField

# All chosen, but for SIZE.
SIZE = 6               # of a press's vector
RADIUS_SIGMA = 0.15    # prior standard deviation of the log tip radius
DRAGGED = 0.25         # prior standard deviation of drag over depth
CARRIED = 0.5          # offset of the tip from the place of first contact over the drag
UNSURE = 0.3           # standard deviation of that offset over the drag
FARTHEST = 1.0         # largest drag over the largest depth
DOUBT = 3.0            # sigmas: threshold of the Huber weights
NEAR = 2.5             # marker pitches from a press within which markers are discs; farther away points
STRIDE = np.array([5e-3, 5e-3, 4e-3, 0.3, 3e-3, 3e-3])  # limit of one step
ROUNDS, FOLLOWED = 5, 3  # Gauss-Newton iterations from a coarse start, and from the last frame's solution
MOVED = 4e-4           # m: change of place or depth from which the disc correction is renewed
NEARLY = 4.0           # sigmas: after a smaller step the Jacobian is kept
SETTLED = 0.5          # sigmas: a smaller step is the last
SHALLOW = 1e-5         # m: least depth
MIXED = 0.3, 0.35      # interaction factor: prior mean and standard deviation
MOST_MIXED = -0.6, 0.9  # interaction factor: least and largest
BETWEEN = np.array([0.02, 0.02, 2.0])  # error of the interaction over the lesser of two presses' displacements (growth: 1/m)


_TIP = np.eye(3, SIZE) + CARRIED * np.eye(3, SIZE, 4) * [[1], [1], [0]]  # from a press's vector to its tip: place and drag


@dataclass(frozen=True)
class FieldNoise:
    """Standard deviations: shift, m, and growth of an untouched field; share_shift and share_growth (1/m): model error over a marker's
    displacement, m.
    """

    shift: float
    growth: float
    share_shift: float
    share_growth: float


@dataclass(frozen=True)
class Inverse:
    """presses: T; covariance: (6 T, 6 T) of their vectors, with one more row for the interaction factor of several; misfit: mean squared
    normalised residual (about 1); mixed: the interaction factor, 0 for one."""

    presses: list[Press]
    covariance: np.ndarray
    misfit: float
    mixed: float = 0.0

    def tip(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Place and depth (3,), m, of press k as if it were alone, and their covariance (3, 3), scaled by a misfit above 1."""
        vector, part = self.presses[k].vector, slice(SIZE * k, SIZE * (k + 1))
        unsure = UNSURE * np.hypot(*vector[4:]) * np.array([1, 1, 0])
        return _TIP @ vector, _TIP @ self.covariance[part, part] @ _TIP.T * max(self.misfit, 1.0) + np.diag(unsure**2)


class Seen:
    """The N markers of a field that are seen: rest (N, 2), eye (N, 3), value (N, 3) shift and growth, 0 where known (N, 3) is False."""

    def __init__(self, field: MarkerField):
        self.index = np.flatnonzero(field.seen & np.isfinite(field.eye).all(1))
        self.rest, self.eye = field.rest[self.index], field.eye[self.index]
        value = np.column_stack([field.shift[self.index], field.growth[self.index]])
        self.known = np.isfinite(value)
        self.value = np.where(self.known, value, 0.0)
        self.sigma = np.nan_to_num(field.sigma[self.index])


class SheetInverse:
    """Fits presses to marker fields. marker_radius: m; pitch: m, of the markers."""

    def __init__(self, library: SheetLibrary, noise: FieldNoise, marker_radius: float, pitch: float):
        self._library, self._noise, self._marker_radius, self._near = library, noise, marker_radius, NEAR * pitch
        farthest = FARTHEST * library.plan.depth
        self._most = np.array([*library.plan.reach, library.plan.depth, SPREAD, farthest, farthest]) * (1 - 1e-6)
        self._least = np.array([*-library.plan.reach, SHALLOW, -SPREAD, -farthest, -farthest])

    def solve(self, seen: Seen, start: list[Press], mixed: float | None = None, dragged: bool = False, near: bool = False) -> Inverse:
        """Fit as many presses as start has. mixed: initial interaction factor; dragged: whether drags are free; near: whether start is the
        last frame's solution, for which FOLLOWED iterations suffice."""
        count = len(start)
        state = np.concatenate([np.clip([press.vector for press in start], self._least, self._most).ravel(), self._mixing(start, mixed)])
        free = np.tile([True, True, True, True, dragged, dragged], count)
        free = np.flatnonzero(np.append(free, np.ones(len(state) - len(free), bool)))
        correction, corrected, length, way, pull = 0.0, np.full_like(state, np.inf), np.inf, np.zeros(len(free)), 1.0
        for turn in range(FOLLOWED if near else ROUNDS):
            presses = _presses(state, count)
            fields = [fields_of(self._library, press) for press in presses]
            if length > NEARLY**2:
                shown, slopes, weight = self._slopes(presses, fields, state, seen, free)
            else:
                shown = self._appears(presses, fields, state, seen)
            if (near or turn) and (np.abs(state - corrected)[:SIZE * count].reshape(-1, SIZE)[:, :3] > MOVED).any():
                correction, corrected = self._disc_correction(presses, fields, seen), state
            residual = (weight * (seen.value - shown - correction)).ravel()
            pulled = slopes * np.minimum(1, DOUBT / np.maximum(np.abs(residual), DOUBT))
            if length > NEARLY**2:
                middle, prior = self._prior(presses, free)
                information = pulled @ slopes.T
                information[np.diag_indices_from(information)] += prior + 1e-9 * np.diag(information)
                covariance = np.linalg.inv(information)
            gradient = pulled @ residual - prior * (state[free] - middle)
            step = covariance @ gradient * _damping(gradient @ way, pull)
            before, state = state, self._within(state, free, step, count)
            way, length = (state - before)[free], step @ gradient
            pull = way @ gradient
            if (near or turn) and length < SETTLED**2:
                break
        misfit = float(np.sum(np.minimum(residual**2, DOUBT * np.abs(residual))) / max(seen.known.sum(), 1))
        whole = np.zeros((len(state), len(state)))
        whole[np.ix_(free, free)] = covariance
        return Inverse(_presses(state, count), whole, misfit, float(state[SIZE * count:].sum()))

    def _slopes(self, presses: list[Press], fields: list[np.ndarray], state: np.ndarray, seen: Seen,
                free: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Shift and growth (N, 3) of the markers' centres; their derivatives by the free state, times the weights, (P, 3 N); the weights
        (N, 3)."""
        parts = [read_derivatives(self._library, press, seen.rest, field) for press, field in zip(presses, fields)]
        alone = [part[..., 0] for part in parts]
        slopes, whole = [part[..., 1:].reshape(-1, 9, SIZE) for part in parts], sum(alone)
        if len(presses) > 1:
            hindered = interaction(alone)
            whole = whole + state[-1] * hindered
            slopes.append(hindered.reshape(-1, 9, 1))
        slopes = appearance_slopes(whole, seen.rest, seen.eye) @ np.concatenate(slopes, axis=2).take(free, axis=2)
        weight = self._weight(seen, [part[:, 0] for part in alone])
        return appearance(whole, seen.rest, seen.eye), (slopes * weight[..., None]).reshape(-1, len(free)).T, weight

    def _appears(self, presses: list[Press], fields: list[np.ndarray], state: np.ndarray, seen: Seen) -> np.ndarray:
        """Shift and growth (N, 3) of the markers' centres."""
        alone = [read_press(self._library, press, seen.rest, field) for press, field in zip(presses, fields)]
        return appearance(sum(alone) + (state[-1] * interaction(alone) if len(presses) > 1 else 0.0), seen.rest, seen.eye)

    @staticmethod
    def _mixing(presses: list[Press], mixed: float | None) -> np.ndarray:
        return np.array([MIXED[0] if mixed is None else mixed] if len(presses) > 1 else [])

    @staticmethod
    def _prior(presses: list[Press], free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Prior mean and inverse variance of the free state; 0 without a prior."""
        middle, sure = np.zeros(SIZE * len(presses) + 1), np.zeros(SIZE * len(presses) + 1)
        for k, press in enumerate(presses):
            sure[SIZE * k + 3] = RADIUS_SIGMA**-2
            sure[SIZE * k + 4:SIZE * k + 6] = (DRAGGED * press.depth)**-2
        middle[-1], sure[-1] = MIXED[0], MIXED[1]**-2
        return middle[free], sure[free]

    def predict(self, presses: list[Press], seen: Seen) -> tuple[np.ndarray, np.ndarray]:
        """Predicted shift and growth (N, 3), markers near a press as discs; and the displacement (N, 3), m."""
        whole = sum(read_press(self._library, press, seen.rest) for press in presses)
        appears = appearance(whole, seen.rest, seen.eye)
        return appears + self._disc_correction(presses, [fields_of(self._library, press) for press in presses], seen), whole[:, 0]

    def _weight(self, seen: Seen, moved: list[np.ndarray]) -> np.ndarray:
        """(N, 3) inverse standard deviations of shift and growth, 0 where unknown; moved: displacement (N, 3), m, by each press alone."""
        noise, amount = self._noise, np.sum(sum(moved)**2, axis=1)[:, None]
        each = np.sum(np.square(moved), axis=2)
        shared = (each.sum(0) - each.max(0))[:, None]
        own = np.array([noise.shift, noise.shift, noise.growth])**2
        share = np.array([noise.share_shift, noise.share_shift, noise.share_growth])**2
        reported = np.stack([seen.sigma, seen.sigma, np.zeros(len(seen.sigma))], axis=1)**2
        return seen.known / np.sqrt(np.maximum(own, reported) + share * amount + BETWEEN**2 * shared)

    def _disc_correction(self, presses: list[Press], fields: list[np.ndarray], seen: Seen) -> np.ndarray:
        """(N, 3): difference of discs and centre points for the markers near a press."""
        correction = np.zeros_like(seen.value)
        apart = np.min([np.abs(seen.rest - press.place).max(1) for press in presses], axis=0)
        near = np.flatnonzero(apart < self._near)
        if len(near) and self._marker_radius > 0:
            rest, eye = seen.rest[near], seen.eye[near]
            points = np.concatenate([disc_points(rest, self._marker_radius), rest])
            discs, middles = np.split(sum(read_press(self._library, press, points, field)
                                             for press, field in zip(presses, fields)), [-len(rest)])
            correction[near] = disc_appearance(discs, rest, eye, self._marker_radius) - appearance(middles, rest, eye)
        return correction

    def _within(self, state: np.ndarray, free: np.ndarray, step: np.ndarray, count: int) -> np.ndarray:
        """The state after a step (P,) of its free part, limited to STRIDE, and clamped to the bounds."""
        stride, number = np.zeros_like(state), SIZE * count
        stride[free] = step
        each = stride[:number].reshape(-1, SIZE)
        each *= np.minimum(1, np.min(STRIDE / np.maximum(np.abs(each), 1e-12), axis=1, keepdims=True))
        state = state + stride
        state[:number] = np.minimum(np.maximum(state[:number].reshape(-1, SIZE), self._least), self._most).ravel()
        state[number:] = np.minimum(np.maximum(state[number:], MOST_MIXED[0]), MOST_MIXED[1])
        return state


def _damping(pull: float, before: float) -> float:
    """Factor of a step that partly reverses the last one; pull, before: gradient along the last step, now and before it. The full step
    would overshoot again."""
    return before / (before - pull) if pull < 0 < before else 1.0


def interaction(deformed: list[np.ndarray]) -> np.ndarray:
    """(N, 3, 3): correction of height and its derivatives for presses that alone give deformed (N, 3, 3), for a factor of one: for each
    pair, the product of their depths over the sum."""
    lacks = np.zeros_like(deformed[0])
    for one, other in combinations(deformed, 2):
        a, b = np.minimum(one[:, 0, 2], -1e-9), np.minimum(other[:, 0, 2], -1e-9)
        lacks[:, 0, 2] -= a * b / (a + b)
        lacks[:, 1:, 2] -= ((b / (a + b))**2)[:, None] * one[:, 1:, 2] + ((a / (a + b))**2)[:, None] * other[:, 1:, 2]
    return lacks


def _presses(state: np.ndarray, count: int) -> list[Press]:
    vectors = state[:SIZE * count].reshape(-1, SIZE)
    return [Press(vector[:2], float(vector[2]), float(vector[3]), (float(vector[4]), float(vector[5]))) for vector in vectors]
