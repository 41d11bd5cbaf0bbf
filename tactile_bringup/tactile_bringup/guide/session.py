# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Which presses count: those that follow an untouched second, are held still at one depth or more, and are lifted where they began."""
from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import cv2
import numpy as np

from .surfaces import Fingertip, MarkedSurface


@dataclass(frozen=True)
class Sample:
    """Raw data of one time, with the probe and the wrench.

    tip: (3,) m, of the probe in the sensor frame; wrench: (6,), N and N m, in the frame of the force sensor, NaN where unknown; changed_s:
    when the wrench last changed; raw: the caller's; to_sensor: transforms a wrench to the origin of the sensor frame.
    """

    stamp_s: float
    tip: np.ndarray
    wrench: np.ndarray
    changed_s: float
    raw: object
    to_sensor: Callable[[np.ndarray], np.ndarray] = lambda wrench: wrench


@dataclass
class Press:
    """A press: samples before it and in it, and the tip at each depth at which it was held; problem: why it does not count, or ''."""

    rest: list[Sample]
    touched: list[Sample] = field(default_factory=list)
    holds: list[np.ndarray] = field(default_factory=list)
    problem: str = ''


class Session:
    """Judges samples in the order of their stamps.

    done: (position (2,), depths) of earlier presses, the newest last; tip: of the newest sample.
    """

    def __init__(self, surface: MarkedSurface | Fingertip):
        self.surface, self.rules, self.positions = surface, surface.rules, surface.positions
        self.done: list[tuple[np.ndarray, list[float]]] = []
        self.tip = np.full(3, np.nan)
        self._rest: list[Sample] = []
        self._press: Press | None = None
        self._recent: deque[Sample] = deque()
        self._kept = 0  # samples of the present depth

    @property
    def open_positions(self) -> list[int]:
        """Numbers of the planned positions without a press: each press counts for the nearest open one."""
        remaining = list(range(len(self.positions)))
        for position, _ in self.done:
            if remaining:
                remaining.remove(min(remaining, key=lambda k: np.linalg.norm(self.positions[k] - position)))
        return remaining

    @property
    def advice(self) -> str:
        """What to press next."""
        if not self.open_positions:
            return 'all positions are pressed'
        x, y = 1e3 * self.positions[self.open_positions[0]]
        depths = 'one depth or more' if self.rules.keeps_all else 'two or three depths'
        return (f'press {len(self.done) + 1} of {len(self.positions)}: go to x {x:+.0f}, y {y:+.0f} mm, wait {self.rules.untouched_s:g} s '
                f'above it, then hold still at {depths}, {self.rules.still_s:g} s each, and lift straight')

    def keep(self, press: Press) -> None:
        """Count a press."""
        self.done.append((np.mean(press.holds, axis=0)[:2], [self.surface.depth(tip) for tip in press.holds]))

    def add(self, sample: Sample) -> tuple[Press | None, str]:
        """Judge a sample; returns a press that counts, or None, and a message for the operator, or ''."""
        before, self.tip = self._recent[-1] if self._recent else None, sample.tip
        depth = self.surface.depth(sample.tip)
        reported = self._jumped(before, sample) if before is not None and depth > self.rules.touch_depth else ''
        self._recent.append(sample)
        while len(self._recent) > 2 and sample.stamp_s - self._recent[1].stamp_s >= self.rules.still_s:
            self._recent.popleft()
        if depth > self.rules.touch_depth:
            return None, reported or self._touched(sample)
        press, self._press = self._press, None
        if not depth > -self.rules.touch_depth:
            self._rest.append(sample)
        if press is None:
            return None, reported
        problem = press.problem or ('' if press.holds else f'the probe never stood still for {self.rules.still_s:g} s')
        return (None, f'dropped: {problem}') if problem else (press, f'taken: {len(press.holds)} depths')

    def drop(self, why: str) -> str:
        """Reject the present press, if there is one, and the untouched time before the next; returns the reason."""
        self._rest, self._recent = [], deque()
        if self._press is not None and not self._press.problem:
            self._press.problem = why
        return why

    def _jumped(self, before: Sample, sample: Sample) -> str:
        """Reject the press if the probe cannot have moved so far while it touched; returns a message."""
        distance = np.linalg.norm(sample.tip - before.tip)
        if self._press is None or distance <= self.rules.max_speed * (sample.stamp_s - before.stamp_s):
            return ''
        return self.drop(f'the probe jumped by {1e3 * distance:.1f} mm; check that /tf has its position without gaps')

    def _touched(self, sample: Sample) -> str:
        """Continue or start a press; returns a message."""
        press = self._press
        if press is None:
            press = self._press = Press(self._untouched(sample.stamp_s))
            self._rest = []
            if not press.rest:
                return self._reject(f'the sensor was not untouched for {self.rules.untouched_s:g} s before')
        if press.problem:
            return ''
        if not self.surface.holds(sample.tip):
            return self._reject('the press is outside the surface; check the pose of the sensor frame')
        if sample.stamp_s - sample.changed_s > self.rules.stuck_s:
            return self._reject('the wrench does not change: the force sensor is saturated or has stopped')
        if press.holds and np.linalg.norm((sample.tip - press.holds[0])[:2]) > self.rules.max_slide:
            return self._reject('the probe slid over the surface')
        if self.rules.keeps_all:
            press.touched.append(sample)
        return self._held(press)

    def _reject(self, why: str) -> str:
        self._press.problem = why
        return f'{why}; lift'

    def _untouched(self, stamp_s: float) -> list[Sample]:
        """Samples that are evenly spread over the untouched time before a press; [] if it was too short."""
        rest = [each for each in self._rest if stamp_s - each.stamp_s < 2 * self.rules.untouched_s]
        if not rest or rest[-1].stamp_s - rest[0].stamp_s < 0.8 * self.rules.untouched_s:
            return []
        count = len(rest) if self.rules.keeps_all else self.rules.rest_frames
        return [rest[k] for k in np.unique(np.linspace(0, len(rest) - 1, count).astype(int))]

    def _held(self, press: Press) -> str:
        tips = np.array([each.tip for each in self._recent])
        span = self._recent[-1].stamp_s - self._recent[0].stamp_s
        if span < self.rules.still_s or np.abs(tips - tips.mean(0)).max() > self.rules.still_radius:
            return ''
        sample = self._recent[-1]
        is_new = not press.holds or np.linalg.norm(press.holds[-1] - sample.tip) >= self.rules.depth_step
        if is_new:
            press.holds.append(sample.tip)
            self._kept = 0
        if not self.rules.keeps_all and self._kept < self.rules.frames:
            press.touched.append(sample)
            self._kept += 1
        return f'held at {1e3 * self.surface.depth(sample.tip):.2f} mm' if is_new else ''

    def picture(self) -> np.ndarray:
        """(H, 480, 3) BGR: open positions (rings), pressed ones (discs with the number of depths) and the probe (cross)."""
        size = self.surface.size
        scale = 400 / size[0]
        height = int(scale * size[1]) + 80
        image = np.full((height, 480, 3), 255, np.uint8)

        def at(position) -> tuple[int, int]:
            return int(240 + scale * position[0]), int(height / 2 + scale * position[1])
        cv2.rectangle(image, at(-size / 2), at(size / 2), (0, 0, 0), 1)
        for number in self.open_positions:
            cv2.circle(image, at(self.positions[number]), 9, (160, 160, 160), 1, cv2.LINE_AA)
        for position, depths in self.done:
            cv2.circle(image, at(position), 9, (60, 160, 60), -1, cv2.LINE_AA)
            cv2.putText(image, str(len(depths)), (at(position)[0] - 5, at(position)[1] + 5), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (0, 0, 0), 1)
        if np.isfinite(self.tip).all():
            cv2.drawMarker(image, at(self.tip), (0, 0, 220), cv2.MARKER_CROSS, 16, 2)
        cv2.putText(image, f'{len(self.done)} presses, {len(self.open_positions)} positions left', (12, 24), cv2.FONT_HERSHEY_SIMPLEX, 0.6,
                    (0, 0, 0), 1, cv2.LINE_AA)
        return image
