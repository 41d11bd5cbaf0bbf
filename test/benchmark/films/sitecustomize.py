# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Python imports this module at startup if this folder is in PYTHONPATH: simulated cameras play films from the folder LIVE_FILMS, forwards
and backwards, without ground truth. Everything else runs as a user starts it; the machine's time is left to the sensors.
"""
import importlib.util
import os
import sys
from importlib.abc import MetaPathFinder
from pathlib import Path

_SCENES = 'tactile_driver.simulation.sensors.scenes'


def film_of(name: str, rate: float) -> Path:
    """Where the frames of a scene at a rate, Hz, are."""
    return Path(os.environ['LIVE_FILMS'], f'{name}_{rate:g}.npy')


class _Played:
    """A scene that plays frames (N, H, W, 3), or (N, 2, H, W, 3) of two cameras; all but its pictures are as the scene has them."""

    def __init__(self, scene, frames):
        self._scene, self._frames = scene, frames

    def __getattr__(self, name: str):
        return getattr(self._scene, name)

    def observe_ahead(self, _number: int) -> bool:
        """False: there is nothing to compute."""
        return False

    def render(self, time: float):
        """What the scene returns, without truth."""
        from types import SimpleNamespace
        count = len(self._frames)
        number = round(time * self._scene.rate) % (2 * count - 2)
        frame = self._frames[min(number, 2 * count - 2 - number)]
        return (frame[0], frame[1], None) if frame.ndim == 4 else SimpleNamespace(image=frame, truth=None)


def playing(open_scene):
    """open_scene, but with the frames of its film where there is one."""
    def opened(name: str, rate: float, *more, **named):
        import numpy as np
        scene, film = open_scene(name, rate, *more, **named), film_of(name, rate)
        return _Played(scene, np.load(film, mmap_mode='r').view(np.ndarray)) if film.is_file() else scene
    return opened


class _Films(MetaPathFinder):
    """Replaces what opens a scene as soon as its module is there, before anybody has taken it from there."""

    def find_spec(self, name, path=None, target=None):
        """Of that one module; all others are left to the other finders."""
        if name != _SCENES:
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(name)
        execute = spec.loader.exec_module

        def replaced(module):
            execute(module)
            for opener in ('open_scene', 'open_dual_scene'):
                setattr(module, opener, playing(getattr(module, opener)))
        spec.loader.exec_module = replaced
        return spec


if 'LIVE_FILMS' in os.environ:
    sys.meta_path.insert(0, _Films())
