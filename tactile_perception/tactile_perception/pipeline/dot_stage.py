# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dot stage: indexed dots and their 3D positions from an image; run by dot_tracker_node and process_bag."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from ..common.camera import CameraModel
from ..common.dots import DotTracks
from ..dots.detect.methods import DotDetector
from ..dots.index.methods import REGISTER
from ..dots.reference.calibrated_rest import CalibratedRest
from ..dots.reference.drift import Reference
from ..dots.tracker import DotTracker
from ..errors import BadFrame
from ..touchpad.water import WaterModel
from ..touchpad.places import DotPlaces
from ..touchpad.sensor import Touchpad


def make_tracker(sensor: Touchpad, values: Mapping, pattern: np.ndarray | None = None, rest: np.ndarray | None = None) -> DotTracker:
    """A tracker with the given parameters.

    values: of DOT_PARAMETERS; pattern: (K, 2) px, untouched image positions whose order gives the ids of an irregular pattern; rest:
    (K, 2) px, calibrated untouched positions, used to detect contact in the first frame.
    """
    known = None if rest is None else CalibratedRest(rest)
    reference = Reference(values['reference.time_constant'], values['reference.frames'], known)
    numbering = values['numbering'] if pattern is None else REGISTER
    return DotTracker(sensor.rows, sensor.columns, values['polarity'], values['detection'], numbering, reference=reference, pattern=pattern)


def find_pattern(image: np.ndarray, values: Mapping) -> np.ndarray:
    """(K, 2) px, image positions of the dots of the untouched sensor, from top to bottom. Raises BadFrame if there are none."""
    uv = DotDetector(values['polarity'], values['detection']).detect(image).uv
    return uv[np.argsort(uv[:, 1])]


class Places(Protocol):
    """3D positions of dots: DotPlaces, SheetPlaces or DomePlaces."""

    def locate(self, image: np.ndarray, tracks: DotTracks) -> np.ndarray:
        """Positions (N, 3), m, in the sensor frame, of tracks in an image; NaN if unknown. Raises BadFrame."""

    def renew(self) -> None:
        """Discard all state that depends on the reference."""


class DotEstimator:
    """Tracks and locates dots frame by frame.

    camera: None if not calibrated, then a touchpad's dots get no 3D positions; values: of DOT_PARAMETERS; places: 3D positions of the
    dots of other sensors; pattern, rest: see make_tracker; seam: px, column of an image
    stitched from two cameras beyond which the right one sees; None for one camera.
    """

    def __init__(self, sensor: Touchpad, camera: CameraModel | None, values: Mapping, water: WaterModel | None = None,
                 places: Places | None = None, pattern: np.ndarray | None = None, rest: np.ndarray | None = None,
                 seam: float | None = None):
        self._seam = seam
        self._tracker, self._places = make_tracker(sensor, values, pattern, rest), places
        if sensor.cap is not None and camera is not None:
            self._places = DotPlaces(sensor, camera, water)

    @property
    def suspicion(self) -> str:
        """Why the reference may not show the untouched sensor; '' without suspicion."""
        return self._tracker.reference.suspicious

    def set_reference(self) -> None:
        """Use the next frame as the untouched reference."""
        self._tracker.set_reference()
        if self._places is not None:
            self._places.renew()

    def process(self, image: np.ndarray, stamp_s: float) -> DotTracks:
        """Dots of an image, uint8 (H, W) or (H, W, 3) BGR, exposed at stamp_s, s. Raises BadFrame for an unusable image or stamp."""
        if self._seam is not None and not len(self._tracker.reference.id) and not self._shows_both(image):
            raise BadFrame('one of the two views is black: both must be there when the reference is taken; check its camera or topic')
        tracks = self._tracker.process(image, stamp_s)
        if self._places is not None:
            tracks.xyz = self._places.locate(image, tracks)
        return tracks

    def _shows_both(self, image: np.ndarray) -> bool:
        """Whether a stitched image shows both views; the half of a view that is missing is black."""
        seam = round(self._seam)
        return bool(image[:, :seam].any() and image[:, seam + 1:].any())
