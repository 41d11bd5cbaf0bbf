# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated gel with an opaque skin, lit by lamps of three colours beside it, seen by a camera below; with and without printed dots.

The skin is a stretched membrane on an elastic foundation. Where an object presses, it lies on the object; elsewhere its depth d satisfies
d = l^2 laplace(d). A pixel's level is the light of the lamps by Lambert's law, through the camera's response and vignetting.
"""
from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import cv2
import numpy as np

from ..optics.camera import CameraDesign
from ..truth import FramesInOrder, SimulatedFrame, Touch, TruthFrame


@dataclass(frozen=True)
class Photometric:
    """A gel seen by its shading, as GelSight Mini within 10 %: lengths in m."""

    scale: float = 3.0e-5  # on the gel that a pixel of the native image shows
    native: tuple[float, ...] = (640, 480)  # px
    length: float = 0.5e-3  # over which the skin beside an object recovers; of a coat as thick as that
    cell: int = 4  # native px, side of a cell of the membrane
    relaxation: float = 1.8  # of the successive over-relaxation
    turns: int = 120  # further ones change depths by less than 1 um
    spare: int = 64  # px, by which the field of noise is larger than the image, so that it differs from frame to frame
    dot: float = 0.25e-3  # radius of a printed dot
    pitch: float = 2.0e-3  # of printed dots


SHADED = Photometric()


def _ball(x: np.ndarray, y: np.ndarray, radius: float) -> np.ndarray:
    square = x * x + y * y
    return np.where(square < radius**2, radius - np.sqrt(np.maximum(radius**2 - square, 0.0)), np.inf)


#: Name of an object -> function of x, y from its middle and of its radius, m, to its height above its deepest point, m; inf beside it.
SHAPES: dict[str, Callable[[np.ndarray, np.ndarray, float], np.ndarray]] = {
    'ball': _ball,
    'balls': lambda x, y, radius: np.minimum(_ball(x - 1.3 * radius, y, radius), _ball(x + 1.3 * radius, y, radius)),
    'rod': lambda x, y, radius: np.where(x * x + y * y < radius**2, 0.0, np.inf),  # its flat end
    'ring': lambda x, y, radius: np.where(np.abs(np.hypot(x, y) - radius) < radius / 4, 0.0, np.inf),
    'edge': lambda x, y, radius: np.where(np.abs(x) < radius, 0.6 * np.abs(y), np.inf),  # of a blunt wedge, across the gel
}


@dataclass(frozen=True)
class PressScript:
    """presses: x, y and depth in m of the deepest point of the object, each for a time; radius: of the object in m; shape: in SHAPES; dots:
    whether dots are printed on the skin; period: s, of a press and of the pause after it."""

    presses: Sequence[tuple[float, float, float]]
    radius: float = 0.003
    shape: str = 'ball'
    dots: bool = False
    period: float = 0.5


class PhotometricScene(FramesInOrder[TruthFrame]):
    """A gel and one object that presses it at several positions, in frames at a fixed rate; see scene.Scene, whose face it has."""

    sensor = 'photometric_gel'
    rows = columns = 0

    def __init__(self, script: PressScript, rate: float, seed: int, width: int):
        rng = np.random.default_rng([seed, 29])
        self.rate, self._script = rate, script
        self.duration = 1.5 + 2 * script.period * len(script.presses)
        self.frames = max(int(round(self.duration * rate)), 1)
        focal, distance = 760.0, 760.0 * SHADED.scale
        design = CameraDesign((focal, focal), (319.5, 239.5), (0.0,) * 5, (0.0, 0.0, 0.0), (0.0, 0.0, distance), SHADED.native)
        self.camera = design.mounted(width)
        self._size = width, width * 3 // 4
        y, x = np.mgrid[:SHADED.native[1] // SHADED.cell, :SHADED.native[0] // SHADED.cell].astype(float)
        middle = (np.array(SHADED.native) / SHADED.cell - 1) / 2
        self._x, self._y = (x - middle[0]) * SHADED.cell * SHADED.scale, (y - middle[1]) * SHADED.cell * SHADED.scale
        self._light = Lamps(rng)
        self._ink = _printed(rng) if script.dots else np.ones(SHADED.native[::-1], np.float32)
        self._seed = seed
        self._known: list[TruthFrame] = []
        self._depths: list[np.ndarray] = []

    def render(self, t: float) -> SimulatedFrame:
        """The frame nearest to time t, s, from the start; the scene repeats after its duration, its noise does not."""
        number = math.floor(t * self.rate + 0.5)
        truth = self.observe(number)
        image = self._light.image(self._depths[number % self.frames], self._ink)
        return SimulatedFrame(noisy(image, self._size, self._seed, number), truth)

    def _next(self) -> TruthFrame:
        """The truth of the next frame; its depths are kept."""
        t = len(self._known) / self.rate - 1.0
        which, phase = divmod(t / self._script.period, 2)
        depth, truth = np.zeros(self._x.shape), TruthFrame()
        if t >= 0 and which < len(self._script.presses) and phase < 1:
            x, y, deepest = self._script.presses[int(which)]
            deepest *= math.sin(math.pi * phase)
            if deepest > 1e-6:
                depth, on = self._pressed(x, y, deepest)
                self._describe(truth, depth, on, (x, y, deepest))
        self._depths.append(depth.astype(np.float32))
        return truth

    def _pressed(self, x: float, y: float, deepest: float) -> tuple[np.ndarray, np.ndarray]:
        """Depth of the skin (rows, columns), and where it lies on the object: the obstacle problem by projected over-relaxation."""
        near = self._near(x, y)
        height = SHAPES[self._script.shape](self._x[near] - x, self._y[near] - y, self._script.radius)
        obstacle = np.maximum(deepest - height, -1.0)
        depth = np.maximum(obstacle, 0.0)
        stiffness = (SHADED.cell * SHADED.scale / SHADED.length)**2
        even = (np.add.outer(*map(np.arange, depth.shape)) % 2).astype(bool)
        for _ in range(SHADED.turns):
            for half in (even, ~even):
                wide = np.pad(depth, 1, mode='edge')
                relaxed = (wide[1:-1, 2:] + wide[1:-1, :-2] + wide[2:, 1:-1] + wide[:-2, 1:-1]) / (4 + stiffness)
                depth = np.where(half, np.maximum(depth + SHADED.relaxation * (relaxed - depth), np.maximum(obstacle, 0.0)), depth)
        whole, on = np.zeros(self._x.shape), np.zeros(self._x.shape, bool)
        whole[near], on[near] = depth, depth <= obstacle + 1e-9
        return whole, on

    def _near(self, x: float, y: float) -> tuple[slice, slice]:
        """Rows and columns of the cells that an object at x, y, m, moves by more than 0.2 % of its depth."""
        reach = 2.3 * self._script.radius + 6 * SHADED.length
        rows, columns = (np.flatnonzero(np.abs(axis - at) < reach) for axis, at in ((self._y[:, 0], y), (self._x[0], x)))
        return slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)

    def _describe(self, truth: TruthFrame, depth: np.ndarray, on: np.ndarray, pressed: tuple[float, float, float]) -> None:
        """Fill in the truth of a press."""
        x, y, _ = pressed
        cell, deepest = SHADED.cell * SHADED.scale, float(depth.max())  # an edge between two cells is less deep
        truth.area, truth.normal = float(on.sum()) * cell**2, np.array([0.0, 0.0, 1.0])
        truth.centroid = np.array([self._x[on].mean(), self._y[on].mean(), -depth[on].mean()])
        truth.contacts = [Touch(np.array([x, y, -deepest if self._script.shape != 'ring' else np.nan]), truth.normal, deepest, np.nan)]
        truth.wrench = np.full(6, np.nan)
        lines, family = cv2.findContours(on.astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
        for line, kin in zip(lines, family[0] if family is not None else ()):
            column, row = line[:, 0].T
            (truth.holes if kin[3] >= 0 else truth.outlines).append(
                np.column_stack([self._x[row, column], self._y[row, column], -depth[row, column]]))


class Lamps:
    """Three lamps, of mostly one colour each, at the borders of the gel, and light from everywhere."""

    def __init__(self, rng: np.random.Generator):
        angle = rng.uniform(0, 2 * np.pi) + np.arange(3) * 2 * np.pi / 3 + rng.normal(0, 0.1, 3)
        lamps = np.stack([0.014 * np.cos(angle), 0.014 * np.sin(angle), np.full(3, 0.008)], axis=1)  # m; below the skin
        self._colour = np.full((3, 3), 0.12) + np.diag(rng.uniform(0.8, 1.0, 3))
        self._ambient = rng.uniform(25, 40, 3)
        self._gamma = rng.uniform(0.8, 0.95)
        y, x = np.mgrid[:SHADED.native[1], :SHADED.native[0]].astype(np.float32)
        x, y = (x - 319.5) * SHADED.scale, (y - 239.5) * SHADED.scale
        self._vignette = (1 / (1 + (x**2 + y**2) / 0.02**2)).astype(np.float32)
        offsets = [(at[0] - x, at[1] - y, np.full_like(x, at[2])) for at in lamps]
        #: (3 lamps, 3, 480, 640): vector to a lamp over the cube of the distance, in units that give levels
        self._towards = np.array([6.0e-5 * np.stack(one) / np.sqrt(sum(c * c for c in one))**3 for one in offsets], np.float32)
        self._untouched = self._levels(np.zeros((2, *x.shape), np.float32), (slice(None), slice(None)))

    def image(self, depth: np.ndarray, ink: np.ndarray) -> np.ndarray:
        """(480, 640, 3) float32 levels of a skin of depth (120, 160) m, printed with ink, the share of light that it reflects."""
        image = self._untouched.copy()
        rows, columns = (np.flatnonzero(depth.any(axis=axis)) for axis in (1, 0))
        if len(rows):
            near = tuple(slice(max(int(at[0]) - 1, 0), int(at[-1]) + 2) for at in (rows, columns))
            fine = tuple(slice(SHADED.cell * part.start, min(SHADED.cell * part.stop, size))
                         for part, size in zip(near, SHADED.native[::-1]))
            size = fine[1].stop - fine[1].start, fine[0].stop - fine[0].start
            surface = cv2.resize(depth[near], size, interpolation=cv2.INTER_CUBIC)
            slope = np.stack([cv2.Sobel(surface, cv2.CV_32F, *axes, scale=1 / (8 * SHADED.scale)) for axes in ((1, 0), (0, 1))])
            image[fine] = self._levels(slope, fine)
        return image * ink[..., None]

    def _levels(self, slope: np.ndarray, part: tuple[slice, slice]) -> np.ndarray:
        """Levels (h, w, 3) of a part of the image, whose skin has slopes (2, h, w) of depth along x and y.

        The camera looks along the normal, and depth goes towards it: a slope towards a lamp gets less of its light."""
        steep = np.sqrt(1 + slope[0]**2 + slope[1]**2)
        light = sum(np.multiply.outer(np.maximum(to[2] - to[0] * slope[0] - to[1] * slope[1], 0.0) / steep, colour.astype(np.float32))
                    for to, colour in zip(self._towards[:, :, part[0], part[1]], self._colour))
        levels = self._ambient.astype(np.float32) + 340 * light**np.float32(self._gamma)
        return (levels * self._vignette[part][..., None]).astype(np.float32)


@lru_cache(maxsize=2)
def _noise_of(size: tuple[int, int], seed: int) -> np.ndarray:
    """(H, W, 3) white noise, larger than images of this width and height."""
    return np.random.default_rng([seed, 37]).standard_normal((size[1] + SHADED.spare, size[0] + SHADED.spare, 3), np.float32)


def noisy(image: np.ndarray, size: tuple[int, int], seed: int, number: int) -> np.ndarray:
    """(H, W, 3) uint8 of levels (480, 640, 3): an image of this width and height, with the noise of a camera, in the frame of a number."""
    if size != SHADED.native:
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    row, column = np.random.default_rng([number, 31]).integers(0, SHADED.spare, 2)
    noise = _noise_of(size, seed)[row:row + image.shape[0], column:column + image.shape[1]]
    return np.clip(image + noise * np.sqrt(1.0 + 0.02 * image) + 0.5, 0, 255).astype(np.uint8)


def _printed(rng: np.random.Generator) -> np.ndarray:
    """(480, 640) float32 share of light that a skin with printed dots reflects."""
    ink = np.ones(SHADED.native[::-1], np.float32)
    for y in np.arange(-0.006, 0.0061, SHADED.pitch):
        for x in np.arange(-0.008, 0.0081, SHADED.pitch):
            at = np.array([x, y]) / SHADED.scale + (319.5, 239.5) + rng.normal(0, 1.0, 2)
            cv2.circle(ink, tuple(int(round(16 * c)) for c in at), int(16 * SHADED.dot / SHADED.scale), 0.3, -1, cv2.LINE_AA, 4)
    return cv2.GaussianBlur(ink, (0, 0), 1.2)


def _spread(count: int, depth: float) -> list[tuple[float, float, float]]:
    """Positions all over the gel, by a sunflower's spiral, and depths from 0.6 to 1 of the given one."""
    turn = math.pi * (3 - math.sqrt(5))
    return [(0.0072 * math.sqrt((k + 0.5) / count) * math.cos(k * turn), 0.0052 * math.sqrt((k + 0.5) / count) * math.sin(k * turn),
             depth * (0.6 + 0.4 * (k % 3) / 2)) for k in range(count)]


_DEMO = PressScript(((-0.003, 0.001, 6e-4), (0.002, -0.002, 9e-4), (0.004, 0.002, 4e-4)), radius=0.0035)

#: Name -> function of (rate, seed, width in px) that makes the scene.
PHOTOMETRIC_SCENES: dict[str, Callable[[float, int, int], PhotometricScene]] = {
    name: partial(PhotometricScene, script) for name, script in {
        'photometric_demo': _DEMO,
        'photometric_dots': replace(_DEMO, dots=True),
        'photometric_ring': replace(_DEMO, radius=0.0016, shape='ring'),
        'photometric_stamp': replace(_DEMO, radius=0.0018, shape='rod'),
        'photometric_calib': PressScript(_spread(20, 8e-4), radius=0.0025),
        'photometric_dots_calib': PressScript(_spread(20, 8e-4), radius=0.0025, dots=True),
    }.items()}
