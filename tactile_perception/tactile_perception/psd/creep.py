# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Creep of the cover: a share of what it shows of an object comes late, so that a contact that slides is seen behind the object.

The cover is a standard linear solid (Zener; Ferry, Viscoelastic Properties of Polymers, chapter 3): of a new load it shows all but a share
at once, and that share with one time constant. An object that rests shows it by its light, which goes on rising after the press. One that
slides is seen at (1 - share) of its place and a share of its fading average over the past, which leaves the place behind, and towards the
middle of a bent way.
"""
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

_FEWEST = 6  # presses. Chosen: their scatter is then known to a third
_SHORTEST_S = 0.06  # s, that a press has to last after its rise. Chosen: twice a rubber's usual time constant
_TIMES_S = np.geomspace(0.005, 0.12, 49)  # s, time constants tried. Chosen: shorter ones hardly matter, longer need long presses
_CERTAIN = 5.0  # standard errors of the share, from which it is used. Chosen
# Share of the place that comes late, over that of the light, which grows faster than a patch. Chosen: 0.6 to 1 in simulated covers.
_PLACE = 0.8
_LARGEST = 0.2  # share. Chosen: a cover that creeps more is no sensor
_HELD = 0.97  # of a press's light, above which it is not being released. Chosen


@dataclass(frozen=True)
class Creep:
    """share: of a place that comes late; seconds: its time constant."""

    share: float
    seconds: float


#: of a cover that is not calibrated. Chosen: a soft silicone
TYPICAL = Creep(0.04, 0.03)


class CreepCorrection:
    """Takes the creep off the unit normals of one contact after the other. Before a contact the cover bears nothing; then a load that does
    not change."""

    def __init__(self, creep: Creep):
        self._creep = creep
        self._id, self._at_s = 0, math.nan
        self._place = self._past = (0.0, 0.0, 0.0)  # the last normal; the fading sum of all
        self._weight = 0.0  # of that sum

    def update(self, number: int, normal: Sequence[float], at_s: float) -> Sequence[float]:
        """The normal (3) without the creep, not of unit length, of a contact of that number that shows the unit normal (3) at a time; NaN
        for one that is NaN. The contact's first normal, and the first one after the clock was set back, comes back as it is.

        Between two results the contact moves at constant speed.
        """
        if not math.isfinite(normal[0]):
            return normal
        seconds = at_s - self._at_s
        if number != self._id or not seconds > 0:
            self._place, self._past, self._weight = normal, (0.0, 0.0, 0.0), 0.0
        else:
            share, steps = self._creep.share, seconds / self._creep.seconds
            fade, mean = math.exp(-steps), -math.expm1(-steps) / steps
            self._weight = 1 - (1 - self._weight) * fade
            scale = 1 / (1 - share * mean)
            shown, last = scale * (1 - share + share * self._weight), mean - fade
            known = [fade * past + last * place for past, place in zip(self._past, self._place)]
            self._place = [shown * now - scale * share * past for now, past in zip(normal, known)]
            self._past = [past + (1 - mean) * place for past, place in zip(known, self._place)]
        self._id, self._at_s = number, at_s
        return self._place


def fit_creep(lights: list[tuple[float, np.ndarray]]) -> Creep | None:
    """The creep of presses that rest; None where they do not show it.

    lights: (s between samples, (N,) V light from before the press to its end) of each press.
    """
    held = [found for period, light in lights if (found := _held(period, light)) is not None]
    if len(held) < _FEWEST:
        return None
    fits = [_best_share(held, seconds) for seconds in _TIMES_S]
    best = int(np.argmin([left for _, _, left in fits]))
    share, error, _ = fits[best]
    if not (0 < best < len(fits) - 1 and _CERTAIN * error < share < _LARGEST):
        return None
    return Creep(_PLACE * float(share), float(_TIMES_S[best]))


def _held(period: float, light: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Times (N,), s, since the middle of a press's rise, and its light (N,) over its mean, while it rests; None where that is too short."""
    light = light[np.isfinite(light)]
    if len(light) * period < _SHORTEST_S:
        return None
    level = float(np.median(light[len(light) // 2:]))
    if not level > 0:
        return None
    low, middle, high = (int(np.argmax(light > part * level)) for part in (0.1, 0.5, 0.9))
    begin = middle + max(high - low, 2)
    end = len(light) if light[-1] > _HELD * level else int(np.flatnonzero(light > _HELD * level)[-1]) - (high - low)
    if (end - begin) * period < _SHORTEST_S:
        return None
    return period * (np.arange(begin, end) - middle), light[begin:end] / light[begin:end].mean()


def _best_share(held: list[tuple[np.ndarray, np.ndarray]], seconds: float) -> tuple[float, float, float]:
    """Share of the light that comes late, its standard error by the scatter of the presses, and the sum of squares that is left, with a
    time constant; each press has its own level."""
    shares, weights, left = np.zeros(len(held)), np.zeros(len(held)), 0.0
    for k, (times, light) in enumerate(held):
        late = np.exp(-times / seconds)
        late -= late.mean()
        weights[k] = late @ late
        shares[k] = -(late @ light) / weights[k]
        left += float((light - light.mean()) @ (light - light.mean()))
    share = float(np.average(shares, weights=weights))
    left -= share * float(weights @ shares)
    scatter = np.average((shares - share) ** 2, weights=weights)
    return share, float(np.sqrt(scatter / (len(held) - 1))), left
