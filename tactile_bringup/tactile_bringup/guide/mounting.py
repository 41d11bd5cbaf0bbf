# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contacts that the sensor's own signal detects: touches by a probe of known position, from which the pose of the sensor follows with its
error; and presses by hand through the holes of a guide plate, for those without a robot."""
from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tactile_driver.errors import BadArgument
from tactile_perception.common.geometry import rotation_matrix, rotation_vector

from .constants import GUIDE
from .session import Press, Sample, Session
from .surfaces import Fingertip, MarkedSurface

_UNKNOWN = np.full(6, np.nan)
#: m and rad, standard deviations of a pose that was measured by hand, along and about the sensor's axes; and of the scale of the readings
_HAND_SIGMA = np.array([0.01] * 3 + [0.1] * 3 + [1.0])
_PRINT_SIGMA = np.array([5e-4, 5e-4, 5e-3])  # m and rad, of the print on the sensor, which no reading shows


@dataclass(frozen=True)
class Touch:
    """First contact of a probe with the sensor.

    tip: (3,) m, of the probe in the supposed sensor frame; doubt: m, its displacement between the last signal without contact and the first
    with it; seen: (2,) m, x and y that the sensor reports, up to a scale, NaN unknown.
    """

    tip: np.ndarray
    doubt: float
    seen: np.ndarray


@dataclass(frozen=True)
class Mounting:
    """Pose of the sensor frame in the supposed one.

    rotation: (3, 3); origin: (3,) m; sigma: (6,) standard deviations along and about the sensor's axes, m and rad. They are NaN where the
    touches do not determine the pose: there it is the supposed one.
    """

    rotation: np.ndarray
    origin: np.ndarray
    sigma: np.ndarray

    def __str__(self) -> str:
        parts = (1e3 * self.sigma[:3], np.degrees(self.sigma[3:]))
        texts = [', '.join(f'{axis} {"as given" if np.isnan(value) else f"{value:.2g}"}' for axis, value in zip('xyz', part))
                 for part in parts]
        return f'standard deviations along its axes {texts[0]} mm, about them {texts[1]} degrees'


class Touches(Session):
    """Judges samples as Session does, but by the sensor's own signal: the depth of the probe is not known yet.

    signal: from the raw data of a sample to a vector (M,) that hardly changes while nothing touches; seen: from untouched raw data (a list)
    and those of the deepest press to Touch.seen. touches: those that count.
    """

    def __init__(self, surface: MarkedSurface | Fingertip, signal: Callable[[object], np.ndarray],
                 seen: Callable[[list, object], np.ndarray]):
        super().__init__(surface)
        self.positions = self.positions[::max(len(self.positions) // GUIDE.max_touches, 1)][:GUIDE.max_touches]
        self.touches: list[Touch] = []
        self._signal, self._seen = signal, seen
        self.drop('')

    @property
    def advice(self) -> str:
        """What to touch next."""
        if not self.open_positions:
            return 'the surface is touched'
        x, y = 1e3 * self.positions[self.open_positions[0]]
        return (f'touch {len(self.done) + 1} of {len(self.positions)}, to find the sensor: go above about x {x:+.0f}, y {y:+.0f} mm, wait '
                f'{2 * self.rules.untouched_s:g} s, go down at 1 mm/s until the touch is reported, and lift')

    def drop(self, why: str) -> str:
        """Drop the present touch and the untouched time before it; returns the reason."""
        self._quiet: deque[tuple[Sample, np.ndarray]] = deque()  # the last untouched seconds
        self._pressed: list[tuple[Sample, np.ndarray]] = []
        return why

    def undo(self) -> None:
        """Remove the last touch."""
        self.touches.pop()
        self.done.pop()

    def add(self, sample: Sample) -> tuple[Press | None, str]:
        """Judge a sample; returns a press that counts (none of Touches), and a message for the operator, or ''."""
        self.tip = sample.tip
        new = sample, self._signal(sample.raw)
        if not self._quiet or self._quiet[-1][0].stamp_s - self._quiet[0][0].stamp_s < self.rules.untouched_s:
            self._quiet.append(new)
            return None, ''
        # The older half of the untouched time: the newer one may hold a touch that is too faint to be detected at once.
        base = np.array([signal for _, signal in list(self._quiet)[:max(len(self._quiet) // 2, 2)]])
        deviation = np.linalg.norm(new[1] - base.mean(0))
        if deviation > GUIDE.min_touch_signal * np.linalg.norm(base - base.mean(0), axis=1).max():
            self._pressed.append(new)
            if sample.stamp_s - self._pressed[0][0].stamp_s > GUIDE.max_touch_s:
                return None, 'dropped: ' + self.drop(f'the signal has been different for {GUIDE.max_touch_s:g} s; check whether the light '
                                                     'has changed')
            return None, 'touched; lift' if len(self._pressed) == 2 else ''
        if self._pressed:
            quiet, pressed = list(self._quiet), self._pressed
            self.drop('')
            return self._judged(quiet, pressed, base) if len(pressed) > 1 else (None, 'dropped: the touch was too short')
        self._quiet.append(new)
        while sample.stamp_s - self._quiet[0][0].stamp_s > 2 * self.rules.untouched_s:
            self._quiet.popleft()
        return None, ''

    def _judged(self, quiet: list[tuple[Sample, np.ndarray]], pressed: list[tuple[Sample, np.ndarray]],
                base: np.ndarray) -> tuple[Press | None, str]:
        """What add returns for the touch that has just ended.

        quiet, pressed: samples before it and in it, with their signals; base: the first signals of quiet.
        """
        path = quiet[len(base):] + pressed
        # Along the pattern of the touch itself its onset is visible long before it is in the whole signal.
        pattern = pressed[1][1] - base.mean(0)
        pattern /= np.linalg.norm(pattern)
        along = np.array([signal - base.mean(0) for _, signal in path]) @ pattern
        threshold = GUIDE.onset_sigmas * np.std((base - base.mean(0)) @ pattern)
        first = len(path) - len(pressed)
        while first > 0 and along[first - 1] > threshold:
            first -= 1
        if first == 0:
            return None, 'dropped: the sensor was touched before its signal was steady'
        tips = np.array([sample.tip for sample, _ in path])
        steps = np.linalg.norm(np.diff(tips[first - 1:first + 2], axis=0), axis=1)
        if steps[0] > GUIDE.max_probe_step:
            return None, f'dropped: the probe moved {1e3 * steps[0]:.1f} mm between two signals as it touched; go down more slowly'
        if steps[0] < GUIDE.min_probe_step:
            return None, 'dropped: the probe did not move as the sensor was touched; check that /tf has its position'
        rise = (along[first + 1] - along[first]) / steps[1] if steps[1] > GUIDE.min_probe_step else 0.0
        depth = along[first] / rise if rise > 0 else 0.5 * steps[0]
        share = 1 - min(depth / steps[0], 1.0)
        touched = tips[first - 1] + share * (tips[first] - tips[first - 1])
        down = (tips[first + 1] - tips[first - 1]) / max(np.linalg.norm(tips[first + 1] - tips[first - 1]), GUIDE.min_probe_step)
        # The deepest sample on the straight path of the touch: later the probe may have slid.
        straight = [each for each in pressed if np.linalg.norm(np.cross(each[0].tip - touched, down)) < GUIDE.max_probe_step]
        deepest = max(straight or pressed, key=lambda each: np.linalg.norm(each[1] - base.mean(0)))
        seen = self._seen([sample.raw for sample, _ in quiet[:len(base)]], deepest[0].raw)
        self.touches.append(Touch(touched, float(steps[0]), seen))
        self.done.append((tips[first][:2], []))
        return None, f'taken: touched within {1e3 * steps[0]:.2f} mm'


class Holes(Touches):
    """Judges presses by hand through a guide plate: the operator presses the named hole, the collar of the tool sets the depth.

    holes: (N, 2) m, in the order in which they are pressed; collars: m, depths of the presses, all holes with the first, then with the
    next; signal: as of Touches. Raises BadArgument for holes beside the surface.
    """

    def __init__(self, surface: MarkedSurface, holes: np.ndarray, collars: Sequence[float], signal: Callable[[object], np.ndarray]):
        super().__init__(surface, signal, lambda *_: np.full(2, np.nan))
        self.positions, self._depths, self._count = np.tile(holes, (len(collars), 1)), np.repeat(collars, len(holes)), len(holes)
        outside = [f'{1e3 * x:g} {1e3 * y:g}' for x, y in holes if not surface.holds(np.array([x, y, 0.0]))]
        if outside or not len(holes) or not len(collars) or min(collars) <= self.rules.touch_depth:
            raise BadArgument(f'calibrate_node: holes at {", ".join(outside) or "no"} mm are outside the surface, or collars '
                              f'{list(collars)} are none; give x and y of each hole, m, and depths above {self.rules.touch_depth:g} m')

    @property
    def advice(self) -> str:
        """What to press next."""
        if not self.open_positions:
            return 'all holes are pressed'
        number = self.open_positions[0]
        return (f'hole {number % self._count + 1}, collar {1e3 * self._depths[number]:g} mm: touch nothing for '
                f'{2 * self.rules.untouched_s:g} s, press to the collar, hold still for a second, and lift')

    def _judged(self, quiet: list[tuple[Sample, np.ndarray]], pressed: list[tuple[Sample, np.ndarray]],
                base: np.ndarray) -> tuple[Press | None, str]:
        size = np.array([np.linalg.norm(signal - base.mean(0)) for _, signal in pressed])
        held = [sample for (sample, _), part in zip(pressed, size / size.max()) if part > GUIDE.collar_signal]
        if held[-1].stamp_s - held[0].stamp_s < self.rules.still_s or len(held) < self.rules.frames:
            return None, f'dropped: the tool was not held at its collar for {self.rules.still_s:g} s'
        number = self.open_positions[0]
        x, y = self.positions[number]
        tip = np.array([x, y, self.surface.depth(np.array([x, y, 0.0])) - self._depths[number]])
        middle = len(held) // 2 - self.rules.frames // 2
        rest = [quiet[k][0] for k in np.unique(np.linspace(0, len(base) - 1, self.rules.rest_frames).astype(int))]
        press = Press([replace(sample, wrench=_UNKNOWN) for sample in rest], holds=[tip])
        press.touched = [replace(sample, tip=tip, wrench=_UNKNOWN) for sample in held[middle:middle + self.rules.frames]]
        return press, f'taken: {1e3 * self._depths[number]:g} mm deep'


def fit_mounting(touches: Sequence[Touch], surface: MarkedSurface | Fingertip) -> Mounting:
    """The pose that puts the touches on the surface and at the reported positions: least squares with the supposed pose as prior.

    The noise of touches and readings is estimated from their residuals. Errors that all of them share show in no residual: the delay of the
    detection, uniform within the doubt of the touches, and the error of the print.
    """
    tips, seen = np.array([touch.tip for touch in touches]), np.array([touch.seen for touch in touches])
    is_read = np.isfinite(seen).all(axis=1)
    rotation, origin, scale, noise = np.eye(3), np.zeros(3), 1.0, np.array([GUIDE.touch_sigma, GUIDE.reading_sigma])

    def misfits(step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Depths (N,) and the readings' errors (2 K,), m, after a step (7,) along and about the sensor's axes, and of the scale."""
        placed = ((tips - origin) @ rotation - step[:3]) @ rotation_matrix(step[3:6])
        depths = np.array([surface.depth(tip) for tip in placed])
        positions = np.array([surface.contact(tip)[0][:2] for tip in placed])
        errors = positions[is_read] - (scale + step[6]) * seen[is_read]
        return np.where(np.isfinite(depths), depths, surface.size.min()), errors.ravel()

    for _ in range(GUIDE.fit_steps):
        now = misfits(np.zeros(7))
        shifted = [misfits(GUIDE.fit_difference * axis) for axis in np.eye(7)]
        slopes = [(np.column_stack([each[part] for each in shifted]) - now[part][:, None]) / GUIDE.fit_difference for part in (0, 1)]
        supposed = np.r_[rotation.T @ origin, rotation_vector(rotation), scale - 1]
        inverse = np.linalg.inv(sum(slope.T @ slope / sigma**2 for slope, sigma in zip(slopes, noise)) + np.diag(_HAND_SIGMA**-2))
        step = -inverse @ (sum(slope.T @ error / sigma**2 for slope, error, sigma in zip(slopes, now, noise)) + supposed / _HAND_SIGMA**2)
        origin, rotation, scale = origin + rotation @ step[:3], rotation @ rotation_matrix(step[3:6]), scale + step[6]
        noise = np.array([np.sqrt(error @ error / max(len(error) - known, 1)) + GUIDE.min_probe_step
                          for error, known in zip(misfits(np.zeros(7)), (3, 4))])
    delayed = inverse @ slopes[0].sum(axis=0) / noise[0]**2 * np.mean([touch.doubt for touch in touches]) / np.sqrt(12)
    shifts = np.tile(np.eye(2), (is_read.sum(), 1)), (seen[is_read] @ [[0.0, 1.0], [-1.0, 0.0]]).ravel()
    printed = inverse @ slopes[1].T @ (scale * np.column_stack(shifts)) / noise[1]**2 * _PRINT_SIGMA
    variance = np.diag(inverse)
    # Touches of a dome may determine only the centre of its sphere: a tilt about it moves the origin on a circle, which is not linear.
    lever = np.linalg.norm(inverse[:3, 3:6] / variance[3:6], axis=0)
    curved = np.r_[np.full(3, 0.5 * lever @ variance[3:6]), np.zeros(4)]
    sigma = np.sqrt(variance + delayed**2 + (printed**2).sum(axis=1) + curved**2)[:6]
    return Mounting(rotation, origin, np.where(sigma < GUIDE.max_sigma * _HAND_SIGMA[:6], sigma, np.nan))
