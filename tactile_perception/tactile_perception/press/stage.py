# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stage of sheets and domes: dots in, contacts, contact region and wrench out."""
from __future__ import annotations

from collections.abc import Collection, Mapping

from geometry_msgs.msg import WrenchStamped
from tactile_msgs.msg import ContactRegion, Contacts, DotTracks

from .calibration import read_touch
from ..camera_stage import CameraStage, Matrices
from ..errors import BadArgument, BadFrame
from ..nodes.messages import conversions as convert
from .parameters import POINT_PARAMETERS, marker_sensor
from ..press.estimator import TouchEstimator
from ..stage import Input
from ..touchpad.sensor import camera_pose
from .field import view_maker


class ContactPointStage(CameraStage):
    """dots -> contacts, contact_region, wrench, points. Raises BadArgument without a calibration file, BadCalibration for a bad one."""

    node, parameters, has_reference = 'contact_point_node', POINT_PARAMETERS, False
    input = Input('dots', DotTracks, depth=1)
    outputs = {'contact_region': ContactRegion, 'contacts': Contacts, 'wrench': WrenchStamped, **convert.POINTS}

    def __init__(self, values: Mapping):
        super().__init__(values)
        self.sensor = marker_sensor(values)
        if not values['calibration']:
            raise BadArgument(f'parameter calibration is empty: a {self.sensor.type} needs a calibration; record presses '
                              'at known positions and run `ros2 run tactile_perception calibrate`')
        self.calibration = read_touch(values['calibration'], self.sensor.type, values)

    @classmethod
    def can_run(cls, values: Mapping) -> bool:
        """Contacts need a calibration with presses."""
        return bool(values['calibration'] and read_touch(values['calibration'], values['sensor_type']).methods)

    def make_estimator(self, matrices: Matrices | None, size: tuple[int, int] | None) -> TouchEstimator | None:
        """See CameraStage; None where the camera is not calibrated: the viewing plane is metric."""
        make_view = view_maker(self.sensor, matrices, self.calibration.stitching, camera_pose(self.values))
        return TouchEstimator(self.sensor, make_view, self.values, self.calibration) if make_view else None

    def estimate(self, message: DotTracks, stamp_s: float, topics: Collection[str]) -> dict[str, list]:
        """The estimates of the dots of one frame, under their header."""
        tracks = convert.tracks_from_message(message)
        self.use_camera_of(tracks)
        if self.estimator is None:
            raise BadFrame('no usable camera_info yet: the markers\' positions need a calibrated camera')
        return convert.results_to_messages(self.estimator.process(tracks, stamp_s), message.header, topics)
