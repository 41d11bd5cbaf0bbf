# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Deblends overlapping dots: fits each again after subtracting its neighbours' images from its patch."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .dot_profile import blurred_disc
from .neighbours import PairList, near_pairs
from .subpixel import Fit, LikelihoodFitter

_PER_SQUARE = 16.0  # table entries per px^2 of squared radius. Chosen
_PER_DIAMETER = 20.0  # tables per px of diameter. Chosen
_BEYOND = 3.5  # blurs outside its edge where a dot's image ends. Chosen
_SAME = 0.4  # of the typical diameter: nearer candidates belong to one dot. Chosen
_MET = 0.15  # of the typical diameter: fits that converge to within this distance belong to one dot. Chosen
_GAP = 1.5  # px, gap between edges below which dots are fitted jointly from the start. Chosen
_RUN_OFF = 1.5  # px from the patch's centre: a fit further away has diverged. Chosen
_ROUNDS = 5  # alternating fits of overlapping dots. Chosen
_SKIN = 3.0  # px of relative motion before the neighbour list is rebuilt. Chosen
_BELIEVABLE = 0.15  # of the typical contrast: the images of fainter dots are not subtracted. Chosen


@dataclass
class Pairs:
    """Pairs of positions by index, i, j (M,), i != j, each in both orders and sorted by i; distance: (M,) px."""

    i: np.ndarray
    j: np.ndarray
    distance: np.ndarray

    def among(self, some: np.ndarray, count: int) -> Pairs:
        """The pairs within the subset `some` (ascending indices) of count positions, renumbered by their index in the subset."""
        number = np.full(count, -1)
        number[some] = np.arange(len(some))
        i, j = number[self.i], number[self.j]
        both = np.flatnonzero((i >= 0) & (j >= 0))
        return Pairs(i[both], j[both], self.distance[both])


def _near(places: np.ndarray, i: np.ndarray, j: np.ndarray, reach: float) -> np.ndarray:
    """Indices of the pairs i, j (M,) of positions (2, N) px that are nearer than reach along both axes."""
    u, v = places
    across = np.flatnonzero(np.abs(u.take(i) - u.take(j)) < reach)
    return across[np.abs(v.take(i.take(across)) - v.take(j.take(across))) < reach]


class Separator:
    """Fits overlapping dots again after subtracting their neighbours' images; look: appearance.Look."""

    def __init__(self, look, fitter: LikelihoodFitter):
        self._look, self._fitter = look, fitter
        self._reach = fitter.half + look.largest / 2 + 2 * look.blur
        self._list = PairList(self._reach, _SKIN)
        self._images = NeighbourImages(look.smallest, look.largest, look.blur, fitter.basis, fitter.half)

    def pairs(self, places: np.ndarray, stay: bool) -> Pairs:
        """Pairs of positions (2, N) px that may appear in each other's patches; stay: the dots are those of the last call with stay."""
        i, j = self._list.of(places) if stay else near_pairs(*places, self._reach)
        near = _near(places, i, j, self._reach)
        if not len(near):
            return Pairs(near, near, np.zeros(0))
        i, j = np.concatenate([i[near], j[near]]), np.concatenate([j[near], i[near]])
        order = np.argsort(i, kind='stable')
        i, j = i[order], j[order]
        return Pairs(i, j, np.hypot(*(places[:, i] - places[:, j])))

    def separate(self, fit: Fit, compressed: np.ndarray, places: np.ndarray, diameter: np.ndarray, centre: np.ndarray,
                 pairs: Pairs) -> np.ndarray:
        """Refine the fits and, for overlapping dots, subtract the neighbours' images and fit again; changes fit and compressed in place.

        compressed: (N, K) patches around the whole pixels centre (2, N); places (2, N) px and diameter (N,) px: initial values of the
        fits; pairs: the result of pairs(places).
        Returns (N,) bool: False for a duplicate fit of another fit's dot.
        """
        look, single = self._look, np.ones(len(compressed), bool)
        i, j, began = pairs.i, pairs.j, pairs.distance
        cleaned = np.zeros(len(compressed), bool)
        if len(i):
            fitted = centre + fit.values[:2]
            now = np.hypot(*(fitted[:, i] - fitted[:, j]))
            single[i[((began < _SAME * look.typical) | (now < _MET * look.typical)) & (i > j)]] = False
            i, j = self._clean(fit, compressed, places, diameter, centre, single, i, j, began)
            cleaned[i] = True
        self._fitter.refine(fit, compressed, cleaned)
        return single

    def _clean(self, fit, compressed, places, diameter, centre, single, i, j, began):
        """Subtract neighbours from patches, in place; returns the pairs (i, j) where j was subtracted from i."""
        look = self._look
        solid = single & (fit.amplitude * look.contrast > _BELIEVABLE * look.contrast**2)
        both = single[i] & solid[j]
        touching = both & (began < look.typical + _GAP) & solid[i]
        if touching.any():
            self._take_turns(fit, compressed, places, diameter, centre, i[touching], j[touching])
        reach = self._fitter.half + fit.diameter[j] / 2 + look.blur
        # a fit that diverged without an overlapping neighbour, as under glare, does not model the image
        settled = (fit.away() < _RUN_OFF) & (fit.diameter < look.largest)
        settled[i[touching]] = True
        across, down = centre[:, i] - centre[:, j] - fit.values[:2, j]
        seen = np.flatnonzero(both & settled[j] & (np.abs(across) < reach) & (np.abs(down) < reach))
        i, j = i[seen], j[seen]
        if len(i):
            some = np.unique(i)
            compressed[some] = self._without(fit, compressed, centre, i, j)
        return i, j

    def _take_turns(self, fit, compressed, places, diameter, centre, i, j):
        """Fit overlapping dots in alternation from their initial values, each without the others' images, in place."""
        some = np.unique(i)
        fit.values[:2, some] = places[:, some] - centre[:, some]
        fit.diameter[some] = diameter[some]
        for _ in range(_ROUNDS):
            fit.put(some, self._fitter.fit(self._without(fit, compressed, centre, i, j), fit.u[some], fit.v[some], fit.diameter[some], 1))

    def _without(self, fit, compressed, centre, i, j):
        """(n, K) patches of the n distinct dots in i (sorted), minus the images of dots j."""
        images = self._images.seen(*(centre[:, j] + fit.values[:2, j] - centre[:, i]), fit.diameter[j], fit.amplitude[j])
        start = np.flatnonzero(np.diff(i, prepend=-1))
        return compressed[i[start]] - np.add.reduceat(images, start)


class NeighbourImages:
    """Images of neighbouring dots in a patch, compressed like patches.

    smallest, largest: diameters, px; blur: standard deviation, px; basis: (P, K), of the compression; half: half the patch's side, px.
    """

    def __init__(self, smallest: float, largest: float, blur: float, basis: np.ndarray, half: int):
        self._basis, self._side = basis, np.arange(-half, half + 1, dtype=np.float32)[:, None]
        self._smallest = smallest
        diameters = np.arange(smallest, largest + 1 / _PER_DIAMETER, 1 / _PER_DIAMETER)
        self._length = int((largest / 2 + _BEYOND * np.hypot(blur, 0.3)) ** 2 * _PER_SQUARE) + 1
        radius = np.sqrt(np.arange(self._length) / _PER_SQUARE)
        tables = np.array([blurred_disc(radius, d, blur) for d in diameters], np.float32)
        tables[:, -1] = 0.0
        self._last, self._tables = len(diameters) - 1, tables.ravel()

    def seen(self, u: np.ndarray, v: np.ndarray, diameter: np.ndarray, amplitude: np.ndarray) -> np.ndarray:
        """(M, K) compressed images of dots at (u, v) px from the patches' centres; diameter: px; amplitude: grey levels; all (M,)."""
        across = self._side - u.astype(np.float32)
        down = self._side - v.astype(np.float32)
        squares = (across * across * _PER_SQUARE + 0.5)[None] + (down * down * _PER_SQUARE)[:, None]
        np.minimum(squares, self._length - 1, out=squares)
        table = np.minimum(np.maximum((diameter - self._smallest) * _PER_DIAMETER + 0.5, 0), self._last).astype(np.int32)
        index = squares.astype(np.int32)
        index += table * np.int32(self._length)
        images = self._tables.take(index).reshape(-1, len(u))
        return (images.T @ self._basis) * amplitude.astype(np.float32)[:, None]
