# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stage of a photometric gel: images in; contact region, contacts, points and wrench (NaN) out."""
from __future__ import annotations

from collections.abc import Collection, Mapping

from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

from tactile_driver.nodes.messages.images import image_to_array

from ..common import messages as convert
from ..core.calibration_file import read_calibration
from ..core.stage import Input, Stage
from .estimator import PhotometricEstimator
from .model import DepthModel
from .parameters import PHOTOMETRIC_NODE, PHOTOMETRIC_PARAMETERS, SENSOR


class PhotometricStage(Stage):
    """image_raw -> contact_region, contacts, points, wrench.

    Parameters
    ----------
    values : Mapping
        Values of PHOTOMETRIC_PARAMETERS.

    Raises
    ------
    BadCalibration
        If the calibration file cannot be used.
    """

    node, parameters = PHOTOMETRIC_NODE, PHOTOMETRIC_PARAMETERS
    input = Input('image_raw', Image, depth=10)
    outputs = convert.WITHOUT_SLIP

    def __init__(self, values: Mapping):
        super().__init__(values)
        path = values['calibration']
        self._model = DepthModel.from_dict(read_calibration(path, SENSOR, values).fitted, path) if path else None
        self._frame_id = SENSOR
        self.reset()

    def use_frame(self, frame_id: str) -> None:
        """See Stage."""
        self._frame_id = frame_id or self._frame_id

    def reset(self) -> None:
        """Drop all earlier images, and the reference."""
        is_known = self._model is not None and self.values['gel.scale'] > 0
        self.estimator = PhotometricEstimator(self._model, self.values['gel.scale']) if is_known else None

    def set_reference(self) -> None:
        """Take the images of the next second for the untouched gel."""
        if self.estimator is not None:
            self.estimator.set_reference()

    def estimate(self, message: Image | CompressedImage, stamp_s: float, topics: Collection[str]) -> dict[str, list]:
        """The estimates of one image; none without a calibration."""
        image = image_to_array(message)
        if self.estimator is None:
            return {}
        header = Header(stamp=message.header.stamp, frame_id=self._frame_id)
        return convert.results_to_messages(self.estimator.process(image, stamp_s), header, topics)

    def health(self) -> tuple[str, dict]:
        """Warns of a missing calibration, and of a gel or light that is not that of the calibration."""
        if self.estimator is None:
            return ('nothing is estimated: set gel.scale and calibration; press a ball of known radius at twenty positions '
                    '(docs/photometric_gel.md)'), {}
        return self.estimator.warning, {}
