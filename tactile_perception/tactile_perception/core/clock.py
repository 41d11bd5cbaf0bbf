# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Distinguishes restarting stamps, as of a recording played in a loop, from a single wrong stamp."""
from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager

from .constants import CORE
from .errors import ClockSetBack


class StampClock:
    """Follows the stamps of a stream of frames."""

    def __init__(self):
        self._last_s = self._back_s = -math.inf
        self._earlier, self._ahead_s = 0, -math.inf

    @contextmanager
    def at(self, stamp_s: float) -> Iterator[bool]:
        """Context manager that yields restarts_at(stamp_s); an exception within the context restores the previous state."""
        restarts, before = None, dict(vars(self))
        try:
            restarts = self.restarts_at(stamp_s)
            yield restarts
        except Exception:
            if restarts is not None:
                vars(self).update(before)
            raise

    def restarts_at(self, stamp_s: float) -> bool:
        """Whether the stamps restart with this one, s.

        A restart needs two consecutive stamps (three, for a step back of less than a second) that are in order and earlier than the last
        stamp before them. Raises ClockSetBack for the stamps before the restart is confirmed, and for the first stamp that is more than
        an hour ahead. Repeated stamps and NaN are left to the stage.
        """
        if self._last_s + CORE.max_ahead_s < stamp_s < math.inf and not math.isinf(self._last_s):
            if not 0 <= stamp_s - self._ahead_s <= CORE.max_ahead_s:
                self._ahead_s = stamp_s
                raise ClockSetBack(f'a stamp is {stamp_s - self._last_s:.0f} s ahead of the last; it counts if the next confirms it')
        self._ahead_s = -math.inf
        if not stamp_s < self._last_s:
            if math.isfinite(stamp_s):
                self._last_s, self._earlier = max(self._last_s, stamp_s), 0
            return False
        self._earlier = self._earlier + 1 if self._earlier and 0 < stamp_s - self._back_s <= CORE.max_ahead_s else 1
        self._back_s = stamp_s
        back = self._last_s - stamp_s
        if self._earlier < (CORE.frames_after_jump if back > CORE.min_jump_s else CORE.frames_after_step):
            raise ClockSetBack(f'stamps go back by {back:.1f} s, as in a recording that plays in a loop; '
                               'if the next frames continue from there, the node restarts with a new reference')
        self._last_s, self._earlier = stamp_s, 0
        return True
