# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of hands, of their view in RViz, and of the pose of a held object."""
import math
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class HandConstants:
    """Constants of hands, of their view in RViz, and of the pose of a held object."""

    sensor_size: float = constant(0.1, 'm', 'prior', 'added to the size of the hand')
    view_distance: float = constant(1.0, '1', 'prior', 'over the size of the hand; the field of view of RViz is 45 degrees high')
    window_height: int = constant(960, 'px', 'prior', 'of the window of RViz')
    window_width: int = constant(1600, 'px', 'prior', 'of the window of RViz')
    dock_height: int = constant(860, 'px', 'prior', 'of the panels beside the scene')
    displays_width: int = constant(260, 'px', 'prior', 'of the panel of displays')
    pictures_width: int = constant(330, 'px', 'prior', 'of the panel of pictures')
    text_rise: float = constant(0.3, '1', 'prior',
                                'of a text behind its sensor, over its distance from it; a dome must not hide its last line')
    letter_height: float = constant(0.018, '1', 'prior', 'over the distance of the viewpoint; 19 px in a view of 900 px')
    max_length_error: float = constant(1e-3, '1', 'limit', 'of a quaternion, from 1')
    gripped_s: float = constant(0.2, 's', 'limit',
                                'of contact with enough sensors, from which the pose counts; before, contacts still grow')
    max_age_s: float = constant(0.5, 's', 'limit', 'of the report of a sensor')
    along_sigma: float = constant(1.5e-6, 'm', 'measured',
                                  'of one motion along the surface that a sensor with dots reports, on the simulated touchpad')
    normal_sigma: float = constant(8e-6, 'm', 'measured', 'of one motion along the normal')
    tilt_sigma: float = constant(math.radians(0.05), 'rad', 'measured', 'of one motion about axes along the surface')
    turn_sigma: float = constant(math.radians(0.005), 'rad', 'measured', 'of one motion about the normal')
    motion_error: float = constant(0.06, '1', 'measured', 'of a motion of 50 um and more, on the same data')
    area: float = constant(80e-6, 'm^2', 'measured',
                           'of the contact with which they were measured; a smaller one holds fewer dots, nearer to each other')
    angle_sigma: float = constant(math.radians(0.5), 'rad', 'measured', 'of the orientation of a long contact, on the simulated array')
    axis_sigma: float = constant(1e-4, 'm', 'measured', 'of the axes of a long contact')
    range_sigma: float = constant(5e-3, 'm', 'prior', 'what moves in the hand unseen stays between the fingers')
    angle_range: float = constant(0.3, 'rad', 'prior', 'of the same')
    speed_sigma: float = constant(0.05, 'm/s', 'prior', 'of an unseen motion')
    spin_sigma: float = constant(1.0, 'rad/s', 'prior', 'of an unseen motion')
    start_sigma: float = constant(
        1e-6, 'm, rad', 'numeric',
        'of the pose when the object is gripped, which is exact by definition; above 0 for the sake of its inverse')


HAND = HandConstants()
