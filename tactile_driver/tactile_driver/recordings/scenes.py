# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""How the simulated scenes of a sensor become recordings."""
from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class SceneWriter:
    """The scenes of a simulated sensor, as its driver publishes them.

    Parameters
    ----------
    scenes : Mapping
        Names of the scenes.
    rate : float
        Usual rate in Hz.
    open_scene : callable
        Function of a name, rate and seed that makes a scene, which has ``sensor``, ``rate`` and ``frames``.
    messages : callable
        Function of a scene, the sensor frame and the stamp in ns of the first frame that yields (stamp in ns, topic, message).
    parts : Mapping
        Frames of the sensor's parts: ending of the name to its position (3,) in m in the sensor frame.
    """

    scenes: Mapping[str, object]
    rate: float
    open_scene: Callable
    messages: Callable[..., Iterator[tuple[int, str, object]]]
    parts: Mapping[str, tuple[float, float, float]]
