# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stage of a touchpad: images in; dots, contact region, contacts, slip and wrench out."""
from __future__ import annotations

from collections.abc import Mapping

from ..common import messages as convert
from ..common.camera_stage import Matrices
from ..core.calibration_file import read_calibration
from ..dots.stage import DotStage
from ..dots.tracker import DotTracker
from .calibration import read_touchpad
from .estimator import ContactEstimator
from .parameters import NODE, TOUCHPAD_PARAMETERS
from .positions import touchpad_tracker
from .sensor import Touchpad


class TouchpadStage(DotStage):
    """image_raw (or dots) -> dots, contact_region, contacts, slip, wrench, points.

    Parameters
    ----------
    values : Mapping
        Values of TOUCHPAD_PARAMETERS.

    Raises
    ------
    BadArgument
        If the values are inconsistent.
    BadCalibration
        If the calibration file cannot be used.
    """

    node, parameters, needs_camera = NODE, TOUCHPAD_PARAMETERS, True
    contact_outputs = convert.RESULTS | convert.POINTS
    without_contact = 'no usable camera_info yet: positions of dots need a calibrated camera'

    def __init__(self, values: Mapping):
        super().__init__(values)
        self.sensor = Touchpad.from_parameters(values)
        self.calibration = read_calibration(values['calibration'], 'touchpad', values) if values['calibration'] else None

    def make_tracker(self, matrices: Matrices | None, size: tuple[int, int] | None) -> DotTracker:
        """Make the tracker; without a calibrated camera its dots have no 3D positions."""
        camera = self.sensor.camera(*matrices) if matrices else None
        water = read_touchpad(self.values['calibration'], camera, size) if self.calibration and camera else None
        return touchpad_tracker(self.sensor, camera, self.values, water)

    def make_contact(self, matrices: Matrices | None, size: tuple[int, int] | None, tracker: DotTracker | None) -> ContactEstimator | None:
        """Make the contact estimator; None without a calibrated camera."""
        if matrices is None:
            return None
        rest = tracker.positions.rest if tracker is not None else None
        return ContactEstimator(self.sensor, self.sensor.camera(*matrices), self.values, self.calibration, rest)
