# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact tracking: one Contact for each region, under an id that it keeps while the touch lasts."""
from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..._core import deepest_notch
from ...common.estimates import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE, ContactEstimate
from ...common.geometry import Cap
from .contact_point import FoundContact, find_contact
from ...errors import BadArgument
from .region import ContactDots, Region

_NOTCH = 1.3  # pitches, convexity defect of an outline from which it may be two merged touches; chosen
_MERGED_FRAMES = 15  # for which a merged region is AMBIGUOUS; chosen
_LASTING = 5  # frames after which a region is a touch of its own, not a part of one that is just beginning; chosen


class ContactTracker:
    """Contacts frame by frame.

    A region continues the contact of the last frame with which it shares most dots; without common dots, the nearest one within a pitch
    and a half from border to border. A contact that is lost for a frame keeps its id. Of merging regions, the one with most common dots
    gives its id; if both had lasted, the contact is AMBIGUOUS for the next frames, and longer only while its outline has a notch. Of the
    parts of a region that splits, the one with most common dots keeps the id.
    calibrated_depth, calibrated_radius: m, largest calibrated depth and distance from the z axis; None: unknown.
    """

    def __init__(self, cap: Cap, calibrated_depth: float | None = None, calibrated_radius: float | None = None):
        for name, value in (('calibrated_depth', calibrated_depth), ('calibrated_radius', calibrated_radius)):
            if value is not None and not 0 < value < np.inf:
                raise BadArgument(f'contact tracker: {name} must be positive, m, got {value}')
        self._cap, self._depth, self._radius = cap, calibrated_depth, calibrated_radius
        self._next = 1
        self.reset()

    def reset(self) -> None:
        """Forget all contacts; ids are not used again."""
        self._last: dict[int, _Track] = {}

    def process(self, dots: ContactDots, regions: list[Region]) -> list[ContactEstimate]:
        """One contact for each region of this frame, in their order."""
        held = [set(np.asarray(dots.ids)[region.members].tolist()) for region in regions]
        chosen = _match(held, regions, self._last)
        contacts, tracks = [], {}
        for k, region in enumerate(regions):
            number = chosen.get(k)
            if number is None:
                number, self._next = self._next, self._next + 1
            merged = self._merged_for(number, k, held, chosen)
            age = self._last[number].age + 1 if number in self._last else 1
            tracks[number] = _Track(held[k], region.moments.centroid, region.moments.area, merged, age)
            contacts.append(self._contact(number, dots, region, merged > 0))
        lost = {number: replace(track, lost=True) for number, track in self._last.items() if number not in tracks and not track.lost}
        self._last = tracks | lost
        return contacts

    def _merged_for(self, number: int, k: int, held: list[set], chosen: dict[int, int]) -> int:
        """Frames for which region k still counts as merged: it absorbs a contact that ends now, or did before and has not split since."""
        ended = [track for other, track in self._last.items()
                 if other not in chosen.values() and not track.lost and track.age >= _LASTING]
        if any(len(track.held & held[k]) > len(track.held) / 2 for track in ended):
            return _MERGED_FRAMES
        before = self._last.get(number)
        whole = before is not None and sum(bool(some & before.held) for some in held) == 1
        return max(before.merged - 1, 0) if whole else 0

    def _contact(self, number: int, dots: ContactDots, region: Region, merged: bool) -> ContactEstimate:
        found = find_contact(dots, region, self._cap)
        flags = self._flags(dots, region, found, merged)
        return ContactEstimate(number, found.position, found.normal, found.depth, found.force, found.covariance, flags, region.members)

    def _flags(self, dots: ContactDots, region: Region, found: FoundContact, merged: bool) -> int:
        place = region.outline.grid_points
        row, column = place.max(axis=0).tolist()
        flags = AT_EDGE if place.min() < 0.5 or row > dots.rows - 1.5 or column > dots.columns - 1.5 else 0
        if merged or deepest_notch(place) > _NOTCH:
            flags |= AMBIGUOUS
        beyond = self._depth is not None and found.depth > self._depth
        outside = self._radius is not None and math.hypot(found.position[0], found.position[1]) > self._radius
        return flags | (OUT_OF_RANGE if beyond or outside else 0)


@dataclass(frozen=True)
class _Track:
    held: set
    centroid: np.ndarray
    area: float
    merged: int
    age: int
    lost: bool = False


def _match(held: list[set], regions: list[Region], last: dict[int, _Track]) -> dict[int, int]:
    """Id for each region that continues a contact: greedily by most common dots, then by the smallest gap."""
    pairs = []
    for k, region in enumerate(regions):
        for number, track in last.items():
            radii = math.sqrt(region.moments.area / math.pi) + math.sqrt(track.area / math.pi)
            gap = math.dist(region.moments.centroid, track.centroid) - radii
            common = len(held[k] & track.held)
            if common or gap < 1.5 * region.pitch:
                pairs.append((-common, gap, number, k))
    chosen: dict[int, int] = {}
    for _, _, number, k in sorted(pairs):
        if k not in chosen and number not in chosen.values():
            chosen[k] = number
    return chosen
