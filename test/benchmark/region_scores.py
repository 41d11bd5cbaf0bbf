# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Scores of contact states, regions and contacts against a recording's truth (its README says what is left out and why)."""
from __future__ import annotations

import cv2
import numpy as np

FREE_GAP = 50e-6  # m: free dots nearer to the tool than this are in neither class
SLIP_TOLERANCE = 10e-6  # m, of the touchpad: slips of half to three times this are in neither class
_PIXEL = 50e-6  # m, of the raster on which regions are compared


def f1(true_positive: int, false_positive: int, false_negative: int) -> float:
    """Harmonic mean of precision and recall; NaN where nothing was there and nothing was found."""
    total = 2 * true_positive + false_positive + false_negative
    return 2 * true_positive / total if total else np.nan


def counts(found: np.ndarray, there: np.ndarray, judged: np.ndarray | None = None) -> np.ndarray:
    """(3,) true positives, false positives, false negatives among judged entries."""
    judged = np.ones(len(found), bool) if judged is None else judged
    return np.array([(found & there & judged).sum(), (found & ~there & judged).sum(), (~found & there & judged).sum()])


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


def raster(loops: list[np.ndarray], size: float = 0.04) -> np.ndarray:
    """Square image, uint8, of size m, of what the loops (M, >= 2) enclose seen along z: holes come out by the even-odd rule."""
    side = int(round(size / _PIXEL))
    image = np.zeros((side, side), np.uint8)
    points = [np.round((loop[:, :2] + size / 2) / _PIXEL * 16).astype(np.int32).reshape(-1, 1, 2) for loop in loops if len(loop) >= 3]
    if points:
        cv2.fillPoly(image, points, 1, shift=4)
    return image


def region_iou(found: list[np.ndarray], there: list[np.ndarray]) -> float:
    """Overlap of the regions within two sets of loops, seen along z; NaN where both are empty."""
    a, b = raster(found), raster(there)
    union = np.count_nonzero(a | b)
    return np.count_nonzero(a & b) / union if union else np.nan


def place_errors(centroid: np.ndarray, depth: float, area: float, truth, frame: int) -> np.ndarray:
    """(3,) distance of the centroid seen along z (m), error of depth (m), area over true area, for a frame with one contact."""
    apart = np.linalg.norm(centroid[:2] - truth['contact_centroid'][frame][:2])
    return np.array([apart, depth - truth['depth'][frame], area / truth['contact_area'][frame]])
