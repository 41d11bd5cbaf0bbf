# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The touchpad's stages from message to message: what a live node computes, process_bag computes by the same lines."""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from geometry_msgs.msg import WrenchStamped
from sensor_msgs.msg import CameraInfo, Image
from tactile_msgs.msg import ContactRegion, Contacts, DotTracks, Slip

from ..calibration.files import read_calibration
from ..calibration.touchpad_file import read_touchpad
from ..camera import CameraModel
from ..errors import BadFrame
from ..pipeline.clock import StampClock
from ..pipeline.contact_stage import ContactStage
from ..pipeline.dot_stage import DotStage
from ..pipeline.sensor import Touchpad
from . import conversions as convert

RESULTS = {'contact_region': ContactRegion, 'contacts': Contacts, 'slip': Slip, 'wrench': WrenchStamped}


class _WithCamera:
    """A stage that begins once the camera is known, and anew when another camera_info comes."""

    def __init__(self, values: Mapping):
        self.sensor = Touchpad.from_parameters(values)
        self.values = values
        self.calibration = read_calibration(values['calibration'], 'touchpad') if values['calibration'] else None
        self.stage = None
        self._camera, self._size = None, (0, 0)
        self._model: CameraModel | None = None
        self._clock = StampClock()

    @property
    def needs_camera(self) -> bool:
        """Whether messages have to wait for a camera_info: none has come, and places in 3D need it."""
        return self._camera is None and self.stage is None and self.sensor.cap is not None

    def on_camera_info(self, message: CameraInfo) -> None:
        """Take the camera's K and distortion. Raises BadFrame where they cannot be used."""
        key = (tuple(message.k), tuple(message.d), message.distortion_model, message.width, message.height)
        if key != self._camera:
            matrices = convert.camera_matrices(message)
            self._model = self.sensor.camera(*matrices) if matrices else None
            self.stage = self.make_stage(self._model, (message.width, message.height))
            self._camera, self._size = key, (message.width, message.height)

    def stamp_of(self, message: Image | DotTracks) -> float:
        """The message's stamp, s; the stage begins anew where stamps do. Raises ClockSetBack for the first that went back."""
        stamp_s = convert.stamp_seconds(message.header)
        if self._clock.begins_anew(stamp_s):
            self.stage = self.make_stage(self._model, self._size if self._camera else None)
        return stamp_s

    def check_size(self, image: np.ndarray) -> None:
        """Raise BadFrame where an image (H, W, ...) is not of the size, px, that camera_info is for (0 x 0: it does not say)."""
        if any(self._size) and image.shape[1::-1] != self._size:
            found, told = (f'{width} x {height} px' for width, height in (image.shape[1::-1], self._size))
            raise BadFrame(f'image is {found}, camera_info is for {told}; places in 3D would be wrong: publish camera_info of this size')


class DotMessages(_WithCamera):
    """image_raw -> dots; values: of DOT_PARAMETERS."""

    def make_stage(self, camera: CameraModel | None, size: tuple[int, int] | None):
        """The stage for a camera (None: not calibrated, so no places in 3D) with images of size (width, height) px."""
        water = read_touchpad(self.values['calibration'], camera, size) if self.calibration and camera else None
        return DotStage(self.sensor, camera, self.values, water)

    @property
    def suspicion(self) -> str:
        """Why the reference may not be of the untouched sensor, '' where nothing speaks against it."""
        return self.stage.suspicion if self.stage is not None else ''

    def set_reference(self) -> bool:
        """Take the next frame as the untouched state; whether there are frames to take it from."""
        if self.stage is None:
            return False
        self.stage.set_reference()
        return True

    def on_image(self, message: Image) -> DotTracks:
        """The dots of one image under its header. Raises BadFrame for an image that cannot be used."""
        if self.needs_camera:
            raise BadFrame('no camera_info: places in 3D need the camera; publish camera_info beside image_raw, or set surface to none')
        if self.stage is None:
            self.stage = self.make_stage(None, None)
        image = convert.image_to_array(message)
        self.check_size(image)
        stamp_s = self.stamp_of(message)
        tracks = self.stage.process(image, stamp_s)
        return convert.tracks_to_message(tracks, message.header)


class ContactMessages(_WithCamera):
    """dots -> contact_region, contacts, slip, wrench; values: of REGION_PARAMETERS."""

    def make_stage(self, camera: CameraModel | None, size: tuple[int, int] | None):
        """The stage for a camera; none where it is not calibrated."""
        return ContactStage(self.sensor, camera, self.values, self.calibration) if camera else None

    def on_dots(self, message: DotTracks) -> dict[str, object]:
        """Topic -> message under the dots' header. Raises BadFrame for dots that cannot be used."""
        if self.stage is None:
            raise BadFrame('no usable camera_info yet: the rest places of dots need a calibrated camera')
        stamp_s = self.stamp_of(message)
        result = self.stage.process(convert.tracks_from_message(message), stamp_s)
        header = message.header
        return {
            'contact_region': convert.region_to_message(result.region, header),
            'contacts': convert.contacts_to_message(result.contacts, header),
            'slip': convert.slip_to_message(result.slip, header),
            'wrench': convert.wrench_to_message(result.wrench, header),
        }
