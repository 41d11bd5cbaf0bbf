# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Displacements inside an elastic layer on a rigid base under loads on its surface: the layer's Green's function."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.errors import BadArgument
from .constants import LAYER


@dataclass(frozen=True)
class Layer:
    """A linear elastic layer, bonded to a rigid plane below, with a free surface above. Loads are in units of its shear modulus.

    Parameters
    ----------
    thickness : float
        Thickness in m.
    poisson : float
        Poisson's ratio, 0 to 0.5.
    depth : float
        Depth of the dots under the surface in m, less than the thickness.

    Raises
    ------
    BadArgument
        For values outside these ranges.
    """

    thickness: float
    poisson: float
    depth: float

    def __post_init__(self):
        if not (0 < self.thickness < np.inf and 0 <= self.poisson <= 0.5 and 0 <= self.depth < self.thickness):
            raise BadArgument(f'gel: a layer needs thickness > 0, a Poisson ratio from 0 to 0.5 and dots above its base, got '
                              f'gel.thickness {self.thickness:g} m, gel.poisson_ratio {self.poisson:g}, gel.dot_depth {self.depth:g} m')

    def waves(self, k: np.ndarray) -> dict[str, np.ndarray]:
        """Displacements at the depth of the dots under sinusoidal loads on the surface.

        Parameters
        ----------
        k : ndarray, shape (K,)
            Wave numbers in 1/m, above 0.

        Returns
        -------
        dict of str to ndarray, shape (K,)
            'along' and 'up' (over i) under a shear load exp(i k x) along k; 'pressed_along' (over i) and 'pressed_up' under a pressure;
            'across' under a shear load across k.

        Notes
        -----
        Four plane strain waves, of gradients and of the potentials of Papkovich and Neuber, fulfil the four conditions at base and surface
        [1]_ [2]_.

        .. [1] J. C. del Alamo et al., PNAS 104, 13343, 2007.
        .. [2] R. Merkel et al., Biophysical Journal 93, 3314, 2007.
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
        """(K, 4) each, of four waves at height z above the base: displacement along k (over i) and up, stress along k (over i) and up."""
        nu, found = self.poisson, [[], [], [], []]
        for s in (1.0, -1.0):
            e = np.exp(s * k * z - (k * self.thickness if s > 0 else 0.0))
            gradient = e, s * e, 2 * s * k * e, 2 * k * e
            potential = (k * z * e, (s * k * z - (3 - 4 * nu)) * e, k * (2 * s * k * z - 2 + 4 * nu) * e,
                         2 * k * (k * z - 2 * s * (1 - nu)) * e)
            for part, one, other in zip(found, gradient, potential):
                part += [one, other]
        return tuple(np.stack(part, axis=1) for part in found)


def _wave_numbers(smallest: float, reach: float) -> np.ndarray:
    """(K,) 1/m, at equal steps, of a quadrature for discs from a radius in m, and distances up to reach in m."""
    step = LAYER.phase_step / reach
    return np.arange(step / 2, LAYER.max_phase / smallest, step)


def _weights(k: np.ndarray, radius: float) -> np.ndarray:
    """(K,) 1/m^2: weights of wave numbers at equal steps in the quadrature over the plane, for a disc of a radius in m."""
    return np.exp(-(k * radius / LAYER.max_phase)**2 * 4) * k * (k[1] - k[0]) / (2 * np.pi)


def _ball(x: np.ndarray) -> np.ndarray:
    """Spectrum of the pressure of a ball at wave number times radius x, for a unit force."""
    return 3 * (np.sin(x) - x * np.cos(x)) / x**3


def depressions(layer: Layer, radii: np.ndarray) -> np.ndarray:
    """Depression of the surface at the centres of discs under a ball's pressure.

    Parameters
    ----------
    layer : Layer
        The layer.
    radii : ndarray, shape (N,)
        Radii of the discs in m.

    Returns
    -------
    ndarray, shape (N,)
        m, for a pressing force of 1 m^2 times the shear modulus.
    """
    k = _wave_numbers(float(np.min(radii)), max(LAYER.max_distance * layer.thickness, 2 * float(np.max(radii))))
    up = Layer(layer.thickness, layer.poisson, 0.0).waves(k)['pressed_up']
    return np.array([-(_ball(k * radius) * _weights(k, radius)) @ up for radius in radii])


class DiscLoads:
    """Displacements of the dots, and depression of the surface, under loads on discs of the layer's surface.

    A disc bears the pressure of a ball (Hertz: a semi-ellipse that falls to zero at the rim) and a uniform shear stress.

    Parameters
    ----------
    layer : Layer
        The elastic layer.
    smallest, largest : float
        Range of the discs' radii in m.
    """

    def __init__(self, layer: Layer, smallest: float, largest: float):
        from scipy.special import j0, j1  # 0.1 s that only gels need
        self.layer = layer
        self.radii = np.geomspace(smallest, largest, int(np.ceil(np.log(largest / smallest) / np.log(LAYER.radius_ratio))) + 1)
        reach = max(LAYER.max_distance * layer.thickness, 2 * largest)
        self._distances = reach * np.linspace(0.0, 1.0, LAYER.table_distances)**1.5
        k = _wave_numbers(smallest, reach)
        wave, surface = layer.waves(k), Layer(layer.thickness, layer.poisson, 0.0).waves(k)
        mean, half = (wave['along'] + wave['across']) / 2, (wave['across'] - wave['along']) / 2
        self._tables, self._depressions = np.zeros((len(self.radii), 5, LAYER.table_distances)), np.zeros(len(self.radii))
        self._drags = np.zeros(len(self.radii))
        angle = np.outer(self._distances, k)
        bessel = [j0(angle), j1(angle)]
        bessel.append(2 * bessel[1] / np.maximum(angle, 1e-9) - bessel[0] * (angle > 0))
        for n, radius in enumerate(self.radii):
            x = k * radius
            weight = _weights(k, radius)
            press, shear = _ball(x) * weight, 2 * j1(x) / x * weight
            self._tables[n] = [bessel[0] @ (shear * mean), bessel[2] @ (shear * half), bessel[1] @ (shear * wave['up']),
                               -bessel[1] @ (press * wave['pressed_along']), bessel[0] @ (press * wave['pressed_up'])]
            self._depressions[n] = -(press @ surface['pressed_up'])
            self._drags[n] = (shear * 2 * j1(x) / x) @ (surface['along'] + surface['across']) / 2

    def depression(self, radius: float) -> float:
        """Depression in m of the surface at the centre of a disc under a unit pressing force."""
        return float(np.interp(radius, self.radii, self._depressions))

    def drag(self, radius: float) -> float:
        """Mean displacement in m of the surface of a disc along a unit shear force."""
        return float(np.interp(radius, self.radii, self._drags))

    def matrix(self, dots: np.ndarray, centre: np.ndarray, radius: float, camera: np.ndarray) -> np.ndarray:
        """Apparent displacements of dots under unit loads on a disc.

        Parameters
        ----------
        dots : ndarray, shape (..., D, 2)
            Positions of the dots in m.
        centre : ndarray, shape (..., 2)
            Centre of the disc in m.
        radius : float
            Radius of the disc in m.
        camera : ndarray, shape (3,)
            Position of the camera above the dots in m. A dot at x that moves by w towards the camera at (c, d) seems to move by
            (x - c) w / d in the plane of the surface.

        Returns
        -------
        ndarray, shape (..., D, 2, 3)
            Displacement along x and y in m, under a shear along x, a shear along y, and a press.
        """
        offset = dots - centre[..., None, :]
        away = np.hypot(offset[..., 0], offset[..., 1])
        unit = offset / np.maximum(away, 1e-12)[..., None]
        at = np.clip(np.interp(np.log(radius), np.log(self.radii), np.arange(len(self.radii))), 0, len(self.radii) - 1)
        low = min(int(at), len(self.radii) - 2)
        table = self._tables[low] + (at - low) * (self._tables[low + 1] - self._tables[low])
        mean, half, up, pressed, down = (np.interp(away, self._distances, row, right=0.0) for row in table)
        found = np.empty((*away.shape, 2, 3))
        found[..., :2] = 2 * half[..., None, None] * unit[..., :, None] * unit[..., None, :]
        found[..., 0, 0] += mean - half
        found[..., 1, 1] += mean - half
        found[..., 2] = unit * pressed[..., None]
        rise = np.concatenate([unit * up[..., None], down[..., None]], axis=-1)
        found -= ((dots - camera[:2]) / camera[2])[..., :, None] * rise[..., None, :]
        return found
