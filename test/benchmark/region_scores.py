# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Scores of contact states, regions and contacts against a recording's ground truth (its README says what is excluded and why)."""
from __future__ import annotations

import numpy as np
from tactile_perception.evaluation.scores import counts

FREE_GAP = 50e-6  # m: free dots nearer to the tool are in neither class
SLIP_TOLERANCE = 10e-6  # m, of the touchpad: slips of half to three times this value are in neither class


def contact_counts(found: np.ndarray, truth, frame: int, ids: np.ndarray) -> np.ndarray:
    """counts of contact dots, found (N,) bool at ids (N,); free dots under FREE_GAP from the tool are left out."""
    there = truth['dot_contact'][frame][ids]
    return counts(found, there, there | ~(truth['dot_gap'][frame][ids] < FREE_GAP))


def slip_counts(state: np.ndarray, truth, frame: int, ids: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """counts of sticking and of slipping dots among those that touch in truth and are found to; slips near the tolerance are left out."""
    there = truth['dot_state'][frame][ids]
    slip = np.linalg.norm(np.nan_to_num(truth['dot_slip'][frame][ids]), axis=1)
    clear = (slip < 0.5 * SLIP_TOLERANCE) | (slip > 3 * SLIP_TOLERANCE)
    judged = (there > 0) & (state > 0) & clear
    return counts(state == 1, there == 1, judged), counts(state == 2, there == 2, judged)


def true_loops(truth, frame: int) -> list[np.ndarray]:
    """Outlines and holes of the true regions, (M, 3) each, m."""
    start = truth['loop_start']
    return [truth['loop_xyz'][start[k]:start[k + 1]].astype(float) for k in np.flatnonzero(truth['loop_frame'] == frame)]


def place_errors(centroid: np.ndarray, depth: float, area: float, truth, frame: int) -> np.ndarray:
    """(3,) distance of the centroid seen along z (m), error of depth (m), area over true area, for a frame with one contact."""
    apart = np.linalg.norm(centroid[:2] - truth['contact_centroid'][frame][:2])
    return np.array([apart, depth - truth['depth'][frame], area / truth['contact_area'][frame]])
