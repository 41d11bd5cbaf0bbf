# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tells stamps that begin anew, as those of a recording that plays in a loop, from one stamp that is wrong."""
from __future__ import annotations

import math

from ..errors import ClockSetBack

_JUMP_S = 1.0  # less is a frame out of order, which is left out and no more


class StampClock:
    """Follows the stamps of a stream of frames."""

    def __init__(self):
        self._last_s = -math.inf
        self._back_s: float | None = None

    def begins_anew(self, stamp_s: float) -> bool:
        """Whether what is known of earlier frames is over with this stamp, s: it goes on from one that went back by more than a second.

        Raises ClockSetBack for that one, of which nobody can tell yet whether others will follow.
        """
        if not self._last_s - stamp_s > _JUMP_S:
            self._back_s = None
            self._last_s = max(self._last_s, stamp_s) if math.isfinite(stamp_s) else self._last_s
            return False
        if self._back_s is not None and 0.0 < stamp_s - self._back_s:
            self._last_s, self._back_s = stamp_s, None
            return True
        self._back_s = stamp_s
        raise ClockSetBack(f'stamps go back by {self._last_s - stamp_s:.1f} s, as those of a recording that begins again: '
                           'if the next frame goes on from there, all begins anew, with a new reference')
