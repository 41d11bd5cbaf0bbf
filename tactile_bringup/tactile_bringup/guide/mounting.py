# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What is judged by the sensor's own signal: touches of its known surface by a probe whose place is known, and the pose of the sensor that
fits them, with its error; and presses by hand through the holes of a guide plate, for those without a robot."""
from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tactile_driver.errors import BadArgument
from tactile_perception.common.geometry import rotation_matrix, rotation_vector

from .session import Press, Sample, Session
from .surfaces import Fingertip, MarkedSurface

_PLATEAU = 0.97  # of the largest signal, from which the collar is at the plate. Chosen: a press by hand goes through the last 3 % at once
_UNKNOWN = np.full(6, np.nan)
_COUNT = 12  # touches: four times the three numbers that those of a plane determine
_TRIGGER = 2.0  # times the largest deviation of the untouched signal. Chosen
_ONSET = 4.0  # standard deviations of the untouched signal along the touch's own pattern. Chosen
_COARSE, _STILL = 1e-3, 1e-6  # m, of the probe's way between two images: beyond, a touch says little; below, it did not come by the probe
_LONGEST_S = 10.0  # chosen: a longer touch is a changed light
#: m and rad, standard deviations of a pose that was measured by hand, along and about the sensor's axes; and of the scale of the readings
_BY_HAND = np.array([0.01] * 3 + [0.1] * 3 + [1.0])
_SEEN = 0.5  # of them: an axis that the touches do not know better than this, they do not see
_GAP, _READING = 1e-4, 1e-3  # m, of a touch and of a reading, to begin with
_PRINT = np.array([5e-4, 5e-4, 5e-3])  # m and rad: how well the dots lie on the sensor where they should, which no reading shows. Chosen
_STEPS, _DIFFERENCE = 8, 1e-6  # of Gauss and Newton, and for their slopes, m and rad


@dataclass(frozen=True)
class Touch:
    """tip: (3,) m, of the probe as it first touched, where the sensor is supposed to be; doubt: m, its way between the last signal without
    and the first with the touch; seen: (2,) m, x and y where the sensor says that it was pressed, but for a scale, NaN unknown."""

    tip: np.ndarray
    doubt: float
    seen: np.ndarray


@dataclass(frozen=True)
class Mounting:
    """Pose of the sensor frame in the supposed one: rotation (3, 3), origin (3,) m; sigma: (6,) standard deviations along and about the
    sensor's axes, m and rad, NaN for what the touches do not show: there the pose is the supposed one."""

    rotation: np.ndarray
    origin: np.ndarray
    sigma: np.ndarray

    def __str__(self) -> str:
        parts = (1e3 * self.sigma[:3], np.degrees(self.sigma[3:]))
        texts = [', '.join(f'{axis} {"as given" if np.isnan(value) else f"{value:.2g}"}' for axis, value in zip('xyz', part))
                 for part in parts]
        return f'standard deviations along its axes {texts[0]} mm, about them {texts[1]} degrees'


class Touches(Session):
    """Judges samples in their order, as Session does, by the sensor's own signal: nobody knows yet how deep the probe is.

    signal: from a sample's raw data to a vector (M,) that hardly moves while nothing touches; seen: from untouched raw data (a list) and
    those of the deepest press to Touch.seen. touches: those that count.
    """

    def __init__(self, surface: MarkedSurface | Fingertip, signal: Callable[[object], np.ndarray],
                 seen: Callable[[list, object], np.ndarray]):
        super().__init__(surface)
        self.places = self.places[::max(len(self.places) // _COUNT, 1)][:_COUNT]
        self.touches: list[Touch] = []
        self._signal, self._seen = signal, seen
        self.drop('')

    @property
    def advice(self) -> str:
        """What to touch next."""
        if not self.open_places:
            return 'the surface is touched'
        x, y = 1e3 * self.places[self.open_places[0]]
        return (f'touch {len(self.done) + 1} of {len(self.places)}, to find the sensor: go above about x {x:+.0f}, y {y:+.0f} mm, wait '
                f'{2 * self.rules.untouched:g} s, go down by 1 mm/s until the touch is reported, and lift')

    def drop(self, why: str) -> str:
        """Forget the present touch and the untouched time before it; what is to be reported."""
        self._quiet: deque[tuple[Sample, np.ndarray]] = deque()  # the last untouched seconds
        self._pressed: list[tuple[Sample, np.ndarray]] = []
        return why

    def undo(self) -> None:
        """Take the last touch away."""
        self.touches.pop()
        self.done.pop()

    def add(self, sample: Sample) -> tuple[Press | None, str]:
        """(a press that counts, None of touches; what is to be reported, or '')."""
        self.tip = sample.tip
        new = sample, self._signal(sample.raw)
        if not self._quiet or self._quiet[-1][0].stamp_s - self._quiet[0][0].stamp_s < self.rules.untouched:
            self._quiet.append(new)
            return None, ''
        # The older half of the untouched time: the newer one may hold a touch that is too faint to be seen at once.
        base = np.array([signal for _, signal in list(self._quiet)[:max(len(self._quiet) // 2, 2)]])
        away = np.linalg.norm(new[1] - base.mean(0))
        if away > _TRIGGER * np.linalg.norm(base - base.mean(0), axis=1).max():
            self._pressed.append(new)
            if sample.stamp_s - self._pressed[0][0].stamp_s > _LONGEST_S:
                return None, 'dropped: ' + self.drop(f'the signal has been another one for {_LONGEST_S:g} s: see whether the light changed')
            return None, 'touched; lift' if len(self._pressed) == 2 else ''
        if self._pressed:
            quiet, pressed = list(self._quiet), self._pressed
            self.drop('')
            return self._judged(quiet, pressed, base) if len(pressed) > 1 else (None, 'dropped: the touch was too short')
        self._quiet.append(new)
        while sample.stamp_s - self._quiet[0][0].stamp_s > 2 * self.rules.untouched:
            self._quiet.popleft()
        return None, ''

    def _judged(self, quiet: list[tuple[Sample, np.ndarray]], pressed: list[tuple[Sample, np.ndarray]],
                base: np.ndarray) -> tuple[Press | None, str]:
        """What add returns of the touch that has just ended: the samples before it and in it, and the signals of the first of them."""
        way = quiet[len(base):] + pressed
        # Along the pattern of the touch itself its onset is seen long before it is in the whole signal.
        pattern = pressed[1][1] - base.mean(0)
        pattern /= np.linalg.norm(pattern)
        along = np.array([signal - base.mean(0) for _, signal in way]) @ pattern
        faintest = _ONSET * np.std((base - base.mean(0)) @ pattern)
        first = len(way) - len(pressed)
        while first > 0 and along[first - 1] > faintest:
            first -= 1
        if first == 0:
            return None, 'dropped: it was touched before it was still'
        tips = np.array([sample.tip for sample, _ in way])
        steps = np.linalg.norm(np.diff(tips[first - 1:first + 2], axis=0), axis=1)
        if steps[0] > _COARSE:
            return None, f'dropped: the probe went {1e3 * steps[0]:.1f} mm between two signals as it touched; go down more slowly'
        if steps[0] < _STILL:
            return None, 'dropped: the probe stood still as the sensor was touched; see whether /tf tells its place'
        rise = (along[first + 1] - along[first]) / steps[1] if steps[1] > _STILL else 0.0
        back = along[first] / rise if rise > 0 else 0.5 * steps[0]
        share = 1 - min(back / steps[0], 1.0)
        touched = tips[first - 1] + share * (tips[first] - tips[first - 1])
        down = (tips[first + 1] - tips[first - 1]) / max(np.linalg.norm(tips[first + 1] - tips[first - 1]), _STILL)
        # The deepest one that lies on the way of the touch: after it the probe may have slid.
        straight = [(sample, signal) for sample, signal in pressed if np.linalg.norm(np.cross(sample.tip - touched, down)) < _COARSE]
        deepest = max(straight or pressed, key=lambda each: np.linalg.norm(each[1] - base.mean(0)))
        seen = self._seen([sample.raw for sample, _ in quiet[:len(base)]], deepest[0].raw)
        self.touches.append(Touch(touched, float(steps[0]), seen))
        self.done.append((tips[first][:2], []))
        return None, f'taken: touched within {1e3 * steps[0]:.2f} mm'


class Holes(Touches):
    """Judges samples in their order, as Session does: the hole is told by its number, the depth by the tool's collar. holes: (N, 2) m, in
    the order in which they are pressed; collars: m, depths to which the tool goes in: all holes with the first, then with the next; signal:
    see Touches. Raises BadArgument for holes beside the surface."""

    def __init__(self, surface: MarkedSurface, holes: np.ndarray, collars: Sequence[float], signal: Callable[[object], np.ndarray]):
        super().__init__(surface, signal, lambda *_: np.full(2, np.nan))
        self.places, self._depths, self._count = np.tile(holes, (len(collars), 1)), np.repeat(collars, len(holes)), len(holes)
        outside = [f'{1e3 * x:g} {1e3 * y:g}' for x, y in holes if not surface.holds(np.array([x, y, 0.0]))]
        if outside or not len(holes) or not len(collars) or min(collars) <= self.rules.touching:
            raise BadArgument(f'calibrate_node: holes at {", ".join(outside) or "no"} mm are outside the surface, or collars '
                              f'{list(collars)} are none; give x and y of each hole, m, and depths above {self.rules.touching:g} m')

    @property
    def advice(self) -> str:
        """What to press next."""
        if not self.open_places:
            return 'all holes are pressed'
        number = self.open_places[0]
        return (f'hole {number % self._count + 1}, collar {1e3 * self._depths[number]:g} mm: touch nothing for '
                f'{2 * self.rules.untouched:g} s, press to the collar, hold still for a second, and lift')

    def _judged(self, quiet: list[tuple[Sample, np.ndarray]], pressed: list[tuple[Sample, np.ndarray]],
                base: np.ndarray) -> tuple[Press | None, str]:
        size = np.array([np.linalg.norm(signal - base.mean(0)) for _, signal in pressed])
        held = [sample for (sample, _), part in zip(pressed, size / size.max()) if part > _PLATEAU]
        if held[-1].stamp_s - held[0].stamp_s < self.rules.still or len(held) < self.rules.frames:
            return None, f'dropped: the tool was not held at its collar for {self.rules.still:g} s'
        number = self.open_places[0]
        x, y = self.places[number]
        tip = np.array([x, y, self.surface.depth(np.array([x, y, 0.0])) - self._depths[number]])
        middle = len(held) // 2 - self.rules.frames // 2
        rest = [quiet[k][0] for k in np.unique(np.linspace(0, len(base) - 1, self.rules.rest).astype(int))]
        press = Press([replace(sample, wrench=_UNKNOWN) for sample in rest], holds=[tip])
        press.touched = [replace(sample, tip=tip, wrench=_UNKNOWN) for sample in held[middle:middle + self.rules.frames]]
        return press, f'taken: {1e3 * self._depths[number]:g} mm deep'


def fit_mounting(touches: Sequence[Touch], surface: MarkedSurface | Fingertip) -> Mounting:
    """The pose that puts the touches on the surface and where the sensor saw them: least squares with the supposed pose as prior.

    Noise of touches and of readings is that of their residuals. What moves all of them alike shows in no residual: a delay with which
    touches are seen, taken as somewhere in their doubt, evenly; and dots that are printed beside their place.
    """
    tips, seen = np.array([touch.tip for touch in touches]), np.array([touch.seen for touch in touches])
    told = np.isfinite(seen).all(axis=1)
    rotation, origin, scale, noise = np.eye(3), np.zeros(3), 1.0, np.array([_GAP, _READING])

    def misfits(step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Depths (N,) and the readings' errors (2 K,), m, after a step (7,) along and about the sensor's axes, and of the scale."""
        placed = ((tips - origin) @ rotation - step[:3]) @ rotation_matrix(step[3:6])
        depths = np.array([surface.depth(tip) for tip in placed])
        places = np.array([surface.contact(tip)[0][:2] for tip in placed])
        off = places[told] - (scale + step[6]) * seen[told]
        return np.where(np.isfinite(depths), depths, surface.size.min()), off.ravel()

    for _ in range(_STEPS):
        now = misfits(np.zeros(7))
        moved = [misfits(_DIFFERENCE * axis) for axis in np.eye(7)]
        slopes = [(np.column_stack([each[part] for each in moved]) - now[part][:, None]) / _DIFFERENCE for part in (0, 1)]
        supposed = np.r_[rotation.T @ origin, rotation_vector(rotation), scale - 1]
        inverse = np.linalg.inv(sum(slope.T @ slope / sigma**2 for slope, sigma in zip(slopes, noise)) + np.diag(_BY_HAND**-2))
        step = -inverse @ (sum(slope.T @ off / sigma**2 for slope, off, sigma in zip(slopes, now, noise)) + supposed / _BY_HAND**2)
        origin, rotation, scale = origin + rotation @ step[:3], rotation @ rotation_matrix(step[3:6]), scale + step[6]
        noise = np.array([np.sqrt(off @ off / max(len(off) - known, 1)) + _STILL for off, known in zip(misfits(np.zeros(7)), (3, 4))])
    delayed = inverse @ slopes[0].sum(axis=0) / noise[0]**2 * np.mean([touch.doubt for touch in touches]) / np.sqrt(12)
    aside = np.tile(np.eye(2), (told.sum(), 1)), (seen[told] @ [[0.0, 1.0], [-1.0, 0.0]]).ravel()
    printed = inverse @ slopes[1].T @ (scale * np.column_stack(aside)) / noise[1]**2 * _PRINT
    variance = np.diag(inverse)
    # Of a dome only its sphere's centre may be seen: a tilt about that moves the frame's origin on a circle, too far for a linear fit.
    lever = np.linalg.norm(inverse[:3, 3:6] / variance[3:6], axis=0)
    curved = np.r_[np.full(3, 0.5 * lever @ variance[3:6]), np.zeros(4)]
    sigma = np.sqrt(variance + delayed**2 + (printed**2).sum(axis=1) + curved**2)[:6]
    return Mounting(rotation, origin, np.where(sigma < _SEEN * _BY_HAND[:6], sigma, np.nan))
