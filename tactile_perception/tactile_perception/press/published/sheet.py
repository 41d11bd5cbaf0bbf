# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact point of a marker sheet by paper areal_sensor_contact_position: marker depths (eqs 1 to 7), Gaussian peak (eqs 8 to 13)."""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...errors import BadArgument, BadCalibration
from .gaussian_peak import grid_point
from .marker_depth import MarkerDepths, fit_marker_depths
from ..cross_validation import cross_validation_rmse
from ..presses import Presses
from ..estimate import AT_EDGE, OUT_OF_RANGE, TouchEstimate
from ..field import MarkerField
from ..sensor import MarkerSensor

QUIET = 2.0     # detection threshold over the greatest depth estimated in untouched frames. Chosen
LEAST = 2e-4    # m, least detection threshold. Chosen


class PaperTouch:
    """The paper's method on a sheet with a regular grid; detects one touch at most."""

    def __init__(self, depths: MarkerDepths, sensor: MarkerSensor, quiet: float, place_sigma: float, depth_sigma: float):
        if not sensor.is_sheet or sensor.rows * sensor.columns != len(depths.rest):
            raise BadArgument(f'the paper\'s method needs a sheet with a grid of {len(depths.rest)} markers, got {sensor}')
        self.depths, self.sensor, self.quiet = depths, sensor, quiet
        self.place_sigma, self.depth_sigma = place_sigma, depth_sigma

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The touch of one frame, with the cross-validation RMSE as covariance; empty without contact."""
        depth, outside = self.depths.depths(field)
        shape = self.sensor.rows, self.sensor.columns
        point = grid_point(depth.reshape(shape), field.rest.reshape(shape + (2,)), self.sensor.pitch)
        if point is None or not point.depth > self.quiet:
            return []
        half = np.array(self.sensor.size) / 2
        place = np.clip(point.place, -half, half)
        flags = (OUT_OF_RANGE if outside[np.nanargmax(depth)] else 0) | (AT_EDGE if point.at_edge else 0)
        variance = np.square([self.place_sigma, self.place_sigma, self.depth_sigma])
        return [TouchEstimate(np.append(place, -point.depth), point.depth, np.diag(variance), self.depth_sigma, flags=flags,
                              reason=point.reason)]

    @classmethod
    def fit(cls, presses: Presses, sensor: MarkerSensor) -> dict:
        """Parameters for the calibration file. Raises BadCalibration where no press is over a marker."""
        method = cls._fitted(presses, sensor)
        place, depth = cross_validation_rmse(lambda some: cls._fitted(some, sensor), presses)
        return {'depths': method.depths.numbers(), 'quiet': method.quiet, 'place_sigma': place, 'depth_sigma': depth}

    @classmethod
    def _fitted(cls, presses: Presses, sensor: MarkerSensor) -> PaperTouch:
        depths = fit_marker_depths(presses, min(sensor.pitch))
        still = [np.nanmax(depths.depths(field)[0], initial=0.0) for field, on in zip(presses.fields, presses.touching) if not on]
        return cls(depths, sensor, float(max(QUIET * max(still, default=0.0), LEAST)), float('nan'), float('nan'))

    @classmethod
    def from_fitted(cls, fitted: Mapping, sensor: MarkerSensor) -> PaperTouch:
        """From the calibration file. Raises BadCalibration where something is missing."""
        try:
            numbers = [float(fitted[name]) for name in ('quiet', 'place_sigma', 'depth_sigma')]
            depths = MarkerDepths.from_numbers(fitted['depths'])
        except (KeyError, TypeError, ValueError) as wrong:
            raise BadCalibration(f'the paper\'s method in the calibration file cannot be read ({wrong!r}); calibrate anew') from wrong
        return cls(depths, sensor, *numbers)
