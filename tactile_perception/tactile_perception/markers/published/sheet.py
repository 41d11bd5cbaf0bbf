# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The contact point of a marker sheet as paper areal_sensor_contact_position has it: depth of each marker, then Gaussians (eqs 1 to 13)."""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...errors import BadArgument, BadCalibration
from .gaussian_peak import grid_point
from .marker_depth import MarkerDepths, fit_marker_depths
from ..touches.cross_validation import held_out_spread
from ..touches.presses import Presses
from ..touches.touch import AT_EDGE, OUT_OF_RANGE, TouchEstimate
from ..view.marker_field import MarkerField
from ..view.sensor import MarkerSensor

QUIET = 2.0     # times the greatest depth told in untouched frames: what is less is no touch
LEAST = 2e-4    # m, the same where no untouched frame was recorded


class PaperTouch:
    """The paper's method on a sheet with a regular grid. Tells one touch at the most."""

    def __init__(self, depths: MarkerDepths, sensor: MarkerSensor, quiet: float, place_sigma: float, depth_sigma: float):
        if not sensor.is_sheet or sensor.rows * sensor.columns != len(depths.rest):
            raise BadArgument(f'the paper\'s method needs a sheet with a grid of {len(depths.rest)} markers, got {sensor}')
        self.depths, self.sensor, self.quiet = depths, sensor, quiet
        self.place_sigma, self.depth_sigma = place_sigma, depth_sigma

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The touch of one frame, with the place and depth errors of held-out presses as covariance; empty where nothing touches."""
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
        """Numbers for the calibration file. Raises BadCalibration where no press stands over a marker."""
        method = cls._fitted(presses, sensor)
        place, depth = held_out_spread(lambda some: cls._fitted(some, sensor), presses)
        return {'depths': method.depths.numbers(), 'quiet': method.quiet, 'place_sigma': place, 'depth_sigma': depth}

    @classmethod
    def _fitted(cls, presses: Presses, sensor: MarkerSensor) -> PaperTouch:
        depths = fit_marker_depths(presses, min(sensor.pitch))
        told = [np.nanmax(depths.depths(field)[0], initial=0.0) for field, on in zip(presses.fields, presses.touching) if not on]
        return cls(depths, sensor, float(max(QUIET * max(told, default=0.0), LEAST)), float('nan'), float('nan'))

    @classmethod
    def from_fitted(cls, fitted: Mapping, sensor: MarkerSensor) -> PaperTouch:
        """Back from the calibration file. Raises BadCalibration where something is missing."""
        try:
            numbers = [float(fitted[name]) for name in ('quiet', 'place_sigma', 'depth_sigma')]
            depths = MarkerDepths.from_numbers(fitted['depths'])
        except (KeyError, TypeError, ValueError) as wrong:
            raise BadCalibration(f'the paper\'s method cannot be read from the calibration ({wrong!r}); calibrate anew') from wrong
        return cls(depths, sensor, *numbers)
