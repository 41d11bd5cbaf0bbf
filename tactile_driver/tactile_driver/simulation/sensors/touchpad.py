# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated touchpad and its scenes: a dome filled with red water, 23 x 23 dark dots, a camera behind it."""
from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..optics.camera import CameraDesign, SimulatedCamera
from ..optics.light import Lighting
from ..optics.pattern import DotPattern, uneven
from ..optics.rendering import Imaging, Renderer
from ..scene.specimen import TIMING, Act, Script, Specimen, acting, one_after_the_other, session
from ..skin.surfaces import Membrane
from ..skin.tools import Key


@dataclass(frozen=True)
class TouchpadMade:
    """A touchpad as made."""

    rows: int = 23
    columns: int = 23
    focal: float = 688.0  # px, of the native image
    distance: float = 0.0400  # m, from the camera to the rim plane


PAD = TouchpadMade()


def touchpad_camera(width: int = 640) -> SimulatedCamera:
    """The camera of the touchpad, 40 mm behind the rim; width: of its 4 : 3 images, px."""
    return CameraDesign((PAD.focal, PAD.focal), (321.3, 237.8), (-0.062, 0.018, 4e-4, -3e-4, 0.0), (0.003, -0.004, 0.002),
                        (-0.00012, 0.00008, PAD.distance)).mounted(width)


def touchpad_dots(membrane: Membrane, rng: np.random.Generator) -> DotPattern:
    """Dots with random errors of position and size, evenly spaced in the image of the resting pad."""
    pitch, jitter = 18.8, 0.055e-3
    v, u = np.mgrid[:PAD.rows, :PAD.columns].reshape(2, -1)
    slope = np.stack([(u - (PAD.columns - 1) / 2) * pitch / PAD.focal, (v - (PAD.rows - 1) / 2) * pitch / PAD.focal, np.ones(u.size)],
                     axis=1)
    rays = slope / np.linalg.norm(slope, axis=1, keepdims=True)
    positions = membrane.seen_at_rest(np.array([0, 0, -PAD.distance]), rays)
    positions += rng.normal(0, jitter, positions.shape)
    return DotPattern(membrane, positions, uneven(0.40e-3, 0.05, len(positions), rng), np.arange(len(positions)), PAD.rows, PAD.columns)


def touchpad(seed: int, width: int, lighting: Lighting = Lighting(), imaging: Imaging = Imaging()) -> Specimen:
    """A touchpad. seed: of the irregularities of the dots and the noise; width: of the image, px."""
    membrane, camera = Membrane(), touchpad_camera(width)
    pattern = touchpad_dots(membrane, np.random.default_rng([seed, 0]))
    return Specimen('touchpad', membrane, pattern, (camera,), (Renderer(membrane, camera, lighting, imaging, seed),))


#: Acts of which each is a scene.
_ACTS = {
    'rectangle_drag': acting('rectangle', {'t': 0.8, 'press': 0.0032}, {'t': 1.1}, {'t': 3.1, 'x': 0.0055}, {'t': 3.4},
                             {'t': 4.0, 'press': 0.0}),
    'disc_twist': acting('disc', {'t': 0.7, 'press': 0.0030}, {'t': 1.0}, {'t': 2.6, 'yaw': 0.75}, {'t': 2.9}, {'t': 3.4, 'press': 0.0}),
    'disc_tilt': acting('disc', {'t': 0.7, 'press': 0.0024}, {'t': 1.5, 'press': 0.0032, 'pitch': 0.16},
                        {'t': 2.3, 'pitch': 0.0, 'roll': 0.16}, {'t': 2.9, 'press': 0.0}),
    'ring_press': acting('ring', {'t': 0.9, 'press': 0.0030}, {'t': 1.4}, {'t': 2.2, 'y': 0.0018}, {'t': 2.8, 'press': 0.0}),
    'sphere_press': acting('sphere', {'t': 0.8, 'press': 0.0042}, {'t': 1.3}, {'t': 1.9, 'press': 0.0}, x=0.003, y=-0.002),
    # a ball hits the pad and leaves within 0.17 s
    'impact': acting('sphere', {'t': 0.07, 'press': 0.0045}, {'t': 0.17, 'press': 0.0}, y=0.002),
    'two_spheres': acting('two_spheres', {'t': 0.8, 'press': 0.0034}, {'t': 1.2}, {'t': 1.9, 'y': 0.002}, {'t': 2.5, 'press': 0.0}),
    # two balls, pressed together, then dragged apart along y, one of them deeper; each slips or sticks by itself
    'two_objects': acting('two_spheres', {'t': 0.8, 'press': 0.0034}, {'t': 1.2},
                          {'t': 2.2, 'y': 0.0008, 'other_y': -0.0035, 'other_press': 0.0005}, {'t': 2.5},
                          {'t': 3.1, 'press': 0.0, 'other_press': 0.0}),
    # along the normal, without slip, deeper and deeper (paper touchpad_contact_region, section 4.4)
    **{f'normal_{tool}': acting(tool, {'t': 2.0, 'press': 0.0032}, {'t': 2.4}) for tool in ('rectangle', 'disc', 'ring')},
}
#: A ball rolls across the pad, then rotates in place.
_SPHERE_TILT = acting('sphere', {'t': 0.7, 'press': 0.0036}, {'t': 2.0, 'x': 0.003, 'pitch': 0.75}, {'t': 2.9, 'roll': 0.35},
                      {'t': 3.4, 'press': 0.0}, x=-0.003)


def _sphere_grid() -> tuple[Act, ...]:
    """Presses of a ball at known positions and depths, each from rest."""
    acts, t = [], TIMING.untouched
    for position, (x, y) in enumerate([(x, y) for y in (-0.006, 0.0, 0.006) for x in (-0.006, 0.0, 0.006)]):
        for depth in (0.0015, 0.0030, 0.0045) if position % 2 == 0 else (0.0020, 0.0040):
            above = Key(t, x, y, -0.001)
            pressed = replace(above, t=t + 0.3, press=depth)
            acts.append(('sphere', [above, pressed, replace(pressed, t=t + 0.6), replace(above, t=t + 0.9)]))
            t += 1.1
    return tuple(acts)


#: m, where a session presses.
_SESSION_POSITIONS = [(x, y) for y in (-0.005, 0.0, 0.005) for x in (-0.006, -0.002, 0.002, 0.006)]

#: px of the native image and grey levels.
_REFLECTIONS = ((214.0, 186.0, 3.0, 160.0), (402.0, 205.0, 4.0, 210.0), (310.0, 352.0, 2.5, 120.0))
#: LED glare of the wet skin, specular spots on skin and window, slow gain drift.
_glaring = partial(touchpad, lighting=replace(Lighting(), gloss=900.0, gloss_width=0.01, sheen=0.15, sheen_width=0.05),
                   imaging=replace(Imaging(), reflections=_REFLECTIONS, drift=0.03))

_noisy = partial(touchpad, imaging=replace(Imaging(), read_noise=4.0, shot_noise=0.10))
_DRAG = one_after_the_other([_ACTS['rectangle_drag']])

TOUCHPAD_SCENES: dict[str, Script] = {
    **{name: Script(touchpad, one_after_the_other([play])) for name, play in _ACTS.items()},
    'demo': Script(touchpad, one_after_the_other([_ACTS['rectangle_drag'], _ACTS['disc_twist'], _ACTS['ring_press'], _SPHERE_TILT,
                                                  _ACTS['impact']], untouched=TIMING.starting)),
    'rest': Script(touchpad, duration=10.0),
    'glare': Script(_glaring, _DRAG),
    'glare_rest': Script(_glaring, duration=10.0),
    'noise': Script(_noisy, _DRAG),
    'session': Script(touchpad, one_after_the_other(session('sphere', _SESSION_POSITIONS, 0.0015, 0.0030, 0.0045))),
    'sphere_calibration': Script(touchpad, _sphere_grid()),
}
