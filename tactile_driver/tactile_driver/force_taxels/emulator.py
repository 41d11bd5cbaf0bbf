# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The command force_taxel_emulator: firmware of taxels that measure force vectors on a pseudo-terminal, with real faults."""
from __future__ import annotations

from pathlib import Path

import numpy as np

from ..emulators import PortEmulator, emulator_parser, serve
from ..errors import reports_errors
from ..serial.frames import VECTORS
from ..simulation.force_taxels.scene import open_vector_scene


class VectorEmulator(PortEmulator):
    """Plays a scene of simulated taxels that measure force vectors, as floats."""

    kind, bits = VECTORS, 32

    def __init__(self, link: str | Path, scene: str = 'demo', rate: float = 100.0, seed: int = 0):
        self._scene = open_vector_scene(scene, rate, seed)
        super().__init__(link, rate, 1, seed)

    def _counts(self) -> np.ndarray:
        return self._scene.render(self._number / self._rate)[0]


@reports_errors('force_taxel_emulator')
def force_taxel_emulator(args: list[str] | None = None) -> int:
    """The command force_taxel_emulator. Returns the exit code."""
    given = emulator_parser('force_taxel_emulator', 'Emulates the firmware of taxels that measure force vectors on a pseudo-terminal.',
                            'force_taxels_port', 100.0).parse_args(args)
    return serve(VectorEmulator(given.link, given.scene, given.rate, given.seed))
