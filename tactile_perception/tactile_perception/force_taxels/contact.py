# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contacts and the contact region from the forces of taxels."""
from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .._core.common import ContactTracker
from .._core.force_taxels import Touch
from ..common.constants import COMMON
from ..common.estimates import ContactEstimate, ContactRegionEstimate
from ..common.surface import Moments
from ..common.surface_points import NON_CONTACT, STICKING
from .taxels import Taxels


@dataclass(frozen=True)
class Forces:
    """Forces of one frame: components (N, 3) along two tangents and inwards, and their variances (N, 3) of noise and offset; both in N, or
    in the unit of the device where its calibration is unknown; touched: (N,) bool; probability: (N,) that a taxel is touched."""

    components: np.ndarray
    variance: np.ndarray
    touched: np.ndarray
    probability: np.ndarray


class ContactFinder:
    """Connected taxels that press are a contact."""

    def __init__(self, taxels: Taxels):
        self._taxels, self._tracker = taxels, ContactTracker()

    def reset(self) -> None:
        """All contacts end."""
        self._tracker.reset()

    def find(self, forces: Forces, is_calibrated: bool, stamp_s: float) -> tuple[list[ContactEstimate], ContactRegionEstimate]:
        """Contacts and the region of all of them; dots of the region are the taxels."""
        taxels, touched = self._taxels, forces.touched
        state = np.where(touched, STICKING, NON_CONTACT).astype(np.uint8)
        region = ContactRegionEstimate(np.arange(len(touched)), state)
        region.dot_confidence = np.where(touched, forces.probability, 1 - forces.probability)
        found = taxels.skin.contacts(forces.components, forces.variance, touched)
        touches = sorted(found.each, key=lambda touch: -touch.count)
        regions = [(touch.label, self._moments(touch)) for touch in touches]
        tracked = self._tracker.assign(found.labels, regions, COMMON.max_step * taxels.pitch, stamp_s)
        contacts = [self._contact(touch, one.number, found.labels, is_calibrated) for touch, one in zip(touches, tracked)]
        if touches:
            region.outlines = [touch.outline for touch in touches]
            self._summarise(region, found.all)
        return contacts, region

    @staticmethod
    def _contact(touch: Touch, number: int, labels: np.ndarray, is_calibrated: bool) -> ContactEstimate:
        """A contact, at its centre of pressure."""
        force = -float(touch.force @ touch.normal) if is_calibrated else np.nan
        return ContactEstimate(number, touch.position, touch.normal, np.nan, force, touch.covariance, 0, labels == touch.label)

    def _moments(self, touch: Touch) -> Moments:
        """Integrals over the cells of taxels."""
        cell = self._taxels.pitch**2
        return Moments(touch.count * cell, cell * touch.normals, cell * touch.positions, cell * touch.squares)

    def _summarise(self, region: ContactRegionEstimate, touch: Touch) -> None:
        """Area, centroid, normal and axes of all contacts together."""
        pitch = self._taxels.pitch
        region.area, region.normal = touch.count * pitch**2, touch.normal
        region.centroid = touch.positions / touch.count
        (x, y, _), (xx, xy, yy) = region.centroid.tolist(), (touch.squares / touch.count).tolist()
        within = (1 / 12) * pitch**2  # variance of a position within a taxel: an even distribution
        a, b, c = xx - x * x + within, xy - x * y, yy - y * y + within
        middle, half = 0.5 * (a + c), math.hypot(0.5 * (a - c), b)
        region.major_axis, region.minor_axis = 4 * math.sqrt(middle + half), 4 * math.sqrt(max(middle - half, 0.0))
        # One cell more along one axis than along the other is no direction.
        if region.major_axis - region.minor_axis > pitch:
            region.orientation = 0.5 * math.atan2(2 * b, a - c)
