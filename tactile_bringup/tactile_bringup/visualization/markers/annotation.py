# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From the messages of one stamp to what is drawn on its image."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import cv2
import numpy as np
from sensor_msgs.msg import CameraInfo
from tactile_driver.stitching.calibration import Stitching
from tactile_msgs.msg import ContactRegion, DotTracks, Slip
from tactile_perception.common.camera import CameraModel

from ..annotated_image import Annotation, states_of
from .messages import rings_of

SLIP_NAMES = {Slip.NONE: 'no slip', Slip.INCIPIENT: 'incipient slip', Slip.GROSS: 'gross slip'}


class Projection:
    """Sensor frame to image, by a camera_info and the camera's place; matrices: of camera_matrices, None where it is not calibrated;
    stitching: of a picture made of two views, which has no camera of its own."""

    def __init__(self, message: CameraInfo, matrices: tuple | None, rotation: Sequence[float], translation: Sequence[float],
                 stitching: Stitching | None = None):
        self.key, self._project = self.key_of(message), None
        if matrices is not None:
            self._project = CameraModel(*matrices, cv2.Rodrigues(np.array(rotation, float))[0], np.array(translation, float)).project
        elif stitching is not None:
            self._project = partial(stitched_places, stitching)

    @staticmethod
    def key_of(message: CameraInfo) -> tuple:
        """What tells one calibration from another."""
        return tuple(message.k), tuple(message.d)

    def places(self, xyz: np.ndarray) -> np.ndarray:
        """Image places (N, 2), px, of one thing's xyz (N, 3), m; NaN where the camera is not calibrated or a place is not known."""
        uv = np.full((len(xyz), 2), np.nan)
        known = np.isfinite(xyz).all(axis=1)
        if self._project is not None and known.any():
            uv[known] = self._project(xyz[known])
        return uv


def stitched_places(stitching: Stitching, xyz: np.ndarray) -> np.ndarray:
    """(N, 2) px of a stitched picture: where xyz (N, 3), m, appear, all as the camera sees them on whose side their middle appears."""
    left, right = (stitching.origin + stitching.scale * (eye[:2] + (xyz[:, :2] - eye[:2]) * (eye[2] / (eye[2] - xyz[:, 2:])))
                   for eye in stitching.eyes)
    return right if stitching.side_of(left.mean(axis=0))[0] else left


def annotation_of(found: Mapping, camera: Projection | None) -> Annotation:
    """What messages by topic (dots, contact_region, contacts, slip; any may be missing) say of the image that they belong to."""
    dots, region = found.get('dots') or DotTracks(), found.get('contact_region') or ContactRegion()
    id = np.asarray(dots.id, np.int64)
    what = Annotation(dots.rows, dots.columns, id, np.column_stack([dots.u, dots.v]).astype(float).reshape(-1, 2),
                      np.column_stack([dots.du, dots.dv]).astype(float).reshape(-1, 2),
                      states_of(id, np.asarray(region.dot_id, np.int64), np.asarray(region.dot_state, np.int64)), text=text_of(found))
    if np.isfinite(dots.area).any():
        what.radius = float(np.sqrt(np.nanmedian(dots.area) / np.pi))
    if camera is not None:
        what.outlines, what.holes = ([uv for uv in map(camera.places, rings) if np.isfinite(uv).all() and len(uv)]
                                     for rings in rings_of(region))
        contacts = found['contacts'].contacts if 'contacts' in found else []
        what.contacts = np.array([camera.places(np.array([(c.position.x, c.position.y, c.position.z)], float))[0] for c in contacts],
                                 float).reshape(-1, 2)
    return what


def text_of(found: Mapping) -> list[str]:
    """Two lines of numbers."""
    dots, region = found.get('dots'), found.get('contact_region')
    if dots is None:
        return ['no dots', '']
    moved = np.hypot(dots.du, dots.dv)
    largest = f'{np.nanmax(moved):.1f} px' if np.isfinite(moved).any() else 'not known yet'
    return [f'{len(dots.id)} dots, largest displacement {largest}', contact_line(found, region) if region is not None else '']


def contact_line(found: Mapping, region: ContactRegion) -> str:
    """Area, depth, force, slip and the number of dots in each state, as far as they are known."""
    if not region.outlines:
        return 'nothing touches'
    counts = np.bincount(np.asarray(region.dot_state, np.int64), minlength=3)
    words = [f'{1e6 * region.area:.0f} mm2']
    contacts = found['contacts'].contacts if 'contacts' in found else []
    depths = [c.depth for c in contacts if np.isfinite(c.depth)]
    if depths:
        words.append(f'{1e3 * max(depths):.1f} mm deep')
    if 'wrench' in found:
        words.append(force_word(found['wrench'].wrench.force))
    words.append(f'{counts[1]} stick, {counts[2]} slip')
    if 'slip' in found:
        words.append(SLIP_NAMES.get(found['slip'].state, ''))
    return ', '.join(word for word in words if word)


def force_word(force) -> str:
    """The force's size; where only its part along z is known, that."""
    size = float(np.linalg.norm([force.x, force.y, force.z]))
    if np.isfinite(size):
        return f'{size:.1f} N'
    return f'{abs(force.z):.1f} N along z' if np.isfinite(force.z) else ''
