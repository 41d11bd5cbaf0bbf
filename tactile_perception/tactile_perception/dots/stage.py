# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stage of all sensors with dots: images in, numbered dots and their 3D positions out."""
from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import partial

from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.stitching.calibration import stitching_from_dict
from tactile_msgs.msg import DotTracks

from ..calibration.files.format import read_calibration
from ..press.calibration import read_touch
from ..touchpad.calibration import read_touchpad
from ..camera_stage import CameraStage, Matrices
from ..press.field import view_maker
from ..press.sensor import MARKER_SENSORS
from ..nodes.messages import conversions as convert
from ..parameters.touchpad import DOT_PARAMETERS
from ..stage import Input
from ..touchpad.places import TouchpadDots
from ..touchpad.sensor import Touchpad, camera_pose
from .tracker import DotTracker, tracker_options


class DotStage(CameraStage):
    """image_raw -> dots, in the sensor frame. Raises BadArgument for wrong values, BadCalibration for a bad file."""

    node, parameters, outputs = 'dot_tracker_node', DOT_PARAMETERS, {'dots': DotTracks}
    input = Input('image_raw', Image, depth=10)  # after a retransmission several arrive at once; chosen

    def __init__(self, values: Mapping):
        super().__init__(values)
        self.sensor = Touchpad.from_parameters(values)
        if self.sensor.cap is not None:
            import scipy.optimize  # noqa: F401 - 0.3 s for which the first image would wait otherwise
        calibrated = self.sensor.cap is not None and values['calibration']
        self._far = 0
        self._water = read_calibration(values['calibration'], 'touchpad', values) if calibrated else None
        self._surface = None
        if values['surface'] in ('sheet', 'dome'):
            from ..press.parameters import marker_sensor  # a touchpad needs no methods of sheets and domes
            self._surface = marker_sensor(values)
        markers = values['sensor_type'] in MARKER_SENSORS and values['calibration']
        self._markers = read_touch(values['calibration'], values['sensor_type']) if markers else None
        if self._markers and self._markers.stitching:
            self.stitching = stitching_from_dict(self._markers.stitching, 'calibration: stitching')
        self.needs_camera = self.sensor.cap is not None or self._surface is not None
        self._frame_id = values['frame_id'] or values['sensor_type']

    def use_frame(self, frame_id: str) -> None:
        """Name the sensor frame, unless the parameter frame_id does."""
        self._frame_id = self.values['frame_id'] or frame_id or self._frame_id

    def make_estimator(self, matrices: Matrices | None, size: tuple[int, int] | None) -> DotTracker:
        """See CameraStage; without a camera dots have no 3D positions."""
        known = {name: self._markers and getattr(self._markers, name) for name in ('pattern', 'rest')}
        if self._surface is not None:
            make_view = view_maker(self._surface, matrices, self._markers and self._markers.stitching, camera_pose(self.values))
            places = self._places(make_view) if make_view else None
            return DotTracker(**tracker_options(self.sensor, self.values, **known), places=places,
                              seam=self.stitching and self.stitching.seam)
        camera = self.sensor.camera(*matrices) if matrices else None
        water = read_touchpad(self.values['calibration'], camera, size) if self._water and camera else None
        return TouchpadDots(self.sensor, camera, self.values, water, **known)

    def _places(self, make_view):
        """The MarkerPlaces of markers; None for a pattern without a grid that is not calibrated."""
        from ..press.positions import MarkerPlaces, SheetSurface, dome_raised
        sensor, known = self._surface, self._markers
        if sensor.is_sheet:
            return MarkerPlaces(sensor, sensor.rows * sensor.columns, make_view, SheetSurface(sensor).raised)
        from ..press.methods import make_method
        count = sensor.rows * sensor.columns if known is None or known.pattern is None else len(known.pattern)
        method = make_method('model', known.fitted('model'), sensor) if known and 'model' in known.methods else None
        return MarkerPlaces(sensor, count, make_view, partial(dome_raised, method)) if count else None

    def estimate(self, message: Image | CompressedImage, stamp_s: float, topics: Collection[str]) -> dict[str, list]:
        """The dots of one image under its stamp."""
        image = image_to_array(message)
        self.use_camera(lambda size: not any(size) or size == image.shape[1::-1])
        if self.estimator is None:
            self.estimator = self.make_estimator(None, None)
        self.check_size(image)
        tracks = self.estimator.process(image, stamp_s)
        return {'dots': [convert.tracks_to_message(tracks, Header(stamp=message.header.stamp, frame_id=self._frame_id))]}

    def set_reference(self) -> None:
        """Take the next frame as the untouched state; an estimator that does not exist yet starts with that."""
        if self.estimator is not None:
            self.estimator.set_reference()

    def health(self) -> tuple[str, dict]:
        """Warns of a missing camera_info, of a reference that may have been taken under a contact, of dots without numbers, and of frames
        since the last call that were too far apart to follow all dots; reports which dots are tracked."""
        if self.estimator is None:
            return '', {}
        warning, unnumbered = self.estimator.warning, self.estimator.unnumbered
        blind = '' if self._camera or not self.needs_camera else (
            'no camera_info: dots have no 3D positions; publish camera_info beside image_raw, or set surface to none')
        jumps, before, self._far = self.estimator.jumps, self._far, self.estimator.links.far
        return unnumbered or blind or warning or (jumps if self._far > before else ''), {
            'reference': warning or 'in order', 'dots': self.estimator.found, 'numbers': unnumbered or 'certain',
            'links': jumps or 'certain'}
