# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tells stamps that begin anew, as those of a recording that plays in a loop, from one stamp that is wrong."""
from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager

from ..errors import ClockSetBack

_JUMP_S = 1.0  # less may be frames that changed places on their way: it takes more of them until all begins anew
_AFTER_JUMP, _AFTER_STEP = 2, 3  # frames in order among themselves
_AHEAD_S = 3600.0  # a sensor that rests longer pays with a frame; a stamp at the end of its range must not make all later ones old


class StampClock:
    """Follows the stamps of a stream of frames."""

    def __init__(self):
        self._last_s = self._back_s = -math.inf
        self._earlier, self._ahead_s = 0, -math.inf

    @contextmanager
    def at(self, stamp_s: float) -> Iterator[bool]:
        """As begins_anew; a frame that is refused within leaves no trace in what is known of stamps."""
        anew, before = None, dict(vars(self))
        try:
            anew = self.begins_anew(stamp_s)
            yield anew
        except Exception:
            if anew is not None:
                vars(self).update(before)
            raise

    def begins_anew(self, stamp_s: float) -> bool:
        """Whether what is known of earlier frames is over with this stamp, s: it and one before it (two, where they went back by less
        than a second) come before the last one and are in order among themselves.

        Raises ClockSetBack for those before it, of which nobody can tell yet whether others will follow, and for the first that is more
        than an hour ahead. A stamp that repeats or is no number is for others to judge.
        """
        if self._last_s + _AHEAD_S < stamp_s < math.inf and not math.isinf(self._last_s):
            if not 0 <= stamp_s - self._ahead_s <= _AHEAD_S:
                self._ahead_s = stamp_s
                raise ClockSetBack(f'a stamp is {stamp_s - self._last_s:.0f} s ahead of the last: it counts if the next one is so too')
        self._ahead_s = -math.inf
        if not stamp_s < self._last_s:
            if math.isfinite(stamp_s):
                self._last_s, self._earlier = max(self._last_s, stamp_s), 0
            return False
        self._earlier = self._earlier + 1 if self._earlier and 0 < stamp_s - self._back_s <= _AHEAD_S else 1
        self._back_s = stamp_s
        back = self._last_s - stamp_s
        if self._earlier < (_AFTER_JUMP if back > _JUMP_S else _AFTER_STEP):
            raise ClockSetBack(f'stamps go back by {back:.1f} s, as those of a recording that begins again: '
                               'if the next frames go on from there, all begins anew, with a new reference')
        self._last_s, self._earlier = stamp_s, 0
        return True
