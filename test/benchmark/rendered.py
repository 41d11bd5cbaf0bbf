# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Simulated sensors that play pre-rendered frames, so that measurements of a hand exclude the cost of rendering.

    python test/benchmark/rendered.py FOLDER NODE ... --ros-args ...

runs sensor_nodes with the arguments after FOLDER; their scenes play frames from FOLDER, forwards and backwards, without ground truth. The
driver's remaining work is a copy of the frame, as from a camera that delivers BGR, or of the voltages.
"""
from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import tactile_driver.nodes  # noqa: F401  (one thread of linear algebra, as in the nodes; said before NumPy is there)

import numpy as np


def frames_of(scene, seconds: float) -> np.ndarray:
    """(N, ...) uint8: what the scene shows, at its own rate; (N, 2, H, W, 3) of two cameras; (N, 4) uint16 of a PSD."""
    if hasattr(scene, 'play'):
        return scene.play(0, round(seconds * scene.rate))[0]
    made = [scene.render(number / scene.rate) for number in range(round(seconds * scene.rate))]
    return np.stack([np.stack(each[:-1]) if isinstance(each, tuple) and len(each) == 3 else image_of(each) for each in made])


def image_of(rendered) -> np.ndarray:
    """The image of what a scene of one camera, or of taxels, returns."""
    return rendered[0] if isinstance(rendered, tuple) else rendered.image


class Rendered:
    """A scene that plays frames; everything else is as the scene has it."""

    def __init__(self, scene, frames: np.ndarray):
        self._scene, self._frames = scene, frames

    def __getattr__(self, name: str):
        return getattr(self._scene, name)

    def observe_ahead(self, _number: int) -> bool:
        """False: there is nothing to compute."""
        return False

    def play(self, first: int, count: int):
        """Counts of so many samples, without truth."""
        return self._frames[np.arange(first, first + count) % len(self._frames)], None

    def render(self, time: float):
        """What the scene returns, without truth."""
        count = len(self._frames)
        number = round(time * self._scene.rate) % (2 * count - 2)
        frame = self._frames[min(number, 2 * count - 2 - number)]
        if frame.ndim == 4:
            return frame[0], frame[1], None
        return SimpleNamespace(image=frame, truth=None) if frame.ndim == 3 else (frame, None)


def file_of(folder: Path, name: str, rate: float) -> Path:
    """Where the frames of a scene are."""
    return Path(folder, f'{name}_{rate:g}.npy')


def playing(folder: Path, open_scene):
    """open_scene, but with frames from the folder where there are some."""
    def opened(name: str, rate: float, *more):
        scene, file = open_scene(name, rate, *more), file_of(folder, name, rate)
        return Rendered(scene, np.load(file, mmap_mode='r').view(np.ndarray)) if file.is_file() else scene
    return opened


def main() -> None:
    """Replace what opens scenes, and run sensor_nodes."""
    from tactile_driver.simulation.sensors import scenes
    from tactile_driver.serial import psd as psd_simulated
    from tactile_driver.serial import taxel as taxel_simulated
    folder = Path(sys.argv[1])
    for module, name in ((scenes, 'open_scene'), (scenes, 'open_dual_scene'), (taxel_simulated, 'open_taxel_scene'),
                         (psd_simulated, 'open_psd_scene')):
        setattr(module, name, playing(folder, getattr(module, name)))
    from tactile_bringup.nodes import compose
    compose.main([sys.argv[0], *sys.argv[2:]])


if __name__ == '__main__':
    main()
