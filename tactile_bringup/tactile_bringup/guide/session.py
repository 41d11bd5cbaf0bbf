# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Which presses of a sheet count: begun after an untouched second, held still at one depth or more, lifted where they began."""
from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np


@dataclass(frozen=True)
class Rules:
    """What a press has to be. All lengths in m, times in s; chosen for a hand-held tool, far above the noise of stages and arms."""

    untouched: float = 1.0
    still: float = 0.4
    noise: float = 5e-5  # of the tip's position while it is held still
    touching: float = 1e-4  # as calibrate, to which a shallower press is none
    step: float = 3e-4  # between two depths
    stuck: float = 1.0  # without another value of the wrench: it is saturated, or has stopped
    slid: float = 4e-4
    fastest: float = 0.5  # m/s; what moves faster has jumped
    frames: int = 3  # images kept of each depth
    rest: int = 8  # images kept before a press


@dataclass(frozen=True)
class Sample:
    """An image and what was there at its time. tip: (3,) m, of the probe in the sensor frame; wrench: (6,), N and N m, in the frame of the
    force sensor, NaN where unknown; changed_s: when it last had another value; image: whatever the caller keeps of it; to_sensor: takes a
    wrench from there to the sensor frame's origin."""

    stamp_s: float
    tip: np.ndarray
    wrench: np.ndarray
    changed_s: float
    image: object
    to_sensor: Callable[[np.ndarray], np.ndarray] = lambda wrench: wrench


@dataclass
class Press:
    """A press: images before it, and those at each depth; problem: why it does not count, ''."""

    rest: list[Sample]
    holds: list[list[Sample]] = field(default_factory=list)
    problem: str = ''

    @property
    def place(self) -> np.ndarray:
        """(x, y), m, where it was held."""
        return np.mean([hold[0].tip[:2] for hold in self.holds], axis=0)

    @property
    def depths(self) -> list[float]:
        """m, of each hold."""
        return [-float(hold[0].tip[2]) for hold in self.holds]


def planned_places(size: Sequence[float]) -> np.ndarray:
    """(12, 2) m: 4 x 3 places over a sheet of this size (x, y), m, as far out as a fingertip fits."""
    x, y = (np.linspace(-0.37, 0.37, count) * length for length, count in zip(size, (4, 3)))
    return np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)


class Session:
    """Judges samples in their order. size: of the sheet, m; done: (place (2,), depths) of earlier presses, the newest last."""

    def __init__(self, size: Sequence[float], rules: Rules | None = None):
        self.size, self.rules, self.places = np.asarray(size, float), rules or Rules(), planned_places(size)
        self.done: list[tuple[np.ndarray, list[float]]] = []
        self.tip = np.full(3, np.nan)
        self._rest: list[Sample] = []
        self._press: Press | None = None
        self._recent: deque[Sample] = deque()

    @property
    def open_places(self) -> list[int]:
        """Numbers of the planned places at which nothing has been pressed: each press takes the nearest that is open."""
        left = list(range(len(self.places)))
        for place, _ in self.done:
            if left:
                left.remove(min(left, key=lambda k: np.linalg.norm(self.places[k] - place)))
        return left

    @property
    def advice(self) -> str:
        """What to press next."""
        if not self.open_places:
            return 'all places are pressed'
        x, y = 1e3 * self.places[self.open_places[0]]
        return (f'press {len(self.done) + 1} of {len(self.places)}: go to x {x:+.0f}, y {y:+.0f} mm, wait {self.rules.untouched:g} s above '
                f'it, then hold still at two or three depths, {self.rules.still:g} s each, and lift straight')

    def add(self, sample: Sample) -> tuple[Press | None, str]:
        """(a press that counts, or None; what is to be told, or '')."""
        before, self.tip = self._recent[-1] if self._recent else None, sample.tip
        jumped = before is not None and np.linalg.norm(sample.tip - before.tip) > self.rules.fastest * (sample.stamp_s - before.stamp_s)
        told = self.drop(f'the probe jumped by {1e3 * np.linalg.norm(sample.tip - before.tip):.1f} mm; see whether /tf tells its place '
                         'without gaps') if jumped else ''
        self._recent.append(sample)
        while len(self._recent) > 2 and sample.stamp_s - self._recent[1].stamp_s >= self.rules.still:
            self._recent.popleft()
        if sample.tip[2] < -self.rules.touching:
            return None, told or self._touched(sample)
        press, self._press = self._press, None
        if sample.tip[2] > self.rules.touching:
            self._rest.append(sample)
        if press is None:
            return None, told
        problem = press.problem or ('' if press.holds else f'the probe never stood still for {self.rules.still:g} s')
        return (None, f'dropped: {problem}') if problem else (press, f'taken: {len(press.holds)} depths')

    def drop(self, why: str) -> str:
        """Spoil the present press, if there is one, and the untouched time before the next; what is to be told."""
        self._rest, self._recent = [], deque()
        if self._press is not None and not self._press.problem:
            self._press.problem = why
        return why

    def _touched(self, sample: Sample) -> str:
        """Go on with a press, or begin one; what is to be told."""
        press = self._press
        if press is None:
            press = self._press = Press(self._untouched(sample.stamp_s))
            self._rest = []
            if not press.rest:
                return self._spoil(f'it came without {self.rules.untouched:g} s untouched before')
        if press.problem:
            return ''
        if (np.abs(sample.tip[:2]) > self.size / 2).any():
            return self._spoil('it is outside the sheet; see where the sensor frame is')
        if sample.stamp_s - sample.changed_s > self.rules.stuck:
            return self._spoil('the wrench stands still: the sensor is saturated or has stopped')
        if press.holds and np.linalg.norm(sample.tip[:2] - press.holds[0][0].tip[:2]) > self.rules.slid:
            return self._spoil('the probe slid over the sheet')
        return self._held(press)

    def _spoil(self, why: str) -> str:
        self._press.problem = why
        return f'{why}; lift'

    def _untouched(self, stamp_s: float) -> list[Sample]:
        """Images of the untouched time before a press, evenly; [] if it was too short."""
        rest = [each for each in self._rest if stamp_s - each.stamp_s < 2 * self.rules.untouched]
        if not rest or rest[-1].stamp_s - rest[0].stamp_s < 0.8 * self.rules.untouched:
            return []
        return [rest[k] for k in np.unique(np.linspace(0, len(rest) - 1, self.rules.rest).astype(int))]

    def _held(self, press: Press) -> str:
        tips = np.array([each.tip for each in self._recent])
        span = self._recent[-1].stamp_s - self._recent[0].stamp_s
        if span < self.rules.still or np.abs(tips - tips.mean(0)).max() > self.rules.noise:
            return ''
        sample = self._recent[-1]
        if press.holds and abs(press.holds[-1][0].tip[2] - sample.tip[2]) < self.rules.step:
            if len(press.holds[-1]) < self.rules.frames:
                press.holds[-1].append(sample)
            return ''
        press.holds.append([sample])
        return f'held at {-1e3 * sample.tip[2]:.2f} mm'

    def picture(self) -> np.ndarray:
        """(H, 480, 3) BGR: the sheet with planned places (rings), pressed ones (discs, darker the deeper) and the probe (cross)."""
        scale = 400 / self.size[0]
        height = int(scale * self.size[1]) + 80
        image = np.full((height, 480, 3), 255, np.uint8)

        def at(place) -> tuple[int, int]:
            return int(240 + scale * place[0]), int(height / 2 + scale * place[1])
        cv2.rectangle(image, at(-self.size / 2), at(self.size / 2), (0, 0, 0), 1)
        for number in self.open_places:
            cv2.circle(image, at(self.places[number]), 9, (160, 160, 160), 1, cv2.LINE_AA)
        for place, depths in self.done:
            shade = int(max(200 - 4e4 * max(depths), 0))
            cv2.circle(image, at(place), 9, (shade, 160, shade), -1, cv2.LINE_AA)
            cv2.putText(image, str(len(depths)), (at(place)[0] - 5, at(place)[1] + 5), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (0, 0, 0), 1)
        if np.isfinite(self.tip).all():
            cv2.drawMarker(image, at(self.tip), (0, 0, 220), cv2.MARKER_CROSS, 16, 2)
        cv2.putText(image, f'{len(self.done)} presses, {len(self.open_places)} places left', (12, 24), cv2.FONT_HERSHEY_SIMPLEX, 0.6,
                    (0, 0, 0), 1, cv2.LINE_AA)
        return image
