# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact estimation of marker sensors from messages to messages, for contact_point_node and process_bag."""
from __future__ import annotations

from collections.abc import Collection, Mapping

from geometry_msgs.msg import WrenchStamped
from tactile_msgs.msg import ContactRegion, Contacts, DotTracks

from ...press.calibration import read_touch
from .camera_side import CameraSide, Matrices
from ...errors import BadArgument, BadFrame
from ...press.field import view_maker
from ..messages import conversions as convert
from ..messages.point_cloud import POINTS
from ...press.parameters import marker_sensor
from ...pipeline.marker_stage import TouchStage
from ...touchpad.sensor import camera_pose

RESULTS = {'contact_region': ContactRegion, 'contacts': Contacts, 'wrench': WrenchStamped}


class TouchMessages(CameraSide):
    """dots -> contacts, contact_region, wrench, points; values: of POINT_PARAMETERS. Raises BadArgument without a calibration file."""

    def __init__(self, values: Mapping):
        super().__init__(values)
        self.sensor = marker_sensor(values)
        if not values['calibration']:
            raise BadArgument(f'parameter calibration is empty: a {self.sensor.type} needs a calibration; record presses '
                              'at known places and run `ros2 run tactile_perception calibrate`')
        self.calibration = read_touch(values['calibration'], self.sensor.type, values)

    @property
    def needs_places(self) -> bool:
        """Always: the viewing plane is metric."""
        return True

    def make_stage(self, matrices: Matrices | None, size: tuple[int, int] | None):
        """See CameraSide; none where the camera is not calibrated."""
        make_view = view_maker(self.sensor, matrices, self.calibration.stitching, camera_pose(self.values))
        return TouchStage(self.sensor, make_view, self.values, self.calibration) if make_view else None

    def on_dots(self, message: DotTracks, topics: Collection[str] = (*RESULTS, *POINTS)) -> dict[str, object]:
        """Topic -> message under the dots' header, for the topics asked for. Raises BadFrame for dots that cannot be used."""
        tracks = convert.tracks_from_message(message)
        self.take_camera_of(tracks)
        if self.stage is None:
            raise BadFrame('no usable camera_info yet: the markers\' places need a calibrated camera')
        with self.stamp_of(message) as stamp_s:
            result = self.stage.process(tracks, stamp_s)
        return convert.results_to_messages(result, message.header, topics)
