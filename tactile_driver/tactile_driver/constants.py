# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Fields of the frozen dataclasses that hold constants of a folder, and those of this folder; docs/constants.md is printed from them."""
from dataclasses import dataclass, field

ORIGINS = ('measured', 'physical', 'prior', 'limit', 'numeric')


def constant(value, unit: str, origin: str, meaning: str):
    """Make a dataclass field.

    unit: '1' for a ratio or a number; origin: one of ORIGINS, that is, a measured noise or error, a physical property, a prior, a limit of
    the sensor or of a method, or the resolution or tolerance of a computation; meaning: what it is, and why it has this value.
    """
    if origin not in ORIGINS:
        raise ValueError(f'origin {origin!r} of a constant; known: {", ".join(ORIGINS)}')
    return field(default=value, metadata={'unit': unit, 'origin': origin, 'meaning': meaning})


@dataclass(frozen=True)
class DriverConstants:
    """Constants of emulated devices, of losses by stamps, and of lenses."""

    garbage_bytes: int = constant(300, 'byte', 'prior', 'length of the garbage that the fault of this name inserts before a frame')
    max_dropped_bytes: int = constant(40, 'byte', 'limit', 'bytes that the fault drop removes from a frame')
    fault_pause_s: float = constant(1.0, 's', 'prior', 'duration of the faults pause and unplug')
    max_backlog_ns: int = constant(500_000_000, 'ns', 'limit',
                                   'a shorter delay of the machine is caught up; a longer one leaves a gap in the data')
    emulated_batch: int = constant(50, '1', 'numeric', 'frames simulated per call, which is faster than one by one')
    emulated_rate: float = constant(50.0, 'Hz', 'numeric', 'simulated frames of an array; a faster device sends each of them several times')
    verified_radius: float = constant(1.5, '1', 'limit', 'normalised radius beyond which undistorted points are verified by reprojection')
    max_reprojection_error: float = constant(1e-4, '1', 'numeric', 'of these points, over the radius')
    period_intervals: int = constant(30, '1', 'numeric',
                                     'latest stamp intervals that determine the period; a change of rate is followed within as many frames')
    messages_per_update: int = constant(5, '1', 'numeric', 'messages between two updates of the period, because an update takes 57 us')
    min_interval_ns: int = constant(100_000, 'ns', 'limit', 'shorter intervals are wrong stamps: no sensor sends 10 000 messages a second')
    max_gap_ns: int = constant(2_000_000_000, 'ns', 'limit', 'longer gaps are pauses of the publisher (paused, reconnected), not losses')
    short_share: float = constant(0.1, '1', 'limit', 'share of intervals that are shorter than the period, because of late messages')


DRIVER = DriverConstants()
