# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The published method of the paper psd_finger (Maekawa et al., section 5): an equidistant projection from the detector to the sphere by
offset and scale (eqs 2 to 5, finger/map.py), an offset that is stored once, and a fixed threshold.
"""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from .._core import finger
from ..finger.model import FingerModel
from ..finger.parameters import finger_settings


def paper_finger(model: FingerModel, threshold: float, **settings) -> finger.PsdFinger:
    """A PsdFinger with the paper's map, in contact where the total exceeds threshold, V; settings: of FingerSettings.

    Raises BadArgument for a threshold that is not positive.
    """
    paper = replace(model, smooth=None, level=None, cross=None, creep=None)
    return finger.PsdFinger(paper, finger.FingerSettings(threshold=threshold, **settings))


def make_finger(model: FingerModel, values: Mapping) -> finger.PsdFinger:
    """The paper's finger with values of PSD_PARAMETERS."""
    return paper_finger(model, values['paper.threshold'], **finger_settings(values))
