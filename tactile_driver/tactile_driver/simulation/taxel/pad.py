# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A soft pad on a taxel array: an elastic layer under friction, bonded to the sheet, and pressure sensitive ink."""
from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from scipy import fft


@dataclass(frozen=True)
class PadMechanics:
    """How a pad passes tractions and pressures on."""

    along: float = 2.1  # c along the wave, of a layer of Poisson's ratio 0.45 that is free to rise: within 3 % up to k h = 2, 15 % beyond
    margin: float = 1.5  # thicknesses around a contact, beyond which nothing moves: over twice of that a shear wave falls to 1 %
    max_rounds: int = 60  # of a step: continued in the next one
    converged: float = 5e-3  # of the largest motion in a step, error of a displacement
    min_error: float = 1e-8  # m, the same
    tiny: float = 1e-3  # Pa, against a division by zero
    fine: int = 2  # positions of the surface along the side of a taxel
    points: tuple[float, ...] = (34, 21)  # in a position at a border, and their lattice: no two lie in a row or column (Fibonacci numbers)
    shifted: float = 0.24  # of the load of a position, by friction
    spread: float = 0.76  # of it, that arises around instead
    spread_thicknesses: float = 1.54  # so far: an elastic layer's response by wave number, Poisson's ratio 0.4 to 0.49, within 0.05
    slips: float = 0.02  # of the farthest motion in a step, from which a position slips: above what is left to converge
    hysteresis_pa: float = 1.2e4  # change of a load after which the ink holds back no more of it: a tenth of the range


PAD = PadMechanics()

# A traction wave of wave number k displaces the surface of a layer of thickness h by less than an even traction: across the wave by 1 /
# (k h coth k h) of it, which is exact, along it by about 1 / (c k h coth c k h). So neighbours move together, and the border of a contact
# is held by the rubber around it: there traction is largest, and slip begins.


class BondedLayer:
    """pull: N/m^3, stiffness under an even traction; reach: thickness in cells; attribute traction: (rows, columns, 2) Pa on the surface;
    shift: (rows, columns, 2) m of the surface."""

    def __init__(self, shape: tuple[int, int], reach: float, pull: float):
        self._reach, self._pull = reach, pull
        self._softness: dict[tuple[int, int], np.ndarray] = {}
        self.traction, self.shift, self._went = (np.zeros((*shape, 2)) for _ in range(3))

    def move(self, wanted: np.ndarray, limit: np.ndarray) -> None:
        """Move the surface to wanted (rows, columns, 2) m where friction allows: traction stays within limit (rows, columns) Pa, 0 where
        nothing touches. Fast iterative projected gradients (Beck and Teboulle 2009), restarted where they overshoot. They start from the
        traction extrapolated from the last step."""
        before, largest = self.traction.copy(), np.abs(np.where(limit[..., None] > 0, wanted - self.shift, 0)).max()
        if not largest and not before.any():
            return
        self.traction[:], self.shift[:] = 0, 0
        loaded = np.flatnonzero(limit.any(axis=1)), np.flatnonzero(limit.any(axis=0))
        if len(loaded[0]):
            margin = math.ceil(PAD.margin * self._reach)
            box = tuple(slice(max(at[0] - margin, 0), at[-1] + margin + 1) for at in loaded)
            softness = self._of(tuple(16 * math.ceil((at[-1] - at[0] + 1 + 2 * margin) / 16) for at in loaded))
            wanted, start = (np.moveaxis(field[box], -1, 0).astype(np.float32, order='C')
                                   for field in (wanted, before + self._went))
            error = max(PAD.converged * largest, PAD.min_error)
            held = self._settled(start, wanted, limit[box].astype(np.float32), softness, error * self._pull)
            self.traction[box] = np.moveaxis(held, 0, -1)
            self.shift[box] = np.moveaxis(self._moved(held, softness), 0, -1)
        self._went = self.traction - before

    def _settled(self, start: np.ndarray, wanted: np.ndarray, limit: np.ndarray, softness: np.ndarray, error: float) -> np.ndarray:
        """Traction (2, rows, columns) Pa, within error, that moves the surface to wanted where limit allows; start: a guess."""
        held = ahead = _within(start, limit)
        pace = 1.0
        for _ in range(PAD.max_rounds):
            last, held = held, _within(ahead + self._pull * (wanted - self._moved(ahead, softness)), limit)
            if np.abs(held - ahead).max() < error:
                break
            change = held - last
            if np.vdot(ahead - held, change) > 0:
                pace = 1.0
            before, pace = pace, 0.5 + math.sqrt(0.25 + pace * pace)
            ahead = held + (before - 1) / pace * change
        return held

    def _moved(self, traction: np.ndarray, softness: np.ndarray) -> np.ndarray:
        """m (2, rows, columns) of the surface under traction of that shape."""
        rows, columns = traction.shape[1:]
        size = softness.shape[-2], 2 * (softness.shape[-1] - 1)
        wave = fft.rfft2(traction, size)
        wave = np.stack([softness[0] * wave[0] + softness[1] * wave[1], softness[1] * wave[0] + softness[2] * wave[1]])
        return fft.irfft2(wave, size)[:, :rows, :columns]

    def _of(self, size: tuple[int, int]) -> np.ndarray:
        """m/Pa (3, rows, columns) xx, xy, yy of each wave in size cells."""
        if size not in self._softness:
            y, x = np.meshgrid(2 * np.pi * np.fft.fftfreq(size[0]), 2 * np.pi * np.fft.rfftfreq(size[1]), indexing='ij')
            length = np.hypot(x, y)
            across, along = (_softness(factor * length * self._reach) / self._pull for factor in (1.0, PAD.along))
            square = np.where(length > 0, length**2, 1)
            self._softness[size] = np.stack([across + (along - across) * x * x / square, (along - across) * x * y / square,
                                             across + (along - across) * y * y / square]).astype(np.float32)
        return self._softness[size]


def _softness(wave: np.ndarray) -> np.ndarray:
    """tanh(w) / w of wave numbers w times thickness."""
    return np.divide(np.tanh(wave), wave, out=np.ones_like(wave), where=wave > 0)


def _within(traction: np.ndarray, limit: np.ndarray) -> np.ndarray:
    """traction (2, rows, columns) cut to the length limit (rows, columns)."""
    return traction * np.minimum(limit / np.maximum(np.hypot(*traction), PAD.tiny), 1)


# under friction; its loads spread in the pad, which is bonded to the sheet; pressure sensitive ink converts load to counts, with gains,
# offsets, noise, hysteresis and dead rows. The sensor has 44 x 44 taxels.

#: Height of the face above its contact point, m, inf outside the face, at x, y (m) in the object frame.
Face = Callable[[np.ndarray, np.ndarray], np.ndarray]


def _flat(inside: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Face:
    return lambda x, y: np.where(inside(x, y), 0.0, np.inf)


def _box(x, y, length: float, width: float):
    return (np.abs(x) <= length / 2) & (np.abs(y) <= width / 2)


FACES: dict[str, Face] = {
    'bar': _flat(lambda x, y: _box(x, y, 0.024, 0.010)),
    'disc': _flat(lambda x, y: np.hypot(x, y) <= 0.010),
    'ring': _flat(lambda x, y: (np.hypot(x, y) <= 0.012) & (np.hypot(x, y) >= 0.006)),
    'l': _flat(lambda x, y: _box(x + 0.006, y, 0.008, 0.024) | _box(x, y + 0.008, 0.020, 0.008)),
    'edge': _flat(lambda x, y: (x >= 0) & (np.abs(x) < 0.1) & (np.abs(y) < 0.1)),
    'sphere': lambda x, y: np.where(np.hypot(x, y) < 0.03, 0.03 - np.sqrt(np.maximum(0.03**2 - x * x - y * y, 0)), np.inf),
    'roller': lambda x, y: np.where((np.abs(y) < 0.008) & (np.abs(x) < 0.02), x * x / 0.06, np.inf),
    'two_fingers': _flat(lambda x, y: (np.hypot(x - 0.009, y) <= 0.006) | (np.hypot(x + 0.009, y) <= 0.006)),
}


_NEIGHBOURS = np.ones((3, 3), np.uint8)
# Friction on the face of a pad that is bonded to the sheet moves the load there by the thickness times friction over pressure, which keeps
# the balance of moments: a part of it moves a position's load, the rest arises around, spread by so many thicknesses: an elastic
# layer's response by wave number, for Poisson's ratios of 0.4 to 0.49, within 0.05.


@dataclass(frozen=True)
class PadSpecimen:
    """rows, columns, pitch (m): of the taxels; thickness: of the pad, m; press: N/m^3, normal stiffness per area; pull: N/m^3, tangential
    stiffness per area under an even traction; grip: coefficient of friction; spread: m, standard deviation of a load in the sheet."""

    rows: int = 44
    columns: int = 44
    pitch: float = 1e-3
    thickness: float = 2e-3
    press: float = 1.4e8
    pull: float = 5.2e7
    grip: float = 0.55
    spread: float = 0.75e-3


@dataclass(frozen=True)
class InkSpecimen:
    """counts_per_pascal: mean gain; uneven: standard deviation of the taxels' gains; offset: mean untouched counts; noise: standard
    deviation, counts; loop: part of a change of load that is held back; memory: part of a load that is shown late; fades: s, in which
    both are lost; bits: of the converter."""

    counts_per_pascal: float = 1 / 500
    uneven: float = 0.05
    offset: float = 1.8
    noise: float = 0.6
    loop: float = 0.08
    memory: float = 0.02
    fades: float = 0.8
    bits: int = 8


#: Another sensor: stiffer pad, rougher, of noisier ink with wider hysteresis.
DEVICE_B = (PadSpecimen(press=1.9e8, pull=7.4e7, grip=0.75, spread=0.9e-3), InkSpecimen(1 / 420, 0.09, 3.0, 0.9, 0.16, 0.04, 0.5))


@dataclass(frozen=True)
class PadState:
    """State of the M positions of the surface. pressure: (M,) Pa; traction: (M, 2) Pa along the surface; covered: (M,) part of each that
    is touched; slipping: (M,) bool, of those that are touched by half or more."""

    pressure: np.ndarray
    traction: np.ndarray
    covered: np.ndarray
    slipping: np.ndarray

    @property
    def touched(self) -> np.ndarray:
        """(M,) bool: whether half of a position or more is touched."""
        return self.covered >= 0.5


class RubberPad:
    """The pad of a specimen, moved in small steps. Attributes: positions: (M, 2) m, of the surface at rest; cell: m^2, area of each."""

    def __init__(self, specimen: PadSpecimen):
        self.specimen = specimen
        step = specimen.pitch / PAD.fine
        y = (np.arange(specimen.rows * PAD.fine) - 0.5 * (specimen.rows * PAD.fine - 1)) * step
        x = (np.arange(specimen.columns * PAD.fine) - 0.5 * (specimen.columns * PAD.fine - 1)) * step
        self.positions = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        self.cell = step**2
        self._layer = BondedLayer((len(y), len(x)), specimen.thickness / step, specimen.pull)
        number = np.arange(PAD.points[0])
        count, lattice = PAD.points
        self._points = step * (np.column_stack([number, number * lattice % count]) / count - 0.5 + 0.5 / count)
        self._met = np.full(self.positions.shape, np.nan)  # point of the object that a position sticks to, in the object frame

    def move(self, face: Face, pose: np.ndarray, depth: float, tilt: np.ndarray = np.zeros(2)) -> PadState:
        """Move the object with that face to pose (x, y: m, turn: rad), its contact point depth, m, below the resting surface; tilt: (2,)
        slopes of the object along x and y, about its contact point."""
        cosine, sine = np.cos(pose[2]), np.sin(pose[2])
        turn = np.array([[cosine, -sine], [sine, cosine]])
        pressed, covered = self._pressed(lambda at: depth - face(*((at - pose[:2]) @ turn).T) - (at - pose[:2]) @ tilt, depth)
        touched = pressed > 0
        pressure = self.specimen.press * pressed
        shift, traction = self._layer.shift.reshape(-1, 2), self._layer.traction.reshape(-1, 2)
        self._met[~touched] = np.nan
        fresh = touched & np.isnan(self._met[:, 0])
        self._met[fresh] = (self.positions[fresh] + shift[fresh] - pose[:2]) @ turn
        wanted = np.where(touched[:, None], self._met @ turn.T + pose[:2] - self.positions, 0)
        went, limit = wanted - shift, self.specimen.grip * pressure
        shape = self._layer.shift.shape
        self._layer.move(wanted.reshape(shape), limit.reshape(shape[:2]))
        slid = wanted - shift
        slips = touched & (np.hypot(*traction.T) >= limit * (1 - 1e-5))
        self._met[slips] -= slid[slips] @ turn
        slipping = slips & (np.hypot(*slid.T) > PAD.slips * np.hypot(*went[touched].T).max(initial=0))
        return PadState(pressure, traction.copy(), covered, slipping & (covered >= 0.5))

    def _pressed(self, depth_at: Callable[[np.ndarray], np.ndarray], depth: float) -> tuple[np.ndarray, np.ndarray]:
        """Mean depth (M,), m, and touched part (M,) of each position, by the depth at points (N, 2); a position at a border is looked at in
        many points, else straight edges along the rows would touch a whole row at once. depth: the largest."""
        pressed = np.maximum(depth_at(self.positions), 0) if depth > 0 else np.zeros(len(self.positions))
        covered = (pressed > 0).astype(float)
        image = covered.reshape(self._layer.traction.shape[:2])
        border = np.flatnonzero(cv2.dilate(image, _NEIGHBOURS) > cv2.erode(image, _NEIGHBOURS))
        inside = np.maximum(depth_at((self.positions[border, None] + self._points).reshape(-1, 2)).reshape(-1, len(self._points)), 0)
        pressed[border], covered[border] = inside.mean(axis=1), (inside > 0).mean(axis=1)
        return pressed, covered

    def felt(self, state: PadState) -> np.ndarray:
        """Mean pressure (rows, columns), Pa, on each taxel."""
        s = self.specimen
        load = state.pressure * self.cell
        lean = np.zeros_like(state.traction)
        np.divide(state.traction * s.thickness, state.pressure[:, None], out=lean, where=state.pressure[:, None] > 0)
        shape, touched = (s.rows * PAD.fine, s.columns * PAD.fine), state.pressure > 0
        feet = self.positions / (s.pitch / PAD.fine) + 0.5 * np.array([s.columns * PAD.fine - 1, s.rows * PAD.fine - 1])
        lean *= PAD.fine / s.pitch
        image = _splat((feet + PAD.shifted * lean)[touched], load[touched], shape)
        image = cv2.GaussianBlur(image, (0, 0), s.spread / s.pitch * PAD.fine, borderType=cv2.BORDER_CONSTANT)
        more = _splat((feet + PAD.spread * lean)[touched], load[touched], shape) - _splat(feet[touched], load[touched], shape)
        image += cv2.GaussianBlur(more, (0, 0), PAD.spread_thicknesses * s.thickness / s.pitch * PAD.fine, borderType=cv2.BORDER_CONSTANT)
        return cv2.resize(image, (s.columns, s.rows), interpolation=cv2.INTER_AREA) * (PAD.fine**2 / s.pitch**2)

    def force(self, state: PadState) -> np.ndarray:
        """Wrench (6,), N and N m, of the object on the pad, about the centre of its surface at rest."""
        pushed = np.column_stack([state.traction, -state.pressure]) * self.cell
        (x, y), z = self.positions.T, -state.pressure / self.specimen.press
        moment = [y @ pushed[:, 2] - z @ pushed[:, 1], z @ pushed[:, 0] - x @ pushed[:, 2], x @ pushed[:, 1] - y @ pushed[:, 0]]
        return np.concatenate([pushed.sum(axis=0), moment])


def _splat(feet: np.ndarray, load: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Image of shape (rows, columns), float32, of loads (M,) at feet (M, 2), (column, row), distributed bilinearly."""
    base = np.floor(feet).astype(int)
    part = feet - base
    image = np.zeros(shape[0] * shape[1])
    for right in (0, 1):
        for down in (0, 1):
            column, row = base[:, 0] + right, base[:, 1] + down
            weight = load * np.abs(1 - right - part[:, 0]) * np.abs(1 - down - part[:, 1])
            inside = (column >= 0) & (column < shape[1]) & (row >= 0) & (row < shape[0])
            image += np.bincount(row[inside] * shape[1] + column[inside], weight[inside], len(image))
    return image.reshape(shape).astype(np.float32)


class Ink:
    """Pressure sensitive ink. shape: (rows, columns); seed: of irregularities and noise; rate: frames/s; dead_rows: rows that read 0."""

    def __init__(self, shape: tuple[int, int], seed: int, rate: float, specimen: InkSpecimen = InkSpecimen(),
                 dead_rows: tuple[int, ...] = ()):
        rng = np.random.default_rng([seed, 17])
        self._gain = specimen.counts_per_pascal * np.clip(rng.normal(1, specimen.uneven, shape), 0.7, 1.3)
        self._offset = rng.gamma(1.2, specimen.offset / 1.2, shape)
        self._noise, self._sigma = np.random.default_rng([seed, 23]), specimen.noise
        self._largest, self._dead = 2**specimen.bits - 1, list(dead_rows)
        self._loop, self._memory = specimen.loop, specimen.memory
        self._fades = 1 - np.exp(-1 / (rate * specimen.fades))
        self._held, self._late, self._last = np.zeros(shape), np.zeros(shape), np.zeros(shape)

    def read(self, load: np.ndarray) -> np.ndarray:
        """Counts (rows, columns), uint8 or uint16, of load (rows, columns), Pa. Depends on earlier loads: the grains of the ink rub against
        each other (Dahl 1968), and a part follows late."""
        change, self._last = load - self._last, load
        limit = np.copysign(PAD.hysteresis_pa, change)
        self._held = limit - (limit - self._held) * np.exp(-np.abs(change) / PAD.hysteresis_pa)
        self._held -= self._fades * self._held
        self._late += self._fades * (load - self._late)
        shown = load - self._loop * self._held + self._memory * (self._late - load)
        value = self._gain * np.maximum(shown, 0) + self._offset + self._noise.normal(0, self._sigma, load.shape)
        whole = np.clip(np.round(value), 0, self._largest)
        whole[self._dead] = 0
        return whole.astype(np.uint8 if self._largest < 256 else np.uint16)
