# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The dots that are printed on a photometric gel: their displacements, and slip."""
from __future__ import annotations

from collections.abc import Mapping

import cv2
import numpy as np

from ..common.dots import DotTracks
from ..common.estimates import SlipEstimate
from ..common.surface_points import NON_CONTACT, SLIPPING, STICKING
from ..dots.tracker import make_tracker
from ..layer.estimator import GelEstimator


class PrintedDots:
    """Tracks the dots of a gel frame by frame, and estimates slip from their displacements.

    Parameters
    ----------
    values : Mapping
        Values of PHOTOMETRIC_PARAMETERS.

    Raises
    ------
    BadArgument
        For values that make no tracker, or describe no gel.
    """

    def __init__(self, values: Mapping):
        self._values = dict(values) | {'gel.young_modulus': 0.0, 'gel.pitch': 0.0}  # no forces; gel.scale is the scale
        self.tracker = make_tracker(values, image_only=True)
        self._layer: GelEstimator | None = None

    def set_reference(self) -> None:
        """Take the next frame for the untouched gel."""
        self.tracker.set_reference()

    def slip(self, tracks: DotTracks, shape: tuple[int, int], stamp_s: float) -> SlipEstimate | None:
        """Slip in one frame.

        Parameters
        ----------
        tracks : DotTracks
            Its dots.
        shape : tuple of int
            Rows and columns of the image.
        stamp_s : float
            Its stamp in s.

        Returns
        -------
        SlipEstimate or None
            None where gel.friction or gel.scale is not known.

        Raises
        ------
        BadFrame
            If too few dots are seen.
        """
        if not self._values['gel.friction'] or not self._values['gel.scale']:
            return None
        if self._layer is None:
            self._layer = GelEstimator(self._values, (np.array(shape[::-1]) - 1) / 2)
        return self._layer.slip(tracks, stamp_s)


def dot_states(uv: np.ndarray, touching: np.ndarray, slipping_fraction: float) -> np.ndarray:
    """Contact states of dots.

    Parameters
    ----------
    uv : ndarray, shape (N, 2)
        Their positions in px of the image of contact.
    touching : ndarray of bool, shape (H, W)
        Where the skin lies on an object.
    slipping_fraction : float
        Share of the contact that slips: its border, where slip begins.

    Returns
    -------
    ndarray of uint8, shape (N,)
        NON_CONTACT, STICKING or SLIPPING.
    """
    column, row = np.rint(uv).astype(int).clip(0, np.array(touching.shape[::-1]) - 1).T
    depth = cv2.distanceTransform(np.pad(touching, 1).astype(np.uint8), cv2.DIST_L2, 3)[1:-1, 1:-1]
    border = np.quantile(depth[touching], slipping_fraction) if slipping_fraction > 0 and touching.any() else 0.0
    return np.where(touching[row, column], np.where(depth[row, column] > border, STICKING, SLIPPING), NON_CONTACT).astype(np.uint8)
