# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of what sensors share: contacts from frame to frame, states of slip, surfaces through points, frames, residuals."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class CommonConstants:
    """Fields are grouped by the module that uses them."""

    max_step: float = constant(1.5, 'pitch', 'limit', 'between the borders of a contact in two consecutive frames')

    begins_incipient: float = constant(0.05, '1', 'limit', 'slipping fraction at which incipient slip begins')
    ends_incipient: float = constant(0.03, '1', 'limit', 'slipping fraction below which it ends: hysteresis against single dots')
    begins_gross: float = constant(0.9, '1', 'limit', 'slipping fraction at which gross slip begins')
    ends_gross: float = constant(0.85, '1', 'limit', 'slipping fraction below which it ends')
    max_centre_distance: float = constant(4.0, 'radius of the contact', 'limit',
                                          'of a centre of rotation; one farther away counts as a translation')
    coincident: float = constant(1e-24, 'm^2', 'numeric', 'square of the distance of positions a picometre apart')

    straight_layers: int = constant(2, '1', 'numeric',
                                    'dots beyond the last known one that are extrapolated linearly; farther ones take means')
    outline_steps: int = constant(2, '1', 'numeric', 'of an outline, per pitch')
    label_spread: tuple[float, float, float] = constant(
        (0.107, 0.786, 0.107), '1', 'numeric', 'Gaussian of half a pitch, which smooths the staircase of labels along a slanted edge')
    neighbours: int = constant(8, '1', 'numeric', 'of a point, as on a grid, through which its plane is laid')
    min_points: int = constant(4, '1', 'limit', 'for a plane with one degree of freedom left')

    notch_steps: float = constant(1e4, '1', 'numeric', "steps a unit of a polygon: OpenCV's contours are whole numbers")
    min_quaternion_norm: float = constant(1e-6, '1', 'limit', 'publishers normalise quaternions; a shorter one was not filled')
    max_translation: float = constant(1e9, 'm', 'limit', 'beyond any robot; chains of transforms stay finite')
    rotation_rounding: float = constant(1e-12, '1', 'numeric', 'of the elements of a rotation')
    pose_memory_s: float = constant(5.0, 's', 'limit', 'longer than anybody waits for an image of that time')

    outlier_sigmas: float = constant(6.0, 'sigma', 'limit', 'robust standard deviations beyond the median error')
    min_presses: int = constant(5, '1', 'limit', 'fewer have no meaningful median')
    max_lines: int = constant(20, '1', 'limit', 'printed for each quantity')


COMMON = CommonConstants()
