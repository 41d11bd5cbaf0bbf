# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact score of each dot by the membrane's force balance; the contour at 0.5 is the border of the contact. Free dots beside an object's
edge carry a part of its line load; they are recognised by their height above the object's face."""
from __future__ import annotations

import numpy as np

from ... import _core
from ..membrane.solver import Membrane
from .loads import DotLoads


def contact_score(membrane: Membrane, state: DotLoads) -> np.ndarray:
    """Score (K,) of each dot: half its distance from the contact's border, pitches, plus 1/2, cut to 0, free, and 1, well inside.

    Above 0.5 the dot is in contact. First a score by the dot's load over that further inside, reduced at a patch's edge by its height above
    a paraboloid fitted to the patch; more height is allowed to a heavier dot, and where the free skin beside it rises more steeply. Then
    the distance from the border, by loads, scores and bends of the skin around the dot: src/touchpad/contact/edge_distance.cpp.
    The outermost dots of the grid have no balance and score 0 at first; a single dot scores 0.5 at most, unless it carries a large load, or
    the largest, and one is left with those around it: an error of one range adds none. One that alone sticks out of a straight border
    scores at most a parabola along it.
    """
    mesh = membrane.mesh
    seen = {'rows': mesh.rows, 'columns': mesh.columns, 'pitch': membrane.pitch}
    score = _core.contact_score(state.load, state.xyz, state.normal, **seen)
    return _core.edge_distance(score, state.load, state.xyz, state.normal, **seen)
