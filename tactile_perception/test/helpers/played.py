# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Scenes of the simulated finger as voltages with their truth."""
import numpy as np
from tactile_driver.simulation.psd.scene import PsdScene, open_psd_scene

from tactile_perception.finger.calibration import Recording
from tactile_perception.finger.map import position

RATE = 1000.0
PERIOD = 1 / RATE
VOLT = 5 / 4096


def scene(name, rate=RATE, seed=0):
    """(volts (N, 4), truth)."""
    return all_of(open_psd_scene(name, rate, seed))


def script(what, rate=RATE, seed=0):
    return all_of(PsdScene(what, rate, seed))


def all_of(played):
    counts, truth = played.play(0, played.samples)
    return counts * VOLT, truth


def recording(name, seed=0, chosen=slice(None)):
    """A scene as what calibrate reads; chosen: of its presses, the others are cut out."""
    volts, truth = scene(name, seed=seed)
    touching = truth.touching > 0
    edges = np.flatnonzero(np.diff(np.r_[False, touching, False].astype(np.int8)))
    keep = np.zeros(len(volts), bool)
    for begin, end in list(zip(edges[::2], edges[1::2]))[chosen]:
        keep[max(begin - 120, 0):end + 100] = True
    return Recording(volts[keep], PERIOD, touching[keep], truth.normal[keep], truth.force[keep], truth.depth[keep])


def onsets(state):
    """(first samples in contact, first samples after it)."""
    edges = np.diff(state.astype(np.int8))
    return np.flatnonzero(edges == 1) + 1, np.flatnonzero(edges == -1) + 1


def lags(true, found):
    """Samples by which each true event is late (early: below 0) in found."""
    return np.array([(found - event)[np.argmin(np.abs(found - event))] for event in true])


def runs(samples):
    """Slices of samples with one contact, or with none."""
    return [slice(*run) for run in samples.runs()]


def touch(finger, samples, run):
    """The contact of a slice of samples."""
    return finger.touch(samples, run.start, run.stop)


def place(samples):
    """Centroids (N, 2) on the detector, half widths; NaN without contact."""
    return np.where(samples.contact[:, None], position(samples.sums), np.nan)
