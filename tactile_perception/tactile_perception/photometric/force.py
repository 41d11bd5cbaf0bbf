# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From the dent of a gel to the force that presses it.

A ball of radius R that is pressed by d into an elastic half-space touches a circle of radius a with a^2 = R d, under a force of
4/3 E* a d (Hertz). The volume V of the skin that lies on it is 3/4 pi a^2 d, and the root of its area A is sqrt(pi) a: the force is
1.00 E* V / sqrt(A), for balls of all radii. Under the flat end of a rod it is 2 E* a d [1]_, or 1.13 E* V / sqrt(A): one law for both.

.. [1] K. L. Johnson, Contact Mechanics, 1985, sections 3.4 and 4.2.
"""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..layer.layer import depressions
from ..layer.undeformed import layer_of
from .constants import PHOTOMETRIC


class ForceLaw:
    """Force of a contact from its volume and area.

    Parameters
    ----------
    modulus : float
        E* = E / (1 - nu^2) in Pa.
    values : Mapping
        Values of LAYER_PARAMETERS; gel.thickness is above 0. A layer resists more than a half-space does: without its thickness, forces of
        a small and a large contact would differ by half.
    """

    def __init__(self, modulus: float, values: Mapping):
        self._modulus, thickness = modulus, values['gel.thickness']
        layer = layer_of(values)
        self._radii = thickness * np.geomspace(*PHOTOMETRIC.table_radii, PHOTOMETRIC.table_size)
        # In a half-space the depression is 3 (1 - nu) / (8 a).
        self._stiffening = 3 * (1 - layer.poisson) / (8 * self._radii) / depressions(layer, self._radii)

    def force(self, volume: float, area: float) -> float:
        """Pressing force in N.

        Parameters
        ----------
        volume : float
            Integral of the depth over the contact in m^3.
        area : float
            Of the contact in m^2.
        """
        stiffening = np.interp(np.sqrt(area / np.pi), self._radii, self._stiffening)
        return float(self._modulus * volume / np.sqrt(area) * stiffening)
