# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact ids from frame to frame, by overlap of regions, with merging and splitting."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .regions import Regions

_LASTING = 3  # frames before a contact that merges is remembered. Chosen: a beginning contact may consist of several regions
_SMALL = 4  # taxels: smaller regions neither merge nor split. Chosen: noise at a border makes such regions


@dataclass(frozen=True)
class TrackedContact:
    """number: id of the contact, never reused; merged: whether several contacts have merged into this region; told: whether it is to
    be reported."""

    number: int
    merged: bool
    told: bool = True


@dataclass
class _Track:
    """merged_ids: id -> last centroid (2,) m of contacts that merged into this one; age: frames; size: largest so far, taxels; own:
    centroid (2,) m before the merge."""

    merged_ids: dict
    age: int
    size: int
    centroid: np.ndarray
    own: np.ndarray


class ContactTracker:
    """A region continues the contact of the last frame with which it shares most taxels; a region that shares none is a new contact.

    Where contacts merge, the one with the largest overlap keeps its id and remembers the others. Where they split, each part gets the id
    of the contact that was nearest to it before the merge.
    """

    def __init__(self):
        self._next = 1
        self.reset()

    def reset(self) -> None:
        """Forget the present contacts; ids are not reused."""
        self._tracks: dict[int, _Track] = {}
        self._numbers: dict[int, int] = {}  # label in the last frame -> id
        self._labels: np.ndarray | None = None

    def assign(self, regions: Regions, least: float = 0.0) -> list[TrackedContact]:
        """The contact of each region, in their order; least: peak of a region's pressure from which it is reported at once.

        A lighter one is reported if it is the largest, or was there in the last frame too: a face that begins or ceases to touch shows as
        pieces for a frame.
        """
        shared = self._shared(regions)
        chosen = self._split_by_position(_greedy_matches(shared), shared, regions)
        tracks: dict[int, _Track] = {}
        for k, number in chosen.items():
            tracks[number] = self._continue(number, regions.all[k], {other: n for (at, other), n in shared.items() if at == k}, chosen)
        for k, region in enumerate(regions.all):
            if k not in chosen:
                chosen[k] = self._start(k, region, shared, tracks)
                tracks[chosen[k]] = _Track({}, 1, region.count, region.moments.centroid[:2], region.moments.centroid[:2])
        self._remember(regions, chosen, tracks)
        found = [tracks[chosen[k]] for k in range(len(regions.all))]
        told = [k == 0 or track.age > 1 or region.peak >= least for k, (track, region) in enumerate(zip(found, regions.all))]
        return [TrackedContact(chosen[k], bool(track.merged_ids), told[k]) for k, track in enumerate(found)]

    def _shared(self, regions: Regions) -> dict[tuple[int, int], int]:
        """(index of a region, id of a contact of the last frame) -> number of taxels in common."""
        shared = {}
        for k, region in enumerate(regions.all if self._numbers else ()):
            before = self._labels[region.box][regions.labels[region.box] == region.label]
            for label, count in enumerate(np.bincount(before).tolist()):
                if count and label in self._numbers:
                    shared[k, self._numbers[label]] = count
        return shared

    def _split_by_position(self, chosen: dict[int, int], shared: dict, regions: Regions) -> dict[int, int]:
        """chosen (index -> id), with the id of a splitting contact moved to the part nearest to where it was before the merge."""
        given = dict(chosen)
        for k, number in chosen.items():
            track = self._tracks[number]
            parts = [at for at, n in shared if n == number and chosen.get(at, number) == number and regions.all[at].count >= _SMALL]
            if track.merged_ids and len(parts) > 1:
                del given[k]
                given[min(parts, key=lambda at: _distance_gain(regions.all[at].moments.centroid[:2], track))] = number
        return given

    def _continue(self, number: int, region, sharing: dict[int, int], chosen: dict[int, int]) -> _Track:
        before = self._tracks[number]
        merged_ids = dict(before.merged_ids)
        for other in sharing:
            ended = self._tracks[other]
            if other not in chosen.values() and ended.age >= _LASTING and ended.size >= _SMALL:
                merged_ids |= {other: ended.centroid} | ended.merged_ids
        centroid = region.moments.centroid[:2]
        return _Track(merged_ids, before.age + 1, max(before.size, region.count), centroid, before.own if merged_ids else centroid)

    def _start(self, k: int, region, shared: dict, tracks: dict[int, _Track]) -> int:
        """Id of a region that continues no contact: a merged one of the contact that it split from, else a new one."""
        centroid = region.moments.centroid[:2]
        for at, number in shared:
            merged_ids = tracks[number].merged_ids if at == k and number in tracks else {}
            if merged_ids and region.count >= _SMALL:
                back = min(merged_ids, key=lambda n: float(np.hypot(*(merged_ids[n] - centroid))))
                del merged_ids[back]
                return back
        self._next += 1
        return self._next - 1

    def _remember(self, regions: Regions, chosen: dict[int, int], tracks: dict[int, _Track]) -> None:
        self._tracks, self._labels = tracks, regions.labels
        self._numbers = {region.label: chosen[k] for k, region in enumerate(regions.all)}


def _greedy_matches(shared: dict[tuple[int, int], int]) -> dict[int, int]:
    """Index of a region -> id: one-to-one, by largest overlap first."""
    chosen: dict[int, int] = {}
    for (k, number), _ in sorted(shared.items(), key=lambda item: (-item[1], item[0][1])):
        if k not in chosen and number not in chosen.values():
            chosen[k] = number
    return chosen


def _distance_gain(place: np.ndarray, track: _Track) -> float:
    """m: distance of place (2,) from the track's own centroid minus that from the nearest merged one."""
    return float(np.hypot(*(place - track.own)) - min(np.hypot(*(place - other)) for other in track.merged_ids.values()))
