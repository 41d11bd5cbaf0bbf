# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of what stages and nodes share: stamps, lost and late messages, limits of the numbers in messages."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class CoreConstants:
    """Limits of numbers are beyond every sensor, and products of numbers within them do not overflow."""

    min_jump_s: float = constant(1.0, 's', 'limit', 'of a restart; a smaller step back may be frames out of order')
    frames_after_jump: int = constant(2, '1', 'limit', 'ordered frames that confirm a restart after a step back of more than min_jump_s')
    frames_after_step: int = constant(3, '1', 'limit', 'the same after a smaller step back')
    max_ahead_s: float = constant(3600.0, 's', 'limit',
                                  'the next stamp must confirm one farther ahead; a sensor that pauses longer loses one frame')

    max_px: float = constant(1e6, 'px', 'limit', 'wider than any image')
    max_m: float = constant(100.0, 'm', 'limit', 'from the origin, which is on the sensor')
    max_value: float = constant(1e9, 'SI units', 'limit', 'of forces, velocities, covariances')
    min_focal_length_px: float = constant(1.0, 'px', 'limit', 'beyond any lens')
    max_distortion: float = constant(1e6, '1', 'limit', 'of a plumb_bob coefficient, beyond any lens')
    no_distortion: float = constant(1e-12, '1', 'numeric',
                                    'a smaller coefficient counts as 0: it bends no ray, and the inversion would divide by it')

    stale_s: float = constant(2.0, 's', 'limit', 'without a processed message there is nothing to take as the reference')
    silence_s: float = constant(2.0, 's', 'limit', 'without a frame before a warning')
    max_wait_s: float = constant(0.05, 's', 'limit',
                                 'that a message may wait; a short load of the machine is caught up, no persistent queue builds up')
    max_wait_periods: int = constant(2, '1', 'limit', 'the same, if longer than max_wait_s: after two periods a newer one has arrived')
    played_fast: float = constant(0.5, '1', 'limit',
                                  'ratio of periods, received to stamped; below it a recording is played fast, and no message is dropped')
    period_smoothing: float = constant(0.1, '1', 'numeric', 'of the periods, exponential: ten messages')


CORE = CoreConstants()
