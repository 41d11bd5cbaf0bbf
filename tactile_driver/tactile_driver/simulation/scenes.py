# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The scenes of the simulated touchpad, by name: which object does what, when."""
from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..errors import BadArgument
from .camera import mounted_camera
from .membrane import Membrane
from .motion import Key, Motion
from .optics import Lighting
from .pattern import DotPattern
from .rendering import Imaging, Renderer
from .scene import Scene
from .tools import tool_named

Act = tuple[str, list[Key]]

#: s: each scene begins with nothing touching for this long, for whoever takes a reference.
UNTOUCHED = 1.5
#: s: the same where everything is started at once, on a machine that may be busy.
_STARTING = 4.0


@dataclass(frozen=True)
class Script:
    """acts: tool name and keys, one after the other; friction: coefficient; lighting, imaging: what the pictures look like."""

    acts: tuple[Act, ...] = ()
    friction: float = 0.35
    lighting: Lighting = Lighting()
    imaging: Imaging = Imaging()
    duration: float = 0.0


def _act(tool: str, start: float, *places: dict) -> Act:
    """A tool that comes from above at the time start, s, goes through places (Key's fields; t: s after the start) and leaves upwards.

    What a place does not name stays as it was.
    """
    keys = [Key(start, press=0.0)]
    for place in places:
        keys.append(replace(keys[-1], **{**place, 't': start + place['t']}))
    above = {'press': -0.0015}
    return tool, [replace(keys[0], t=start - 0.25, **above), *keys, replace(keys[-1], t=keys[-1].t + 0.25, **above)]


def _rectangle_drag(t: float) -> Act:
    return _act('rectangle', t, {'t': 0.8, 'press': 0.0032}, {'t': 1.1}, {'t': 3.1, 'x': 0.0055}, {'t': 3.4}, {'t': 4.0, 'press': 0.0})


def _disc_twist(t: float) -> Act:
    return _act('disc', t, {'t': 0.7, 'press': 0.0030}, {'t': 1.0}, {'t': 2.6, 'yaw': 0.75}, {'t': 2.9}, {'t': 3.4, 'press': 0.0})


def _ring_press(t: float) -> Act:
    return _act('ring', t, {'t': 0.9, 'press': 0.0030}, {'t': 1.4}, {'t': 2.2, 'y': 0.0018}, {'t': 2.8, 'press': 0.0})


def _sphere_press(t: float) -> Act:
    tool, keys = _act('sphere', t, {'t': 0.8, 'press': 0.0042}, {'t': 1.3}, {'t': 1.9, 'press': 0.0})
    return tool, [replace(key, x=0.003, y=-0.002) for key in keys]


def _sphere_tilt(t: float) -> Act:
    """A ball that rolls across the pad, then turns on the spot."""
    tool, keys = _act('sphere', t, {'t': 0.7, 'press': 0.0036}, {'t': 2.0, 'x': 0.006, 'pitch': 0.75}, {'t': 2.9, 'roll': 0.35},
                      {'t': 3.4, 'press': 0.0})
    return tool, [replace(key, x=key.x - 0.003) for key in keys]


def _impact(t: float) -> Act:
    """A ball that is in and out within a sixth of a second."""
    tool, keys = _act('sphere', t, {'t': 0.07, 'press': 0.0045}, {'t': 0.17, 'press': 0.0})
    return tool, [replace(key, y=0.002) for key in keys]


def _disc_tilt(t: float) -> Act:
    return _act('disc', t, {'t': 0.7, 'press': 0.0024}, {'t': 1.5, 'press': 0.0032, 'pitch': 0.16}, {'t': 2.3, 'pitch': 0.0, 'roll': 0.16},
                {'t': 2.9, 'press': 0.0})


def _prism(t: float) -> Act:
    return _act('prism', t, {'t': 0.8, 'press': 0.0034}, {'t': 1.1}, {'t': 2.1, 'yaw': 0.5}, {'t': 2.7, 'press': 0.0})


def _two_spheres(t: float) -> Act:
    return _act('two_spheres', t, {'t': 0.8, 'press': 0.0034}, {'t': 1.2}, {'t': 1.9, 'y': 0.002}, {'t': 2.5, 'press': 0.0})


def _one_after_the_other(*acts, untouched: float = UNTOUCHED) -> tuple[Act, ...]:
    """The acts, each a second after the one before has gone; untouched: s before the first."""
    played, t = [], untouched + 0.25
    for act in acts:
        played.append(act(t))
        t = played[-1][1][-1].t + 1.25
    return tuple(played)


def _sphere_grid() -> tuple[Act, ...]:
    """Presses of a ball at known places and depths, each from rest."""
    acts, t = [], UNTOUCHED
    for place, (x, y) in enumerate([(x, y) for y in (-0.006, 0.0, 0.006) for x in (-0.006, 0.0, 0.006)]):
        for depth in (0.0015, 0.0030, 0.0045) if place % 2 == 0 else (0.0020, 0.0040):
            above = Key(t, x, y, -0.001)
            pressed = replace(above, t=t + 0.3, press=depth)
            acts.append(('sphere', [above, pressed, replace(pressed, t=t + 0.6), replace(above, t=t + 0.9)]))
            t += 1.1
    return tuple(acts)


SCENES: dict[str, Script] = {
    'demo': Script(_one_after_the_other(_rectangle_drag, _disc_twist, _ring_press, _sphere_tilt, _impact, untouched=_STARTING)),
    'rest': Script(duration=10.0),
    'rectangle_drag': Script(_one_after_the_other(_rectangle_drag)),
    'disc_twist': Script(_one_after_the_other(_disc_twist)),
    'disc_tilt': Script(_one_after_the_other(_disc_tilt)),
    'ring_press': Script(_one_after_the_other(_ring_press)),
    'sphere_press': Script(_one_after_the_other(_sphere_press)),
    'sphere_tilt': Script(_one_after_the_other(_sphere_tilt)),
    'impact': Script(_one_after_the_other(_impact)),
    'prism': Script(_one_after_the_other(_prism)),
    'two_spheres': Script(_one_after_the_other(_two_spheres)),
    'glare': Script(_one_after_the_other(_rectangle_drag), lighting=replace(Lighting(), gloss=900.0, gloss_width=0.02, largest_spot=14.0)),
    'noise': Script(_one_after_the_other(_rectangle_drag), imaging=replace(Imaging(), read_noise=4.0, shot_noise=0.10)),
    'sphere_calibration': Script(_sphere_grid()),
}


def open_scene(name: str = 'demo', rate: float = 30.0, seed: int = 0, width: int = 640, height: int = 480) -> Scene:
    """The scene of that name, at rate frames/s and width x height px.

    seed: of the painted dots' irregularities and the noise. Raises BadArgument for an unknown name (the message lists the known ones), a
    rate that is not positive, or a picture that is not 4 : 3 or under 160 px wide.
    """
    if name not in SCENES:
        raise BadArgument(f'simulation: scene {name!r} is unknown; choose one of {", ".join(sorted(SCENES))}')
    if not 0 < rate < np.inf:
        raise BadArgument(f'simulation: rate is {rate!r}; give frames per second, more than 0')
    if width < 160 or width * 3 != height * 4 or width % 4 or height % 4:
        raise BadArgument(f'simulation: no picture of {width} x {height} px; give 640 x 480, 320 x 240 or another 4 : 3 in multiples of 4')
    script = SCENES[name]
    membrane, camera = Membrane(), mounted_camera(width, height)
    pattern = DotPattern(membrane, camera, np.random.default_rng([seed, 0]))
    motions = [Motion(tool_named(tool), keys, membrane.centre, membrane.radius) for tool, keys in script.acts]
    duration = max([script.duration] + [motion.times[-1] + 0.75 for motion in motions])
    renderer = Renderer(membrane, camera, script.lighting, script.imaging, seed)
    return Scene(motions, duration, rate, script.friction, membrane, camera, pattern, renderer)
