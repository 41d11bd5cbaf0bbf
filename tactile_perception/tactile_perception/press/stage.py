# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stage of sheets and domes with markers: images in; markers, contacts, contact region and wrench out."""
from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import NamedTuple

from std_msgs.msg import Header

from tactile_driver.stitching.calibration import stitching_from_dict

from ..common import messages as convert
from ..common.camera import camera_pose
from ..common.camera_stage import Matrices
from ..common.dots import DotTracks
from ..dots.stage import DotStage
from ..dots.tracker import DotTracker, tracker_options
from .calibration import read_touch
from .estimator import TouchEstimator
from .field import RestMarkers, checked_view, view_maker
from .methods import make_method
from .parameters import MARKER_PARAMETERS, NODE, marker_sensor
from .positions import MarkerPositions


class MarkerModel(NamedTuple):
    """The untouched markers of a camera, shared by positions and contacts. contact: None if presses are not calibrated."""

    rest: RestMarkers
    positions: MarkerPositions
    contact: TouchEstimator | None


class MarkerStage(DotStage):
    """image_raw (or dots) -> dots, and with a calibration of presses contacts, contact_region, wrench, points.

    Parameters
    ----------
    values : Mapping
        Values of MARKER_PARAMETERS.

    Raises
    ------
    BadArgument
        If the values are inconsistent.
    BadCalibration
        If the calibration file cannot be used.
    """

    node, parameters, needs_camera = NODE, MARKER_PARAMETERS, True
    without_contact = "no usable camera_info yet: the markers' positions need a calibrated camera"

    def __init__(self, values: Mapping):
        self.sensor = marker_sensor(values)
        self._known = read_touch(values['calibration'], self.sensor.type, values) if values['calibration'] else None
        self.contact_outputs = convert.WITHOUT_SLIP if self._known and self._known.methods else {}
        super().__init__(values)
        if self._known and self._known.stitching:
            self.stitching = stitching_from_dict(self._known.stitching, 'calibration: stitching')

    def make_tracker(self, matrices: Matrices | None, size: tuple[int, int] | None) -> DotTracker:
        """Make the tracker of the markers."""
        known = {name: self._known and getattr(self._known, name) for name in ('pattern', 'rest')}
        return DotTracker(**tracker_options(self.values, **known), seam=self.stitching and self.stitching.seam)

    def make_contact(self, matrices: Matrices | None, size: tuple[int, int] | None, tracker: DotTracker | None) -> MarkerModel | None:
        """Make the model; None without a calibrated camera, since the viewing plane is metric, and for a pattern of unknown size."""
        known, sensor = self._known, self.sensor
        make_view = view_maker(sensor, matrices, known and known.stitching, camera_pose(self.values))
        count = sensor.rows * sensor.columns if known is None or known.pattern is None else len(known.pattern)
        if make_view is None or not count:
            return None
        rest = RestMarkers(count, checked_view(make_view, known and known.rest))
        contact = TouchEstimator(sensor, rest, self.values, known) if self.contact_outputs else None
        method = contact and contact.model
        if method is None and not sensor.is_sheet and known and 'model' in known.methods:
            method = make_method('model', known.fitted('model'), sensor)
        return MarkerModel(rest, MarkerPositions(sensor, method), contact)

    def estimate_contact(self, tracks: DotTracks, stamp_s: float, header: Header, topics: Collection[str]) -> dict[str, list]:
        """Estimate the contacts and, from the same solution, the positions of the markers."""
        model = self.estimator.contact
        if model is None:
            return super().estimate_contact(tracks, stamp_s, header, topics)
        of_contact = [topic for topic in topics if topic in self.contact_outputs]
        if of_contact:
            model.contact.check(tracks, stamp_s)
        field = model.rest.field(tracks, stamp_s)
        result = model.contact.touches(tracks, field, stamp_s) if of_contact else None
        if not self._takes_dots and ('dots' in topics or 'points' in topics):
            tracks.xyz = model.positions.xyz(field)[tracks.id]
        return convert.results_to_messages(result, header, of_contact) if of_contact else {}
