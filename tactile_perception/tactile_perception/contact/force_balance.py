# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What touches, from the membrane's balance: a score for each dot whose half level is the border of the contact."""
from __future__ import annotations

import cv2
import numpy as np

from ..surface.membrane import Membrane
from .dot_loads import DotLoads
from .tool_face import heights_over_face

_HALF = 0.5
# An object's rounded edge lifts a dot that touches it by up to about this share of a pitch.
_EDGE_HEIGHT = 0.1


def contact_score(membrane: Membrane, state: DotLoads) -> np.ndarray:
    """Score (K,) of each dot, 0 free to 1 well inside: the object's pressure over that further inside, less where the dot stands off the
    object's face.

    Above 0.5 the dot is in contact; the half level between dots is the border. The outermost dots of the grid have no balance and score 0.
    """
    mesh = membrane.mesh
    shape = (mesh.rows, mesh.columns)
    share = load_share(state.load.reshape(shape))
    loaded = share > _HALF
    if not loaded.any():
        return share.ravel()
    heights = heights_over_face(loaded, state.xyz.reshape(*shape, 3), state.normal.reshape(*shape, 3))
    face = 1 - np.nan_to_num(heights) / (2 * _EDGE_HEIGHT * membrane.pitch)
    return _without_single_dots(np.minimum(share, np.clip(face, 0, 1))).ravel()


def _without_single_dots(score: np.ndarray) -> np.ndarray:
    """score (rows, columns) with dots that alone are over half brought down to it: an error of one range looks like that, an object never
    for long."""
    over = score > _HALF
    return np.where(over & (around(over.astype(np.uint8)) == 0), _HALF, score)


def load_share(load: np.ndarray) -> np.ndarray:
    """load (rows, columns), over the fluid's pressure, as a share of what full contact carries there, 0 to 1.

    That is 1 under a flat face and 2 to 4 under a ball or an edge: on the border of a patch the mean load of the loaded dots around, each
    counted by its load, since beside a ridge most of them carry only what the mesh has spread over them; inside of it every dot is in full
    contact.
    """
    loaded = load > _HALF
    if not loaded.any():
        return np.clip(load, 0, 1)
    carried = np.where(loaded, load, 0.0)
    mean = around(carried * carried) / np.maximum(around(carried), 1e-9)
    return np.clip(load / np.where(around(loaded.astype(np.uint8)) == 8, 1.0, np.maximum(mean, 1.0)), 0, 1)


def around(values: np.ndarray) -> np.ndarray:
    """Sum (rows, columns) of values (rows, columns) over the eight neighbours of each dot; nothing outside the grid counts as 0."""
    return cv2.boxFilter(values, -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT) - values
