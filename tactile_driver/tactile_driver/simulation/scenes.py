# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The scenes of the simulated touchpad, by name."""
from __future__ import annotations

import numpy as np

from ..errors import BadArgument
from .camera import mounted_camera
from .contact import FrictionalContact
from .membrane import Membrane
from .motion import Key, Motion
from .optics import Lighting
from .pattern import DotPattern
from .rendering import Imaging, Renderer
from .tools import tool_named
from .truth import SimulatedFrame, TruthFrame


class Scene:
    """A touchpad and what happens to it: .camera, .rows, .columns, .rate, .duration s, .render(t)."""

    def __init__(self, name, acts, rate, seed, width, height):
        self.membrane = Membrane()
        self.camera = mounted_camera(width, height)
        self.pattern = DotPattern(self.membrane, self.camera, np.random.default_rng([seed, 0]))
        self.rows, self.columns = self.pattern.rows, self.pattern.columns
        self.renderer = Renderer(self.membrane, self.camera, Lighting(), Imaging(), seed)
        self.contact = FrictionalContact(self.membrane, 0.4)
        self.rate = rate
        self.motions = [Motion(tool_named(n), k, self.membrane.centre, self.membrane.radius) for n, k in acts]
        self.duration = max(m.times[-1] for m in self.motions) + 0.5
        self._at = 0

    def render(self, t: float) -> SimulatedFrame:
        number = int(round(t * self.rate))
        if number < self._at:
            self.contact.reset(); self._at = 0
        while self._at < number:
            a, b = self._at / self.rate, (self._at + 1) / self.rate
            for m in self.motions:
                if m.covers(a) and m.covers(b):
                    self.contact.step(m.tool, m.pose(a), m.pose(b))
            self._at += 1
        shape = self.contact.state.shape
        places, uv, spread = self.pattern.seen(shape, self.camera)
        image = self.renderer.draw(shape, (uv, spread, self.pattern.radius), number)
        k = np.arange(len(uv))
        return SimulatedFrame(image, TruthFrame(k, uv, places, np.zeros(len(uv), np.uint8)))


SCENES = {'demo': [('rectangle', [Key(1, press=-.001), Key(2, press=.0034), Key(2.5, press=.0034), Key(4.5, x=.005, press=.0034), Key(5, x=.005, press=-.002)])]}


def open_scene(name: str = 'demo', rate: float = 30.0, seed: int = 0, width: int = 640, height: int = 480) -> Scene:
    if name not in SCENES:
        raise BadArgument(f'simulation: scene {name!r} is unknown; choose one of {", ".join(sorted(SCENES))}')
    return Scene(name, SCENES[name], rate, seed, width, height)
