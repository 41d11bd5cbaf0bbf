# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""True contacts between two stamps, for estimates that carry the mean time of several samples."""
from __future__ import annotations

from bisect import bisect_left, insort
from dataclasses import replace

import numpy as np

from ..common.estimates import ContactEstimate

_LONGEST_NS = 60_000_000  # between two known stamps. Derived: a little more than the longest batch of psd_node


class SampledTruth:
    """Contacts known at stamps. used: the stamps between which some were asked for."""

    def __init__(self):
        self._known: dict[int, list[ContactEstimate]] = {}
        self._stamps: list[int] = []
        self.used: set[int] = set()

    def add(self, stamp: int, contacts: list[ContactEstimate]) -> None:
        """Contacts at a stamp, ns."""
        if stamp not in self._known:
            insort(self._stamps, stamp)
        self._known[stamp] = contacts

    def at(self, stamp: int) -> list[ContactEstimate] | None:
        """Contacts at a stamp between two known ones that are not far apart, None elsewhere: moved evenly from one to the other where they
        are the same, otherwise those of the earlier stamp."""
        place = bisect_left(self._stamps, stamp)
        if not 0 < place < len(self._stamps) or self._stamps[place] - self._stamps[place - 1] > _LONGEST_NS:
            return None
        first, last = self._stamps[place - 1], self._stamps[place]
        self.used |= {first, last}
        before, after = self._known[first], {contact.id: contact for contact in self._known[last]}
        if {contact.id for contact in before} != set(after):
            return before
        return [_between(contact, after[contact.id], (stamp - first) / (last - first)) for contact in before]


def _between(one: ContactEstimate, other: ContactEstimate, part: float) -> ContactEstimate:
    position, normal, depth, force = ((1 - part) * getattr(one, name) + part * getattr(other, name)
                                      for name in ('position', 'normal', 'depth', 'force'))
    length = np.linalg.norm(normal)
    return replace(one, position=position, normal=normal / length if length > 0 else normal, depth=depth, force=force)
