# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Inversion of the sheet model: a coarse place by a matched filter, and from there the presses that explain a marker field."""
from __future__ import annotations

from dataclasses import astuple, dataclass, replace

import numpy as np

from ..field import MarkerField
from .library import Press, SheetLibrary

SIZE = 6    # of a press's vector
ANY_TIP = 0.0, 0.15  # log of a tip's radius over the calibrated one: prior mean and standard deviation. Chosen
SURE = 4.0  # least depth of a touch, standard deviations of the fit. Chosen
NEAR = 2.5  # marker pitches from a press within which markers are discs; farther away points. Chosen


@dataclass(frozen=True)
class FieldNoise:
    """Standard deviations: shift, m, and growth of an untouched field; share_shift and share_growth (1/m): model error over a marker's
    displacement, m; depth_shift and depth_growth (1/m): over the depth of the press, m.
    """

    shift: float
    growth: float
    share_shift: float
    share_growth: float
    depth_shift: float = 0.0
    depth_growth: float = 0.0


@dataclass(frozen=True)
class Inverse:
    """presses: T; covariance: (6 T, 6 T) of their vectors, with one more row for the interaction factor of two; misfit: mean squared
    normalised residual (about 1); wrenches: (T, 9) log of normal force over depth, tangential over normal force, moment about the tip over
    normal force, m, and centre of the pressure relative to the tip, m; mixed: the interaction factor, 0 for one."""

    presses: list[Press]
    covariance: np.ndarray
    misfit: float
    wrenches: np.ndarray
    mixed: float = 0.0

    def is_sure(self, k: int) -> bool:
        """Whether the markers show press k: that its depth is uncertain, as in drags, does not make it less so."""
        (*_, depth), covariance = self.tip(k)
        return bool(depth > SURE * np.sqrt(covariance[2, 2]))

    def tip(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Place and depth (3,), m, of press k as if it were alone, and their covariance (3, 3), scaled by a misfit above 1."""
        part = slice(SIZE * k, SIZE * k + 3)
        return self.presses[k].vector[:3], self.covariance[part, part] * max(self.misfit, 1.0)


class Seen:
    """The N markers of a field that are seen: rest (N, 2), camera_centre (N, 3), value (N, 3) shift and growth, NaN where unknown; sigma
    (N,).

    motion: (N, 3) of value, of those that a second camera sees at a moment of its own, by an unknown share of which they may be late.
    """

    def __init__(self, field: MarkerField, motion: np.ndarray | None = None):
        self.index = np.flatnonzero(field.seen & np.isfinite(field.camera_centre).all(1))
        self.rest, self.camera_centre, self.sigma = field.rest[self.index], field.camera_centre[self.index], field.sigma[self.index]
        self.value = np.column_stack([field.shift[self.index], field.growth[self.index]])
        self.motion = np.zeros((len(self.index), 3)) if motion is None else motion[self.index]


class SheetInverse:
    """Fits presses to marker fields. marker_radius: m; pitch: m, of the markers."""

    def __init__(self, library: SheetLibrary, noise: FieldNoise, marker_radius: float, pitch: float):
        self._library, self._marker = library, {'marker_radius': marker_radius, 'near': NEAR * pitch}
        self._noise = astuple(noise)

    def solve(self, seen: Seen, start: list[Press], drags: bool = False) -> Inverse:
        """Fit one press or two from start; drags: whether their drags are unknown, else 0."""
        vectors = np.array([press.vector for press in start])
        found = self._library.table.fit(seen.rest, seen.camera_centre, seen.value, seen.sigma, seen.motion, vectors, noise=self._noise,
                                        tip=ANY_TIP,
                                        drags=drags, **self._marker)
        presses = [Press.of(found.state[SIZE * k:SIZE * (k + 1)]) for k in range(len(start))]
        return Inverse(presses, found.covariance, found.misfit, found.wrenches, float(found.state[SIZE * len(start):].sum()))

    def predict(self, presses: list[Press], seen: Seen, mixed: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Predicted shift and growth (N, 3), and the displacement with its derivatives by x and y (N, 3, 3)."""
        return show(self._library, presses, seen.rest, seen.camera_centre, mixed, **self._marker)


def show(library: SheetLibrary, presses: list[Press], rest: np.ndarray, camera_centre: np.ndarray, mixed: float = 0.0,
         marker_radius: float = 0.0, near: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Shift, m, and growth (N, 3) of markers at rest (N, 2), m, seen from camera_centre (N, 3), m, under one press or two with an
    interaction factor mixed; and the displacement of the sheet there with its derivatives by x and y (N, 3, 3). Markers of marker_radius,
    m, nearer than near, m, to a press are discs, else points."""
    return library.table.show(rest, camera_centre, np.array([press.vector for press in presses]), mixed=mixed, marker_radius=marker_radius,
                              near=near)


GRID = (13, 11)          # template places along x and y. Chosen
DEPTHS = (0.1, 0.4, 0.8)  # template depths over the library's largest. Chosen
PAIR_DEPTH = 1           # of DEPTHS: templates of two presses at once. Chosen
_MOVED = 1e-4            # m: a camera centre or untouched marker that changed by more renews the templates. Chosen


class SheetStart:
    """Matches fields of one marker pattern with templates. shift, m, growth: standard deviations of an untouched field."""

    def __init__(self, library: SheetLibrary, shift: float, growth: float):
        self._library, self._sigma = library, np.array([shift, shift, growth])
        x, y = (np.linspace(-0.95, 0.95, count) * reach for count, reach in zip(GRID, library.plan.reach))
        places = np.stack(np.meshgrid(x, y, indexing='ij'), axis=-1).reshape(-1, 2)
        self._presses = [Press(place, depth * library.plan.depth) for place in places for depth in DEPTHS]
        self._rest = self._camera_centre = np.zeros((0, 2))

    def best(self, field: MarkerField) -> tuple[Press, float]:
        """The best matching press, with depth scaled to the match, and the match in standard deviations of the noise or of the residual,
        whichever is larger."""
        self._renew(field)
        value = self._values(field)
        known = np.isfinite(value) & self._known
        value = np.where(known, value, 0.0)
        match, length = self._fields @ value.astype(np.float32), self._lengths(known)
        score = match / length
        k = int(np.argmax(score))
        press, best = self._presses[k], float(score[k])
        depth = min(max(press.depth * best / float(length[k]), 1e-5), self._library.plan.depth)
        left = (float(value @ value) - best**2) / max(np.count_nonzero(known), 1)
        return Press(press.place, depth), best / np.sqrt(max(left, 1.0))

    def best_pair(self, field: MarkerField) -> list[Press]:
        """The two presses whose fields, each scaled, add up to the field best; of the templates of PAIR_DEPTH, as best for the rest."""
        self._renew(field)
        value = self._values(field)
        known = np.isfinite(value) & self._known
        fields = np.where(known, self._fields[PAIR_DEPTH::len(DEPTHS)], 0.0)
        match, both = fields @ np.where(known, value, 0.0), fields @ fields.T + 1e-9 * np.eye(len(fields))
        own = np.diag(both)
        free = np.maximum(own[:, None] * own - both**2, 1e-3 * own[:, None] * own)  # alike ones tell nothing apart
        share = (match[:, None] * own - both * match) / free  # of the first of each pair
        reported = np.where((share > 0) & (share.T > 0), share * match[:, None] + share.T * match, 0.0)
        first, second = np.unravel_index(np.argmax(reported), reported.shape)
        presses = self._presses[PAIR_DEPTH::len(DEPTHS)]
        return [replace(presses[k], depth=float(np.clip(presses[k].depth * share[k, other], 1e-5, self._library.plan.depth)))
                for k, other in ((first, second), (second, first))]

    def _values(self, field: MarkerField) -> np.ndarray:
        """(3 K,) shift and growth of all markers over their noise."""
        return (np.column_stack([field.shift, field.growth]) / self._sigma).ravel()

    def _lengths(self, known: np.ndarray) -> np.ndarray:
        """(P,) norms of the templates over the known values (3 K,)."""
        if not np.array_equal(known, self._last[0]):
            self._last = known, np.sqrt(np.maximum(self._fields**2 @ known.astype(np.float32), 1e-9))
        return self._last[1]

    def _renew(self, field: MarkerField) -> None:
        """Renew the templates where markers or camera centres changed; a marker that is not seen keeps its last position."""
        if len(self._rest) == len(field):
            rest = np.where(np.isfinite(field.rest), field.rest, self._rest)
            camera_centre = np.where(np.isfinite(field.camera_centre), field.camera_centre, self._camera_centre)
            moved = [(np.abs(now - before) >= _MOVED).any() or np.count_nonzero(np.isnan(now)) != np.count_nonzero(np.isnan(before))
                     for now, before in ((rest, self._rest), (camera_centre, self._camera_centre))]
            if not any(moved):
                return
        else:
            rest, camera_centre = field.rest, field.camera_centre
        self._rest, self._camera_centre = rest, camera_centre
        known = np.isfinite(rest).all(1) & np.isfinite(camera_centre).all(1)
        fields = np.zeros((len(self._presses), len(field), 3))
        for k, press in enumerate(self._presses):
            fields[k, known] = show(self._library, [press], rest[known], camera_centre[known])[0] / self._sigma
        self._known = np.repeat(known, 3)
        self._fields = fields.reshape(len(fields), -1).astype(np.float32)
        self._last = np.zeros(0, bool), np.zeros(0)
