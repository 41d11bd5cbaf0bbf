# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Polar mesh on an inflated dome, centred where a tip touches: finite elements along the radius, harmonics around it.

Stereographic projection from the lowest point of the dome's sphere maps the cap to a disc; the disc's automorphism
z -> (z + a) / (1 + a z) moves the centre to the touch and leaves the rim where it is. Both preserve angles. So the mesh is dense at
any touch, and coefficients vary smoothly with its place. The meridian through the touch is the plane y = 0.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...common.geometry import Cap

GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3.0)


@dataclass(frozen=True)
class MeshPlan:
    """even: rings of equal width at the touch; rings: in all; width: of the even ones, of the unit disc; harmonics: highest; around:
    integration points along half a circle. Chosen: under a press of 34 mm on a dome of 120 mm, markers are within 0.03 mm (40 mm off the
    axis) and 0.04 mm (70 mm off) of those of a mesh with rings of half the width and seven harmonics; with 28 rings and four harmonics
    0.05 and 0.12 mm. Far rings count, because the gas makes all of the skin bulge.
    """

    even: int = 12
    rings: int = 36
    width: float = 0.0125
    harmonics: int = 5
    around: int = 12

    @property
    def size(self) -> int:
        """Coefficients of a field: three components of cosines or sines on each ring and in the centre."""
        return (self.rings + 1) * 3 * (self.harmonics + 1)

    @property
    def edges(self) -> np.ndarray:
        """(rings + 1,) radii of the rings in the unit disc, from 0 to 1: even, then growing by a constant factor."""
        left, count = 1 - self.even * self.width, self.rings - self.even
        low, high = 1.0, 3.0
        for _ in range(60):
            factor = (low + high) / 2
            low, high = (factor, high) if self.width * np.sum(factor**np.arange(1, count + 1)) < left else (low, factor)
        widths = np.concatenate([np.full(self.even, self.width), self.width * low**np.arange(1, count + 1)])
        return np.concatenate([[0.0], np.cumsum(widths)]) / widths.sum()


def disc_scale(cap: Cap) -> float:
    """Radius of the stereographic projection of a cap's rim: the tangent of half the rim's angle from the pole."""
    return float(np.tan(np.arctan2(cap.rim_radius, -cap.centre_z) / 2))


def disc_of(points: np.ndarray, cap: Cap) -> np.ndarray:
    """(K,) complex: places in the unit disc of points (K, 3), m, on the cap."""
    return (points[:, 0] + 1j * points[:, 1]) / ((cap.curvature_radius + points[:, 2] - cap.centre_z) * disc_scale(cap))


def shift_of(across: float, tip_radius: float, cap: Cap) -> float:
    """The automorphism's a for a tip of tip_radius, m, whose centre is across, m, from the dome's axis as it first touches."""
    angle = np.arcsin(min(across / (cap.curvature_radius + tip_radius), 0.99))
    return float(np.tan(angle / 2) / disc_scale(cap))


class DomeMesh:
    """The mesh of a touch with the automorphism's shift on a cap.

    At P points in each of n ring elements: rest (n, P, 3), m, and its derivatives along the radius and along the circle, scale (n, P), m:
    length per length in the disc, weight (n, P): area in the disc. Coefficients of a field are (rings + 1, 3, harmonics + 1); even
    fields are mirror symmetric to the meridian plane (x: cosines, y: sines, z: cosines), odd ones antisymmetric.
    """

    def __init__(self, shift: float, cap: Cap, plan: MeshPlan):
        self.shift, self.cap, self.plan = shift, cap, plan
        self.n, self.per_ring = plan.rings, 3 * (plan.harmonics + 1)
        edges, phi = plan.edges, (np.arange(plan.around) + 0.5) * np.pi / plan.around
        low, width = edges[:-1, None], np.diff(edges)[:, None]
        radius = low + width * (1 + GAUSS) / 2
        self._radius, self._phi = radius, phi
        self._share = np.stack([1 - (1 + GAUSS) / 2, (1 + GAUSS) / 2], axis=-1), np.array([-1.0, 1.0]) / width
        weight = width / 2 * radius * np.pi / plan.around
        self.weight = np.repeat(weight[:, :, None], plan.around, axis=2).reshape(self.n, -1)
        z = (radius[:, :, None] * np.exp(1j * phi)).reshape(self.n, -1)
        self._place(z)
        self.of = np.arange(self.n)[:, None] * self.per_ring + np.arange(2 * self.per_ring)

    def _place(self, z: np.ndarray) -> None:
        """Places of the points z of the disc, and their derivatives along the radius and along the circle."""
        scale, along = disc_scale(self.cap), z / np.abs(z)
        moved = self._projected(z)
        slope = scale * (1 - self.shift**2) / (1 + self.shift * z)**2 * along
        square, size = np.abs(moved)**2, self.cap.curvature_radius
        self.rest = self.points(z)
        self.scale = 2 * size * np.abs(slope) / (1 + square)
        self.along, self.across = (self._pushed(moved, way, square) * size for way in (slope, 1j * slope))

    def _projected(self, z: np.ndarray) -> np.ndarray:
        """Stereographic projections of the points z of the disc."""
        return disc_scale(self.cap) * (z + self.shift) / (1 + self.shift * z)

    def points(self, z: np.ndarray) -> np.ndarray:
        """(..., 3) m: the places on the cap of points z (...) of the disc, complex."""
        moved = self._projected(z)
        square = np.abs(moved)**2
        unit = _stacked(2 * moved / (1 + square), 2 / (1 + square) - 1)
        return unit * self.cap.curvature_radius + [0.0, 0.0, self.cap.centre_z]

    @staticmethod
    def _pushed(at: np.ndarray, way: np.ndarray, square: np.ndarray) -> np.ndarray:
        """Derivative of the inverse stereographic projection onto the unit sphere at a place along a way, both complex."""
        grows = 2 * (at * way.conj()).real
        return _stacked(2 * way / (1 + square) - 2 * at * grows / (1 + square)**2, -2 * grows / (1 + square)**2)

    def basis(self, odd: bool) -> tuple[np.ndarray, np.ndarray]:
        """Of the coefficients of two neighbouring rings at the points: value (n, 3 P, D), and derivatives (n, 6 P, D) along the radius and
        along the circle, component by component.
        """
        order, shape = np.arange(self.plan.harmonics + 1), (self.n, 2, self.plan.around, 3, 2, 3, self.plan.harmonics + 1)
        cos, sin = (function(np.outer(self._phi, order)) for function in (np.cos, np.sin))
        near, slope = self._share[0][None, :, None, :, None], self._share[1][:, None, None, :, None]
        value, along, across = (np.zeros(shape) for _ in range(3))
        for axis in range(3):
            wave, turned = (sin, order * cos) if (axis == 1) != odd else (cos, -order * sin)
            wave, turned = wave[None, None, :, None], turned[None, None, :, None]
            value[..., axis, :, axis, :] = near * wave
            along[..., axis, :, axis, :] = slope * wave
            across[..., axis, :, axis, :] = near * turned / self._radius[:, :, None, None, None]
        rows = self.n, 3 * self.weight.shape[1], 2 * self.per_ring
        return value.reshape(rows), np.stack([along, across], axis=3).reshape(rows[0], 2 * rows[1], rows[2])

    def free(self, odd: bool) -> np.ndarray:
        """(size,) bool: coefficients that are not zero: none at the rim, the zeroth harmonic alone in the centre, no sine of zero."""
        free = np.ones((self.n + 1, 3, self.plan.harmonics + 1), bool)
        free[-1] = free[0, :, 1:] = False
        free[:, [0, 2] if odd else [1], 0] = False
        return free.ravel()


def _stacked(flat: np.ndarray, up: np.ndarray) -> np.ndarray:
    """(..., 3) from x + i y and z."""
    return np.stack([flat.real, flat.imag, up], axis=-1)


def evaluate(field: np.ndarray, mesh: DomeMesh, points: np.ndarray, odd: bool = False) -> np.ndarray:
    """(K, 3) displacement, m, of a field (size,) at points (K, 3), m, on the cap."""
    w = disc_of(points, mesh.cap)
    z = (w - mesh.shift) / (1 - mesh.shift * w)
    edges, radius, turn = mesh.plan.edges, np.abs(z), np.angle(z)
    low = np.clip(np.searchsorted(edges, radius) - 1, 0, mesh.n - 1)
    part = ((radius - edges[low]) / (edges[low + 1] - edges[low]))[:, None, None]
    rings = field.reshape(mesh.n + 1, 3, -1)
    here = rings[low] * (1 - part) + rings[low + 1] * part
    phase = np.outer(turn, np.arange(mesh.plan.harmonics + 1))
    moved = np.stack([(here[:, axis] * (np.sin(phase) if (axis == 1) != odd else np.cos(phase))).sum(1) for axis in range(3)], axis=1)
    return np.where(radius[:, None] <= 1, moved, 0.0)
