# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers of contacts from frame to frame: one for each region, kept while it lasts, given back where regions merge and part."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .regions import Regions

_LASTING = 3  # frames from which on a contact is one of its own, not a part of one that is just beginning
_SMALL = 4  # taxels under which what comes and goes beside a contact is no contact that has merged with it


@dataclass(frozen=True)
class NumberedRegion:
    """number: of the contact, never used for another; merged: whether it is several contacts that have run together."""

    number: int
    merged: bool


@dataclass
class _Track:
    """swallowed: numbers and last centroids (2,) m of the contacts that have merged with this one; age: frames; size: largest, taxels; own:
    its centroid before others merged with it."""

    swallowed: dict
    age: int
    size: int
    centroid: np.ndarray
    own: np.ndarray


class RegionNumbers:
    """A region goes on as the contact of the last frame with which it shares most taxels. Of regions that merge, the contact with most
    taxels in common gives its number and remembers the others'; where it parts again, its parts get their numbers back by where they
    were. A region with none in common is a new contact."""

    def __init__(self):
        self._next = 1
        self.reset()

    def reset(self) -> None:
        """Forget the present contacts; numbers are not used again."""
        self._tracks: dict[int, _Track] = {}
        self._numbers: dict[int, int] = {}  # of the last frame's labels
        self._labels: np.ndarray | None = None

    def assign(self, regions: Regions) -> list[NumberedRegion]:
        """One for each region of the frame, in their order."""
        shared = self._shared(regions)
        chosen = self._by_place(_chosen(shared), shared, regions)
        tracks: dict[int, _Track] = {}
        for k, number in chosen.items():
            tracks[number] = self._continued(number, regions.all[k], {other: n for (at, other), n in shared.items() if at == k}, chosen)
        for k, region in enumerate(regions.all):
            if k not in chosen:
                chosen[k] = self._parted(k, region, shared, tracks)
                tracks[chosen[k]] = _Track({}, 1, region.count, region.moments.centroid[:2], region.moments.centroid[:2])
        self._remember(regions, chosen, tracks)
        return [NumberedRegion(chosen[k], bool(tracks[chosen[k]].swallowed)) for k in range(len(regions.all))]

    def _shared(self, regions: Regions) -> dict[tuple[int, int], int]:
        """(index of a region, number of a contact of the last frame) -> taxels that they share."""
        shared = {}
        for k, region in enumerate(regions.all if self._numbers else ()):
            before = self._labels[region.box][regions.labels[region.box] == region.label]
            for label, count in enumerate(np.bincount(before).tolist()):
                if count and label in self._numbers:
                    shared[k, self._numbers[label]] = count
        return shared

    def _by_place(self, chosen: dict[int, int], shared: dict, regions: Regions) -> dict[int, int]:
        """chosen with the number of a contact that parts given to the part that is where that contact was before others merged with it."""
        given = dict(chosen)
        for k, number in chosen.items():
            track = self._tracks[number]
            parts = [at for at, n in shared if n == number and chosen.get(at, number) == number and regions.all[at].count >= _SMALL]
            if track.swallowed and len(parts) > 1:
                del given[k]
                given[min(parts, key=lambda at: _nearer(regions.all[at].moments.centroid[:2], track))] = number
        return given

    def _continued(self, number: int, region, sharing: dict[int, int], chosen: dict[int, int]) -> _Track:
        before = self._tracks[number]
        swallowed = dict(before.swallowed)
        for other in sharing:
            ended = self._tracks[other]
            if other not in chosen.values() and ended.age >= _LASTING and ended.size >= _SMALL:
                swallowed |= {other: ended.centroid} | ended.swallowed
        centroid = region.moments.centroid[:2]
        return _Track(swallowed, before.age + 1, max(before.size, region.count), centroid, before.own if swallowed else centroid)

    def _parted(self, k: int, region, shared: dict, tracks: dict[int, _Track]) -> int:
        """The number of a region that no contact goes on as: one that the contact it parted from had swallowed, else a new one."""
        centroid = region.moments.centroid[:2]
        for at, number in shared:
            swallowed = tracks[number].swallowed if at == k and number in tracks else {}
            if swallowed and region.count >= _SMALL:
                back = min(swallowed, key=lambda n: float(np.hypot(*(swallowed[n] - centroid))))
                del swallowed[back]
                return back
        self._next += 1
        return self._next - 1

    def _remember(self, regions: Regions, chosen: dict[int, int], tracks: dict[int, _Track]) -> None:
        self._tracks, self._labels = tracks, regions.labels
        self._numbers = {region.label: chosen[k] for k, region in enumerate(regions.all)}


def _chosen(shared: dict[tuple[int, int], int]) -> dict[int, int]:
    """Number for each region that goes on: pairs by most taxels in common, each number and region once."""
    chosen: dict[int, int] = {}
    for (k, number), _ in sorted(shared.items(), key=lambda item: (-item[1], item[0][1])):
        if k not in chosen and number not in chosen.values():
            chosen[k] = number
    return chosen


def _nearer(place: np.ndarray, track: _Track) -> float:
    """m: how much farther place (2,) is from where a contact was than from those that have merged with it."""
    return float(np.hypot(*(place - track.own)) - min(np.hypot(*(place - other)) for other in track.swallowed.values()))
