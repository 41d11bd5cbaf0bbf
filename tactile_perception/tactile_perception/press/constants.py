# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of sheets and domes: of both, of the sheet method, and of the dome method; halved and doubled in docs/constants.md."""
import math
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class PressConstants:
    """Constants that sheets and domes share."""

    values_per_error: float = constant(20.0, '1', 'measured', 'values that share a model error, which is smooth over some pitches')
    dragged_odds: float = constant(0.9, '1', 'prior', 'dragged presses over straight ones, which are about as frequent')
    two_odds: float = constant(0.1, '1', 'prior', 'two presses over a straight one: a frame of twenty, on a hand as in recordings')
    max_speed: float = constant(0.5, 'm/s', 'prior', 'speed of a contact; faster than a person slides a finger')
    gate_sigmas: float = constant(4.0, '1', 'limit', 'standard deviations by which two estimates of one contact may differ')
    max_radius_ratio: float = constant(0.95, '1', 'limit', 'contact radius over tip radius; the slope of a hemisphere is infinite')
    min_markers: int = constant(12, '1', 'limit',
                                'visible markers for a press or a pose, which have six numbers: twice two coordinates each')
    max_coordinate_px: float = constant(1e5, 'px', 'limit', 'larger coordinates are invalid: far outside any image')
    untouched_px: float = constant(0.3, 'px', 'measured', 'displacement within which a marker is untouched and a reference the same')
    area_time_s: float = constant(2.0, 's', 'prior', 'time constant of the average of the area of untouched markers')
    strain_weight: float = constant(3.0, '1', 'prior',
                                    'stiffness of the skin between markers against strain, over that of the observations')
    bending_weight: float = constant(1e-3, '1', 'prior', 'the same against bending')
    min_clamp_distance: float = constant(0.3, 'pitch', 'numeric', 'distance of a marker from the clamp, which bounds its weight')
    max_untouched_shift: float = constant(1e-4, 'm', 'limit', 'apparent shift above which the height of an uncalibrated marker is unknown')
    depth_power: float = constant(1.5, '1', 'numeric', 'grading of simulated depths, which are denser at first contact')
    depth_margin: float = constant(1.15, '1', 'limit', 'simulated depth over the deepest calibrated press')
    max_relative_depth: float = constant(1.02, '1', 'limit', 'depth over the calibrated one; deeper presses are out of range')
    model_preference: float = constant(2.0, '1', 'prior', 'calibration prefers the model unless its errors are so many times larger')
    min_presses: int = constant(6, '1', 'limit', 'presses for the calibration of a model, and with a wrench for the stiffness')
    min_press_depth: float = constant(0.02, '1', 'limit', 'depth over the deepest; the stiffness leaves shallower presses out')
    same_position: float = constant(1e-3, 'm', 'limit', 'presses nearer to each other share a position; a stage repeats better')
    max_straight_travel: float = constant(2e-4, 'm', 'limit', 'lateral travel since first contact of a straight press')
    max_drag_step: float = constant(5e-3, 'm', 'limit', 'a larger step between two frames starts a new press')
    depth_tolerance: float = constant(5e-5, 'm', 'measured', 'variation of a depth that a stage holds')
    lift_ratio: float = constant(0.6, '1', 'limit', 'a depth below this share of the previous one starts a new press')
    min_positions: int = constant(3, '1', 'limit', 'positions of presses; cross-validation holds out one of three')
    min_depth_span: float = constant(0.2, '1', 'limit', 'range of the depths of presses over the largest')
    marker_noise_px: float = constant(0.04, 'px', 'measured', 'standard deviation per axis of the position of a marker in a view')
    min_print_sigma: float = constant(2e-6, 'm', 'limit', 'irregularity of a print')
    max_stitching_residual: float = constant(0.1, 'pitch', 'limit', 'RMS residual; more indicates mismatched markers or a wrong pitch')
    min_aspect: float = constant(0.02, '1', 'limit', 'width over length of the markers in a view, which determine the pose of its camera')
    min_column_share: float = constant(0.8, '1', 'limit', 'markers of a column over rows; the border of the image cuts off one with fewer')
    stitched_resolution: float = constant(0.8, '1', 'measured', 'over that of the views: positions 3 % noisier, a third of the time saved')
    exposures: tuple[float, float] = constant((5.0, 250.0), 'grey level', 'limit', 'levels between which exposures are compared')
    max_reference_tries: int = constant(5, '1', 'limit', 'pairs of untouched images tried before the fit is abandoned')
    min_recorded_depth: float = constant(1e-4, 'm', 'limit', 'depth of a recorded press whose stiffness counts')


@dataclass(frozen=True)
class SheetConstants:
    """Constants of the sheet method, tuned on simulated sheets. Pairs are of position and depth."""

    tip: float = constant(0.15, '1', 'prior',
                          'standard deviation of the log of a tip radius over the calibrated; three in four within 20 %')
    stands_out: float = constant(8.0, 'sigma', 'measured', 'smallest match of a contact, three times the largest of untouched frames')
    sure: float = constant(4.0, 'sigma', 'limit', 'smallest depth of a contact')
    ordinary: float = constant(0.5, '1', 'measured', 'residual chi-square of presses under their own hypothesis, which is 0.2 to 1')
    strange: float = constant(2.5, '1', 'limit', 'chi-square of a first frame, above which two cameras show it at different times')
    unexplained: float = constant(4.0, '1', 'limit', 'chi-square above which an estimate is ambiguous')
    unseen: float = constant(2.0, 'pitch', 'limit', 'distance to the nearest visible marker, above which a contact is not reported')
    floor: tuple[float, float] = constant((0.005, 0.003), 'tip radius', 'measured',
                                          'smallest standard deviations; frictions and paths differ')
    dragged: tuple[float, float] = constant((0.1, 0.06), 'tip radius', 'measured', 'standard deviations that a drag of 1 adds')
    radius: tuple[float, float] = constant((0.1, 0.2), '1', 'measured', 'standard deviations of the log radius, of a press and of a drag')
    apart: tuple[float, float] = constant((0.1, 0.04), 'tip radius', 'measured', 'standard deviations of two presses at a chi-square of 2')
    disc_pitches: float = constant(2.5, 'pitch', 'numeric', 'distance from a press within which markers are discs; farther ones are points')
    max_relative_reach: float = constant(0.999, '1', 'limit', 'of the reach of the library; contacts beyond are at the edge')
    template_grid: tuple[int, int] = constant((13, 11), '1', 'numeric', 'positions of templates along x and y')
    template_depths: tuple[float, ...] = constant((0.1, 0.4, 0.8), '1', 'numeric',
                                                  'of templates over the largest; the second also for pairs')
    max_template_shift: float = constant(1e-4, 'm', 'limit', 'motion of a camera centre or an untouched marker that outdates the templates')
    min_mode_rms: float = constant(2e-7, 'm', 'numeric',
                                   'modes of the library that are weaker are truncated; at 1e-6 a press on a stiff sheet was 0.3 mm off')
    max_unsolved_share: float = constant(0.1, '1', 'limit',
                                         'of the simulations; deep presses of a large tip near the clamp do not converge')
    radius_ratio: float = constant(1.35, '1', 'limit', 'of the simulated tip radii to the calibrated one')
    positions_and_depths: tuple[int, int] = constant((6, 5), '1', 'numeric', 'of the fit; three positions confound material and tip')
    unsolved_residual: float = constant(3.0, 'sigma', 'limit', 'of presses whose simulation does not converge')
    model_shift: float = constant(1e-5, 'm', 'measured', 'model error of the position of a marker, in addition to its noise')
    model_growth: float = constant(4e-3, '1', 'measured', 'model error of the log area of a marker')
    model_share: float = constant(2e-3, '1', 'measured', 'model error over depth; of the log area per mm')
    prior_mean: tuple[float, ...] = constant((7.5e-3, 0.03, 0.5, 2.5e-7), 'm, 1, 1, m^2', 'prior',
                                             'tip radius, prestretch minus 1, friction, bending stiffness: a rubber sheet, a fingertip')
    prior_sigma: tuple[float, ...] = constant((0.7, 0.7, 0.5, 0.7), '1', 'prior', 'standard deviations of their logs')
    starts: tuple[tuple[float, ...], ...] = constant(((1.0, 1.0, 1.0, 1.0), (1.0, 3.0, 1.0, 5.0), (1.0, 10.0, 0.7, 20.0)), '1', 'numeric',
                                                     'of the fit over the prior mean, from a thin sheet to a thick one')
    max_prior_sigmas: float = constant(5.0, 'sigma', 'limit', 'of every fitted value around the prior mean')
    alignment_sigma: float = constant(3e-4, 'm', 'prior', 'shifts of camera centres and print')
    rotation_sigma: float = constant(5e-3, 'rad', 'prior', 'rotation of the print: half a pitch over a large sheet')
    mesh_scale: float = constant(10e-3, 'm', 'numeric', 'of the mesh at the tip, about a tip radius')
    max_mesh_scale: float = constant(0.4, '1', 'numeric', 'of the mesh at the tip over half a side')
    still_share: float = constant(0.05, '1', 'limit',
                                  'displacement over depth; markers displaced by less show the error that grows with depth')
    default_noise: tuple[float, ...] = constant((1e-5, 5e-3, 3e-3, 1.0), 'm, 1, 1, 1/m', 'measured', 'FieldNoise without untouched frames')
    min_noise: tuple[float, ...] = constant((1e-6, 5e-4, 5e-4, 0.1), 'm, 1, 1, 1/m', 'limit', 'smallest FieldNoise')

    tractions: tuple[float, ...] = constant((0.35, 0.7, 1.0), '1', 'numeric', 'of simulated drags over pressure, for frictions of 0.2 to 1')
    directions: int = constant(6, '1', 'numeric', 'of the simulated drags of one traction')

    @property
    def radius_spread(self) -> float:
        """Spread of the simulated log tip radii around the calibrated one."""
        return math.log(self.radius_ratio)


@dataclass(frozen=True)
class DomeConstants:
    """Constants of the dome method, tuned on simulated domes. Pairs are of position and depth."""

    alike: float = constant(4.5, '1', 'measured', 'factor on the model error, because errors of neighbouring markers are similar')
    stands_out: float = constant(12.0, 'sigma', 'measured', 'smallest match of a contact')
    quieter: float = constant(1.5, '1', 'limit', 'smallest match of a contact over the largest of untouched frames')
    sure: float = constant(2.5, 'sigma', 'limit', 'smallest depth, and tip radius over the error of position; fainter is not reported')
    faint: float = constant(8.0, '1', 'limit', 'match over the smallest, below which two presses may be mistaken for one')
    ordinary: float = constant(1.0, '1', 'measured', 'residual chi-square of presses under their own hypothesis, which is 0.4 to 2')
    unexplained: float = constant(12.0, '1', 'limit', 'chi-square above which an estimate is ambiguous')
    not_linear: tuple[float, float] = constant((0.07, 0.1), '1', 'measured',
                                               'error over a drag, which is linearised; the first of markers too')
    added: float = constant(0.12, '1', 'measured', 'error of the depth of each of two presses, whose fields are added')
    scaled: float = constant(0.5, '1', 'prior', 'error of a scale over the correction of the calibrated tip; other tips may need another')
    apart: float = constant(2.2, 'pitch', 'limit', 'smallest distance of the starts of two contacts')
    straight: tuple[float, float] = constant((0.005, 0.02), '1', 'prior', 'drag over depth, and friction number, of a straight press')
    dragged: tuple[float, float] = constant((1.0, 1.0), '1', 'prior', 'of a drag: a sticking tip moves the skin farther than it is deep')
    two: tuple[float, float, float] = constant((0.1, 0.01, 0.1), '1', 'prior', 'of two presses; the last is the error of the sum of fields')
    tip_sigma: float = constant(0.35, '1', 'prior', 'log tip radius over the spread of the library')
    unknown_friction: float = constant(0.35, '1', 'prior', 'friction number for coefficients of 0.2 to 1.0: 0.46, less as large ones stick')
    unknown_tips: tuple[float, float] = constant((0.6, 2.0), '1', 'prior', 'range of tip radii over the calibrated one')
    max_steps: tuple[float, ...] = constant((0.01, 0.01, 0.5, 0.5, 0.5, 0.3, 0.3), 'm, 1', 'numeric', 'of one step of the fit')
    start_rings: tuple[float, ...] = constant((0.0, 0.14, 0.28, 0.42, 0.56), '1', 'numeric', 'of the starts of the fit over the rim radius')
    start_depths: tuple[float, ...] = constant((0.06, 0.15, 0.35, 0.6, 0.85), '1', 'numeric', 'the same over the deepest press')
    max_relative_reach: float = constant(0.98, '1', 'limit', 'of the reach of the library; contacts beyond are at the edge')
    shallow: float = constant(0.2, '1', 'measured', 'depth over the deepest press; above it, model errors are proportional to depth')
    slope_share: float = constant(0.5, '1', 'measured', 'share of the slope of the skin under the other press that displaces a contact')
    slope_base: float = constant(3e-3, 'm', 'numeric', 'length over which that slope is computed')
    contact_gap: float = constant(0.05, 'tip radius', 'limit', 'gap between skin and tip above the smallest; in contact below it')
    centre_error: float = constant(0.15, '1', 'measured', 'of the centre of a contact over its distance from the lowest point')
    min_mode_rms: float = constant(1.5e-6, 'm', 'numeric',
                                   'modes of the library that are weaker are truncated: below the noise of a marker')
    max_unsolved_share: float = constant(0.2, '1', 'limit', 'of the presses; deep presses of a large tip near the rim do not converge')
    radius_ratio: float = constant(2.2, '1', 'limit', 'of the simulated tip radii to the middle one')
    drag: float = constant(0.5, '1', 'numeric', 'displacement over depth for which the apparent displacement of markers is exact')
    penalty: float = constant(4e6, '1/m^2', 'numeric', 'stiffness of contact over the tension over G, for a penetration of about 10 um')
    transition: float = constant(10e-6, 'm', 'numeric', 'half width of the transition into contact')
    max_newton_steps: int = constant(24, '1', 'numeric', 'before a load step is halved')
    exact_steps: int = constant(8, '1', 'numeric', 'first steps with the exact tangent; stick and slip might alternate for ever')
    max_halvings: int = constant(4, '1', 'numeric', 'of a load step')
    tolerance: float = constant(2e-6, 'm', 'numeric', 'largest last Newton step, far below the noise of a marker')
    max_step: float = constant(2e-3, 'm', 'numeric', 'of a Newton step')
    load_steps: int = constant(18, '1', 'numeric', 'of a press to the largest depth; friction depends on the path')
    load_power: float = constant(1.3, '1', 'numeric', 'grading of the load steps')
    positions_and_depths: tuple[int, int] = constant((3, 4), '1', 'numeric', 'of the identification, evenly over distances from the axis')
    prior_mean: tuple[float, ...] = constant((0.2, 70.0, 0.5), '1', 'prior', 'log prestretch, gas and friction: sealed air at 1.5 kPa')
    prior_sigma: tuple[float, ...] = constant((2.0, 6.0, 0.7), '1', 'prior', 'standard deviations of their logs: any other gas, too')
    radius_sigma: float = constant(0.01, '1', 'prior', 'log radius of the calibration tip, which heights determine')
    starts: tuple[tuple[float, float], ...] = constant(
        ((1.6, 0.35), (1.6, 0.5), (0.06, 0.35), (0.02, 0.35)), '1', 'numeric',
        'log prestretch and friction, from a balloon to a skin hardly stretched; with less friction deep presses of some balloons do not '
        'converge, with more the tip sticks and slopes are small')
    gas_starts: tuple[float, ...] = constant((70.0, 2.0, 0.01), '1', 'numeric', 'sealed air, air with a reservoir, a constant pressure')
    model_error: float = constant(5e-4, '1', 'measured', 'relative; at 0.002 the prior dominated the prestretch of an ideal balloon')
    unsolved_error: float = constant(0.2, '1', 'limit', 'relative, of presses whose simulation does not converge')
    min_numbers: tuple[float, ...] = constant((3e-3, 1e-3, 0.05, 2e-3), '1, 1, 1, m', 'limit', 'log prestretch, gas, friction, tip radius')
    max_numbers: tuple[float, ...] = constant((1.8, 500.0, 3.0, 0.2), '1, 1, 1, m', 'limit', 'the same; less gas is a constant pressure')
    reach_margin: float = constant(1.5, 'pitch', 'limit', 'by which the library extends beyond the presses')
    default_marker: float = constant(0.3, 'pitch', 'prior', 'radius of markers whose area is unknown')
    top: float = constant(0.35, '1', 'limit', 'of the rim radius; markers nearer to the axis are used for their radius')
    default_noise: float = constant(2e-5, 'm', 'measured', 'without untouched frames')
    min_noise: float = constant(1e-6, 'm', 'limit', 'of an untouched marker')
    tips: int = constant(4, '1', 'numeric', 'number of simulated tips')
    mesh_difference: float = constant(1e-5, '1', 'numeric', 'of the unit disc; finite difference for derivatives, accurate to 1e-10')
    outline_points: int = constant(12, '1', 'numeric', 'of the outline of a marker; with 24, a centroid differs by less than a micrometre')
    min_outline_area: float = constant(0.02, '1', 'limit', 'of the mean; a part of an outline seen from behind must not count negatively')
    min_shares: tuple[float, float] = constant((0.003, 0.002), '1', 'limit', 'model error over a displacement, and over the largest one')

    @property
    def radius_spread(self) -> float:
        """Spread of the simulated log tip radii around the middle one."""
        return math.log(self.radius_ratio)

    @property
    def outline_stretch(self) -> float:
        """Distance of the points of an outline over a disc's radius for which the polygon has the disc's second moment over its area."""
        return math.sqrt(3 / (2 + math.cos(2 * math.pi / self.outline_points)))


PRESS, SHEET, DOME = PressConstants(), SheetConstants(), DomeConstants()
