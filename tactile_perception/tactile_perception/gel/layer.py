# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Displacements inside an elastic layer on a rigid base under loads on its surface: the layer's Green's function."""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..errors import BadArgument

_REACH = 8.0  # thicknesses: farther away a load on a bonded layer moves nothing. Property: the slowest decay is exp(-pi/2 r/h)
_STEP = 0.4  # rad: of the quadrature at the farthest distance; halved, no displacement changes by a thousandth of the largest
_DISTANCES = 400  # of the table; the same
_SHORTEST = 5.0  # standard deviations of a load's spectrum that are summed: exp(-12.5) of it is left out


@dataclass(frozen=True)
class Layer:
    """A linear elastic layer, bonded to a rigid plane below, free above.

    thickness: m; poisson: its ratio, 0 to 0.5; depth: m, of the dots under the surface, less than thickness. The shear modulus is 1: loads
    are in units of it. Raises BadArgument for values that are no layer.
    """

    thickness: float
    poisson: float
    depth: float

    def __post_init__(self):
        if not (0 < self.thickness < np.inf and 0 <= self.poisson <= 0.5 and 0 <= self.depth < self.thickness):
            raise BadArgument(f'gel: a layer needs thickness > 0, a Poisson ratio from 0 to 0.5 and dots above its base, got '
                              f'gel.thickness {self.thickness:g} m, gel.poisson_ratio {self.poisson:g}, gel.dot_depth {self.depth:g} m')

    def waves(self, k: np.ndarray) -> dict[str, np.ndarray]:
        """Displacements at the dots' depth under loads exp(i k x) on the surface, k (K,) 1/m > 0; keys: load then displacement.

        'along', 'up' under a shear load i exp(i k x) along k (displacements i along, up); 'pressed_along', 'pressed_up' under a pressure;
        'across' under a shear load across k. Plane strain waves of gradients and of Papkovich's and Neuber's potentials, four of them, by
        the four conditions at base and surface; the same layer as in del Alamo et al. 2007 and Merkel et al. 2007.
        """
        h, at = self.thickness, self.thickness - self.depth
        base, top = self._waves_at(k, 0.0), self._waves_at(k, h)
        conditions = np.stack([base[0], base[1], top[2], top[3]], axis=1)
        shear, press = np.zeros((2, len(k), 4, 1))
        shear[:, 2], press[:, 3] = 1.0, -1.0
        weights = np.linalg.solve(np.stack([conditions] * 2), np.stack([shear, press]))[..., 0]
        along, up = self._waves_at(k, at)[:2]
        across = np.exp(k * (at - h)) * (1 - np.exp(-2 * k * at)) / (1 + np.exp(-2 * k * h)) / k
        return {'along': (weights[0] * along).sum(1), 'up': (weights[0] * up).sum(1), 'pressed_along': (weights[1] * along).sum(1),
                'pressed_up': (weights[1] * up).sum(1), 'across': across}

    def _waves_at(self, k: np.ndarray, z: float) -> tuple[np.ndarray, ...]:
        """(K, 4) each, of four waves at height z over the base: displacement along k (over i) and up, stress along k (over i) and up."""
        nu, found = self.poisson, [[], [], [], []]
        for s in (1.0, -1.0):
            e = np.exp(s * k * z - (k * self.thickness if s > 0 else 0.0))
            gradient = e, s * e, 2 * s * k * e, 2 * k * e
            potential = (k * z * e, (s * k * z - (3 - 4 * nu)) * e, k * (2 * s * k * z - 2 + 4 * nu) * e,
                         2 * k * (k * z - 2 * s * (1 - nu)) * e)
            for part, one, other in zip(found, gradient, potential):
                part += [one, other]
        return tuple(np.stack(part, axis=1) for part in found)


@dataclass(frozen=True)
class Loads:
    """Displacements around a round load of unit force with a Gaussian profile; width: its standard deviation, m."""

    layer: Layer
    width: float

    @cached_property
    def _table(self) -> tuple[np.ndarray, np.ndarray]:
        """Distances (D,) m and, in rows, five functions of it (5, D): Hankel transforms of Layer.waves."""
        from scipy.special import j0, j1  # needed here alone
        reach = _REACH * self.layer.thickness
        top = _SHORTEST / self.width
        step = _STEP / reach
        k = np.arange(step / 2, top, step)
        r = np.linspace(0.0, reach, _DISTANCES)
        wave = self.layer.waves(k)
        share = np.exp(-(k * self.width)**2 / 2) * k * step / (2 * np.pi)
        angle = np.outer(r, k)
        bessel = [j0(angle), j1(angle)]
        bessel.append(2 * bessel[1] / np.maximum(angle, 1e-9) - bessel[0] * (angle > 0))
        mean, half = (wave['along'] + wave['across']) / 2, (wave['across'] - wave['along']) / 2
        rows = [bessel[0] @ (share * mean), bessel[2] @ (share * half), bessel[1] @ (share * wave['up']),
                -bessel[1] @ (share * wave['pressed_along']), bessel[0] @ (share * wave['pressed_up'])]
        return r, np.array(rows)

    def matrix(self, dots: np.ndarray, places: np.ndarray) -> np.ndarray:
        """(D, 3, P, 3): displacement x, y, z at each of the dots (D, 2) m under unit loads along x, along y, and pressing, at places
        (P, 2) m."""
        off = dots[:, None] - places
        distance = np.hypot(*np.moveaxis(off, -1, 0))
        away = off / np.maximum(distance, 1e-12)[..., None]
        at, rows = self._table
        mean, half, up, pressed, down = (np.interp(distance, at, row, right=0.0) for row in rows)
        found = np.empty((len(dots), 3, len(places), 3))
        found[:, :2, :, :2] = np.einsum('dpi,dpj,dp->dipj', away, away, 2 * half) + np.einsum('ij,dp->dipj', np.eye(2), mean - half)
        found[:, 2, :, :2] = away * up[..., None]
        found[:, :2, :, 2] = np.moveaxis(away * pressed[..., None], -1, 1)
        found[:, 2, :, 2] = down
        return found
