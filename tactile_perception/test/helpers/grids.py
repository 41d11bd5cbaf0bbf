# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Places of dots on deformed grids with known numbers, for the tests of numbering."""
import numpy as np

SCENES = {
    'plain': {},
    'bulged': {'bulge': 0.2},
    'compressed': {'compression': 0.6},
    'sheared': {'shear': 0.2, 'turn': 20.0},
    'sheared back': {'shear': -0.2, 'turn': -20.0},
    'dragged': {'drag': 2.0},
    'missing, merged and false': {'missing': 0.02, 'merged': 0.01, 'false': 0.01},
    'all at once': {'bulge': 0.1, 'compression': 0.7, 'shear': 0.1, 'turn': 20.0, 'missing': 0.02, 'merged': 0.01, 'false': 0.01},
}


def make_grid(rng, rows=23, columns=23, pitch=18.0, size=(640, 480), turn=0.0, shear=0.0, bulge=0.0, compression=1.0, drag=0.0,
              shift=(0.0, 0.0), missing=0.0, merged=0.0, false=0.0, noise=0.05):
    """(uv (N, 2) px, number (N,)) in random order; number is -2 for false and merged dots. shift, drag: pitches; turn: degrees."""
    number = np.arange(rows * columns)
    p = np.stack([number % columns - (columns - 1) / 2, number // columns - (rows - 1) / 2], axis=1)
    p = p * (1 + bulge * (1 - (p**2).sum(axis=1, keepdims=True) / (rows / 2) ** 2) / 2)
    centre, direction = rng.uniform(-5, 5, 2), np.exp(1j * rng.uniform(0, 2 * np.pi))
    direction = np.array([direction.real, direction.imag])
    away, width = p - centre, rng.uniform(3, 6)
    p = p - (1 - compression) * np.outer(away @ direction * np.exp(-(away**2).sum(axis=1) / (2 * width**2)), direction)
    width = max(2.2, 1.7 * drag) * rng.uniform(1, 1.5)
    p = p + drag * np.outer(np.exp(-(away**2).sum(axis=1) / (2 * width**2)), direction)
    c, s = np.cos(np.deg2rad(turn)), np.sin(np.deg2rad(turn))
    p = p @ np.array([[1, shear], [0, 1]]).T @ np.array([[c, -s], [s, c]]).T
    uv = (p + shift) * pitch + np.array(size) / 2 + rng.normal(0, noise, p.shape)
    keep = rng.uniform(size=len(uv)) >= missing
    pairs = np.flatnonzero((rng.uniform(size=len(uv)) < merged) & (number % columns < columns - 1))
    uv[pairs], keep[pairs + 1] = (uv[pairs] + uv[pairs + 1]) / 2, False
    number[pairs] = -2
    keep &= np.all((uv > 2) & (uv < np.array(size) - 3), axis=1)
    stray = rng.uniform(0, 1, (rng.poisson(false * rows * columns), 2)) * size
    order = rng.permutation(keep.sum() + len(stray))
    return np.vstack([uv[keep], stray])[order], np.r_[number[keep], np.full(len(stray), -2)][order]
