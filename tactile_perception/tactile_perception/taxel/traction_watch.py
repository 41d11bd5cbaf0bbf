# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Sudden slip of an object that is smoother than expected, and rolling, from the pressure that traction causes.

While an object sticks, its traction grows with its motion, and so does the pressure before it at the expense of that behind it, over some
two thicknesses of the pad. Once all of it slides, the picture moves on and that difference grows no more. So a picture is told as one
before the motion, shifted, turned, grown, of another load, and with some traction; that it falls while the object moves on, or that of a
flat face falls behind what it would be if it stuck, tells the slip.
The picture of an object that rolls moves on without any traction. Only curved faces roll, and only theirs show an even traction well.
"""
from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .._core import taxel_spread, taxel_traction, taxel_traction_fit
from .array import SoftPad, TaxelArray
from .shear import SPREADS

_REACH = 2.5  # thicknesses around a contact, within which its traction is looked for. Chosen: beyond the wider of SPREADS
_SMALLEST = 4  # rows and columns, from which slopes are told. Chosen
_MEAN = 10  # frames at rest that are averaged for the picture before the motion. Chosen
_FEWEST = 5  # of them, without which nothing is told. Chosen
_STRAIGHT = 0.5  # cosine of the angle to the first direction, within which an object moves on: after a turn back traction falls. Chosen
_FARTHEST = 0.5  # taxels from that picture, from which a new one is taken: slopes hold for parts of a taxel. Chosen
_OFTEN = 0.5  # part of that way, while an object rolls: its contact grows and its load varies on the way. Chosen
# Traction over pressure that is missing where an object slides: at least, and in standard deviations of the noise. Chosen.
_MISSING, _SIGMAS = 0.04, 5.0
_PULLS = 0.05  # traction over pressure, from which an object does not roll. Chosen: rollers show 0.04
_WENT = 0.03  # thicknesses, up to which a motion was none but noise. Chosen
# Variance of the places of pressure along the motion over that of the touched area, up to which a face is curved. Derived: 2/3 for a
# sphere, 3/5 for a cylinder, 1 for a flat face; blurred by the pad 0.67 to 0.75 and 0.91 to 1.0 (measured by simulation).
_CURVED = 0.85
_SEEN = 0.1  # traction over pressure that must be seen at least, to tell rolling. Chosen: a sixth of the usual friction
_ROLLED = 0.15  # taxels of motion without traction, from which a curved object rolls. Chosen: traction is seen at a third of that
_LAGS = 0.8  # of a layer's loop over the load, traction over pressure up to which what is seen of a flat face may be its lag. Chosen
_GOES_ON = 0.7  # part of its growth with which the traction of an object that sticks goes on at least. Chosen: its rim slips first


def is_curved(pressure: np.ndarray, touched: np.ndarray, direction: np.ndarray) -> bool:
    """Whether the face is curved along a direction (2,), from pressure (rows, columns) where touched (rows, columns) bool."""
    return taxel_spread(pressure, touched, direction) < _CURVED


def _dot(one: tuple, other: tuple) -> float:
    return one[0] * other[0] + one[1] * other[1]


@dataclass(frozen=True)
class TractionState:
    """slides: whether the traction of a moving object has ceased to grow; rolls: whether it moves without traction; sticks: whether it has
    grown on after all since slides was told."""

    slides: bool
    rolls: bool
    sticks: bool = False


class TractionWatch:
    """Watches the traction of a moving contact."""

    def __init__(self, array: TaxelArray, pad: SoftPad):
        self._thickness = pad.thickness / array.pitch
        self._rule = {'reach': min(math.ceil(_REACH * self._thickness), max(array.shape)), 'thickness': self._thickness,
                      'spreads': np.array(SPREADS) * [1, self._thickness]}
        self.reset()

    def reset(self) -> None:
        """Forget; the next picture is the one before a motion, of which no traction is known."""
        self._forget()
        self._pulls = self._rolls = self._loose = False

    def _forget(self) -> None:
        self._before: np.ndarray | None = None
        self._frames = 0
        self._share: np.ndarray | None = None
        self._went = 0.0
        self._rested = True  # whether that picture is of an object at rest, not of the motion itself

    def rest(self, pressure: np.ndarray, same_load: bool) -> None:
        """Take pressure (rows, columns) as of an object that does not move; same_load: since the last frame."""
        if self._before is None or not same_load or self._went > _WENT:
            self._forget()
            self._before = pressure.copy()
        self._share, self._rested = None, True
        self._frames = min(self._frames + 1, _MEAN)
        self._before += (pressure - self._before) / np.float32(self._frames)

    def release(self) -> None:
        """The object of the last picture at rest has hardly any traction: that of the next motion is told anew."""
        self._pulls, self._loose = False, True

    def follow(self, pressure: np.ndarray, touched: np.ndarray, sigma: float, direction: np.ndarray, clipped: bool = False,
               lead: float = 1.0, loop: float = 0.0) -> TractionState:
        """What the traction of an object does that moves in a direction (2,).

        pressure: (rows, columns); touched: (rows, columns) bool; sigma: noise of a taxel's pressure; clipped: whether taxels are
        saturated, so that what is curved looks flat; lead: speed of the picture over that of an object that sticks; loop: width of the
        layer's loop over the mean load.
        """
        if min(pressure.shape) < _SMALLEST:
            return TractionState(False, False)
        if self._before is None:
            self.rest(pressure, True)
        if self._share is None:
            self._begin(touched)
        found = taxel_traction(self._share, pressure, self._before, top=self._top, left=self._left)
        size = math.hypot(*direction)
        if size == 0 or not all(map(math.isfinite, found)):
            return TractionState(False, self._rolls)
        shift, traction, along = found[:2], found[2:], (direction[0] / size, direction[1] / size)
        went = math.hypot(*shift)
        if self._along is None and went > _WENT * self._thickness:
            self._along = along
        self._straight = self._straight and (self._along is None or _dot(along, self._along) > _STRAIGHT)
        now, way = self._carried[0] + _dot(traction, along), self._carried[1] + _dot(shift, along) / self._thickness
        if now > self._most:
            self._most, self._from = now, way
        self._went = max(self._went, way)
        noise = _SIGMAS * self._noise * sigma
        least = max(_MISSING, noise)
        slides = self._slides(now, way, least, lead, lambda: not (
            clipped or self._most < _LAGS * loop or is_curved(pressure, touched, np.array(along))))
        if slides:
            self._told, self._sticks = min(self._told, self._most), False
        elif now > self._told + least:
            self._told, self._sticks = math.inf, True
        towards = (shift[0] / went, shift[1] / went) if went > 0 else along
        rolls = self._roll(_dot(traction, towards), max(_PULLS, noise), went,
                           lambda: is_curved(pressure, touched, np.array(towards)), clipped)
        if went > (_OFTEN if self._rolls else 1.0) * _FARTHEST:
            self._loose = False
            self._forget()
            self.rest(pressure, True)
            self._rested, self._carried = False, (now, way)
        return TractionState(slides, rolls, self._sticks)

    def _roll(self, traction: float, least: float, shift: float, curved: Callable[[], bool], clipped: bool) -> bool:
        """Whether the object rolls, or is still to show by its traction that it does not; shift: taxels; curved: tells whether the face
        looks so; clipped: see follow."""
        if traction > (2 if self._rolls else 1) * least:  # growth and load disturb what is seen of one that rolls on
            self._pulls, self._rolls = True, False
        if self._rolls and shift > _ROLLED and not (clipped or curved()):
            self._rolls = False
        if self._pulls or self._rolls or not (self._loose and least <= _SEEN and curved()):
            return self._rolls
        self._rolls = shift > _ROLLED
        return True

    def _slides(self, now: float, way: float, least: float, lead: float, flat: Callable[[], bool]) -> bool:
        """Whether traction over pressure, now, has fallen by least on the way, thicknesses, or that of a flat face has fallen behind
        that of one that sticks, in two frames; lead: see follow."""
        missing, before = self._most - now, self._behind
        stuck = 2 * (1 - 1 / lead)  # growth of an even traction on the way of the picture, by BORDER_LEAD
        grown = _GOES_ON * min(stuck, self._most / max(self._from, 1e-9)) * (way - self._from)
        self._behind = missing + grown > least
        return self._straight and way > self._from and self._most > least and (missing > least or before and self._behind and flat())

    def _begin(self, touched: np.ndarray) -> None:
        """Least squares by the picture before the motion: its slopes, turn, growth, load, and the pressure of an even traction."""
        self._share, self._top, self._left, square = taxel_traction_fit(self._before, touched, **self._rule)
        self._noise = math.sqrt(square * (1 + 1 / self._frames))
        self._went = 0.0
        if self._rested:
            self._along, self._most, self._from, self._carried = None, -math.inf, 0.0, (0.0, 0.0)
            self._behind = False  # whether traction of a flat face fell behind that of one that sticks, in the last frame
            self._told, self._sticks = math.inf, False  # largest traction when slides was told; whether it has grown on since
            self._straight = self._frames >= _FEWEST
