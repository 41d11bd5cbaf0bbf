# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stages of gels and of domes of pins: images in; dots, contact region, contacts, wrench, and the slip of a gel out."""
from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from std_msgs.msg import Header

from ..common import messages as convert
from ..common.camera_stage import Matrices
from ..common.dots import DotTracks
from ..core.calibration_file import AGAIN, fitted_arrays, read_calibration
from ..core.errors import BadCalibration
from ..dots.stage import DotStage
from ..dots.tracker import DotTracker
from ..layer.estimator import GelEstimator
from ..layer.undeformed import layer_of
from .parameters import GEL_NODE, GEL_PARAMETERS, PINS_NODE, PINS_PARAMETERS
from .pins import SENSOR, PinEstimator, PinModel

GEL = 'gel'  # sensor type, of a gel's calibration
#: Fitted numbers of that, and their shapes.
_FITTED = {'young_modulus': (), 'force_sigma': ()}


class _ImageStage(DotStage):
    """A stage whose contact model takes image positions of dots."""

    def health(self) -> tuple[str, dict]:
        """Health of the dots and of the contact model."""
        warning, values = super().health()
        of_contact, more = self.estimator.contact.health() if self.estimator and self.estimator.contact else ('', {})
        return warning or of_contact, values | more


class GelStage(_ImageStage):
    """image_raw (or dots) -> dots, contact_region, contacts, wrench, points, and slip where the gel's friction is known. Raises BadArgument
    for wrong values, BadCalibration for a bad file."""

    node, parameters, contact_outputs = GEL_NODE, GEL_PARAMETERS, convert.RESULTS | convert.POINTS
    without_contact = 'no usable camera_info arrived: positions on a gel need the parameter gel.pitch or gel.scale, or a calibrated camera'

    def __init__(self, values: Mapping):
        super().__init__(values)
        layer_of(values)  # wrong values are refused now, not with the first camera_info
        self._force_error = {}
        if values['calibration']:
            self._take_calibration(values['calibration'])
        self.needs_camera = not (values['gel.scale'] > 0 or values['gel.pitch'] > 0)

    def _take_calibration(self, path: str) -> None:
        fitted = fitted_arrays(read_calibration(path, GEL, self.values).fitted, _FITTED, path)
        if not fitted['young_modulus'] > 0 or not fitted['force_sigma'] > 0:
            raise BadCalibration(f'{path}: young_modulus and force_sigma must be above 0; {AGAIN}')
        self.values['gel.young_modulus'], self._force_error = fitted['young_modulus'], {'force_error': fitted['force_sigma']}

    def make_contact(self, matrices: Matrices | None, size: tuple[int, int] | None, tracker: DotTracker | None) -> GelEstimator | None:
        """See DotStage. The origin of the sensor frame is at the principal point, else in the middle of the image, else of the dots."""
        if matrices:
            focal = float(np.sqrt(matrices[0][0, 0] * matrices[0][1, 1]))
            return GelEstimator(self.values, matrices[0][:2, 2], focal, **self._force_error)
        if self.needs_camera:
            return None
        return GelEstimator(self.values, (np.array(size) - 1) / 2 if size and all(size) else None, **self._force_error)

    def estimate_contact(self, tracks: DotTracks, stamp_s: float, header: Header, topics: Collection[str]) -> dict[str, list]:
        """See DotStage. Slip is not published without the friction: displacements alone do not show how near a contact is to slipping."""
        return super().estimate_contact(tracks, stamp_s, header, [one for one in topics if one != 'slip' or self.values['gel.friction']])


class PinsStage(_ImageStage):
    """image_raw (or dots) -> dots, contact_region, contacts, wrench (NaN), points. Raises BadArgument for wrong values, BadCalibration for
    a bad file."""

    node, parameters, contact_outputs = PINS_NODE, PINS_PARAMETERS, convert.WITHOUT_SLIP

    def __init__(self, values: Mapping):
        super().__init__(values)
        fitted = values['calibration'] and read_calibration(values['calibration'], SENSOR, values).fitted
        self._model = PinModel.from_dict(fitted) if fitted else None

    def make_contact(self, matrices: Matrices | None, size: tuple[int, int] | None, tracker: DotTracker | None) -> PinEstimator:
        """See DotStage."""
        return PinEstimator(self.values, self._model)
