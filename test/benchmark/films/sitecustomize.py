# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Python imports this module at startup if this folder is in PYTHONPATH: simulated cameras play films from the folder LIVE_FILMS, forwards
and backwards, without ground truth. Everything else runs as a user starts it; the machine's time is left to the sensors.
"""
import os
from pathlib import Path
from types import SimpleNamespace


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
        count = len(self._frames)
        number = round(time * self._scene.rate) % (2 * count - 2)
        frame = self._frames[min(number, 2 * count - 2 - number)]
        return (frame[0], frame[1], None) if frame.ndim == 4 else SimpleNamespace(image=frame, truth=None)


def playing(open_scene):
    """open_scene, but with the frames of its film where there is one."""
    def opened(name: str, rate: float, *more, **named):
        import numpy as np
        scene, film = open_scene(name, rate, *more, **named), Path(os.environ['LIVE_FILMS'], f'{name}.npy')
        return _Played(scene, np.load(film, mmap_mode='r').view(np.ndarray)) if film.is_file() else scene
    return opened


if 'LIVE_FILMS' in os.environ:
    import tactile_driver.nodes  # noqa: F401  (one thread of linear algebra; said before NumPy is there)
    from tactile_driver.simulation.sensors import scenes
    scenes.open_scene, scenes.open_dual_scene = playing(scenes.open_scene), playing(scenes.open_dual_scene)
