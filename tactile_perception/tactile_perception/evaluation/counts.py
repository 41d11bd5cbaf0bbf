# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Scores of labels: what is there against what was found."""
from __future__ import annotations

import numpy as np


def f1(true_positive: int, false_positive: int, false_negative: int) -> float:
    """Harmonic mean of precision and recall; NaN where nothing was there and nothing was found."""
    total = 2 * true_positive + false_positive + false_negative
    return 2 * true_positive / total if total else np.nan


def counts(found: np.ndarray, there: np.ndarray, judged: np.ndarray | None = None) -> np.ndarray:
    """(3,) true positives, false positives, false negatives among judged entries; all arrays (N,) bool."""
    judged = np.ones(len(found), bool) if judged is None else judged
    return np.array([(found & there & judged).sum(), (found & ~there & judged).sum(), (~found & there & judged).sum()])


def label_f1(confusion: np.ndarray) -> np.ndarray:
    """(L,) f1 of each label; NaN for one that neither is there nor was found. confusion: (L, >= L) counts, true by found; columns beyond
    the labels are of what was not found at all."""
    labels = len(confusion)
    right, true, found = np.diag(confusion), confusion.sum(axis=1), confusion[:, :labels].sum(axis=0)
    return np.array([f1(r, f - r, t - r) for r, f, t in zip(right.tolist(), found.tolist(), true.tolist())])


def macro_f1(confusion: np.ndarray) -> float:
    """Mean of label_f1 over the labels that occur in truth; NaN where none does. confusion: (L, L), true by found."""
    occurring = confusion.sum(axis=1) > 0
    return float(label_f1(confusion)[occurring].mean()) if occurring.any() else np.nan
