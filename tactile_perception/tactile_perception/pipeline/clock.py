# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tells stamps that begin anew, as those of a recording that plays in a loop, from one stamp that is wrong."""
from __future__ import annotations

import math

from ..errors import ClockSetBack

_JUMP_S = 1.0  # less may be frames that changed places on their way: it takes more of them until all begins anew
_AFTER_JUMP, _AFTER_STEP = 2, 3  # frames in order among themselves


class StampClock:
    """Follows the stamps of a stream of frames."""

    def __init__(self):
        self._last_s = self._back_s = -math.inf
        self._earlier = 0

    def begins_anew(self, stamp_s: float) -> bool:
        """Whether what is known of earlier frames is over with this stamp, s: it and one before it (two, where they went back by less
        than a second) come before the last one and are in order among themselves.

        Raises ClockSetBack for those before it, of which nobody can tell yet whether others will follow. A stamp that repeats or is no
        number is for others to judge.
        """
        if not stamp_s < self._last_s:
            if math.isfinite(stamp_s):
                self._last_s, self._earlier = max(self._last_s, stamp_s), 0
            return False
        self._earlier = self._earlier + 1 if self._earlier and stamp_s > self._back_s else 1
        self._back_s = stamp_s
        back = self._last_s - stamp_s
        if self._earlier < (_AFTER_JUMP if back > _JUMP_S else _AFTER_STEP):
            raise ClockSetBack(f'stamps go back by {back:.1f} s, as those of a recording that begins again: '
                               'if the next frames go on from there, all begins anew, with a new reference')
        self._last_s, self._earlier = stamp_s, 0
        return True
