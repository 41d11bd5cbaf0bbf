# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of the drivers of force taxels."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class ForceTaxelDriverConstants:
    """Constants of the drivers of force taxels."""

    min_normal_length: float = constant(1e-6, '1', 'limit', 'length of a vector that gives a direction')
    max_taxels: int = constant(10_000, '1', 'limit', 'far beyond the largest hands')
    max_position: float = constant(100.0, 'm', 'limit', 'coordinate of a taxel; beyond all sensors')
    max_force: float = constant(1e9, 'N', 'limit', 'component of a force, in any unit; beyond all sensors')
    max_waiting_frames: int = constant(100, '1', 'limit', 'received frames that wait')
    file_rate: float = constant(100.0, 'Hz', 'prior', 'of a file without times, as the simulated devices')


FORCE_TAXEL_DRIVER = ForceTaxelDriverConstants()
