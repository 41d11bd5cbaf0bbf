# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Scenes of the simulated finger as voltages with their truth."""
import numpy as np

from tactile_driver.simulation.psd_scene import PsdScene, open_psd_scene
from tactile_perception.finger.calibration import Recording
from tactile_perception.finger.parameters import FingerSettings, PsdFinger

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


def recording(name, seed=0, selected=slice(None)):
    """Return a scene as the recording that calibrate reads, with only the selected presses."""
    volts, truth = scene(name, seed=seed)
    touching = truth.touching > 0
    edges = np.flatnonzero(np.diff(np.r_[False, touching, False].astype(np.int8)))
    keep = np.zeros(len(volts), bool)
    for begin, end in list(zip(edges[::2], edges[1::2]))[selected]:
        keep[max(begin - 120, 0):end + 100] = True
    return Recording(volts[keep], PERIOD, touching[keep], truth.normal[keep], truth.force[keep], truth.depth[keep])


def onsets(state):
    """(first samples in contact, first samples after it)."""
    edges = np.diff(state.astype(np.int8))
    return np.flatnonzero(edges == 1) + 1, np.flatnonzero(edges == -1) + 1


def lags(true, found):
    """Samples by which each true event is late (early: below 0) in found."""
    return np.array([(found - event)[np.argmin(np.abs(found - event))] for event in true])


class Player:
    """A PsdFinger that is fed voltages batch by batch, without a gap unless one is made by wait."""

    def __init__(self, finger):
        self.finger, self._stamp_s = finger, 1.0

    def play(self, volts, size=10**9, period=PERIOD):
        """[(mean sample, touch or None)] of batches of that size."""
        found = []
        for first in range(0, len(volts), size):
            batch = volts[first:first + size]
            found += [(first + one.at, one.touch) for one in self.finger.estimate(batch, self._stamp_s, period).estimates]
            self._stamp_s += len(batch) * period
        return found

    def wait(self, seconds):
        self._stamp_s += seconds


def each_sample(model, **settings):
    """A player of a finger with a result for each sample."""
    return Player(PsdFinger(model, FingerSettings(each_sample=True, **settings)))


def touches(found, count):
    """The touch of each of so many samples, or None, of the results of a finger with one for each sample."""
    at = {round(k): touch for k, touch in found}
    return [at.get(k) for k in range(count)]


def contact(found, count):
    """(count,) bool: whether something touches."""
    return np.array([touch is not None for touch in touches(found, count)])
