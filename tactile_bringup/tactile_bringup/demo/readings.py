# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Converts the messages of one frame, checked before, to the numbers that the demo shows."""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .summary import Reading
from ..visualization.markers.words import SLIP_NAMES


def reading_of(found: Mapping, stamp_s: float, latency_s: float) -> Reading:
    """The numbers of a frame. found: topic (dots, contact_region, contacts, slip, wrench) -> message that passed check_message; any may
    be missing."""
    values = {}
    if 'dots' in found:
        dots = found['dots']
        moved = np.hypot(dots.du, dots.dv)
        values.update(dots=len(dots.id), displacement=float(np.nanmax(moved)) if np.isfinite(moved).any() else float('nan'))
    if 'contact_region' in found:
        values.update(_region(found['contact_region']))
    if 'contacts' in found:
        depths = [c.depth for c in found['contacts'].contacts if np.isfinite(c.depth)]
        values.update(touches=len(found['contacts'].contacts), depth=max(depths) if depths else float('nan'))
    if 'wrench' in found and values.get('touches'):
        force = found['wrench'].wrench.force
        values['force'] = float(np.linalg.norm((force.x, force.y, force.z)))
    if 'slip' in found and values.get('touches'):
        values.update(slip=SLIP_NAMES.get(found['slip'].state, ''), slipping=found['slip'].slipping_fraction)
    return Reading(stamp_s, latency_s, **values)


def _region(region) -> dict:
    translation, rotation = region.motion.translation, region.motion.rotation
    axis = np.array([rotation.x, rotation.y, rotation.z])
    # The angle from the vector part: near zero rotation the cosine in w has no resolution.
    length = np.linalg.norm(axis)
    turn = axis * (2 * np.arctan2(length, abs(rotation.w)) / length * np.sign(rotation.w or 1.0)) if length > 0 else axis
    return {'states': tuple(np.bincount(np.asarray(region.dot_state, np.int64), minlength=3)[:3].tolist()), 'area': region.area,
            'motion': (translation.x, translation.y, translation.z, *turn.tolist()), 'motion_interval': region.motion_interval}
