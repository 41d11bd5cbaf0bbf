# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of serial ports, of their frames, and of the clocks of devices."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class SerialConstants:
    """Constants of serial ports, of their frames, and of the clocks of devices."""

    clock_wrap: int = constant(2**32, 'us', 'physical', 'time after which the clock of a device restarts at 0')
    block_ns: int = constant(1_000_000_000, 'ns', 'numeric', 'length of a block of offsets')
    blocks: int = constant(5, '1', 'numeric', 'latest blocks that are kept; a crystal with an error of 50 ppm moves by 0.25 ms meanwhile')
    max_step_ns: int = constant(1_000_000_000, 'ns', 'limit',
                                'difference of device and host intervals that counts as a restart of the device')
    slew: float = constant(0.05, '1', 'numeric', 'correction per elapsed time: stamps converge without going back')
    period_intervals: int = constant(64, '1', 'numeric', 'latest intervals whose median is the period, for frames without one')
    grid_tolerance: float = constant(0.5, 'period', 'limit', 'deviation of a sample from the regular grid, above which it counts as a gap')
    crc_start: int = constant(0xffff, '1', 'numeric', 'initial value of the CRC')
    max_missing_frames: int = constant(2**16, '1', 'limit', "a longer gap of the frames' numbers is a restart")
    max_line_bytes: int = constant(256, 'byte', 'limit', 'longer data without an end of line are discarded')
    max_read_s: float = constant(0.1, 's', 'limit', 'duration of one read')
    max_poll_s: float = constant(0.01, 's', 'limit', 'poll period; Linux buffers 4 KB of unread input: 10 ms at 400 KB/s')
    file_rate: float = constant(100.0, 'Hz', 'prior', 'of a file without times, as the simulated array')
    folder_rate: float = constant(10.0, 'Hz', 'prior', 'of a folder of files, as slow mats')


SERIAL = SerialConstants()
