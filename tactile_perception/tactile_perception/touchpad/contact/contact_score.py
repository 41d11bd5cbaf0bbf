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
    """Score (K,) of each dot, 0 free to 1 well inside: its load over that further inside, reduced at a patch's edge by its height above a
    paraboloid fitted to the patch. More height is allowed to a heavier dot, and where the free skin beside it rises more steeply. Beside
    the edge a score also follows the dot's distance from it, which the loads on both its sides tell (lever rule). Where that hardly
    decides, the four dots next to it do: outlines are smooth.

    Above 0.5 the dot is in contact. The outermost dots of the grid have no balance and score 0; a single dot is an error of its range and
    scores 0.5.
    """
    mesh = membrane.mesh
    score = _core.contact_score(state.load, state.xyz, state.normal, rows=mesh.rows, columns=mesh.columns, pitch=membrane.pitch)
    score = _core.place_edges(score, state.load, rows=mesh.rows, columns=mesh.columns)
    return _core.smooth_edges(score, rows=mesh.rows, columns=mesh.columns)
