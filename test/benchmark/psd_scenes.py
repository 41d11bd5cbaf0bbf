# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Signals of PSD fingers with ground truth: simulated specimens, or recordings in the folder given by TACTILE_RECORDINGS."""
from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from tactile_driver.simulation.psd.finger import Design
from tactile_driver.simulation.psd.scene import open_psd_scene

from tactile_perception.finger.calibration import Recording

_VOLT, _RATE, _CONTACT = 5 / 4096, 1000.0, 2
_RECORDED = {'calibration': 'psd_cal_dense', 'grid': 'psd_grid25', 'taps': 'psd_inter_32_670', 'light': 'psd_nocontact_drift',
             'bright': 'psd_grid25_bright', 'lamp': 'psd_light_step', 'slide': 'psd_slide_meridian'}


@dataclass(frozen=True)
class Signals:
    """volts (N, 4); period_s; touching (N,); normal (N, 3), force (N,), depth (N,): NaN where nothing touches."""

    volts: np.ndarray
    period_s: float
    touching: np.ndarray
    normal: np.ndarray
    force: np.ndarray
    depth: np.ndarray

    @property
    def recording(self) -> Recording:
        """As calibrate reads it."""
        return Recording(self.volts, self.period_s, self.touching, self.normal, self.force, self.depth)

    def held(self, least_s: float = 0.1) -> list[slice]:
        """The middle half of each contact that lasts."""
        edges = np.flatnonzero(np.diff(np.r_[False, self.touching, False].astype(np.int8)))
        pairs = [(b, e) for b, e in zip(edges[::2].tolist(), edges[1::2].tolist()) if (e - b) * self.period_s >= least_s]
        return [slice(b + (e - b) // 4, e - (e - b) // 4) for b, e in pairs]


def simulated(name: str, seed: int, design: Design = Design()) -> Signals:
    """A scene of a simulated finger at 1 kHz."""
    scene = open_psd_scene(name, _RATE, seed, design)
    counts, truth = scene.play(0, scene.samples)
    return Signals(counts * _VOLT, 1 / _RATE, truth.touching > 0, truth.normal, truth.force, truth.depth)


def recorded(name: str) -> Signals:
    """The recording that corresponds to a scene; calibration is told at the places that the stage has labelled."""
    folder = Path(os.environ['TACTILE_RECORDINGS'], 'simulated', _RECORDED[name])
    given, truth = np.load(folder / 'input.npz'), np.load(folder / 'truth.npz')
    touching = truth['phase'] == _CONTACT
    normal = np.where(touching[:, None], truth['normal'], np.nan)
    if name == 'calibration':
        _label(normal, touching, given['label_phi'], given['label_theta'])
    force, depth = (np.where(touching, known, np.nan) for known in (truth['force_N'], 1e-3 * truth['indentation_mm']))
    return Signals(given['volts'], float(np.median(np.diff(given['t']))), touching, normal, force, depth)


def _label(normal: np.ndarray, touching: np.ndarray, phi: np.ndarray, theta: np.ndarray) -> None:
    edges = np.flatnonzero(np.diff(np.r_[False, touching, False].astype(np.int8)))
    for begin, end in zip(edges[::2], edges[1::2]):
        known = np.flatnonzero(np.isfinite(theta[begin:end]))
        if len(known):
            a, b = phi[begin + known[0]], theta[begin + known[0]]
            normal[begin:end] = np.cos(a) * np.sin(b), np.sin(a) * np.sin(b), np.cos(b)
