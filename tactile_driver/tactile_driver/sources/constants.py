# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of sources, and of the capture of their frames."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class SourceConstants:
    """Constants of sources, and of the capture of their frames."""

    max_listed_columns: int = constant(8, '1', 'limit', 'names of columns in an error message')
    max_value: int = constant(2**16 - 1, '1', 'limit', 'value of a mono16 image')
    step_sample: int = constant(1_000_000, '1', 'numeric', 'values from which the smallest difference is taken')
    max_number: float = constant(1e30, '1', 'limit', 'larger numbers are missing values: they fill unwritten cells')
    untouched_frames: int = constant(10, '1', 'prior',
                                     'frames at the start that are taken as untouched, as reference.frames of taxel_contact_node')
    window_s: float = constant(4.0, 's', 'numeric', 'window of rates and shares')
    max_silent_periods: int = constant(5, 'period', 'limit', 'a source that is silent for longer, and for min_silence_s, is absent')
    min_silence_s: float = constant(1.0, 's', 'limit', 'see max_silent_periods')
    recent_frames: int = constant(2000, '1', 'limit', 'frames in the window, at 500 Hz')
    retry_s: float = constant(0.2, 's', 'limit',
                              'between two tries to open a device that is missing: it is back soon after it was plugged in')
    idle_s: float = constant(0.02, 's', 'limit', 'poll period while there is nothing to read')
    rate_frames: int = constant(120, '1', 'numeric', 'latest frames over which the rate is measured')
    other_size_s: float = constant(0.3, 's', 'limit', 'frames of another size for this long are permanent')
    log_again_s: float = constant(10.0, 's', 'limit', 'time without bad frames after which the next one is logged')
    max_comparison_ns: int = constant(50_000, 'ns', 'measured',
                                      'duration of a comparison of two clocks; three reads take a few us on an idle machine')
    max_comparisons: int = constant(4, '1', 'limit', 'tries of a comparison of two clocks')
    max_gap_ns: int = constant(5_000_000_000, 'ns', 'limit', 'a longer gap of the stamps of a recording is skipped')
    late_ns: int = constant(100_000_000, 'ns', 'limit', 'a frame that is later is due at once')


SOURCES = SourceConstants()
