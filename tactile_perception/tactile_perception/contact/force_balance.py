# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What touches, from the membrane's balance: a score for each dot whose half level is the border of the contact."""
from __future__ import annotations

import numpy as np

from ..surface.membrane import Membrane, MembraneState
from .tool_face import heights_over_face

_HALF = 0.5
# An object's rounded edge lifts a dot that touches it by up to about this share of a pitch.
_EDGE_HEIGHT = 0.1


def contact_score(membrane: Membrane, state: MembraneState) -> np.ndarray:
    """Score (K,) of each dot, 0 free to 1 well inside: the object's pressure over the fluid's, less where the dot stands off the object's face.

    Above 0.5 the dot is in contact; the half level between dots is the border. The outermost dots of the grid have no balance and score 0.
    """
    mesh = membrane.mesh
    shape = (mesh.rows, mesh.columns)
    load = np.clip(state.load, 0, 1)
    heights = heights_over_face((load > _HALF).reshape(shape), state.xyz.reshape(*shape, 3), state.normal.reshape(*shape, 3)).ravel()
    limit = _EDGE_HEIGHT * membrane.pitch
    face = 1 - np.nan_to_num(heights) / (2 * limit)
    return np.minimum(load, np.clip(face, 0, 1))
