# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tangential deformation of an elastic layer that is bonded below, and of its surface under an object with friction.

A traction wave of wave number k displaces the surface of a layer of thickness h by less than an even traction: across the wave by
1 / (k h coth k h) of it, which is exact, along it by about 1 / (c k h coth c k h). So neighbours move together, and the border of a contact
is held by the rubber around it: there traction is largest, and slip begins.
"""
from __future__ import annotations

import math

import numpy as np
from scipy import fft

# c along the wave. Derived: an elastic layer of Poisson's ratio 0.45 whose surface is free to rise, within 3 % up to k h = 2, 15 % beyond.
_ALONG = 2.1
_MARGIN = 1.5  # thicknesses around a contact, beyond which nothing moves. Chosen: over twice of that a shear wave falls to a hundredth
_ROUNDS = 60  # most for a step. Chosen: continued in the next one
_CONVERGED = 5e-3  # of the largest motion in a step, error of a displacement. Chosen
_LEAST = 1e-8  # m, such an error at least. Chosen
_TINY = 1e-3  # Pa, against a division by zero


class BondedLayer:
    """pull: N/m^3, stiffness under an even traction; reach: thickness in cells; attribute traction: (rows, columns, 2) Pa on the surface;
    shift: (rows, columns, 2) m of the surface."""

    def __init__(self, shape: tuple[int, int], reach: float, pull: float):
        self._reach, self._pull = reach, pull
        self._softness: dict[tuple[int, int], np.ndarray] = {}
        self.traction, self.shift, self._went = (np.zeros((*shape, 2)) for _ in range(3))

    def move(self, wanted: np.ndarray, limit: np.ndarray) -> None:
        """Move the surface to wanted (rows, columns, 2) m where friction allows: traction stays within limit (rows, columns) Pa, 0 where
        nothing touches. Fast iterative projected gradients (Beck and Teboulle 2009), begun anew where they overshoot, from the traction
        that goes on as in the last step."""
        before, far = self.traction.copy(), np.abs(np.where(limit[..., None] > 0, wanted - self.shift, 0)).max()
        if not far and not before.any():
            return
        self.traction[:], self.shift[:] = 0, 0
        loaded = np.flatnonzero(limit.any(axis=1)), np.flatnonzero(limit.any(axis=0))
        if len(loaded[0]):
            margin = math.ceil(_MARGIN * self._reach)
            box = tuple(slice(max(at[0] - margin, 0), at[-1] + margin + 1) for at in loaded)
            softness = self._of(tuple(16 * math.ceil((at[-1] - at[0] + 1 + 2 * margin) / 16) for at in loaded))
            wanted, start = (np.moveaxis(field[box], -1, 0).astype(np.float32, order='C')
                                   for field in (wanted, before + self._went))
            held = self._settled(start, wanted, limit[box].astype(np.float32), softness, max(_CONVERGED * far, _LEAST) * self._pull)
            self.traction[box] = np.moveaxis(held, 0, -1)
            self.shift[box] = np.moveaxis(self._moved(held, softness), 0, -1)
        self._went = self.traction - before

    def _settled(self, start: np.ndarray, wanted: np.ndarray, limit: np.ndarray, softness: np.ndarray, error: float) -> np.ndarray:
        """Traction (2, rows, columns) Pa, within error, that moves the surface to wanted where limit allows; start: a guess."""
        held = ahead = _within(start, limit)
        pace = 1.0
        for _ in range(_ROUNDS):
            last, held = held, _within(ahead + self._pull * (wanted - self._moved(ahead, softness)), limit)
            if np.abs(held - ahead).max() < error:
                break
            change = held - last
            if np.vdot(ahead - held, change) > 0:
                pace = 1.0
            before, pace = pace, 0.5 + math.sqrt(0.25 + pace * pace)
            ahead = held + (before - 1) / pace * change
        return held

    def _moved(self, traction: np.ndarray, softness: np.ndarray) -> np.ndarray:
        """m (2, rows, columns) of the surface under traction of that shape."""
        rows, columns = traction.shape[1:]
        size = softness.shape[-2], 2 * (softness.shape[-1] - 1)
        wave = fft.rfft2(traction, size)
        wave = np.stack([softness[0] * wave[0] + softness[1] * wave[1], softness[1] * wave[0] + softness[2] * wave[1]])
        return fft.irfft2(wave, size)[:, :rows, :columns]

    def _of(self, size: tuple[int, int]) -> np.ndarray:
        """m/Pa (3, rows, columns) xx, xy, yy of each wave in size cells."""
        if size not in self._softness:
            y, x = np.meshgrid(2 * np.pi * np.fft.fftfreq(size[0]), 2 * np.pi * np.fft.rfftfreq(size[1]), indexing='ij')
            length = np.hypot(x, y)
            across, along = (_softness(factor * length * self._reach) / self._pull for factor in (1.0, _ALONG))
            square = np.where(length > 0, length**2, 1)
            self._softness[size] = np.stack([across + (along - across) * x * x / square, (along - across) * x * y / square,
                                             across + (along - across) * y * y / square]).astype(np.float32)
        return self._softness[size]


def _softness(wave: np.ndarray) -> np.ndarray:
    """tanh(w) / w of wave numbers w times thickness."""
    return np.divide(np.tanh(wave), wave, out=np.ones_like(wave), where=wave > 0)


def _within(traction: np.ndarray, limit: np.ndarray) -> np.ndarray:
    """traction (2, rows, columns) cut to the length limit (rows, columns)."""
    return traction * np.minimum(limit / np.maximum(np.hypot(*traction), _TINY), 1)
