# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of gels whose surface is seen by its shading."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class PhotometricConstants:
    """Pixels are those of a working image, 320 px wide."""

    width_px: int = constant(320, 'px', 'numeric',
                             'of a working image: 0.06 mm a pixel on a gel of 19 mm, a third of the blur that the skin itself has')
    window_px: int = constant(9, 'px', 'numeric',
                              'side of the square over which changes are averaged before they are judged; a fifth of the smallest contact')
    max_flat_distance: float = constant(30.7, 'sigma^2', 'limit', 'squared distance of the averaged change of a flat skin: chi-squared of '
                                                                  'three colours, one false pixel in a million')
    min_bend: float = constant(0.15, '1', 'limit', 'of the mean bend of the skin beside an object; a skin that bends back by less lies on '
                                                   'an object. A flat object has none')
    significant_sigmas: float = constant(3.0, 'sigma', 'limit', 'of the depth of an untouched skin, from which on a skin is dented')
    circle_radii: tuple[float, float] = constant((0.02, 0.25), 'width', 'limit', 'of the image; smallest and largest that are searched')
    shape_error: float = constant(0.12, '1', 'physical', 'of a force by the shape of the object, from a ball to a flat rod')
    table_radii: tuple[float, float] = constant((0.1, 2.0), 'thickness', 'numeric',
                                                'smallest and largest radius of a contact in the table; beyond, the nearest counts')
    table_size: int = constant(24, '1', 'numeric', 'radii of the table')
    min_presses: int = constant(6, '1', 'limit', 'for a polynomial that changes linearly over the image, and one press left out')
    inner: float = constant(0.6, 'radius', 'limit', 'of the found circle: certainly on the ball, as the skin leaves the ball gradually')
    max_circle: float = constant(1.6, 'radius', 'limit', 'of the ball: its circle is smaller, and is found up to half larger')
    steepest: float = constant(0.85, '1', 'physical',
                               'sine of the slope of a ball up to which its skin follows it; the camera sees no steeper one from above')
    unlike: float = constant(4.0, 'sigma', 'limit', 'of the log relative error of slopes from which a press is left out')
    usual_spread: float = constant(0.25, '1', 'prior', 'smallest standard deviation of that log over good presses')
    outside: float = constant(2.2, 'radius', 'limit', 'of the circle from which on the skin is taken for flat')
    flat_pixels: int = constant(2000, '1', 'numeric', 'of each press, drawn from those outside; as many as within a circle')
    ridge: float = constant(3e-5, '1', 'prior',
        'variance of the noise over that of a coefficient, of features around 1; ten times more: three times the errors')
    field_tolerance: float = constant(0.06, '1', 'limit',
                                      'relative difference of the fields of two images; rows of a background are rounded by 4 % at most')
    untouched_s: float = constant(1.0, 's', 'prior', 'over which the untouched gel is averaged')
    min_pixels: int = constant(81, 'px^2', 'limit', 'of a contact: the square over which changes of colour are averaged')
    point_step: int = constant(8, 'px', 'numeric', 'from one surface point to the next')
    steep_error: float = constant(0.5, '1', 'prior', 'relative standard deviation of a slope steeper than those of the calibration')
    max_jump: float = constant(0.05, 'width', 'limit',
                               'of the image, over which a contact may move from frame to frame, from border to border')
    dent_skirts: float = constant(2.0, 'skirt', 'physical', 'beside an object, in which its dent is')
    speckle: int = constant(5, 'px', 'numeric', 'side of the square in which most of the pixels decide about contact: half of a window')
    dark_levels: float = constant(10.0, 'grey level', 'measured',
                                  'added to a level before the division: noise of a dark pixel would be divided by next to nothing')
    marker_brightness: float = constant(0.82, '1', 'physical',
                                        'of the median around it: darker pixels are ink; shading changes over wider distances')
    marker_neighbourhood: float = constant(0.065, 'width', 'limit', 'three times the largest printed marker')
    bend_px: float = constant(1.0, 'px', 'numeric',
                              'standard deviation of the weights that average slopes and curvatures: half of the blur of a working image')
    level_slope: float = constant(1e-3, '1', 'numeric',
                                  'squared slope below which a skin has no direction of steepest descent; its mean curvature counts then')
    filled_px: float = constant(2.0, 'px', 'numeric', 'standard deviation of the weights with which pixels around a marker fill it in')
    min_covered: float = constant(0.25, '1', 'limit',
                                  'of the image between the presses, below which more are asked for; twenty all over a gel cover 30 %')


PHOTOMETRIC = PhotometricConstants()
