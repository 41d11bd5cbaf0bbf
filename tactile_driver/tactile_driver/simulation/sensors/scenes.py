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
from .gel import GEL_SCENES as _GEL_SCENES, GelScene
from .photometric_gel import PHOTOMETRIC_SCENES
from .photometric_shear import SHEAR_SCENES
from .touchpad import TOUCHPAD_SCENES

#: Scenes of the touchpad have plain names; names of other scenes begin with the sensor.
SCENES: dict[str, Script] = {**TOUCHPAD_SCENES, **AREAL_SINGLE_SCENES, **AREAL_DUAL_SCENES, **AIR_CUSHION_SCENES}

#: Scenes of gels, with dots or without: name -> function of (rate, seed, width in px) that makes the scene.
GEL_SCENES = {**_GEL_SCENES, **PHOTOMETRIC_SCENES, **SHEAR_SCENES}


def _script(name: str, rate: float) -> Script | Callable[[float, int, int], GelScene]:
    script = by_name(SCENES | GEL_SCENES, name, 'simulation: scene')
    if not 0 < rate < math.inf:
        raise BadArgument(f'simulation: rate is {rate!r}; give frames per second, more than 0')
    return script


def _play(script: Script, specimen: Specimen) -> tuple[list[Motion], float]:
    """Return the motions of the tools over the specimen, and the duration of the scene, in s."""
    motions = [Motion(TOOLS[tool], keys, specimen.skin) for tool, keys in script.acts]
    return motions, max([script.duration] + [motion.times[-1] + 0.75 for motion in motions])


def open_scene(name: str = 'demo', rate: float = 30.0, seed: int = 0, width: int = 640, height: int = 480) -> Scene | GelScene:
    """Make a scene of a sensor with one camera.

    Parameters
    ----------
    name : str
        Name of the scene.
    rate : float
        Frames per second.
    seed : int
        Of the irregularities of the specimen and the noise.
    width, height : int
        Size of the images, in px: 4 : 3 in multiples of 4, and at least 160 px wide.

    Returns
    -------
    Scene or GelScene
        The scene, whose frames hold images and their truth.

    Raises
    ------
    BadArgument
        For an unknown name (the message lists the known ones), another rate or size, and a sensor with two cameras.
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
    """Make a scene of a sensor with two cameras, in native size.

    Parameters
    ----------
    name : str
        Name of the scene.
    rate : float
        Pairs per second.
    seed : int
        As in `open_scene`.
    shutters : Shutters, optional
        Times at which the cameras expose; by default those of the scene.

    Returns
    -------
    TwoCameraScene
        The scene, whose frames hold pairs of images and their truth.

    Raises
    ------
    BadArgument
        For an unknown name, a rate that is not positive and finite, and a sensor with one camera.
    """
    script = _script(name, rate)
    if name not in AREAL_DUAL_SCENES:
        two = ', '.join(sorted(AREAL_DUAL_SCENES))
        raise BadArgument(f'simulation: scene {name!r} is of a sensor with one camera; those with two are {two}')
    specimen = script.build(seed)
    return TwoCameraScene(specimen, *_play(script, specimen), rate, script.friction, shutters or script.shutters)
