# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Counts skipped items, for the report and the exit code of a tool."""
from __future__ import annotations

import re

_MOST = 50  # distinct reasons kept, further ones are counted together; chosen
_NUMBER = re.compile(r'-?\d+(\.\d+)?')


class LeftOut:
    """Skipped items by place and reason. Reasons that differ only in numbers count as one; the first is reported."""

    def __init__(self):
        self._found: dict[tuple[str, str], list] = {}

    def add(self, where: str, reason: str, stamp_ns: int | None = None, count: int = 1) -> None:
        """Count skipped items. where: topic or file; stamp_ns: stamp of the message, ns; count: number of items."""
        key = (where, _NUMBER.sub('#', reason))
        if key not in self._found and len(self._found) >= _MOST:
            key, reason = ('elsewhere', ''), 'other reasons'
        entry = self._found.setdefault(key, [0, reason, stamp_ns])
        entry[0] += count

    @property
    def total(self) -> int:
        """Number of skipped items."""
        return sum(count for count, _, _ in self._found.values())

    def merge(self, other: LeftOut) -> None:
        """Add the counts of another LeftOut."""
        for (where, _), (count, reason, stamp_ns) in other._found.items():
            self.add(where, reason, stamp_ns, count)

    def lines(self) -> list[str]:
        """One line per reason: count, place, reason and first time; most frequent first."""
        told = sorted(self._found.items(), key=lambda item: -item[1][0])
        return [f'{count} of {where}: {reason}' + ('' if stamp is None else f' (first at {stamp / 1e9:.3f} s)')
                for (where, _), (count, reason, stamp) in told]
