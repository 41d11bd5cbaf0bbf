# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Force taxels on the gripper's left finger: the numbers that they send of the forces that the engine has computed on domes."""
from __future__ import annotations

import numpy as np
import yaml

from tactile_driver.simulation.force_taxels.device import Electronics, Specimen, flat_grid

from .constants import GRASP

_SPECIMEN = Specimen(press=6e7, pull=2e7, spread=0.0015)  # in N; a cover spreads the force of a dome over its neighbours


class ForcePad:
    """Electronics behind the domes; seed: of its noise and irregularities."""

    def __init__(self, seed: int):
        self.shape = flat_grid(GRASP.domes, GRASP.dome_pitch, 1)
        self._electronics = Electronics(self.shape, _SPECIMEN, np.random.default_rng([seed, 31]))

    def read(self, forces: np.ndarray) -> np.ndarray:
        """Numbers (GRASP.domes**2, 3), float32, of the forces (GRASP.domes**2, 3), N, of a frame of the engine; a press is positive."""
        return self._electronics.read(forces, GRASP.frame_s)


def layout() -> str:
    """Text of the pad's layout file."""
    return yaml.safe_dump({'patches': [{'rows': GRASP.domes, 'columns': GRASP.domes, 'pitch': GRASP.dome_pitch}]})
