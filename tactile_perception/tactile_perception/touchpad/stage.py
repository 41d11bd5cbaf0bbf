# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stage of contact of touchpads, gels and pins: dots in, contact region, contacts, slip and wrench out."""
from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from tactile_msgs.msg import DotTracks

from ..calibration.files.format import read_calibration
from ..camera_stage import CameraStage, Matrices
from ..errors import BadFrame
from ..gel.estimator import GelEstimator, layer_of
from ..gel.pins import SENSOR as PINS, PinEstimator, PinModel
from ..nodes.messages import conversions as convert
from ..parameters.touchpad import REGION_PARAMETERS
from ..stage import Input
from .estimator import ContactEstimator
from .sensor import Touchpad


class ContactRegionStage(CameraStage):
    """dots -> contact_region, contacts, slip, wrench, points; of pins, and of a gel without its friction, no slip. Raises BadArgument for
    wrong values, BadCalibration for a bad file."""

    node, parameters, has_reference = 'contact_region_node', REGION_PARAMETERS, False
    input = Input('dots', DotTracks, depth=1)
    outputs = convert.RESULTS | convert.POINTS

    def __init__(self, values: Mapping):
        super().__init__(values)
        self.sensor = Touchpad.from_parameters(values)
        self._gel, self._pins = values['surface'] == 'gel', values['surface'] == 'pins'
        sized = values['gel.scale'] > 0 or values['gel.pitch'] > 0
        self.needs_camera = values['surface'] == 'cap' or self._gel and not sized
        if self.sensor.cap is not None:
            import scipy.optimize  # noqa: F401 - 0.3 s for which the first image would wait otherwise
        calibrated = self.sensor.cap is not None and values['calibration']
        self.calibration = read_calibration(values['calibration'], 'touchpad', values) if calibrated else None
        if self._pins:
            fitted = values['calibration'] and read_calibration(values['calibration'], PINS, values).fitted
            self._pin_model = PinModel.from_dict(fitted) if fitted else None
            self.estimator = self.make_estimator(None, None)
        if self._gel:
            layer_of(values)  # wrong values are refused now, not with the first camera_info
        if self._gel and sized:
            self.estimator = self.make_estimator(None, None)

    @classmethod
    def can_run(cls, values: Mapping) -> bool:
        """Contact needs the dots' positions in 3D, or the dots of an elastic layer, or pins."""
        return values['surface'] in ('cap', 'gel', 'pins')

    def make_estimator(self, matrices: Matrices | None,
                       size: tuple[int, int] | None) -> ContactEstimator | GelEstimator | PinEstimator | None:
        """See CameraStage; None if the camera is needed and not calibrated. A gel's origin is where the camera looks, else the middle of
        the image, else of the dots."""
        if self._pins:
            return PinEstimator(self.values, self._pin_model)
        if self._gel and matrices:
            return GelEstimator(self.values, matrices[0][:2, 2], float(np.sqrt(matrices[0][0, 0] * matrices[0][1, 1])))
        if self._gel and not self.needs_camera:
            return GelEstimator(self.values, (np.array(size) - 1) / 2 if size and all(size) else None)
        return ContactEstimator(self.sensor, self.sensor.camera(*matrices), self.values, self.calibration) if matrices else None

    def estimate(self, message: DotTracks, stamp_s: float, topics: Collection[str]) -> dict[str, list]:
        """The estimates of the dots of one frame, under their header."""
        tracks = convert.tracks_from_message(message)
        self.use_camera_of(tracks)
        if self.estimator is None:
            raise BadFrame('no usable camera_info yet: places of dots need a calibrated camera, or those of a gel gel.scale or gel.pitch')
        if self._pins or self._gel and not self.values['gel.friction']:
            topics = set(topics) - {'slip'}  # how far a contact is from slipping, displacements alone do not tell
        return convert.results_to_messages(self.estimator.process(tracks, stamp_s), message.header, topics)

    def health(self) -> tuple[str, dict]:
        """Of a gel: what it takes for the scale, the noise, and the errors of the force; of pins: their noise."""
        return self.estimator.health() if (self._gel or self._pins) and self.estimator else ('', {})
