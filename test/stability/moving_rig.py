# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of touches in simulated scenes of sheets, processed with the calibration that ships."""
from __future__ import annotations

from pathlib import Path

import numpy as np
from tactile_bringup.installed import share
from tactile_bringup.simulate.camera import write_scene
from tactile_perception.bags.judged_bag import JudgedBag

RATE = 30.0


def errors(folder: Path, scene: str, shutters=None) -> tuple[np.ndarray, int]:
    """(N, 3): place, depth, mm, and normalised squared error of the place, of the frames with a touch; and how many were told beside.

    scene: its name begins with that of the sensor; shutters: of two cameras.
    """
    files = [Path(share(kind, '_'.join(scene.split('_')[:2]) + '_sim.yaml')) for kind in ('params', 'calibration')]
    write_scene(folder / 'bag', scene, RATE, shutters=shutters)
    found, beside = [], 0
    for _, told, true in JudgedBag(folder / 'bag', params=files[0], calibration=files[1]).instants():
        if not true.contacts:
            beside += any(touch.depth > 0.3e-3 for touch in told.contacts)
        elif told.contacts:
            touch, tip = told.contacts[0], true.contacts[0]
            off = touch.position - tip.position
            squared = off @ np.linalg.solve(touch.position_covariance, off) / 3
            found.append((1e3 * np.hypot(*off[:2]), 1e3 * abs(touch.depth - tip.depth), squared))
    return np.array(found), beside
