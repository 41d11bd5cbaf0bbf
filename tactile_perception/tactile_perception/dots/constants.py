# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of finding, numbering and following dots; those of the kernels are in structs of src/dots."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class DotConstants:
    """Limits and priors of detectors, tracks, registration and the judgement of untouched states."""

    # Detection
    min_frame_side: int = constant(32, 'px', 'limit', 'of a frame; the detectors average over boxes of 15 px and more')
    min_range: int = constant(4, 'grey level', 'limit', 'a frame with a smaller range is constant; above the noise of a covered camera')
    max_growth: float = constant(2.2, '1', 'limit', 'of the typical diameter, the largest that is searched')
    growth: float = constant(1.15, '1', 'numeric', 'of the largest diameter, from one model to the next')
    lost_share: float = constant(0.6, '1', 'limit',
        'of the dots at the measurement of the appearance; with fewer, it is measured again where that finds more')
    mean_side: float = constant(1.1, 'pitch', 'numeric', 'of the box of the local mean; a little over one marker with its ground')
    min_halved_diameter: float = constant(8.0, 'px', 'numeric', 'of markers; smaller ones are segmented in the full image')
    segmentation_share: float = constant(0.13, '1', 'limit', 'of the contrast of markers, threshold of the segmentation')
    # Tracks
    max_new_distance: float = constant(0.5, 'spacing', 'limit',
        'from where a lost track is expected; a nearer dot may be its own, and starts no track')
    max_common_motion: float = constant(0.5, 'spacing', 'limit', "between two frames; beyond it the nearest dot is the neighbour's")
    confirmed_s: float = constant(0.05, 's', 'prior',
        'that a dot which appears later is followed before it is reported; false ones last a frame or two')
    kept_s: float = constant(2.0, 's', 'prior', 'that a lost track is kept')
    min_interval_s: float = constant(1e-06, 's', 'numeric', 'between two frames; bounds velocities')
    # Registration of a pattern
    min_pattern: int = constant(8, '1', 'limit', 'dots of a pattern')
    max_pattern: int = constant(3000, '1', 'limit', 'dots of a pattern; more take minutes and gigabytes')
    modes: int = constant(40, '1', 'numeric', 'smooth modes of displacement besides the affine ones')
    kernel_width: float = constant(3.0, 'spacing', 'prior', 'of the Gaussian kernel of the displacement')
    stiffness: float = constant(1.0, '1', 'prior', 'regularisation of the modes')
    coarse_width: float = constant(1.5, 'spacing', 'numeric', 'of the mixture at the start, if a smaller one finds too few')
    middle_width: float = constant(0.7, 'spacing', 'numeric', 'of the mixture at the start')
    fine_width: float = constant(0.15, 'spacing', 'numeric', 'of the mixture at the end')
    cooling: float = constant(0.82, '1', 'numeric', 'factor of the width of the mixture per step')
    outlier_density: float = constant(0.1, '1', 'prior', 'of outliers over that of the pattern')
    match_gate: float = constant(0.45, 'spacing', 'limit', 'largest residual of a match; below half a spacing')
    pattern_neighbours: int = constant(8, '1', 'numeric', 'that predict the position of a dot of a pattern')
    max_disagreement: float = constant(0.35, 'spacing', 'limit', 'deviation from that prediction')
    min_matched: float = constant(0.75, '1', 'limit', 'of the pattern, matches of a certain result')
    nearly_all_matched: float = constant(0.985, '1', 'numeric', 'of the pattern, matches at which no wider start is tried')
    # Judgement of an untouched state
    calibrated_frames: int = constant(10, '1', 'prior', 'untouched frames, weight of calibrated positions where the camera has not moved')
    min_judged: int = constant(30, '1', 'limit', 'dots for a judgement of an untouched state')
    fit_rounds: int = constant(3, '1', 'numeric', 'of a robust fit')
    ridge: float = constant(1e-12, '1', 'numeric', 'of its normal equations, for collinear dots')
    judged_neighbours: int = constant(4, '1', 'numeric', 'with whose residuals that of a dot is compared')
    press_correlation: float = constant(0.4, '1', 'limit',
        'of the residuals of neighbours, beyond which they are a press; slow sagging is less')
    press_size: float = constant(0.1, 'px', 'limit', 'of the residuals that neighbours share, the same')
    kept_percent: int = constant(80, '%', 'numeric', 'of the dots with the smallest residuals that a fit uses')
    stillest_percent: int = constant(10, '%', 'limit', 'of the dots, those that a press moves least')
    max_still_motion: float = constant(0.2, 'pitch', 'limit', 'of those dots; a pressed dome leans as a whole')
    max_stayed: float = constant(0.05, 'px', 'measured',
        'median distance from the calibrated positions of a camera that has not moved; the noise is less')
    grid_degree: int = constant(5, '1', 'numeric', 'of the polynomial in row and column; fits a lens and a dome, not a press')
    grid_correlation: float = constant(0.3, '1', 'measured', 'as press_correlation; irregular prints have up to 0.25, presses from 0.35')
    grid_size: float = constant(0.01, 'pitch', 'limit', 'as press_size')
    grid_kept_percent: int = constant(85, '%', 'numeric', 'as kept_percent')
    view_steps: int = constant(8, '1', 'numeric', 'of the fit of the view')
    max_view_step: float = constant(0.3, '1', 'numeric', 'largest step of that fit, in half sizes of the grid')
    view_difference: float = constant(0.0001, '1', 'numeric', 'of its numerical derivatives')
    view_rank: float = constant(1e-05, '1', 'numeric', 'a view without distortion shows no centre of it')


DOT = DotConstants()
