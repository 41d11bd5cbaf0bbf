# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of loads on an elastic layer with dots: gels and pads of rubber."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class LayerConstants:
    """Physical properties, noises and priors of an elastic layer and of the search for loads on it.

    Evidence is twice the logarithm of a likelihood ratio. Numeric constants, halved or doubled, change no result by more than its standard
    deviation; those of the tables change no displacement by more than 0.1 % of the largest (radius_ratio: 0.5 %).
    """

    min_dots: int = constant(6, '1', 'limit', 'three parameters of a press and three of a shear')
    max_contacts: int = constant(4, '1', 'numeric', 'bounds the time of a frame')
    mean_stress: float = constant(0.7, '1', 'prior',
                                  'mean pressure over shear modulus; a ball on a thick layer has 1.7 a / R (Hertz), a / R about 0.4')
    stress_spread: float = constant(0.35, '1', 'prior', 'standard deviation of its log: a factor of 1.4, as a / R from 0.3 to 0.6')
    model_error: float = constant(0.1, '1', 'measured',
                                  'relative error of a displacement by a linear layer; residuals of real presses are 0.1 to 0.3 of it')
    shift: float = constant(3e-5, 'm', 'physical', 'standard deviation of the shift of the gel against its camera, as the holder yields')
    correlation: float = constant(2.0, 'pitch', 'measured',
                                  'distance at which residuals are independent: real ones correlate by 0.1 at one, 0.02 at two')
    max_residual: float = constant(0.3, 'pitch', 'limit', 'a larger residual is a dot that was taken for its neighbour')
    first_evidence: float = constant(8.0, '1', 'limit', 'for a disc instead of none, where dots have moved significantly')
    next_evidence: float = constant(24.0, '1', 'limit',
                                    'for one disc more, with six parameters: by chance once in 2,000 frames (chi-square)')
    min_radius: float = constant(0.3, 'pitch', 'limit', 'smallest disc that dots resolve')
    max_radius: float = constant(0.4, 'side', 'limit', 'largest disc, of the shorter side of the field of dots')
    search_positions: int = constant(220, '1', 'numeric', 'of the coarse search')
    search_ratio: float = constant(1.4, '1', 'numeric', 'of neighbouring radii of the coarse search')
    damping: float = constant(1e-3, '1', 'numeric', 'of the first step of Gauss-Newton')
    difference: float = constant(1e-4, '1', 'numeric', 'step of a derivative, in pitches or of the radius')
    min_noise_px: float = constant(0.05, 'px', 'measured',
                                   'light that shifts as the skin tilts moves a dot by so much; no detector is better on a moving gel')
    prior_noise_px: float = constant(0.1, 'px', 'prior', 'noise of a detector of dots, before two frames have shown it')
    pressed_sigmas: float = constant(5.0, 'sigma', 'limit',
                                     'three dots displaced by more are a press: by chance never, and one mistaken dot is none')
    kept_share: float = constant(0.1, '1', 'prior', 'share of the displacement by a press that silicone keeps')
    recovery_s: float = constant(10.0, 's', 'prior', 'in which it falls to a third')
    min_force_sigmas: float = constant(2.0, 'sigma', 'limit', 'a pressing force below is unknown')
    min_slip_sigmas: float = constant(3.0, 'sigma', 'limit', 'of shear over pressure since the press began, before slip is reported')
    depth_error: float = constant(0.1, '1', 'measured', 'relative standard deviation of depths, on simulated gels')
    max_distance: float = constant(8.0, 'thickness', 'physical',
                                   'beyond, a load on a bonded layer moves nothing: displacements decay as exp(-pi/2 r/h) or faster')
    phase_step: float = constant(0.4, 'rad', 'numeric', 'step of the quadrature at the largest distance')
    table_distances: int = constant(160, '1', 'numeric', 'entries of a table, denser near the load')
    max_phase: float = constant(15.0, 'rad', 'numeric', 'wave number times radius at which the spectrum of a disc is cut off smoothly')
    radius_ratio: float = constant(1.15, '1', 'numeric', 'of neighbouring tables, between which displacements are interpolated')
    min_frames: int = constant(5, '1', 'limit', 'with the same load, for a median that one bad frame does not change')
    view_deg: float = constant(60.0, 'degree', 'prior',
                               'angle of view of an uncalibrated camera along the longer side; lenses of webcams have 50 to 75')
    min_dots_for_tilt: int = constant(16, '1', 'limit', 'twice the parameters of a homography')
    min_perspective: float = constant(0.1, '1', 'limit',
                                      'of the scale in the middle: no gel is so oblique that a pixel shows ten times the length')
    max_drift: float = constant(0.25, 'pitch', 'limit', 'a dot whose undeformed position differs by more is another dot')
    max_new_share: float = constant(0.2, '1', 'limit', 'of the dots of a frame; if more are new, the undeformed gel is measured again')
    min_pitch: float = constant(0.02, 'thickness', 'limit', 'below, a press moves all dots alike')
    max_px: float = constant(1e5, 'px', 'limit', 'of a coordinate; no camera has so many pixels')
    no_force: float = constant(1e-30, 'm^2', 'numeric', 'squared displacements without any force')
    max_pitch: float = constant(4.0, 'thickness', 'limit', 'above, it moves only one dot')


LAYER = LayerConstants()
