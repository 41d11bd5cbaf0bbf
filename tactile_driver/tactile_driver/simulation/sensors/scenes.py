# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The scenes of all simulated camera sensors, by name."""
from __future__ import annotations

import math
from collections.abc import Callable

from ...errors import BadArgument, by_name
from ..scene.scene import Scene, TwoCameraScene
from ..scene.specimen import Script, Shutters, Specimen
from ..skin.tools import TOOLS, Motion
from .air_cushion import AIR_CUSHION_SCENES
from .areal_dual import AREAL_DUAL_SCENES
from .areal_single import AREAL_SINGLE_SCENES
from .gel import GEL_SCENES, GelScene
from .touchpad import TOUCHPAD_SCENES

#: Scenes of the touchpad have plain names; names of other scenes begin with the sensor.
SCENES: dict[str, Script] = {**TOUCHPAD_SCENES, **AREAL_SINGLE_SCENES, **AREAL_DUAL_SCENES, **AIR_CUSHION_SCENES}


def _script(name: str, rate: float) -> Script | Callable[[float, int, int], GelScene]:
    script = by_name(SCENES | GEL_SCENES, name, 'simulation: scene')
    if not 0 < rate < math.inf:
        raise BadArgument(f'simulation: rate is {rate!r}; give frames per second, more than 0')
    return script


def _play(script: Script, specimen: Specimen) -> tuple[list[Motion], float]:
    """The motions of the tools over the specimen, and the duration of the scene, s."""
    motions = [Motion(TOOLS[tool], keys, specimen.skin) for tool, keys in script.acts]
    return motions, max([script.duration] + [motion.times[-1] + 0.75 for motion in motions])


def open_scene(name: str = 'demo', rate: float = 30.0, seed: int = 0, width: int = 640, height: int = 480) -> Scene | GelScene:
    """The scene of that name, for a sensor with one camera, at rate frames/s, with images of width x height px.

    seed: of the irregularities of the specimen and the noise. Raises BadArgument for an unknown name (the message lists the known ones), a
    rate that is not positive and finite, an image size that is not 4 : 3 in multiples of 4 or under 160 px wide, and a sensor with two
    cameras.
    """
    script = _script(name, rate)
    if width < 160 or width * 3 != height * 4 or width % 4 or height % 4:
        raise BadArgument(f'simulation: no picture of {width} x {height} px; give 640 x 480, 320 x 240 or another 4 : 3 in multiples of 4')
    if name in AREAL_DUAL_SCENES:
        raise BadArgument(f'simulation: scene {name!r} is of a sensor with two cameras; dual_camera_node plays it')
    if name in GEL_SCENES:
        return script(rate, seed, width)
    specimen = script.build(seed, width)
    return Scene(specimen, *_play(script, specimen), rate, script.friction)


def open_dual_scene(name: str = 'areal_dual_demo', rate: float = 30.0, seed: int = 0,
                    shutters: Shutters | None = None) -> TwoCameraScene:
    """The scene of that name, for a sensor with two cameras, at rate pairs/s in native size. seed: as in open_scene; shutters: None for
    those of the scene. Raises BadArgument for an unknown name, a rate that is not positive and finite, and a sensor with one camera."""
    script = _script(name, rate)
    if name not in AREAL_DUAL_SCENES:
        two = ', '.join(sorted(AREAL_DUAL_SCENES))
        raise BadArgument(f'simulation: scene {name!r} is of a sensor with one camera; those with two are {two}')
    specimen = script.build(seed)
    return TwoCameraScene(specimen, *_play(script, specimen), rate, script.friction, shutters or script.shutters)
