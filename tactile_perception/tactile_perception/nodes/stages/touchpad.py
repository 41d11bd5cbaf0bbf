# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The touchpad's stages from message to message, shared by live nodes and process_bag."""
from __future__ import annotations

from collections.abc import Collection, Mapping

from geometry_msgs.msg import WrenchStamped
from sensor_msgs.msg import CompressedImage, Image, TimeReference
from std_msgs.msg import Header
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.stitching.calibration import stitching_from_dict
from tactile_msgs.msg import ContactRegion, Contacts, DotTracks, Slip

from ...calibration.files.format import read_calibration
from ...calibration.files.markers import read_touch
from ...touchpad.calibration import read_touchpad
from .camera_side import CameraSide, Matrices
from ...common.camera import CameraModel
from ...errors import BadFrame
from ...markers.view.camera_views import view_maker
from ...markers.view.sensor import MARKER_SENSORS
from ..messages import conversions as convert
from ..messages.point_cloud import POINTS
from ...pipeline.contact_stage import ContactStage
from ...pipeline.dot_stage import DotStage
from ...touchpad.sensor import Touchpad, camera_pose

RESULTS = {'contact_region': ContactRegion, 'contacts': Contacts, 'slip': Slip, 'wrench': WrenchStamped}

_SKEWS = 32  # pictures whose right exposure is kept; chosen: more than wait in the subscription


class _TouchpadSide(CameraSide):
    """Sensor and calibration, common to dots and contact."""

    def __init__(self, values: Mapping):
        super().__init__(values)
        self.sensor = Touchpad.from_parameters(values)
        if self.sensor.cap is not None:
            import scipy.optimize  # noqa: F401 - 0.3 s for which the first image would wait otherwise
        places = self.sensor.cap is not None and values['calibration']
        self.calibration = read_calibration(values['calibration'], 'touchpad', values) if places else None

    @property
    def needs_places(self) -> bool:
        """Whether dots get 3D positions."""
        return self.sensor.cap is not None

    def _model(self, matrices: Matrices | None) -> CameraModel | None:
        return self.sensor.camera(*matrices) if matrices else None


class DotMessages(_TouchpadSide):
    """image_raw -> dots of any sensor that has them; values: of DOT_PARAMETERS. frame_id: of the dots, the sensor frame."""

    def __init__(self, values: Mapping):
        super().__init__(values)
        self._surface = None
        if values['surface'] in ('sheet', 'dome'):
            from ...parameters.markers import marker_sensor  # a touchpad needs no methods of sheets and domes
            self._surface = marker_sensor(values)
        markers = values['sensor_type'] in MARKER_SENSORS and values['calibration']
        self._markers = read_touch(values['calibration'], values['sensor_type']) if markers else None
        self.frame_id = values['frame_id'] or values['sensor_type']
        self._skews: dict[int, float] = {}  # s, of the right view, by the picture's stamp, ns

    @property
    def needs_places(self) -> bool:
        """Whether dots get 3D positions."""
        return super().needs_places or self._surface is not None

    def make_stage(self, matrices: Matrices | None, size: tuple[int, int] | None):
        """See CameraSide; without a camera dots have no 3D positions."""
        known = {name: self._markers and getattr(self._markers, name) for name in ('pattern', 'rest')}
        if self._surface is not None:
            make_view = view_maker(self._surface, matrices, self._markers and self._markers.stitching, camera_pose(self.values))
            return DotStage(self.sensor, None, self.values, places=self._places(make_view) if make_view else None,
                            right=self._right_shutter(), **known)
        camera = self._model(matrices)
        water = read_touchpad(self.values['calibration'], camera, size) if self.calibration and camera else None
        return DotStage(self.sensor, camera, self.values, water, **known)

    def _right_shutter(self):
        """The RightShutter of two cameras; None for one."""
        if not self.two_cameras:
            return None
        from ...pipeline.shutters import right_shutter
        return right_shutter(stitching_from_dict(self._markers.stitching, 'calibration: stitching'), self._surface)

    def _places(self, make_view):
        """The SheetPlaces or DomePlaces of markers; None for a pattern without a grid that is not calibrated."""
        sensor, known = self._surface, self._markers
        if sensor.is_sheet:
            from ...markers.places.sheet import SheetPlaces
            return SheetPlaces(sensor, make_view)
        from ...markers.places.dome import DomePlaces
        from ...markers.methods import make_method
        count = sensor.rows * sensor.columns if known is None or known.pattern is None else len(known.pattern)
        method = make_method('model', known.fitted('model'), sensor) if known and 'model' in known.methods else None
        return DomePlaces(sensor, count, make_view, method) if count else None

    @property
    def suspicion(self) -> str:
        """Why the reference may not show the untouched sensor, '' if it is in order."""
        return self.stage.suspicion if self.stage is not None else ''

    def set_reference(self) -> None:
        """Take the next frame as the untouched state; a stage that does not exist yet starts with that."""
        if self.stage is not None:
            self.stage.set_reference()

    @property
    def two_cameras(self) -> bool:
        """Whether images are stitched from two cameras."""
        return bool(self._markers and self._markers.stitching)

    def on_right_time(self, message: TimeReference) -> None:
        """Take the exposure of the right view of a picture that follows. Raises BadFrame for an invalid time."""
        self._skews[convert.stamp_ns_of(message.header)] = convert.skew_of(message)
        while len(self._skews) > _SKEWS:
            del self._skews[next(iter(self._skews))]

    def on_image(self, message: Image | CompressedImage) -> DotTracks:
        """The dots of one image under its stamp; those of the right one of two views at that stamp too.

        Raises BadFrame for an image that cannot be used.
        """
        if self.needs_camera:
            raise BadFrame('no camera_info: 3D positions need the camera; publish camera_info beside image_raw, or set surface to none')
        image = image_to_array(message)
        self.take_camera(lambda size: not any(size) or size == image.shape[1::-1])
        if self.stage is None:
            self.stage = self.make_stage(None, None)
        self.check_size(image)
        skew_s = self._skews.get(convert.stamp_ns_of(message.header), 0.0)
        with self.stamp_of(message) as stamp_s:
            tracks = self.stage.process(image, stamp_s, skew_s)
        return convert.tracks_to_message(tracks, Header(stamp=message.header.stamp, frame_id=self.frame_id))


class ContactMessages(_TouchpadSide):
    """dots -> contact_region, contacts, slip, wrench, points; values: of REGION_PARAMETERS."""

    def make_stage(self, matrices: Matrices | None, size: tuple[int, int] | None):
        """See CameraSide; None if the camera is not calibrated."""
        camera = self._model(matrices)
        return ContactStage(self.sensor, camera, self.values, self.calibration) if camera else None

    def on_dots(self, message: DotTracks, topics: Collection[str] = (*RESULTS, *POINTS)) -> dict[str, object]:
        """Topic -> message under the dots' header, for the topics asked for. Raises BadFrame for dots that cannot be used."""
        tracks = convert.tracks_from_message(message)
        self.take_camera_of(tracks)
        if self.stage is None:
            raise BadFrame('no usable camera_info yet: the rest positions of dots need a calibrated camera')
        with self.stamp_of(message) as stamp_s:
            result = self.stage.process(tracks, stamp_s)
        return convert.results_to_messages(result, message.header, topics)
