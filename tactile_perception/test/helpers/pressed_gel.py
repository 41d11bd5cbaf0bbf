# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots of a simulated gel under a ball, as a tracker would report them, with the truth."""
from dataclasses import dataclass

import numpy as np

from tactile_driver.simulation.gel.contact import GelContact, GelState, Indenter
from tactile_driver.simulation.gel.elements import Material
from tactile_perception.common.dots import DotTracks

METRES = 3e-5  # a pixel
CENTRE = np.array([319.5, 239.5])
FOCAL = 750.0  # px
DISTANCE = FOCAL * METRES  # m, of the camera
STEP = 1e-4  # m, of the ball


@dataclass
class PressedGel:
    """parameters: of the gel, by name; dots: (D, 2) m at rest; states: of the contact, one for each time that it was looked at."""

    parameters: dict
    dots: np.ndarray
    states: list[GelState]
    contact: GelContact
    grid: tuple[int, int]

    def tracks(self, state, rng, noise=0.05, distance=DISTANCE):
        """Tracks of the dots in a state, None for the untouched gel; noise: px."""
        positions = np.pad(self.dots, ((0, 0), (0, 1)))
        if state is not None:
            positions += np.einsum('dipj,pj->di', self.contact.response.matrix(self.dots, state.positions, 'dots'), state.force)
        seen = positions[:, :2] / (1 + positions[:, 2:] / distance)
        rest = self.dots / METRES + CENTRE
        uv = seen / METRES + CENTRE + rng.normal(0, noise, rest.shape)
        count = len(uv)
        return DotTracks(*self.grid, np.arange(count), uv, np.full(count, 40.0), np.full(count, np.nan), uv - rest)


def pressed_gel(rng, pitch=1.5e-3, thickness=4e-3, poisson=0.48, radius=6e-3, half=None, friction=0.5, depth=0.8e-3,
                displacement=(0.0, 0.0), middle=(0.0, 0.0), grid=True, size=(16.5e-3, 12e-3)):
    """Return a gel pressed by a ball (or a stamp of half sides half, m) at middle, m, to depth, m, and then displaced, m.

    It is seen after the press, and after half and all of the displacement.
    """
    material = Material(thickness, 0.1 * thickness, 2.2e5, poisson)
    contact = GelContact(material, Indenter(radius) if half is None else Indenter(0.0, half), friction)
    middle, displacement = np.array(middle), np.array(displacement)
    for part in range(1, 9):
        state = contact.step(middle, depth * part / 8, middle)
    states, steps = [state], max(int(np.ceil(np.hypot(*displacement) / STEP)), 1) if displacement.any() else 0
    for k in range(1, steps + 1):
        state = contact.step(middle + displacement * k / steps, depth, middle + displacement * (k - 1) / steps)
        if k in (steps // 2, steps):
            states.append(state)
    columns, rows = (np.array(size) / pitch).round().astype(int) + 1
    v, u = np.mgrid[:rows, :columns].reshape(2, -1)
    dots = (np.stack([u, v], axis=1) - (np.array([columns, rows]) - 1) / 2) * pitch
    dots += rng.normal(0, 0.03 * pitch, dots.shape) if grid else rng.uniform(-0.3 * pitch, 0.3 * pitch, dots.shape)
    parameters = {'gel.thickness': thickness, 'gel.dot_depth': material.depth, 'gel.young_modulus': material.young,
                  'gel.poisson_ratio': poisson, 'gel.friction': friction, 'gel.scale': METRES, 'gel.pitch': 0.0}
    return PressedGel(parameters, dots, states, contact, (int(rows), int(columns)) if grid else (0, 0))
