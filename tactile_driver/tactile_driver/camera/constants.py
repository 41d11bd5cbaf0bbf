# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of cameras, and of the pairing of the images of two of them."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class CameraConstants:
    """Constants of cameras, and of the pairing of the images of two of them."""

    frozen_s: float = constant(1.0, 's', 'limit',
                               'duration of identical images that counts as frozen: noise changes every image, even of a still scene')
    black_s: float = constant(0.3, 's', 'limit', 'duration of black images that is reported; the first images after the start may be black')
    max_image_age_s: float = constant(2.0, 's', 'limit', 'without an image for longer, there is no warning about images')
    max_black_mean: float = constant(8.0, 'grey level', 'limit', 'mean of a black image')
    row_step: int = constant(8, 'px', 'numeric', 'distance of the rows that are compared; noise changes every row')
    rate_tolerance: float = constant(0.02, '1', 'limit', 'share of the requested rate by which the rate of the camera may differ')
    max_listed_modes: int = constant(4, '1', 'limit', 'modes in a warning, which has to fit a line')
    max_stamp_age_ns: int = constant(1_000_000_000, 'ns', 'limit', 'an older stamp of the driver is not of the monotonic clock')
    default_rate: float = constant(30.0, 'Hz', 'prior', 'of a folder, and of a video without a rate; the rate of most cameras')
    skews: int = constant(150, '1', 'numeric', 'latest pairs whose skew is reported; 5 s at 30 Hz')
    min_skews: int = constant(10, '1', 'limit', 'pairs from which the skew is known')
    max_waiting_frames: int = constant(8, '1', 'limit', 'frames of one camera that wait for their counterparts')
    intervals: int = constant(30, '1', 'numeric', 'latest intervals that determine the period')
    min_intervals: int = constant(4, '1', 'limit', 'intervals from which the period is known')
    period_percentile: int = constant(
        20, '%', 'measured',
        'percentile of the intervals that is the period; below the median, because lost frames lengthen intervals')
    restart_ns: int = constant(1_000_000_000, 'ns', 'limit', 'a stamp that is further back restarts the pairing')
    hysteresis: float = constant(
        0.1, 'period', 'limit',
        'by which a skew may exceed half a period before each frame pairs with its other neighbour; jitter is smaller')
    max_read_s: float = constant(0.2, 's', 'limit', 'duration of one read of a pair')
    simulated_size: tuple[int, int] = constant(
        (640, 480), 'px', 'prior',
        'width and height; the image size of the touchpad paper (touchpad_contact_region, section 2)')
    ahead_s: float = constant(3.0, 's', 'numeric', 'duration of the scene that is computed ahead')
    spare_ns: int = constant(20_000_000, 'ns', 'measured',
                             'time before a frame is due that one state of a touched skin may take; of the sheet with two cameras')
    min_rate_share: float = constant(0.99, '1', 'limit',
                                     'share of the requested rate that a mode has to reach; drivers round intervals to 100 ns')


CAMERA = CameraConstants()
