# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From links between neighbours to relative rows and columns: along whole rows and columns in turn, breadth-first."""
from __future__ import annotations

import numpy as np

ALONG_ROW, ALONG_COLUMN = 1.0, 1.0j  # a place on the grid is column + i row


class Links:
    """Neighbours of count dots: right, left, below, above (N + 1,) int64, -1 where none; the last entry is -1, so that -1 reads none."""

    def __init__(self, count: int, row: tuple[np.ndarray, np.ndarray], column: tuple[np.ndarray, np.ndarray]):
        """row: left and right dots of the links along rows; column: upper and lower dots of those along columns."""
        self.count = count
        self.right, self.left, self.below, self.above = np.full((4, count + 1), -1)
        self.right[row[0]], self.left[row[1]] = row[1], row[0]
        self.below[column[0]], self.above[column[1]] = column[1], column[0]

    def sound(self) -> 'Links':
        """Those links that are a side of a closed mesh: right then below ends where below then right does."""
        corner = self.below[self.right]
        top_left = np.flatnonzero((corner >= 0) & (corner == self.right[self.below]))
        right, below, corner = self.right[top_left], self.below[top_left], corner[top_left]
        first = (np.concatenate([top_left, below]), np.concatenate([right, corner]))
        return Links(self.count, first, (np.concatenate([top_left, right]), np.concatenate([below, corner])))


def walk(links: Links) -> tuple[np.ndarray, int]:
    """Place (N,) complex, column + i row, of each dot that links lead to, nan + nan i elsewhere; and the number of contradictions."""
    sound = links.sound()
    chains = [_chains(sound.left[:-1], ALONG_ROW), _chains(sound.above[:-1], ALONG_COLUMN)]
    place = _along_chains(chains, links.count)
    contradictions = _contradictions(sound, place)
    if not contradictions:
        place = _join(links, place)
    return place, contradictions


def _chains(back: np.ndarray, step: complex) -> tuple[np.ndarray, np.ndarray]:
    """First dot (N,) of the chain that each dot is in, and the way (N,) from it, by doubling the path until none is left."""
    first = np.where(back >= 0, back, np.arange(len(back)))
    way = np.where(back >= 0, step, 0)
    for _ in range(max(1, int(len(back)).bit_length())):
        further = first[first]
        if np.array_equal(further, first):
            break
        way = way + way[first]
        first = further
    return first, way


def _along_chains(chains: list, count: int) -> np.ndarray:
    """Places of all dots that the longest row leads to, over columns and rows in turn."""
    first, way = chains[0]
    longest = np.bincount(first).argmax()
    place = np.where(first == longest, way, np.nan + 1j * np.nan)
    known = np.count_nonzero(first == longest)
    for turn in range(1, count + 2):
        first, way = chains[turn % 2]
        start = np.full(count, np.nan + 1j * np.nan)
        index = np.flatnonzero(np.isfinite(place.real))
        if turn > 2 and len(index) == known:
            break
        known = len(index) if turn > 1 else 0
        start[first[index]] = place[index] - way[index]
        place = np.where(np.isfinite(place.real), place, start[first] + way)
    return place


def _contradictions(links: Links, place: np.ndarray) -> int:
    """How many links lead to another place than found, and dots have the place of another."""
    right, below = links.right[:-1], links.below[:-1]
    row, column = np.flatnonzero(right >= 0), np.flatnonzero(below >= 0)
    off = np.concatenate([place[right[row]] - place[row] - ALONG_ROW, place[below[column]] - place[column] - ALONG_COLUMN])
    return int(np.count_nonzero(np.abs(off) > 0.5)) + int(np.count_nonzero(_doubles(place)))


def _doubles(place: np.ndarray) -> np.ndarray:
    """(N,) bool: the dot has the same place as another."""
    known = np.isfinite(place.real)
    column, row = place.real[known].astype(np.int64), place.imag[known].astype(np.int64)
    flat = (row - row.min()) * (np.ptp(column) + 1) + column - column.min()
    double = np.zeros(len(place), bool)
    double[known] = np.bincount(flat)[flat] > 1
    return double


def _join(links: Links, place: np.ndarray) -> np.ndarray:
    """Places with those of dots outside closed meshes whose links to known places all say the same.

    Without any of these if two dots end up in one place.
    """
    joined = place.copy()
    for _ in range(2):
        loose = np.flatnonzero(~np.isfinite(joined.real))
        if not len(loose):
            break
        said = np.full((4, len(loose)), np.nan + 1j * np.nan)
        sides = ((links.left, ALONG_ROW), (links.right, -ALONG_ROW), (links.above, ALONG_COLUMN), (links.below, -ALONG_COLUMN))
        for k, (side, step) in enumerate(sides):
            other = side[loose]
            has = other >= 0
            said[k, has] = joined[other[has]] + step
        heard = np.isfinite(said.real)
        mean = np.where(heard, said, 0).sum(axis=0) / np.maximum(heard.sum(axis=0), 1)
        agree = heard.any(axis=0) & ~np.any(heard & (np.abs(said - mean) > 0.1), axis=0)
        joined[loose[agree]] = np.round(mean[agree])
    return place if _doubles(joined).any() else joined
