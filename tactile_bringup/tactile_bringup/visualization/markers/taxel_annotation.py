# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The annotated image of a taxel array: values in colours, and what the messages of one stamp say, as an annotation."""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from tactile_msgs.msg import ContactRegion

from .. import colours
from ..annotated_image import Annotation
from .messages import rings_of
from .words import SLIP_NAMES, force_word

_LEGEND = [('untouched', tuple(colours.of_depth(np.zeros(1))[0])), ('full', tuple(colours.of_depth(np.ones(1))[0])),
           ('region', colours.REGION), ('contact', colours.CONTACT), ('slip', colours.STATE_COLOURS[2])]
_RING = 0.3  # taxels, radius of the ring at the tip of the slip arrow; chosen


def coloured(values: np.ndarray, full_value: float) -> np.ndarray:
    """values (rows, columns) as colours (rows, columns, 3) uint8 BGR, those of the markers; full_value: the brightest."""
    rgb = colours.of_depth(np.clip(values.astype(float) / full_value, 0, 1).ravel())
    return np.round(255 * rgb[:, 2::-1]).astype(np.uint8).reshape(*values.shape, 3)


def taxel_annotation(found: Mapping, shape: tuple[int, int], sizes: Mapping) -> Annotation:
    """Outlines, contacts, the slip arrow and two lines of text, from messages by topic (contact_region, contacts, slip, wrench; any may be
    missing); shape: (rows, columns); sizes: pitch (m), flow_scale (s), by which a velocity becomes the arrow's length."""
    region = found.get('contact_region') or ContactRegion()
    middle = 0.5 * np.array([shape[1] - 1, shape[0] - 1])

    def places(xy: np.ndarray) -> np.ndarray:
        return xy[:, :2] / sizes['pitch'] + middle

    contacts = found['contacts'].contacts if 'contacts' in found else []
    outlines, holes = ([places(ring) for ring in rings if len(ring)] for rings in rings_of(region))
    what = Annotation(outlines=outlines, holes=holes, radius=_RING, text=_lines(found, region, len(contacts)), legend=_LEGEND)
    what.contacts = places(np.array([(c.position.x, c.position.y) for c in contacts], float).reshape(-1, 2))
    velocity = _velocity(found, region)
    if np.isfinite(velocity).all() and velocity.any():
        what.duv = velocity[None] * (sizes['flow_scale'] / sizes['pitch'])
        what.uv = places(np.array([[region.centroid.x, region.centroid.y]])) + what.duv
        what.id, what.state = np.zeros(1, np.int64), np.array([2])
    return what


def _velocity(found: Mapping, region: ContactRegion) -> np.ndarray:
    """(2,) m/s of the object at the region's centroid; NaN without slip."""
    if 'slip' not in found or not region.outlines or not found['slip'].state:
        return np.full(2, np.nan)
    twist, at = found['slip'].velocity, region.centroid
    turn = np.nan_to_num(twist.angular.z)
    return np.array([twist.linear.x - turn * at.y, twist.linear.y + turn * at.x])


def _lines(found: Mapping, region: ContactRegion, contacts: int) -> list[str]:
    if not region.outlines:
        return ['nothing touches', '']
    force = force_word(found['wrench'].wrench.force) if 'wrench' in found else ''
    first = [f'{contacts} contact{"s" if contacts != 1 else ""}', f'{1e6 * region.area:.0f} mm2', force]
    return [', '.join(filter(None, first)), SLIP_NAMES.get(found['slip'].state, '') if 'slip' in found else '']
