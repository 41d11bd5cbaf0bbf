# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of domes with pins; those of elastic layers are in layer/constants.py."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class PinConstants:
    """Priors of the motion of pins, and limits of what determines a calibration."""

    contact_share: float = constant(0.5, '1', 'limit', 'of the largest displacement: pins beside the contact move less')
    correlation: float = constant(1.0, 'spacing', 'prior', 'over which neighbouring pins move alike')
    nugget: float = constant(1e-3, '1', 'prior', "variance of a pin's own part over that of the common one")
    min_positions: int = constant(12, '1', 'limit', 'four numbers for each of three functions')
    ridges: tuple[float, ...] = constant(tuple(10.0 ** (k / 2) for k in range(-8, 4)), '1', 'numeric',
                                         'candidates, in units of the largest singular value squared')
    max_unexplained: float = constant(3.0, '1', 'limit',
                                      'over what presses of the calibration leave unexplained; more is another object or a far position')
    range_sigmas: float = constant(2.0, 'sigma', 'limit', 'by which a result may lie outside the calibrated range')


PIN = PinConstants()
