# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated gel with an opaque skin and printed dots, which an object presses and drags: the mechanics of sensors.gel, which give the
shape of the skin, the displacements of the dots and what slips, under the light of sensors.photometric_gel."""
from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import cv2
import numpy as np

from ..constants import SIMULATION
from ..gel.contact import GelState, Indenter
from ..truth import SimulatedFrame, TruthFrame
from .gel import GEL, GelScene, GelScript, moved
from .photometric_gel import SHADED, Lamps, noisy


class PhotometricShearScene(GelScene):
    """A gel with printed dots and one object, in frames at a fixed rate; see scene.Scene, whose face it has."""

    _where = 'surface'

    def __init__(self, script: GelScript, rate: float, seed: int, width: int):
        super().__init__(script, rate, seed, width)
        rng = np.random.default_rng([seed, 29])
        self.sensor, self._size = 'photometric_gel', (width, width * 3 // 4)
        self.positions[:, 2] = 0.0
        self._lamps, self._seed = Lamps(rng), seed
        self._centre = np.array([321.0, 238.5])
        self._scale = GEL.distance / GEL.focal  # m a native px, of the undeformed skin
        half = np.ceil(np.array(SHADED.native) / 2 * self._scale / self._contact.cell).astype(int) + SIMULATION.margin_cells
        self._first = -half * self._contact.cell
        self._nodes = np.stack(np.meshgrid(*(np.arange(-n, n + 1) * self._contact.cell for n in half)), axis=-1)
        self._untouched = self._drawn(np.zeros((*SHADED.native[::-1], 2), np.float32))
        self._deformed: list[GelState | None] = []

    def _truth(self, state: GelState | None) -> TruthFrame:
        self._deformed.append(state)
        return super()._truth(state)

    def render(self, t: float) -> SimulatedFrame:
        """The frame nearest to time t, s, from the start; the scene repeats after its duration, its noise does not."""
        number = math.floor(t * self.rate + 0.5)
        truth = self.observe(number)
        state = self._deformed[number % self.frames]
        columns, rows = (size // SHADED.cell for size in SHADED.native)
        if state is None:
            image = self._lamps.image(np.zeros((rows, columns), np.float32), self._untouched)
        else:
            depth, shift = self._seen(moved(self._contact.response, self._nodes.reshape(-1, 2), state, 'surface'))
            image = self._lamps.image(cv2.resize(depth, (columns, rows), interpolation=cv2.INTER_AREA), self._drawn(shift))
        return SimulatedFrame(noisy(image, self._size, self._seed, number), truth)

    def _seen(self, displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Depth (480, 640) m of the skin at each pixel, and by how much (480, 640, 2) px the point that it shows has moved in the image.

        A point at x that moves by u along the surface and by d towards the camera is seen where an undeformed one at
        (x + u) D / (D - d) would be, D being the distance of the camera."""
        nodes = displacement.reshape(*self._nodes.shape[:2], 3)
        towards = GEL.distance / (GEL.distance + nodes[..., 2:])
        fields = np.dstack([(self._nodes + nodes[..., :2]) * towards - self._nodes, -nodes[..., 2:]]).astype(np.float32)
        y, x = np.mgrid[:SHADED.native[1], :SHADED.native[0]].astype(np.float32)
        u, v = x, y
        for _ in range(SIMULATION.image_rounds):
            column, row = (((part - middle) * self._scale - first) / self._contact.cell
                           for part, middle, first in zip((u, v), self._centre, self._first))
            found = cv2.remap(fields, column.astype(np.float32), row.astype(np.float32), cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
            u, v = x - found[..., 0] / self._scale, y - found[..., 1] / self._scale
        return found[..., 2], np.dstack([x - u, y - v]).astype(np.float32)

    def _drawn(self, shift: np.ndarray) -> np.ndarray:
        """(480, 640) share of the light that the skin reflects, where what a pixel shows has moved by shift (480, 640, 2) px."""
        ink = np.ones(SHADED.native[::-1], np.float32)
        for position in self.positions[:, :2] / self._scale + self._centre:
            cv2.circle(ink, tuple(int(round(16 * c)) for c in position), int(16 * SIMULATION.gel_dot_radius / self._scale),
                       SIMULATION.gel_dot_albedo, -1, cv2.LINE_AA, 4)
        ink = cv2.GaussianBlur(ink, (0, 0), 1.2)
        y, x = np.mgrid[:SHADED.native[1], :SHADED.native[0]].astype(np.float32)
        return cv2.remap(ink, x - shift[..., 0], y - shift[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)


#: t, s, x, y and depth, m: a ball is pressed, dragged until it slips, and lifted.
_SHEAR = GelScript(Indenter(0.006), [(1.5, -0.002, 0.001, -2e-4), (2.0, -0.002, 0.001, 6e-4), (2.5, -0.002, 0.001, 9e-4),
                                     (3.0, -0.002, 0.001, 9e-4), (4.5, 0.0005, 0.0018, 9e-4), (4.8, 0.0005, 0.0018, 9e-4),
                                     (5.2, 0.0005, 0.0018, -2e-4)])

#: Name -> function of (rate, seed, width in px) that makes the scene.
SHEAR_SCENES: dict[str, Callable[[float, int, int], PhotometricShearScene]] = {
    'photometric_shear': partial(PhotometricShearScene, _SHEAR)}
