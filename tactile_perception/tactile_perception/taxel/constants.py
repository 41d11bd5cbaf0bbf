# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of taxel arrays; those of motion and slip are in src/taxel/tracker.hpp."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class TaxelConstants:
    """Measured errors of contacts, and limits of what determines a response."""

    max_reach: float = constant(0.5, '1', 'limit',
                                'of the largest load, both reaches together; a larger one is not visible during unloading')
    max_loop_residual: float = constant(0.7, '1', 'limit',
                                        'of that without a loop, for one to be accepted; noise alone reduces it by a few percent')
    max_late_residual: float = constant(0.5, '1', 'limit',
                                        'of that without late parts: a hard loop resembles a softer one with a small late part')
    knee: float = constant(0.05, '1', 'physical', 'of the largest calibrated change; below it pressure may rise faster (a dead zone)')
    min_loads: int = constant(3, '1', 'limit', 'one for each coefficient of the curve')
    weight_floor: float = constant(0.3, '1', 'prior',
                                   'of the largest force, added to each: errors of large forces count relatively, others absolutely')
    min_coverage: float = constant(0.95, '1', 'limit', 'taxels that respond to an even load')
    min_response: float = constant(0.3, '1', 'limit', 'of the mean change, for a taxel to respond; below the smallest gain')
    min_load: float = constant(0.05, '1', 'limit', 'of the largest mean change, for a frame to be used for gains')
    gain_range: tuple[float, float] = constant((0.5, 2.0), '1', 'limit', 'a taxel with a gain outside it keeps gain 1')
    patches: float = constant(44.0, '1', 'measured', 'that slip independently, on two simulated devices')
    error_rate: float = constant(0.012, '1', 'measured', 'of the frames, that no slipping fraction explains')
    uncalibrated_precision: tuple[float, float, float] = constant((0.98, 0.26, 0.63), '1', 'measured',
        'of the three states in ten scenes: 0.978 to 0.989, 0.07 to 0.32, 0.57 to 0.70')
    max_hidden: float = constant(0.9, '1', 'limit', 'share of a loop, and of all late parts; compensation multiplies noise by ten there')
    hidden_noise: float = constant(0.3, '1', 'measured',
                                   'of the hidden share of changes, that adds to the noise, as it is blurred over a taxel')
    max_load_change: float = constant(0.02, '1', 'limit', 'relative; loads that differ by less are equal')


TAXEL = TaxelConstants()
