# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stage of a photometric gel: images in; contact region, contacts, points and wrench out; of a gel with markers also dots and
slip."""
from __future__ import annotations

from collections.abc import Collection, Mapping

from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

from tactile_driver.nodes.messages.images import image_to_array
from tactile_msgs.msg import DotTracks as DotTracksMessage

from ..common import messages as convert
from ..core.calibration_file import read_calibration
from ..core.errors import BadFrame
from ..core.stage import Input, Stage
from .estimator import PhotometricEstimator, PhotometricResult
from .force import ForceLaw
from .markers import PrintedDots
from .model import DepthModel
from .parameters import PHOTOMETRIC_NODE, PHOTOMETRIC_PARAMETERS, SENSOR

_OF_DOTS = {'dots', 'slip', 'contact_region'}  # topics whose content depends on printed dots


class PhotometricStage(Stage):
    """image_raw -> contact_region, contacts, points, wrench; dots and slip of a gel with markers.

    model: DepthModel, None without a calibration.

    Parameters
    ----------
    values : Mapping
        Values of PHOTOMETRIC_PARAMETERS.

    Raises
    ------
    BadCalibration
        If the calibration file cannot be used.
    BadArgument
        For wrong values.
    """

    node, parameters = PHOTOMETRIC_NODE, PHOTOMETRIC_PARAMETERS
    input = Input('image_raw', Image, depth=10)
    outputs = convert.RESULTS | convert.POINTS | {'dots': DotTracksMessage}

    def __init__(self, values: Mapping):
        super().__init__(values)
        path = values['calibration']
        self.model = DepthModel.from_dict(read_calibration(path, SENSOR, values).fitted, path) if path else None
        self._frame_id = values['frame_id'] or SENSOR
        self.reset()

    def use_frame(self, frame_id: str) -> None:
        """See Stage."""
        self._frame_id = self.values['frame_id'] or frame_id or self._frame_id

    def reset(self) -> None:
        """Drop all earlier images, and the reference."""
        is_known, self.estimator = self.model is not None and self.values['gel.scale'] > 0, None
        if is_known:
            has_force = self.model.modulus and self.values['gel.thickness']
            force = ForceLaw(self.model.modulus, self.values) if has_force else None
            self.estimator = PhotometricEstimator(self.model, self.values['gel.scale'], force)
        self.dots = PrintedDots(self.values) if self.values['gel.markers'] else None

    def set_reference(self) -> None:
        """Take the images of the next second for the untouched gel."""
        if self.estimator is not None:
            self.estimator.set_reference()
        if self.dots is not None:
            self.dots.set_reference()

    def estimate(self, message: Image | CompressedImage, stamp_s: float, topics: Collection[str]) -> dict[str, list]:
        """The estimates of one image; without a calibration only dots. A BadFrame of the dots holds the others."""
        image = image_to_array(message)
        header = Header(stamp=message.header.stamp, frame_id=self._frame_id)
        result = self.estimator.process(image, stamp_s) if self.estimator is not None else None
        if self.dots is None or not _OF_DOTS & {*topics}:
            return self._messages(result, header, topics)
        try:
            tracks = self.dots.tracker.process(image, stamp_s)
            slip = self.dots.slip(tracks, image.shape[:2], stamp_s) if {'slip', 'contact_region'} & {*topics} else None
        except BadFrame as error:
            error.partial = self._messages(result, header, topics)
            raise
        if result is not None:
            result, tracks = result.with_dots(tracks, slip, image.shape[1])
        dots = {'dots': [convert.tracks_to_message(tracks, header)]} if 'dots' in topics else {}
        return dots | self._messages(result, header, topics)

    @staticmethod
    def _messages(result: PhotometricResult | None, header: Header, topics: Collection[str]) -> dict[str, list]:
        """Those of the topics that are known."""
        if result is None:
            return {}
        return convert.results_to_messages(result, header, [one for one in topics if one != 'slip' or result.slip is not None])

    def health(self) -> tuple[str, dict]:
        """Warns of a missing calibration, of a gel or light that is not that of the calibration, and of dots without a reference."""
        values = {} if self.dots is None else {'dots': self.dots.tracker.found}
        if self.model is not None and self.model.modulus:
            values['standard deviation of the force'] = f'{self.model.force_error:.0%} of it'
        if self.estimator is None:
            return ('nothing is estimated: set gel.scale and calibration; press a ball of known radius at twenty positions '
                    '(docs/photometric_gel.md)'), values
        return self.estimator.warning or (self.dots.tracker.warning if self.dots else ''), values
