# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What presses a field of markers shows: one straight down, one that is dragged, or several at once; and where their tips stand.

What explains more takes its place only where what explains less is wrong by more than the model is, and is far better itself: a tip of
another size, or a flat one, is no two tips.
"""
from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .field import MarkerField
from .sheet_appearance import Press, read_press
from .sheet_inverse import Inverse, Seen, SheetInverse, hindrance
from .sheet_library import SheetLibrary
from .sheet_start import SheetStart

WRONG = 2.5         # misfit, from which on something else is looked for
BETTER = 0.5        # of the misfit, below which a drag has that of a press straight down
FAR_BETTER = 0.5    # the same of two presses
HOPELESS = 4.0      # times that, above which it is not sought any further
RIGHT = 4.0         # misfit, above which two presses are not believed
APART = 2.2         # marker pitches between two tips, below which they are one
SLIGHT = 0.12       # of the deeper press's depth: a slighter one beside it is not believed
AGAIN = 2           # times that two presses are solved for anew, from where they were
UNSURE_PLACE, UNSURE_DEPTH = 0.4, 0.15  # of what other tips move a place, and sink the sheet, by which that may be wrong


@dataclass(frozen=True)
class Tip:
    """vector: (3,) m, place and depth of a tip, and its covariance; log_radius: of its radius over the calibrated one."""

    vector: np.ndarray
    covariance: np.ndarray
    log_radius: float


class SheetPresses:
    """Explains fields by presses. pitch: m, of the markers."""

    def __init__(self, library: SheetLibrary, inverse: SheetInverse, start: SheetStart, pitch: float):
        self._library, self._inverse, self._start, self._pitch = library, inverse, start, pitch

    def explain(self, field: MarkerField, begin: Press) -> Inverse:
        """What explains a field; begin: where a press of it may be."""
        seen = Seen(field)
        found = self._inverse.solve(seen, [begin])
        if found.misfit < WRONG:
            return found
        dragged = self._inverse.solve(seen, self._inverse.solve(seen, found.presses, dragged=True).presses, dragged=True)
        single = dragged if dragged.misfit < BETTER * found.misfit else found
        if single.misfit < WRONG:
            return single
        two = self._two(field, seen, found, FAR_BETTER * dragged.misfit)
        return two if two.misfit <= min(RIGHT, FAR_BETTER * dragged.misfit) and self._apart(two) else single

    def _two(self, field: MarkerField, seen: Seen, one: Inverse, enough: float) -> Inverse:
        """Two presses: one, and another where it leaves most unexplained; given up where their misfit stays far from enough."""
        told = np.zeros((len(field), 3))
        told[seen.index] = self._inverse.predict(one.presses, seen)[0]
        left = replace(field, shift=field.shift - told[:, :2], growth=field.growth - told[:, 2])
        two = self._inverse.solve(seen, [*one.presses, self._start.best(left)[0]])
        for _ in range(AGAIN if two.misfit < HOPELESS * enough else 0):
            two = self._inverse.solve(seen, two.presses, two.mixed)
        return two

    def _apart(self, two: Inverse) -> bool:
        (one, other), depths = tips_of(self._library, two), sorted(press.depth for press in two.presses)
        apart = np.hypot(*(one.vector - other.vector)[:2])
        return bool(apart > APART * self._pitch and depths[0] > SLIGHT * depths[1])


def tips_of(library: SheetLibrary, found: Inverse) -> list[Tip]:
    """Where the tips of presses stand. One that comes down where others have inclined the sheet touches it uphill of its lowest point."""
    tips = []
    for k, press in enumerate(found.presses):
        vector, covariance = found.tip(k)
        if len(found.presses) > 1:
            alone = [read_press(library, other, press.place[None]) for other in found.presses]
            others = (sum(alone) - alone[k] + found.mixed * hindrance(alone))[0]
            radius, slope, sunk = library.plan.radius * np.exp(press.log_radius), others[1:, 2], -others[0, 2]
            vector = vector + np.append(-radius * slope, sunk + 0.5 * radius * slope @ slope)
            unsure = np.array([UNSURE_PLACE * radius * np.hypot(*slope)] * 2 + [UNSURE_DEPTH * sunk])
            covariance = covariance + np.diag(unsure**2)
        tips.append(Tip(vector, covariance, press.log_radius))
    return tips
