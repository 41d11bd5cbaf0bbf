# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the published detectors of dots share."""
from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from ..common.dots import Dots


class PublishedDetector(ABC):
    """Dots or markers of single images, as a paper finds them.

    Parameters
    ----------
    sign : int
        1 for bright dots, -1 for dark ones.
    """

    def __init__(self, sign: int):
        self._sign = sign

    @abstractmethod
    def detect(self, image: np.ndarray) -> Dots:
        """Find the dots of one image.

        Parameters
        ----------
        image : ndarray of uint8, shape (H, W) or (H, W, 3)
            A checked image.

        Returns
        -------
        Dots
            The papers state no noise, so sigma is NaN.

        Raises
        ------
        BadFrame
            If there are no dots.
        """
