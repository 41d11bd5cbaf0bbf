# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of a touchpad; those of colour and glare are in water.py, those of membrane, stick and slip in src/touchpad."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class TouchpadConstants:
    """Limits of a calibration, and measured errors of positions, poses and slip."""

    min_sphere_radius: float = constant(2e-3, 'm', 'limit', 'of the search for the radius of the sphere')
    max_sphere_radius: float = constant(30e-3, 'm', 'limit', 'the same')
    penetration_share: float = constant(0.5, '1', 'limit',
                                        'of the deepest penetration; where the sphere is that deep in the cap, the membrane lies on it')
    min_depth: float = constant(3e-4, 'm', 'limit', 'too few dots of a shallower press lie on the sphere')
    min_depth_span: float = constant(1e-3, 'm', 'limit', 'between the shallowest and the deepest press')
    min_spread: float = constant(2e-3, 'm', 'limit', 'between the pressed positions')
    min_dots: int = constant(20, '1', 'limit', 'on the sphere, over all presses')
    max_scale_sigma: float = constant(0.03, '1', 'limit', 'relative standard deviation of the depth scale')
    scale_sigma_floor: float = constant(0.005, '1', 'measured', 'relative error of the depth scale that the light path model itself leaves')
    pose_tolerance: float = constant(2e-4, 'm', 'limit', 'between the position of the camera and that of the calibration')
    radius_tolerance: float = constant(0.01, '1', 'numeric', 'relative, of the radius of the sphere')
    ring_test_points: int = constant(8, '1', 'numeric', 'on the sampling ring of a dot, all of which must lie on the sphere')
    max_coordinate: float = constant(10.0, 'curvature radius', 'limit', 'of the cap; farther positions are invalid')
    max_unchecked_drift: float = constant(0.1, 'px', 'limit', 'a reference that has drifted further is checked again')
    range_sigma: float = constant(0.15e-3, 'm', 'measured', 'common-mode error of the ranges without a calibration')
    model_sigma: float = constant(5e-4, '1', 'measured', 'error of the path model in a log ratio')
    rim_margin: float = constant(0.04, 'height', 'limit', 'of the cap; nearer to the rim the image blurs into the outside')
    huber_sigmas: float = constant(3.0, 'sigma', 'limit', 'beyond which residuals count linearly')
    derivative_step: float = constant(1e-6, 'scale', 'numeric', 'of the parameters, for derivatives of the fit to the untouched pad')
    max_fit_steps: int = constant(60, '1', 'numeric', 'of the fit to the untouched pad')
    min_decrease: float = constant(1e-9, '1', 'numeric', 'relative decrease of the sum of losses that continues that fit')
    min_drift: float = constant(0.02, 'px', 'limit', 'a smaller drift of the reference does not update the membrane')
    notch_depth: float = constant(1.3, 'pitch', 'limit', 'of a convexity defect; an outline with a deeper one may be two merged contacts')
    min_dots_for_twist: int = constant(6, '1', 'limit', 'twice the three that determine it')
    sure_but_wrong: float = constant(0.09, '1', 'measured',
                                     'frames whose state of slip is wrong although the model is certain, on random scenes')
    max_objects: int = constant(3, '1', 'numeric', 'largest first; the joint probability enumerates 4**max_objects combinations of modes')
    max_presses: int = constant(80, '1', 'numeric', 'frames used in the fit')
    max_untouched: int = constant(10, '1', 'numeric', 'the same')
    max_red: int = constant(250, 'grey level', 'limit', 'with a larger mean some pixels may be saturated, a few levels of noise below 255')
    min_background: float = constant(0.93, '1', 'physical',
                                     'of the brightest surrounding pixel; brighter pixels of the untouched pad are background')
    ring: float = constant(0.45, 'pitch', 'limit', 'radius of a ring: as far from the dot as possible without the rim of the next one')
    wide_ring: float = constant(0.55, 'pitch', 'limit',
                                'the same where dots bleed into the background, as colour has a reduced resolution (4:2:0, 4:2:2, JPEG)')
    min_bleeding: float = constant(2e-3, '1', 'measured',
                                   'difference of ln(blue/red) between both rings: four times that of a dented surface')
    min_colour_ratio: float = constant(0.01, '1', 'limit',
                                       'of glare over scattered light; a smaller one, or one above the inverse, is noise')


TOUCHPAD = TouchpadConstants()
