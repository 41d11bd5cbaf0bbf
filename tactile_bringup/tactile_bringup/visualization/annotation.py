# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Converts the messages of one stamp to the annotation of its image."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import cv2
import numpy as np
from sensor_msgs.msg import CameraInfo
from tactile_driver.stitching.calibration import Stitching
from tactile_msgs.msg import ContactRegion, DotTracks
from tactile_perception.common.camera import CameraModel

from . import pictures as colours
from .markers import rings_of, touch_words
from .pictures import Annotation, states_of

_LEGEND = [*zip(colours.STATE_NAMES, colours.STATE_COLOURS), ('displacement', colours.ARROW), ('region', colours.REGION),
           ('contact', colours.CONTACT)]


class Projection:
    """Projects points from the sensor frame to the image.

    message: CameraInfo, which identifies the calibration; matrices: from camera_matrices, None for an uncalibrated camera
    rotation, translation: from sensor to camera frame, as a rotation vector (rad) and a vector (m)
    stitching: calibration of a picture stitched from two views, which has no camera model of its own
    """

    def __init__(self, message: CameraInfo, matrices: tuple | None, rotation: Sequence[float], translation: Sequence[float],
                 stitching: Stitching | None = None):
        self.key, self._project = self.key_of(message), None
        if matrices is not None:
            self._project = CameraModel(*matrices, cv2.Rodrigues(np.array(rotation, float))[0], np.array(translation, float)).project
        elif stitching is not None:
            self._project = partial(stitched_places, stitching)

    @staticmethod
    def key_of(message: CameraInfo) -> tuple:
        """Key that differs between calibrations."""
        return tuple(message.k), tuple(message.d)

    def places(self, xyz: np.ndarray) -> np.ndarray:
        """Image positions (N, 2), px, of the points xyz (N, 3), m, of one object; NaN for an uncalibrated camera or an unknown point."""
        uv = np.full((len(xyz), 2), np.nan)
        known = np.isfinite(xyz).all(axis=1)
        if self._project is not None and known.any():
            uv[known] = self._project(xyz[known])
        return uv


def stitched_places(stitching: Stitching, xyz: np.ndarray) -> np.ndarray:
    """Positions (N, 2), px, of the points xyz (N, 3), m, in a stitched picture.

    The view that shows the mean of the points places all of them.
    """
    left, right = (stitching.origin + stitching.scale * (centre[:2] + (xyz[:, :2] - centre[:2]) * (centre[2] / (centre[2] - xyz[:, 2:])))
                   for centre in stitching.camera_centres)
    return right if stitching.side_of(left.mean(axis=0))[0] else left


def annotation_of(found: Mapping, camera: Projection | None) -> Annotation:
    """Convert messages by topic (dots, contact_region, contacts, slip, wrench; any may be missing) to an annotation."""
    dots, region = found.get('dots') or DotTracks(), found.get('contact_region') or ContactRegion()
    id = np.asarray(dots.id, np.int64)
    what = Annotation(dots.rows, dots.columns, id, np.column_stack([dots.u, dots.v]).astype(float).reshape(-1, 2),
                      np.column_stack([dots.du, dots.dv]).astype(float).reshape(-1, 2),
                      states_of(id, np.asarray(region.dot_id, np.int64), np.asarray(region.dot_state, np.int64)), text=text_of(found),
                      legend=_LEGEND)
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
    """Two lines of text: dots and largest displacement; contact."""
    dots, region = found.get('dots'), found.get('contact_region')
    if dots is None:
        return ['no dots', '']
    moved = np.hypot(dots.du, dots.dv)
    largest = f'{np.nanmax(moved):.1f} px' if np.isfinite(moved).any() else 'not known yet'
    return [f'{len(dots.id)} dots, largest displacement {largest}', contact_line(found, region) if region is not None else '']


def contact_line(found: Mapping, region: ContactRegion) -> str:
    """Area, depth, force, slip state, as far as they are known, and the number of sticking and slipping dots."""
    if not region.outlines:
        return 'nothing touches'
    counts = np.bincount(np.asarray(region.dot_state, np.int64), minlength=3)
    dots = [f'{counts[1]} stick, {counts[2]} slip'] if counts.any() else []
    return ', '.join([f'{1e6 * region.area:.0f} mm2', *touch_words(found), *dots])
