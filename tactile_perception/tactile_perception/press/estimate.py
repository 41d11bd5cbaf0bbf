# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The estimate of one press, the interface of methods, and how src/press/choice.hpp selects the hypothesis that explains a field.

The hypotheses are one straight press, one dragged press, and two presses; sheets and domes share the rule. The evidence of a hypothesis is
its log likelihood at the best fit, minus half the log number of values for each fitted number (Schwarz 1978), plus its log prior. With
other tips, frictions and paths than in calibration, displacements deviate more than noise and known model error predict. The scale of the
errors is therefore unknown, and the likelihood of n values with a residual chi-square q per value is q^(-n/2). Model errors are smooth, so
that neighbouring markers have similar errors, and n is smaller than the number of markers.
"""
from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import Protocol

import numpy as np

from .. import _core
from ..common.estimates import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE
from .constants import PRESS
from .field import MarkerField

__all__ = ['AMBIGUOUS', 'AT_EDGE', 'OUT_OF_RANGE', 'TouchEstimate', 'TouchMethod']


@dataclass(frozen=True)
class TouchEstimate:
    """Estimate of one contact.

    Attributes
    ----------
    position : ndarray, shape (3,)
        Lowest point of the object in m in the sensor frame (z = -depth on a sheet); of two presses, the centre of each contact.
    depth : float
        Distance in m along z by which the object would have to be lifted to just touch the undeformed surface.
    covariance : ndarray, shape (3, 3)
        Covariance of position in m^2.
    depth_sigma : float
        Standard deviation of depth in m.
    radius : float
        Radius of the object's tip in m; NaN if the method does not estimate it.
    flags : int
        OUT_OF_RANGE, AT_EDGE, AMBIGUOUS.
    wrench : ndarray, shape (6,)
        Wrench of the object on the sensor, at the origin of the sensor frame, over the stiffness of the skin, in m and m^2; NaN if the
        method does not estimate it.
    lowest : ndarray, shape (3,), or None
        Lowest point of the object in m; None if it is position.
    """

    position: np.ndarray
    depth: float
    covariance: np.ndarray
    depth_sigma: float
    radius: float = float('nan')
    flags: int = 0
    wrench: np.ndarray = field(default_factory=partial(np.full, 6, np.nan))
    lowest: np.ndarray | None = None


def estimates_of(found) -> list[TouchEstimate]:
    """Convert what a kernel found (PressEstimate in src/press/choice.hpp)."""
    return [TouchEstimate(one.position, one.depth, one.covariance, one.depth_sigma, one.radius, one.flags, one.wrench, one.lowest)
            for one in found]


def constants_of(kind: type, constants):
    """Make a struct of a kernel from the constants of the same names, of these or of PRESS, with its prior of hypotheses."""
    def values(of: type) -> dict:
        """Of each field of a struct."""
        known = {name: getattr(constants, name, getattr(PRESS, name, None)) for name in dir(of) if name[0] != '_' and name != 'odds'}
        return {name: np.array(value) if isinstance(value, tuple) else value for name, value in known.items()}
    return kind(odds=_core.press.PressOdds(**values(_core.press.PressOdds)), **values(kind))


class TouchMethod(Protocol):
    """A method that is calibrated for one sensor."""

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """Estimate the contacts of one frame; empty without contact."""
