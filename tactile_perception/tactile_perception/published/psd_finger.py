# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The method of the paper psd_finger (Maekawa et al., section 5).

An equidistant projection from the detector to the sphere by offset and scale (equations 2 to 5, finger/map.py), an offset that is stored
once, and a fixed threshold.
"""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from .._core import finger
from ..finger.model import FingerModel
from ..finger.parameters import finger_settings


def paper_finger(model: FingerModel, threshold: float, **settings) -> finger.PsdFinger:
    """A finger with the paper's map and a fixed threshold.

    Parameters
    ----------
    model : FingerModel
        Of which the equidistant map and the loads are used.
    threshold : float
        Sum of the outputs above which something touches, V.
    **settings
        Of FingerSettings.

    Returns
    -------
    PsdFinger

    Raises
    ------
    BadArgument
        If the threshold is not positive.
    """
    paper = replace(model, smooth=None, level=None, cross=None, creep=None)
    return finger.PsdFinger(paper, finger.FingerSettings(threshold=threshold, **settings))


def make_finger(model: FingerModel, values: Mapping) -> finger.PsdFinger:
    """The paper's finger with values of PSD_PARAMETERS."""
    return paper_finger(model, values['paper.threshold'], **finger_settings(values))
