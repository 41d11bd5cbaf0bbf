# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stage of force taxels: point clouds of force vectors in; contact region, contacts, slip, wrench and points out."""
from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from sensor_msgs.msg import PointCloud2

from tactile_driver.force_taxels.messages import taxels_of_message

from ..common import messages as convert
from ..core.calibration_file import read_calibration
from ..core.stage import Input, Stage
from .estimator import ForceTaxelsEstimator, Response
from .parameters import FORCE_NODE, FORCE_PARAMETERS, SENSOR


class ForceTaxelsStage(Stage):
    """taxels -> contact_region, contacts, slip, wrench, points.

    Parameters
    ----------
    values : Mapping
        Values of FORCE_PARAMETERS.

    Raises
    ------
    BadCalibration
        If the calibration file cannot be used.
    """

    node, parameters = FORCE_NODE, FORCE_PARAMETERS
    # Longer than usual, since slip is estimated from the rate of the forces, so that no frame should be lost.
    input = Input('taxels', PointCloud2, depth=100, patience_s=0.15)
    outputs = convert.RESULTS | convert.POINTS

    def __init__(self, values: Mapping):
        super().__init__(values)
        path, unit = values['calibration'], values['force_unit']
        self._response = Response(unit * np.eye(3)) if unit > 0 else None
        if path:
            self._response = Response.from_dict(read_calibration(path, SENSOR, values).fitted, path)
        self.reset()

    def reset(self) -> None:
        """Drop all earlier frames, and the reference."""
        self.estimator = ForceTaxelsEstimator(self._response)
        self._wrench_sigma = np.full(6, np.nan)

    def set_reference(self) -> None:
        """Take the frames of the next second for the untouched sensor."""
        self.estimator.set_reference()

    def estimate(self, message: PointCloud2, stamp_s: float, topics: Collection[str]) -> dict[str, list]:
        """The estimates of one cloud, under its header; none until the untouched readings are known."""
        result = self.estimator.process(*taxels_of_message(message), stamp_s)
        if result is None:
            return {}
        self._wrench_sigma = np.sqrt(np.diag(result.wrench_covariance))
        return convert.results_to_messages(result, message.header, topics)

    def health(self) -> tuple[str, dict]:
        """Warns of dead taxels; friction and the standard deviations of the wrench."""
        if self.estimator.taxels is None:
            return '', {}
        slip, sigma = self.estimator.slip, self._wrench_sigma
        return self.estimator.warning, {
            'friction': f'{slip.friction:.2f} +- {slip.friction_sigma:.2f}',
            'force error (N)': ' '.join(f'{each:.3g}' for each in sigma[:3]),
            'torque error (N m)': ' '.join(f'{each:.3g}' for each in sigma[3:])}
