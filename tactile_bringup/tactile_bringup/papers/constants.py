# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of the experiments of the papers."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class PaperConstants:
    """Constants of the experiments of the papers."""

    max_ratio: float = constant(1.5, '1', 'limit',
                                'of the error of the published method here to the error in the paper, above which a table names the cause')
    dome_rate: float = constant(20.0, 'Hz', 'prior',
                                'SORT follows circles by their overlap from frame to frame, so the descent is recorded, too')
    max_standstill: float = constant(1e-5, 'm', 'limit', 'in a frame, below which the tip stands still')
    max_panels: int = constant(3, '1', 'limit', 'side by side')
    title_characters: int = constant(12, '1/inch', 'limit', 'of a title in an inch of width')
    finger_rate: float = constant(1000.0, 'Hz', 'prior', 'samples of the finger')
    published_samples: int = constant(20, '1', 'prior', 'N_s of eqs 9 to 14 of the paper of the finger')
    max_polar: float = constant(45.0, 'degree', 'prior', 'from the pole, up to which the paper states the mean deviation')
    sheet_rate: float = constant(2.0, 'Hz', 'prior', 'each stop of the stage is one frame')
    hold_rate: float = constant(30.0, 'Hz', 'prior', 'of the scene with which the Kalman filter is tried')
    min_depth: float = constant(1e-4, 'm', 'limit', 'a tip that grazes the sheet while it moves presses nothing')
    px_per_mm: float = constant(10.0, 'px/mm', 'prior',
                                'of the paper with two cameras: "assuming that the coordinate value per 1 mm was 10"')
    taxel_rate: float = constant(50.0, 'Hz', 'prior', 'frames of the array')
    max_link: float = constant(1.0, 'mm', 'limit', 'from a track to the point that it moves with; one taxel')
    min_spacing: float = constant(2.0, 'mm', 'limit', 'between the beginnings of tracks, as between the corners of the paper')
    held_until_s: float = constant(3.0, 's', 'prior', 'stamp until which the faces are held')
    untouched_frames: int = constant(10, '1', 'prior', 'at the start, without contact')
    touchpad_rate: float = constant(10.0, 'Hz', 'prior', 'frames of the touchpad')
    depth_tolerance: float = constant(1e-6, 'm', 'numeric', 'up to which the object is held at a depth')
    touchpad_columns: int = constant(23, '1', 'physical', 'dots in a row of the simulated touchpad')
    bar_width: float = constant(0.030, 'm', 'physical', 'of the bar between the fingers')


PAPERS = PaperConstants()
