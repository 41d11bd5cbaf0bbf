# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of the demo's report and video."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class DemoConstants:
    """Constants of the demo's report and video."""

    check_s: float = constant(0.25, 's', 'limit', 'between two checks for the end')
    line_s: float = constant(1.0, 's', 'limit', 'between two lines of the report')
    silence_s: float = constant(3.0, 's', 'limit', 'time without a frame after which the recording has ended or the device is lost')
    recent_frames: int = constant(90, '1', 'numeric', 'latest frames whose rate and latency are reported; 3 s at 30 Hz')
    max_latency_s: float = constant(60.0, 's', 'limit', 'older stamps are those of a recording, whose latency is unknown')
    max_still_frames: int = constant(30, '1', 'limit', 'of the video, 2 s; a longer gap in the stamps is cut to this')


DEMO = DemoConstants()
