# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of guided calibrations."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class GuideConstants:
    """Constants of guided calibrations."""

    untouched_s: float = constant(1.0, 's', 'limit', 'before the first load')
    released_s: float = constant(5.0, 's', 'limit', 'after the last load')
    weight_s: float = constant(1.0, 's', 'limit', 'with each weight')
    load_sigmas: float = constant(6.0, 'sigma', 'limit', 'from which a force sensor is loaded')
    min_load: float = constant(0.05, 'N', 'limit', 'from which a force sensor is loaded; far below a tenth of the largest load')
    stuck_s: float = constant(1.0, 's', 'limit', 'time without another value of the wrench')
    max_image_shift: float = constant(1 / 300, '1', 'limit', 'over the width of an image; a quarter of the radius of a marker')
    collar_signal: float = constant(
        0.97, '1', 'measured',
        'share of the largest signal from which the collar is at the plate; a press by hand passes the last 3 % at once')
    max_touches: int = constant(12, '1', 'numeric', 'four times the three numbers that touches of a plane determine')
    min_touch_signal: float = constant(2.0, '1', 'limit', 'signal of a touch over the largest deviation of the untouched signal')
    onset_sigmas: float = constant(4.0, 'sigma', 'limit', 'of the untouched signal along the pattern of the touch itself')
    max_probe_step: float = constant(1e-3, 'm', 'limit', 'of the probe between two images; more is too coarse')
    min_probe_step: float = constant(1e-6, 'm', 'limit', 'less is no motion')
    max_touch_s: float = constant(10.0, 's', 'limit', 'a longer signal is a change of the light')
    max_sigma: float = constant(
        0.5, '1', 'limit',
        'over that of a pose measured by hand; an axis that the touches determine less well counts as not determined')
    touch_sigma: float = constant(1e-4, 'm', 'prior', 'initial value')
    reading_sigma: float = constant(1e-3, 'm', 'prior', 'initial value')
    fit_steps: int = constant(8, '1', 'numeric', 'of Gauss-Newton')
    fit_difference: float = constant(1e-6, 'm, rad', 'numeric', 'for the slopes of Gauss-Newton')
    reduced_width: int = constant(160, 'px', 'numeric',
                                  'of the reduced image; small motions of a dot change it smoothly, and the noise of pixels is averaged')
    depth_power: int = constant(5, '1', 'measured',
                                'of the weight of a dot; the position is 0.35 mm RMS off on a sheet, with 3 it is 0.6, with 12 0.45')


GUIDE = GuideConstants()
