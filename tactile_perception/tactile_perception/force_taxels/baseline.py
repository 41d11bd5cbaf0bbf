# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What taxels read untouched: offset, drift and noise, measured while nothing touches; dead taxels; the probability of a touch."""
from __future__ import annotations

import math

import numpy as np

from .constants import FORCE_TAXEL


class Baseline:
    """Follows the untouched readings of taxels by a Kalman filter whose gain is the probability that nothing touches.

    Readings are (N, 3): two tangential components and the pressing one. The offset is a random walk; its rate is measured by the
    innovations, and the white noise by the differences between frames. The offset of taxels that are touched is kept, and becomes less
    certain.

    Attributes
    ----------
    noise, variance : ndarray, shape (N, 3)
        Variance of the white noise, and of the offset.
    touch : float
        Probability that something touches; 0 until the reference is known.
    alive : ndarray of bool, shape (N,)
    is_new : ndarray of bool, shape (N,)
        Taxels whose reading is not that of the last frame.
    """

    def __init__(self, count: int):
        self._since_s: float | None = None
        self._frames, self._last = 0, np.zeros((count, 3))
        self._mean, self._steps, self._squares = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros((count, 3))
        self.noise, self.variance = np.full((count, 3), np.nan), np.zeros((count, 3))
        self.alive = self.is_new = np.ones(count, bool)
        self.touch, self.is_known = 0.0, False
        self._drift, self._evidence = FORCE_TAXEL.drift, np.zeros(count)
        self._quantum, self._checked_s = np.inf, -np.inf

    def update(self, reading: np.ndarray, interval: float, stamp_s: float, near: np.ndarray | None = None) -> np.ndarray:
        """Take a reading, interval s after the last; the forces (N, 3) above the offset. near: as of `probabilities`; None: all."""
        if not self.is_known:
            return self._learn(reading, stamp_s)
        step, self._last = reading - self._last, reading
        self.is_new = (step != 0).any(axis=1)
        variance = self.variance + self._drift * interval * self._measured
        force = reading - self._mean
        total = variance + self.noise
        squares = force * force / total
        self._weigh(force, squares, interval)
        held = self.touch if near is None else self.touch * np.where(near, 1.0, self.probabilities(near, interval))[:, None]
        gain = (1.0 - held) * variance / total
        self._mean += gain * force
        self.variance = variance * (1.0 - gain) + (held * FORCE_TAXEL.late**2 * interval) * (force * force)
        if self.touch < 0.5:
            self._adapt(squares, step, interval)
            if stamp_s - self._checked_s > 1.0:  # between searches for taxels that died
                self._checked_s = stamp_s
                self._find_dead()
        return force

    def _learn(self, reading: np.ndarray, stamp_s: float) -> np.ndarray:
        """Average the first second."""
        if self._since_s is None:
            self._since_s = stamp_s
        else:
            step = np.abs(reading - self._last)
            self._steps += step**2
            self._quantum = min(self._quantum, float(step[step > 0].min(initial=np.inf)))
        self._last = reading
        self._frames += 1
        away = reading - self._mean
        self._mean += away / self._frames
        self._squares += away * (reading - self._mean)
        if stamp_s - self._since_s <= 0.5 * FORCE_TAXEL.reference_s:
            self._first_half = self._frames, self._mean.copy()
        if stamp_s - self._since_s >= FORCE_TAXEL.reference_s and self._frames > 3:
            # A number is known to its last digit at best.
            # smallest step of a sensor of which no number has ever changed, in its unit
            self._least = (self._quantum if np.isfinite(self._quantum) else 1e-6)**2 / 12
            steps = self._steps / (2 * (self._frames - 1))
            # Devices that repeat or filter their readings change by less than their noise from frame to frame.
            some = steps > 0
            self._repeats = max(float(np.median((self._squares / (self._frames - 1))[some] / steps[some])), 1.0) if some.any() else 1.0
            self._measured = steps * self._repeats
            self._find_dead()
            self.variance = self._measured / self._frames
            self._drift = min(max(self._first_drift(), FORCE_TAXEL.drift), FORCE_TAXEL.drift_range[1])
            self.is_known = True
        return reading - self._mean

    def _first_drift(self) -> float:
        """Rate of the random walk, in noise variances a second, by the difference of the means of both halves of the first second."""
        first, mean = self._first_half
        second = self._frames - first
        apart = (self._mean - mean) * (self._frames / second)
        squares = float((apart**2 / self.noise)[self.alive].mean())
        return 3 * (squares - 1 / first - 1 / second) / FORCE_TAXEL.reference_s

    def _find_dead(self) -> None:
        """A taxel whose noise is far from that of the others is dead: constant, or loud. The noise of a dead taxel is infinite."""
        level = 0.5 * np.log(self._measured + self._least).mean(axis=1)
        middle = float(np.median(level))
        spread = max(1.4826 * float(np.median(np.abs(level - middle))), FORCE_TAXEL.usual_spread)
        self.alive = np.abs(level - middle) < FORCE_TAXEL.unusual * spread
        self._blind = np.where(self.alive, 0.0, np.inf)[:, None]
        self.noise = self._measured + self._least + self._blind

    def _weigh(self, force: np.ndarray, squares: np.ndarray, interval: float) -> None:
        """Update the probability of a touch: a Bayes factor a taxel, a hidden state that persists."""
        occam = math.log(FORCE_TAXEL.range)  # price of a force of unknown size
        press = np.where(force[:, 2] > 0, 0.5 * squares[:, 2] - occam + math.log(2), -occam)
        shear = 0.5 * (squares[:, 0] + squares[:, 1]) - 2 * occam
        self._evidence = press + np.logaddexp(0.0, shear) - math.log(2)
        news = np.where(self.is_new, self._evidence, 0.0)  # a reading that is repeated says nothing new
        largest = float(news.max())
        frame = largest + math.log(np.exp(news - largest).sum() / len(press))
        before = min(self.touch + (1 - 2 * self.touch) * min(FORCE_TAXEL.rate * interval, 0.5), 1 - 1e-9)
        odds = math.log(before / (1 - before)) + max(-FORCE_TAXEL.max_evidence, min(frame, FORCE_TAXEL.max_evidence))
        self.touch = 1 / (1 + math.exp(-odds))

    def _adapt(self, squares: np.ndarray, step: np.ndarray, interval: float) -> None:
        """Follow drift and noise while nothing touches."""
        excess = float(squares.sum()) / max(3 * np.count_nonzero(self.alive), 1) - 1.0
        drift = self._drift * math.exp(max(-1.0, min(excess, 1.0)) * min(interval / FORCE_TAXEL.adapts_s, 1.0))
        self._drift = min(max(drift, FORCE_TAXEL.drift_range[0]), FORCE_TAXEL.drift_range[1])
        self._measured += min(interval / FORCE_TAXEL.noise_s, 1.0) * (0.5 * self._repeats * step * step - self._measured)
        self.noise = self._measured + self._least + self._blind

    def probabilities(self, near: np.ndarray, interval: float) -> np.ndarray:
        """Probability (N,) that each taxel is touched; near: (N,) those that were touched in the last frame, interval s ago, and those
        beside them, which are as likely touched as not. On the others a touch may begin."""
        begins = min(FORCE_TAXEL.rate * max(interval, 1e-4), 0.5) / len(near)
        prior = np.where(near, 0.0, math.log(begins)) + math.log(max(self.touch, 1e-12) / (2.0 - self.touch))
        return 1 / (1 + np.exp(-np.clip(self._evidence + prior, -FORCE_TAXEL.max_evidence, FORCE_TAXEL.max_evidence)))
