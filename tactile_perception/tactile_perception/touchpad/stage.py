# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stage of the touchpad's contact: dots in, contact region, contacts, slip and wrench out."""
from __future__ import annotations

from collections.abc import Collection, Mapping

from tactile_msgs.msg import DotTracks

from ..calibration.files.format import read_calibration
from ..camera_stage import CameraStage, Matrices
from ..errors import BadFrame
from ..nodes.messages import conversions as convert
from ..nodes.messages.point_cloud import POINTS
from ..parameters.touchpad import REGION_PARAMETERS
from ..stage import Input
from .estimator import ContactEstimator
from .sensor import Touchpad


class ContactRegionStage(CameraStage):
    """dots -> contact_region, contacts, slip, wrench, points. Raises BadArgument for wrong values, BadCalibration for a bad file."""

    node, parameters, has_reference = 'contact_region_node', REGION_PARAMETERS, False
    input = Input('dots', DotTracks, depth=1)
    outputs = convert.RESULTS | POINTS

    def __init__(self, values: Mapping):
        super().__init__(values)
        self.sensor = Touchpad.from_parameters(values)
        self.needs_camera = self.can_run(values)
        if self.needs_camera:
            import scipy.optimize  # noqa: F401 - 0.3 s for which the first image would wait otherwise
        calibrated = self.needs_camera and values['calibration']
        self.calibration = read_calibration(values['calibration'], 'touchpad', values) if calibrated else None

    @classmethod
    def can_run(cls, values: Mapping) -> bool:
        """Contact needs the dots' positions in 3D."""
        return values['surface'] == 'cap'

    def make_estimator(self, matrices: Matrices | None, size: tuple[int, int] | None) -> ContactEstimator | None:
        """See CameraStage; None if the camera is not calibrated."""
        return ContactEstimator(self.sensor, self.sensor.camera(*matrices), self.values, self.calibration) if matrices else None

    def estimate(self, message: DotTracks, stamp_s: float, topics: Collection[str]) -> dict[str, list]:
        """The estimates of the dots of one frame, under their header."""
        tracks = convert.tracks_from_message(message)
        self.use_camera_of(tracks)
        if self.estimator is None:
            raise BadFrame('no usable camera_info yet: the rest positions of dots need a calibrated camera')
        return convert.results_to_messages(self.estimator.process(tracks, stamp_s), message.header, topics)
