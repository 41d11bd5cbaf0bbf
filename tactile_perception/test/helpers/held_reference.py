# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the kernel of held light (src/psd/held_light.cpp) does, in NumPy: slow and obvious."""
from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tactile_perception.psd.geometry import CROSS, MIX, TOTAL, position

_TOTALS = 4 * TOTAL + TOTAL  # flat index of the total's variance in a covariance of sums
_BIN_S = 0.01  # s, over which light is averaged. Derived: a period of lamps on 50 Hz mains
_RESTS = 5  # bins that agree while an object rests. Chosen
_AGREE = 4.0  # standard deviations by which such bins may differ. Chosen: as much as five of them do by noise
_FORGOTTEN_S = 0.2  # s without rest, after which the last rest says nothing. Chosen: lamps are switched faster
_CERTAIN = 6.0  # standard deviations of light that is judged. Chosen
_AROUND = 0.2  # half widths between centroids of the room's light and of the offset, which holds the dark voltages too. Chosen
_APART, _APART_SIGMA = 0.05, 4.0  # half widths, and standard deviations, between the centroids of a lamp and of the contact. Chosen
_MOST_ROOM, _MOST_CONTACT = 3.0, 0.5  # parts of the room's light, and of the contact's; brighter changes are a second object. Chosen
_GROWN = 0.015  # part of an object's light that it grows by as the cover creeps, from rest to rest. Chosen
_LEFT = 0.7  # part of an object's light that is left at most after it is gone. Chosen
# Part of the room's light that an object shades, and its standard deviation, before it is measured. Chosen: it hides a tenth at most.
_SHADE_EXPECTED, _SHADE = 0.05, 0.05
_SHADE_LEAST = 0.01  # smallest standard deviation, of all of the room's light: objects differ. Chosen
_SHADE_MOST = 0.3  # largest part. Chosen
_ALIKE = 0.05  # part of a lamp's light by which it may change until the object goes. Chosen
_TWO = 4.0  # standard deviations of the cross term, beyond which it is that of two contacts. Chosen
_ONSET_S = 0.03  # s of a contact in which it grows. Chosen
_MODEL_S = 0.2  # s of a contact from which the shade is measured; the error of the expected cross term is the same for it. Chosen


class Change(NamedTuple):
    """shift: (4,) V, to be added to the offset, or None; net: (4,) V, to be added to the sums of the present samples."""

    shift: np.ndarray | None
    net: np.ndarray


class HeldLight:
    """Follows ambient light through a contact. cross: expected cross term over the total at places (N, 2), None where it is not calibrated;
    cross_volts: V, its standard deviation."""

    def __init__(self, cross: Callable[[np.ndarray], np.ndarray] | None, cross_volts: float):
        self._cross, self._cross_volts = cross, cross_volts
        self.shade, self._gained = 0.0, 0.0
        self.begin(np.zeros(4), np.zeros(4))

    def begin(self, offset: np.ndarray, calibrated: np.ndarray) -> None:
        """A contact begins; offset: (4,) V, of the untouched outputs before it; calibrated: (4,) V, at the calibration."""
        self._room, self._expected, self._since_s = offset @ MIX, _SHADE_EXPECTED * (offset - calibrated) @ MIX, 0.0
        self._shaded = self._expected + self.shade * self._room
        self._doubtful = np.zeros(4)
        self.interrupt()

    def interrupt(self) -> None:
        """Samples are missing: what came before them is no longer compared with what follows."""
        self._rest: np.ndarray | None = None
        self._bins: deque[list[float]] = deque(maxlen=_RESTS)
        self._sum, self._count, self._restless_s = [0.0] * 4, 0, 0.0

    def follow(self, mean: np.ndarray, count: int, noise: np.ndarray, period_s: float) -> Change:
        """The change of ambient light in samples of one contact; mean: (4,) V, of the sums of count samples; noise: (4, 4) V^2, covariance
        of one sample's sums."""
        self._sum, self._count = [a + b * count for a, b in zip(self._sum, mean.tolist())], self._count + count
        shift = None
        if self._count * period_s >= _BIN_S * (1 - 1e-9):
            shift = self._end_bin(noise, self._count * period_s)
        if shift is not None:
            return Change(MIX @ shift / 4, self._shaded - shift)
        rest, sigma = self._rest, math.sqrt(noise.item(_TOTALS) / count)
        if rest is not None and abs(mean.item(TOTAL) - rest.item(TOTAL)) > _CERTAIN * sigma and self._is_room(mean - rest, rest, sigma):
            return Change(None, self._shaded + rest - mean)
        return Change(None, self._shaded)

    def _end_bin(self, noise: np.ndarray, seconds: float) -> np.ndarray | None:
        """See follow; the change (4,) of the sums that is ambient light, or None."""
        count, light = self._count, [part / self._count for part in self._sum]
        self._sum, self._count = [0.0] * 4, 0
        self._bins.append(light)
        self._since_s += seconds
        if self._cross is not None and _ONSET_S < self._since_s <= _ONSET_S + _MODEL_S:
            self._measure_shade(np.array(light), count, noise, seconds)
        sigma = math.sqrt(noise.item(_TOTALS) / count)
        if len(self._bins) < _RESTS or max(max(part) - min(part) for part in zip(*self._bins)) > _AGREE * sigma:
            self._restless_s += seconds
            if self._restless_s > _FORGOTTEN_S:
                self._rest = None
            return None
        return self._judge(np.mean(self._bins, axis=0), sigma / math.sqrt(_RESTS))

    def _judge(self, light: np.ndarray, sigma: float) -> np.ndarray | None:
        """As _end_bin, for the light (4,) of an object that rests."""
        before, self._restless_s = self._rest, 0.0
        if before is not None and abs(light[TOTAL] - before[TOTAL]) > _CERTAIN * sigma:
            if self._is_room(light - before, before, sigma):
                self._bins.clear()
                return light - before
            if light[TOTAL] < _LEFT * before[TOTAL] and (self._is_room(light, before, sigma) or self._is_doubtful(light, before, sigma)):
                self.interrupt()
                return light
            self._doubtful = self._doubtful + light - before
        self._rest = light
        return None

    def _is_room(self, change: np.ndarray, contact: np.ndarray, sigma: float) -> bool:
        """Whether a change (4,) of the sums is the room's light, not that of the contact with sums (4,)."""
        total = change[TOTAL]
        each = MIX @ change / (4 * math.copysign(1.0, total))
        most = max(_MOST_ROOM * self._room[TOTAL], _MOST_CONTACT * contact[TOTAL])
        if self._room[TOTAL] < _CERTAIN * sigma or each.min() < -sigma or abs(total) > most:
            return False
        where = change[:2] / total
        from_room = math.dist(where, self._room[:2] / self._room[TOTAL])
        from_contact = math.dist(where, contact[:2] / contact[TOTAL])
        return from_room < min(_AROUND, from_contact) and from_contact > _APART + _APART_SIGMA * sigma / abs(total)

    def _is_doubtful(self, light: np.ndarray, rest: np.ndarray, sigma: float) -> bool:
        """Whether light (4,) is what has come suddenly while the object rested, with the light rest (4,) in the end."""
        total, most = self._doubtful[TOTAL], _ALIKE * self._doubtful[TOTAL] + _GROWN * rest[TOTAL] + _AGREE * sigma
        return total > _CERTAIN * sigma and np.abs(light - self._doubtful).max() < most

    def _measure_shade(self, light: np.ndarray, count: int, noise: np.ndarray, seconds: float) -> None:
        """Update the shaded part by the cross term of light (4,), the mean sums of count samples: least squares with a known variance."""
        step = max(_SHADE_LEAST, 1e-3)
        beyond = abs(self._expected[TOTAL]) / _SHADE_EXPECTED / max(abs(self._room[TOTAL]), 1e-9)
        known = max(_SHADE * min(beyond, 1.0), _SHADE_LEAST) ** -2
        tried = light + self._expected + np.array([self.shade, self.shade + step])[:, None] * self._room
        if not (light[TOTAL] > 0 and (tried[:, TOTAL] > 0).all()):
            return
        missing = tried[:, CROSS] - self._cross(np.clip(position(tried), -1, 1)) * tried[:, TOTAL]
        slope = (missing[1] - missing[0]) / step
        each = noise[CROSS, CROSS] / count
        if missing[0] ** 2 > _TWO**2 * (each + self._cross_volts**2 + slope * slope / (known + self._gained)):
            return
        variance = each + self._cross_volts**2 * _MODEL_S / seconds
        information = min(known + self._gained + slope * slope / variance, max(known + self._gained, 1 / _SHADE_LEAST**2))
        self._gained = information - known
        least = min(-self._expected[TOTAL] / max(self._room[TOTAL], self._expected[TOTAL]), 0.0)  # no object adds light
        self.shade = min(max(self.shade - slope * missing[0] / variance / information, least), _SHADE_MOST)
        self._shaded = self._expected + self.shade * self._room
