# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of the calibration and the stage of a PSD finger; those of its estimator are in src/finger/constants.hpp."""
import math
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class FingerConstants:
    """Limits of what determines a calibration. Halved and doubled in docs/constants.md."""

    rest_s: float = constant(0.6, 's', 'prior', 'duration of the untouched samples before a press')
    gap_s: float = constant(0.03, 's', 'prior', 'from them to the press')
    recovery_s: float = constant(0.1, 's', 'physical', 'from a press to the untouched samples of the next one')
    min_rest_samples: int = constant(5, '1', 'limit', 'samples of one rest')
    min_line_rests: int = constant(4, '1', 'limit', 'rests that determine a line of the offset')
    drift_window_s: float = constant(2.0, 's', 'prior', 'around a press, within which the drift of a room is straight')
    max_line_misfit: float = constant(3.0, '1', 'limit', 'mean squared deviation from that line over the noise')
    rest_sigmas: float = constant(4.0, 'sigma', 'limit', 'above the darkest samples, up to which samples count as untouched')
    segment_rad: float = constant(0.005, 'rad', 'measured', 'spread of the normals of one position: 0.3 degrees, below the error of a map')
    segment_s: float = constant(0.05, 's', 'limit', 'longest segment; force changes little within it')
    contact_sigmas: float = constant(5.0, 'sigma', 'limit', 'of the total, from which light counts as contact')
    same_position_rad: float = constant(0.006, 'rad', 'limit',
                                        'within which presses are at one position: a little more than one segment spans')
    min_radial: int = constant(16, '1', 'limit', 'positions for the radial trend: about 3 for each of its coefficients')
    min_smooth: int = constant(8, '1', 'limit', 'positions for a Gaussian process')
    max_positions: int = constant(250, '1', 'numeric', 'bounds the time of the fit, which grows with their cube')
    max_loads: int = constant(600, '1', 'numeric', 'segments; bounds the memory of the leave-one-out errors')
    min_cross_share: float = constant(0.1, '1', 'measured',
                                      'of the variance of the cross term, that is not noise: the noise is known to a tenth')
    min_cross_segments: int = constant(12, '1', 'limit', 'two for each of the 6 coefficients')
    reach_spacings: float = constant(1.5, 'spacing', 'limit', 'range of a calibrated position, which closes the gaps between positions')
    min_reach: float = constant(0.02, 'half width', 'limit', 'smallest range of a position')
    max_reach: float = constant(0.25, 'half width', 'limit', 'largest range of a position')
    min_creep_presses: int = constant(6, '1', 'limit', 'presses whose scatter is then known to a third')
    min_creep_s: float = constant(0.06, 's', 'physical', 'rest of a press after its rise: twice the usual time constant of rubber')
    creep_sigmas: float = constant(5.0, 'sigma', 'limit', 'share of creep from which it is used')
    creep_of_position: float = constant(0.8, '1', 'physical',
                                        'late share of the displacement over that of the light; 0.6 to 1 in simulated covers')
    max_creep: float = constant(0.2, '1', 'limit', 'share: a cover that creeps more is no sensor')
    release_light: float = constant(0.97, '1', 'measured', 'of the light of a press, above which it is not being released')
    min_loads: int = constant(12, '1', 'limit', 'contacts: 1.5 for each of the 8 coefficients')
    min_load_ratio: float = constant(1.3, '1', 'limit', 'largest load over the smallest one, which determines the slope')
    ridge: float = constant(1e-4, '1', 'numeric', 'for each contact; keeps the normal equations definite where all light is alike')
    max_onset: float = constant(0.35, '1', 'limit', 'of the brightest light of a press: a brighter onset was labelled late')
    load_terms: int = constant(8, '1', 'numeric', 'coefficients of the logarithm of a force or a depth')
    light_terms: int = constant(5, '1', 'numeric', 'coefficients of the logarithm of the typical light')
    max_log: float = constant(20.0, '1', 'numeric', 'of that logarithm: keeps the exponential finite far from calibrated spots')
    nominal_beta: float = constant(math.pi / 2, 'rad per half width', 'prior',
                                   'without calibration: the rim of the hemisphere (90 degrees) is imaged to the edge of the detector')
    cells: int = constant(128, '1', 'numeric',
                          'of a table along each axis: interpolation adds less than 0.02 degrees to a normal (a test holds it)')
    min_period_s: float = constant(1e-7, 's', 'limit', 'between samples: no converter is faster')
    max_period_s: float = constant(1.0, 's', 'limit', 'between samples: longer than a press')
    max_volts: float = constant(1e6, 'V', 'limit', 'beyond every converter')
    min_onsets: float = constant(0.6, '1', 'limit', 'part of the onsets that must be labelled in time')


FINGER = FingerConstants()
