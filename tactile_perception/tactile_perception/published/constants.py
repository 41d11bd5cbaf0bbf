# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of the papers' methods: those that a paper states, and those that it does not."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class CushionConstants:
    """Constants of the paper air_cushion_contact."""

    denoising_strength: float = constant(10.0, 'grey level', 'numeric', 'of non-local means; the paper gives none')
    search_window: int = constant(7, 'px', 'numeric', 'side of the window in which similar patches are searched; the paper gives none')
    neighbours: int = constant(5, '1', 'numeric', 'of a marker (equation 1)')
    largest_changes: int = constant(4, '1', 'numeric', 'that determine the contact point (equation 2)')
    max_distance: float = constant(3.0, 'pitch', 'limit', 'from the largest change to the others; the paper gives none')
    threshold_ratio: float = constant(2.0, '1', 'limit',
                                      'detection threshold over the maximum change in untouched frames; the paper gives none')


@dataclass(frozen=True)
class SortConstants:
    """Constants of SORT. Its variances are those of the authors' program, for frames of video."""

    frame_s: float = constant(1 / 30, 's', 'prior', 'interval of two frames')
    initial_variance: tuple[float, float] = constant((10.0, 1e4), 'px^2', 'prior', 'of a coordinate and its velocity where a track begins')
    process_variance: tuple[tuple[float, float], ...] = constant(
        ((1.0, 0.01), (1.0, 0.01), (1.0, 1e-4)), 'px^2', 'prior', 'added a frame to column, row and area, each with its velocity')
    measurement_variance: tuple[float, float, float] = constant((1.0, 1.0, 10.0), 'px^2, px^2, px^4', 'prior', 'of column, row and area')
    min_overlap: float = constant(0.3, '1', 'limit', 'intersection over union of a box with the predicted one')
    max_age: int = constant(1, 'frame', 'limit', "in which a track may be unseen: the default of the authors' program")


@dataclass(frozen=True)
class ArealConstants:
    """Constants of the paper areal_sensor_contact_position; the thresholds of sizes and depths serve air_cushion_contact too."""

    min_area: int = constant(6, 'px', 'limit', 'smaller regions are noise')
    median_areas: tuple[float, float] = constant((0.2, 5.0), 'median area', 'limit', 'of the smallest and the largest marker')
    degree: int = constant(3, '1', 'numeric', 'of the polynomials ("the third-degree polynomial is the best fit")')
    range_margin: float = constant(0.05, '1', 'limit', 'of the calibrated range: a value further below it is out of range')
    min_plate_depths: int = constant(3, '1', 'limit', 'with the undeformed sheet they determine a cubic')
    neighbours: int = constant(2, '1', 'numeric', 'on each side of the deepest marker (equation 13)')
    min_threshold: float = constant(2e-4, 'm', 'limit',
                                    'of depth and of change of distance. The paper gives none; of a sheet, the maximum of untouched frames')
    speed_sigma: float = constant(0.1, 'm/s', 'prior', 'standard deviation of the velocity with which a contact begins')
    acceleration_sigma: float = constant(0.5, 'm/s^2', 'prior',
                                         'standard deviation: a hand moves over a sheet within centimetres and tenths of a second')


@dataclass(frozen=True)
class TaxelArrayConstants:
    """Constants of the paper taxel_array_image_processing, which gives none of them. They are for contacts of 5 to 30 taxels."""

    edge_thresholds: tuple[int, int] = constant((100, 200), 'grey level', 'limit',
                                                'of Canny, of an image scaled to 255; half and double of these find the same edges')
    max_corners: int = constant(50, '1', 'numeric', 'of a frame')
    corner_quality: float = constant(0.05, '1', 'limit', 'of a corner over the best one')
    corner_distance: int = constant(2, 'taxel', 'limit', 'between corners')
    corner_block: int = constant(3, 'taxel', 'numeric', 'side of the square from which a corner is computed')
    flow_window: int = constant(7, 'taxel', 'numeric', 'side of the square that is followed')
    flow_levels: int = constant(2, '1', 'numeric', 'of the pyramid above the image itself')
    min_displacement: float = constant(0.05, 'taxel', 'limit', 'in a frame, of a feature that moves')
    min_features: int = constant(3, '1', 'limit', 'for an estimate of slip')
    min_side: int = constant(8, 'taxel', 'limit', 'of an image in which corners are detected')
    zero_sigmas: float = constant(3.0, 'sigma', 'limit', 'of the noise, up to which a taxel counts as zero')


@dataclass(frozen=True)
class TouchpadConstants:
    """Constants of the paper touchpad_contact_region. Those of images are not stated; they are for dots of 5 to 15 px in 640 x 480 px."""

    mean_side: int = constant(31, 'px', 'numeric', 'side of the square over which the local mean is taken')
    min_area: int = constant(6, 'px', 'limit', 'smaller regions are noise')
    max_image_share: float = constant(0.02, '1', 'limit', 'of the image, area of the largest region')
    max_median_areas: float = constant(4.0, 'median area', 'limit', 'the largest region')
    search_radius: float = constant(0.5, 'pitch', 'limit',
                                    'around a predicted position. The paper gives no value; wider circles would overlap')
    nearest_dots: int = constant(8, '1', 'numeric',
                                 'that hold those along the row and the column; the diagonal ones may be nearer than the latter')
    max_interval_s: float = constant(4.0, 's', 'limit', 'before the present frame, in which t_p is searched')
    sticking_dots: int = constant(9, '1', 'limit',
                                  'around the reference dot, that are assumed to stick (section 3.2: "at least a set of nine dots")')


CUSHION, SORT, AREAL = CushionConstants(), SortConstants(), ArealConstants()
TAXEL_ARRAY, TOUCHPAD = TaxelArrayConstants(), TouchpadConstants()
