# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Parametric deflection (bell) of a clamped sheet under a round tip and the apparent displacement of its markers; no material model.

The bell is a power of the clamped rectangle's Green function, rounded at the tip (strip solution with image sources; exactly zero at the
clamp). Stretching also displaces the markers in the plane: to second order in the slopes this follows from the bell alone (plane elasticity
of an incompressible sheet, Foeppl and von Karman), up to factors that calibration fits.
"""
from __future__ import annotations

import numpy as np

POISSON = 0.5                # of an incompressible sheet
MODES, SPANS = (9, 7), (18, 14)  # sine modes of the in-plane displacement along x and y, and points for slopes. Chosen
SOFTENING = (1.0, 6.0)       # per slope squared: saturation of the in-plane displacement at steep slopes. Chosen
ROUNDING = 1.0               # transition from the rounded tip to the Green function: 0 abrupt, 2 slow. Chosen
PLACE, DEPTH, ROUND, POWER = slice(0, 2), 2, 3, 4  # of the parameters (x, y, log depth, log tip width, log power, carried x, y)
CARRIED = slice(5, 7)        # m, lateral displacement of the sheet at the tip by a drag; zero where there are only five parameters
_IMAGE, _SIGN = (part.reshape(-1, 1) for part in np.meshgrid([-1.0, 0.0, 1.0], [1.0, -1.0]))  # image sources beyond the clamps
_OWN = 1                     # the source itself among its images
_FLOOR = 1e-6                # of the bell's height, least Green function for its power


class SheetBell:
    """size: (2,) m of the sheet; rest: (K, 2) m, eye: (K, 3) m as in MarkerField; radius: m, of a marker, over whose disc its position is
    averaged; draw: (3,) factors of the in-plane displacement: two saturations, and friction at the tip.
    """

    def __init__(self, size: np.ndarray, rest: np.ndarray, eye: np.ndarray, radius: float, draw: np.ndarray = (0.3, 0.3, 0.3)):
        self.size, self.draw, self.radius = np.asarray(size, float), np.asarray(draw, float), radius
        self.out, self.height = rest - eye[:, :2], -eye[:, 2]
        self.count = len(rest)
        edges = [(np.arange(n) + 0.5) / n * side - side / 2 for n, side in zip(SPANS, self.size)]
        points = np.stack(np.meshgrid(*edges), axis=-1).reshape(-1, 2)
        self._loads = _in_plane(points, self.size)
        self._modes = np.nan_to_num(_modes(rest, self.size))
        self._places = _Places(np.vstack([rest, points]), self.size)

    def bell(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Depths (n, K) m of the markers, slopes (n, P, 2) at the inner points, and the Green function (n, K) over its top."""
        count, depth, power = self.count, np.exp(parameters[:, DEPTH, None]), np.exp(parameters[:, POWER, None])
        width = np.exp(parameters[:, ROUND])
        green, slope = self._places.green(parameters[:, PLACE], np.sqrt(width**2 + self.radius**2 / 2), count)
        top = np.diag(_Places(parameters[:, PLACE], self.size).green(parameters[:, PLACE], width, len(parameters))[0])[:, None]
        green = np.maximum(green / top, _FLOOR)
        deep = depth * green**power
        steep = (power * deep / green / top)[:, count:, None] * slope
        return np.minimum(deep[:, :count], 0.9 * self.height), steep, green[:, :count]

    def _sideways(self, parameters, slope, green):
        """In-plane displacement (n, K, 2, 3) m for factors of one."""
        squares = np.stack([slope[..., 0]**2, slope[..., 0] * slope[..., 1], slope[..., 1]**2], axis=1)
        steep = squares[:, 0] + squares[:, 2]
        at_tip = _modes(parameters[:, PLACE], self.size)
        drawn = []
        for soft in SOFTENING:
            weight = ((squares / (1 + soft * steep)[:, None]).reshape(len(parameters), -1) @ self._loads.T).reshape(len(parameters), 2, -1)
            drawn.append((weight @ self._modes.T).swapaxes(1, 2))
        held = np.sum(weight * at_tip[:, None], axis=2)
        return np.stack([*drawn, -held[:, None] * green[..., None]], axis=-1)

    def appear(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Apparent displacement (n, K, 2) m due to depth, and due to in-plane displacement for factors of one (n, K, 2, 3)."""
        deep, slope, green = self.bell(parameters)
        zoom = self.height / (self.height - deep)
        return self.out * (zoom - 1)[..., None], self._sideways(parameters, slope, green) * zoom[..., None, None]

    def predict(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Apparent displacement (n, 2 K) m and depths (n, K) m; parameters: (n, 5), or (n, 7) with a drag."""
        deep, slope, green = self.bell(parameters)
        zoom = self.height / (self.height - deep)
        drawn = self._sideways(parameters, slope, green) @ self.draw
        if parameters.shape[1] > CARRIED.start:
            drawn += green[..., None] * parameters[:, None, CARRIED]
        return (self.out * (zoom - 1)[..., None] + drawn * zoom[..., None]).reshape(len(parameters), -1), deep


class _Places:
    """Evaluates the Green function at fixed places; keeps the terms that do not depend on the source."""

    def __init__(self, places: np.ndarray, size: np.ndarray):
        self.k, self.size = np.pi / size[1], size
        x, y = ((places + size / 2) * self.k).T
        self.cosh, self.sinh, self.cos, self.sin = np.cosh(x), np.sinh(x), np.cos(y), np.sin(y)

    def green(self, source: np.ndarray, width: np.ndarray, first_slope: int) -> tuple[np.ndarray, np.ndarray]:
        """Values (n, N) for sources (n, 2) m rounded over width (n,) m, and gradients (n, N - first_slope, 2) from place first_slope on."""
        x, y = ((source + self.size / 2) * self.k).T[..., None, None]
        round_off, late = ((self.k * width)**2 / 2)[:, None], slice(first_slope, None)
        at = _SIGN * x + 2 * self.k * self.size[0] * _IMAGE
        level = self.cosh * np.cosh(at) - self.sinh * np.sinh(at)
        rise = self.sinh[late] * np.cosh(at) - self.cosh[late] * np.sinh(at)
        same, other = self.cos * np.cos(y), self.sin * np.sin(y)
        cross, turn = self.sin[late] * np.cos(y), self.cos[late] * np.sin(y)
        top, low = level - same + _SIGN * other, level - same - _SIGN * other
        share = 1 / low[..., late]
        sharp, gentle = low[:, _OWN, late], (low[:, _OWN] + ROUNDING * round_off) * low[:, _OWN] + round_off**2
        share[:, _OWN] = (sharp + ROUNDING / 2 * round_off) / gentle[:, late]
        low[:, _OWN] = np.sqrt(gentle)
        value = np.log(np.maximum(np.prod(top / low, axis=1), 1 + 1e-9))
        over = 1 / top[..., late]
        slope_x = np.sum(rise * (over - share), axis=1)
        slope_y = np.sum((cross + _SIGN * turn) * over - (cross - _SIGN * turn) * share, axis=1)
        return value, self.k * np.stack([slope_x, slope_y], axis=-1)


def _phases(places: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return tuple(np.pi * np.arange(1, count + 1) * (places[:, side, None] / size[side] + 0.5) for side, count in enumerate(MODES))


def _modes(places: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Sine modes of the clamped rectangle (N, n) at places (N, 2)."""
    x, y = _phases(places, size)
    return (np.sin(y)[:, :, None] * np.sin(x)[:, None, :]).reshape(len(places), -1)


def _mode_slopes(places: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Their slopes along x and along y, each (N, n)."""
    x, y = _phases(places, size)
    wave_x, wave_y = (np.pi * np.arange(1, count + 1) / side for count, side in zip(MODES, size))
    along, across = np.sin(y)[:, :, None] * (wave_x * np.cos(x))[:, None, :], (wave_y * np.cos(y))[:, :, None] * np.sin(x)[:, None, :]
    return along.reshape(len(places), -1), across.reshape(len(places), -1)


def _in_plane(points: np.ndarray, size: np.ndarray) -> np.ndarray:
    """(2 n, 3 P): coefficients of the in-plane modes from the slopes' products (xx, xy, yy) at P points."""
    along, across = _mode_slopes(points, size)
    none = np.zeros_like(along)
    xx, yy, xy = np.hstack([along, none]), np.hstack([none, across]), np.hstack([across, along]) / 2
    stiff = xx.T @ xx + yy.T @ yy + POISSON * (xx.T @ yy + yy.T @ xx) + 2 * (1 - POISSON) * xy.T @ xy
    loads = -np.hstack([(xx + POISSON * yy).T, 2 * (1 - POISSON) * xy.T, (yy + POISSON * xx).T]) / 2
    return np.linalg.solve(stiff, loads)
