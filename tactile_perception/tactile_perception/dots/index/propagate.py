# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From links between neighbours to relative rows and columns: along whole rows and columns in turn, breadth-first."""
from __future__ import annotations

import numpy as np

_ROW = 1 << 20  # a place on the grid is row * _ROW + column, in one number
_NOWHERE = -(1 << 50)
_FAR = _NOWHERE // 2  # places below are not known


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


def walk(links: Links) -> tuple[np.ndarray, np.ndarray, int]:
    """Row and column (N, 2) int64 of each dot that links lead to, which these are (N,) bool, and the number of contradictions."""
    sound = links.sound()
    place = _along_chains(*_chains(sound), links.count)
    contradictions = _contradictions(sound, place)
    if not contradictions:
        place = _join(links, place)
    known = place > _FAR
    row = (place + _ROW // 2) // _ROW
    return np.where(known, np.stack([row, place - row * _ROW]), 0).T, known, contradictions


def _chains(links: Links) -> tuple[np.ndarray, np.ndarray]:
    """First dot (2, N) of the row and of the column that each dot is in, and the way (2, N) from it, by doubling the path until none is
    left."""
    back = np.concatenate([links.left[:-1], links.above[:-1] + links.count])
    linked = np.concatenate([links.left[:-1], links.above[:-1]]) >= 0
    first = np.where(linked, back, np.arange(len(back)))
    way = linked * np.repeat([1, _ROW], links.count)
    while True:
        further = first[first]
        if (further == first).all():
            break
        way = way + way[first]
        first = further
    return first.reshape(2, -1) - [[0], [links.count]], way.reshape(2, -1)


def _along_chains(first: np.ndarray, way: np.ndarray, count: int) -> np.ndarray:
    """Places of all dots that the longest row leads to, over columns and rows in turn."""
    longest = np.bincount(first[0]).argmax()
    place = np.where(first[0] == longest, way[0], _NOWHERE)
    index, before = np.flatnonzero(place > _FAR), 0
    for turn in range(1, count + 2):
        chain, along = first[turn % 2], way[turn % 2]
        start = np.full(count, _NOWHERE)
        start[chain[index]] = place[index] - along[index]
        place = np.where(place > _FAR, place, start[chain] + along)
        index, last = np.flatnonzero(place > _FAR), len(index)
        if len(index) == count or len(index) == last == before:
            break
        before = last
    return place


def _contradictions(links: Links, place: np.ndarray) -> int:
    """How many links lead to another place than found, and dots have the place of another."""
    wrong = 0
    for side, step in ((links.right[:-1], 1), (links.below[:-1], _ROW)):
        dot = np.flatnonzero((side >= 0) & (place > _FAR))
        wrong += np.count_nonzero(place[side[dot]] - place[dot] != step)
    return int(wrong) + _doubles(place)


def _doubles(place: np.ndarray) -> int:
    """How many dots have the same place as another."""
    known = np.sort(place[place > _FAR])
    return int(np.count_nonzero(known[1:] == known[:-1]))


def _join(links: Links, place: np.ndarray) -> np.ndarray:
    """Places with those of dots outside closed meshes whose links to known places all say the same.

    Without any of these if two dots end up in one place.
    """
    joined = place.copy()
    for _ in range(2):
        loose = np.flatnonzero(joined <= _FAR)
        if not len(loose):
            break
        said = np.full((4, len(loose)), _NOWHERE)
        for k, (side, step) in enumerate(((links.left, 1), (links.right, -1), (links.above, _ROW), (links.below, -_ROW))):
            has = np.flatnonzero(side[loose] >= 0)
            said[k, has] = joined[side[loose[has]]] + step
        heard = said > _FAR
        highest = said.max(0)
        agree = heard.any(0) & ~(heard & (said != highest)).any(0)
        joined[loose[agree]] = highest[agree]
    return place if _doubles(joined) else joined
