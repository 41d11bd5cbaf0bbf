# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated PSD finger: cover, waveguide, fibre plate, detector and converter.

The model covers what determines the four voltages. An object presses the cover towards the waveguide. Before contact the cover reflects
leaking light; in contact a patch of finite size scatters light. The tapered, irregular fibre plate leads the light of each point of the
patch to the detector, where four electrodes share the current. The constants and the spreads of the random numbers are chosen.
"""
from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

COVER_RADIUS = 0.016  # m, outer radius
# Points (radius, angle) of the unit disc that stand for a patch, and number of waves in the distortion of the fibre plate.
_PATCH = [(0.0, 0.0)] + [(0.55, k * math.pi / 3) for k in range(6)] + [(0.92, (k + 0.5) * math.pi / 6) for k in range(12)]
_MODES = 8


@dataclass(frozen=True)
class Material:
    """gap: m, between cover and waveguide; soft, hard: stiffness, N/m before and N/m^1.5 after they touch; leak: V, reflected light when
    they just touch; scatter: V, of a patch of 1 mm^2 at the pole; glow: m, radius of the reflecting area of the cover; creep: part of its
    place and depth that a contact shows late."""

    gap: float = 1.1e-4
    soft: float = 1200.0
    hard: float = 1.1e6
    leak: float = 0.30
    scatter: float = 0.85
    glow: float = 2.4e-3
    creep: float = 0.03


@dataclass(frozen=True)
class Design:
    """A kind of finger. reach: radius of the rim's image, in half widths of the detector; squeeze: how much more the plate magnifies at the
    rim; irregular: factor of the plate's irregularities."""

    reach: float = 0.66
    squeeze: float = 0.10
    irregular: float = 1.0
    material: Material = Material()


#: Another kind of finger: a larger image, a thicker and softer cover that glows more, a finer plate.
DESIGN_B = Design(0.80, 0.02, 1.4, Material(1.6e-4, 800.0, 0.7e6, 0.45, 0.65, 3.2e-3, 0.06))


class FingerSpecimen:
    """One finger of a design; seed: of its irregularities."""

    def __init__(self, seed: int = 0, design: Design = Design()):
        rng = np.random.default_rng([20260, seed])
        self.material = design.material
        self._reach = design.reach * (1 + 0.03 * rng.standard_normal())
        self._squeeze = design.squeeze + 0.03 * rng.standard_normal()
        self._oval = rng.normal(0, 0.015, (3, 2))
        self._twist = rng.normal(0, 0.015)
        self._waves = rng.normal(0, 2.2, (_MODES, 2))
        self._phases = rng.uniform(0, 2 * math.pi, (_MODES, 2))
        self._heights = design.irregular * rng.normal(0, 0.0022, (_MODES, 2))
        self._turn, self._shift = rng.normal(0, 0.015), rng.normal(0, 0.03, 2)
        self._lamps = rng.normal(0, 0.06, 2)
        self.gains = 1 + rng.normal(0, 0.006, 4)
        self.dark = 0.03 + rng.normal(0, 0.004, 4)
        self.stray = rng.normal(0, 0.15, 2)

    def force(self, depth: np.ndarray) -> np.ndarray:
        """Force, N, for the indentation depth of the cover, m: linear up to the gap, then with the power 1.5 (Hertz contact)."""
        into = np.maximum(depth - self.material.gap, 0)
        return self.material.soft * np.clip(depth, 0, self.material.gap) + self.material.hard * into**1.5

    def plate(self, normal: np.ndarray) -> np.ndarray:
        """Positions (..., 2) on the detector, in half widths, of the fibres from unit directions (..., 3)."""
        across = np.hypot(normal[..., 0], normal[..., 1])
        polar, around = np.arctan2(across, normal[..., 2]), np.arctan2(normal[..., 1], normal[..., 0])
        far = 2 * polar / math.pi
        radius = self._reach * far * (1 + self._squeeze * far * far)
        for order, (c, s) in enumerate(self._oval, 1):
            radius = radius * (1 + far * (c * np.cos(order * around) + s * np.sin(order * around)))
        turned = around + self._twist * far + self._turn
        end = np.stack([radius * np.cos(turned), radius * np.sin(turned)], axis=-1)
        argument = end @ self._waves.T
        ripple = np.stack([(np.sin(argument + self._phases[:, k]) * self._heights[:, k]).sum(-1) for k in (0, 1)], axis=-1)
        return end + ripple + self._shift

    def transmission(self, normal: np.ndarray) -> np.ndarray:
        """Fraction (...) of light transmitted by the fibres from unit directions (..., 3): less for bent fibres."""
        across = np.hypot(normal[..., 0], normal[..., 1])
        polar, around = np.arctan2(across, normal[..., 2]), np.arctan2(normal[..., 1], normal[..., 0])
        ring = 1 + polar * (self._lamps[0] * np.cos(4 * around) + self._lamps[1] * np.sin(3 * around))
        return ring * np.cos(np.minimum(polar, 1.4)) / (1 + (polar / 1.05) ** 6)

    def light(self, normal: np.ndarray, depth: np.ndarray) -> np.ndarray:
        """Voltages (N, 4), V, for an object pressed in by depth (N,), m, along unit normals (N, 3)."""
        near = np.clip(depth / self.material.gap, 0, 1)
        into = np.maximum(depth - self.material.gap, 0)
        spot = np.sqrt(2 * COVER_RADIUS * into)
        brightness = self.material.scatter * (math.pi * spot**2 * 1e6) ** 0.75
        glowing = self.material.leak * near**2.6
        return self._patch(normal, spot, brightness) + self._patch(normal, np.full(len(normal), self.material.glow), glowing)

    def _patch(self, normal: np.ndarray, radius: np.ndarray, brightness: np.ndarray) -> np.ndarray:
        """Voltages (N, 4), V, of round patches around unit normals (N, 3), of radius (N,), m, and brightness (N,), V."""
        aside = np.cross(normal, np.where(np.abs(normal[:, :1]) < 0.8, [[1.0, 0, 0]], [[0, 1.0, 0]]))
        aside /= np.linalg.norm(aside, axis=1, keepdims=True)
        other = np.cross(normal, aside)
        share, angle = np.array(_PATCH).T
        away = share * (radius / COVER_RADIUS)[:, None]
        offset = np.cos(angle)[:, None] * aside[:, None] + np.sin(angle)[:, None] * other[:, None]
        points = np.cos(away)[..., None] * normal[:, None] + np.sin(away)[..., None] * offset
        led = self.transmission(points) * (brightness / len(_PATCH))[:, None]
        return (self.electrodes(self.plate(points)) * led[..., None]).sum(1)

    def electrodes(self, place: np.ndarray) -> np.ndarray:
        """Fractions (..., 4) of the electrodes x1, y1, x2, y2 for light at positions (..., 2), half widths; nearer corners take more."""
        u, w = place[..., 0], place[..., 1]
        u, w = u * (1 + 0.01 * w * w), w * (1 + 0.01 * u * u)
        left, right, low, high = (1 - u) / 2, (1 + u) / 2, (1 - w) / 2, (1 + w) / 2
        return np.stack([left * low, right * low, right * high, left * high], axis=-1)


@dataclass(frozen=True)
class Electronics:
    """noise: V, of each output; shot: V, shot noise variance per volt; limit: V, saturation of the amplifiers; full_scale: V; bits: of the
    converter. The defaults are chosen."""

    noise: float = 0.011
    shot: float = 1.0e-5
    limit: float = 4.95
    full_scale: float = 5.0
    bits: int = 12

    def counts(self, volts: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Counts (N, 4) uint16 of voltages (N, 4), V, with noise from rng."""
        noisy = volts + rng.standard_normal(volts.shape) * np.sqrt(self.noise**2 + self.shot * np.maximum(volts, 0))
        return np.clip(np.clip(noisy, 0, self.limit) / self.full_scale * 2**self.bits, 0, 2**self.bits - 1).astype(np.uint16)
