# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception.common.marker_sensor import MARKER_SENSORS, MarkerSensor
from tactile_perception.core.errors import BadArgument, BadCalibration
from tactile_perception.press.calibration import restored, stored
from tactile_perception.press.estimate import AT_EDGE, OUT_OF_RANGE, TouchEstimate
from tactile_perception.press.field import MarkerField
from tactile_perception.press.methods import DOME_METHODS, SHEET_METHODS
from tactile_perception.press.presses import Presses
from tactile_perception.published.air_cushion_contact import distance_changes, four_largest, neighbours
from tactile_perception.published.areal_sensor_contact_position import ContactFilter, Cubics, MarkerDepths, grid_point, plate_step

PAPER, CUSHION = SHEET_METHODS['paper'], DOME_METHODS['paper_cushion']

HEIGHT, PITCH = 0.06, 4.5e-3
GRID = np.stack(np.meshgrid(np.arange(-4, 5) * PITCH, np.arange(-3, 4) * PITCH), -1).reshape(-1, 2)


def field(depth):
    """Field of markers at a depth (K,) or a common one, m."""
    depth = np.broadcast_to(np.asarray(depth, float), len(GRID))
    shift = GRID * (depth / (HEIGHT - depth))[:, None]
    camera_centre = np.tile([0.0, 0.0, -HEIGHT], (len(GRID), 1))
    plain = np.full(len(GRID), 1e-6)
    return MarkerField(GRID, shift, 2 * np.log(HEIGHT / (HEIGHT - depth)), camera_centre, GRID, shift, plain)


def plate(depths=(1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3, 8e-3), slope=0.0):
    """A plate pressed onto all markers in steps; slope: along x."""
    pressed = [0.0, *depths]
    position = np.array([[np.nan] * 3] + [[0.0, 0.0, -depth] for depth in depths])
    fields = tuple(field(depth + (slope * GRID[:, 0] if depth else 0.0)) for depth in pressed)
    return Presses(fields, position, np.array(pressed))


def presses(markers, depths, plate_of=plate()):
    """A tip pressed onto markers."""
    pressed = [(marker, depth) for marker in markers for depth in depths]
    position = np.array([[*GRID[marker], -depth] for marker, depth in pressed])
    return Presses(tuple(field(depth) for _, depth in pressed), position, np.array([depth for _, depth in pressed]), plate=plate_of)


def test_a_cubic_is_recovered_and_clamped_and_flagged_beyond_its_range():
    x = np.linspace(0.1, 0.8, 8)
    truth = 1e-3 + 0.01 * x + 0.004 * x**2 + 0.002 * x**3
    cubics = Cubics.fit(np.column_stack([x, np.full(8, np.nan), np.ones(8)]), truth)
    depth, outside = cubics(np.array([0.45, 0.45, 1.0]))
    assert depth[0] == pytest.approx(1e-3 + 0.0045 + 0.004 * 0.45**2 + 0.002 * 0.45**3) and np.isnan(depth[1:]).all() and not outside[0]
    assert cubics(np.array([5.0, 0, 0]))[0][0] == pytest.approx(truth[-1]) and cubics(np.array([5.0, 0, 0]))[1][0]


def test_the_marker_under_the_lens_is_measured_by_its_area_alone():
    rng, middle, flat = np.random.default_rng(0), 31, plate()
    tip = presses([middle, 0, 62], [2e-3, 3e-3, 4e-3, 5e-3], flat)
    for some, aside in ((flat, 5e-6), (tip, 1e-4)):  # m: a plate hardly moves it, a tip draws it aside
        for one, depth in zip(some.fields, some.depth):
            one.shift[middle] = 0.01 * depth + abs(rng.normal(0, aside)), 0.0
            one.growth[middle] += rng.normal(0, 0.03)  # 0.9 mm of depth: nearly a step of the plate
    seen = field(3e-3)
    seen.shift[middle] = 3e-4, 0.0  # a tip beside it
    assert MarkerDepths.fit(tip, PITCH).depths(seen)[0][middle] == pytest.approx(3e-3, abs=1.5e-3)


def test_depths_of_a_plate_are_reported_for_all_markers():
    fitted = MarkerDepths.fit(presses([0, 30, 62], [2e-3, 4e-3]), PITCH)
    depth, outside = fitted.depths(field(5e-3))
    assert np.abs(depth - 5e-3).max() < 5e-5 and not outside.any()
    assert fitted.depths(field(9.5e-3))[1].all()
    seen = field(3e-3)
    seen.shift[5], seen.growth[5], seen.growth[7] = np.nan, np.nan, np.nan
    depth, _ = fitted.depths(seen)
    assert np.isnan(np.delete(depth, 5)).sum() == 0 and depth[7] == pytest.approx(3e-3, abs=5e-5)
    again = restored(MarkerDepths, stored(fitted))
    assert np.array_equal(again.depths(field(3e-3))[0], fitted.depths(field(3e-3))[0])


def test_the_more_accurate_of_area_and_displacement_weighs_more():
    beside = presses([30], [2e-3, 4e-3])
    for one in beside.fields:
        one.shift[:] *= 1.5  # dragged aside: displacements lie
    assert MarkerDepths.fit(beside, PITCH).weight.min() > 0.9


@pytest.mark.parametrize('wrong, message', [(dict(plate_of=None), 'needs a plate'), (dict(plate_of=plate(slope=0.05)), 'tilted by 2.9'),
                                            (dict(plate_of=plate((2e-3, 4e-3))), '2 depths; at least 3')])
def test_a_plate_without_information_is_refused_by_name(wrong, message):
    small = MarkerSensor(7, 9, (PITCH, PITCH), (0.045, 0.036), type='areal_single')
    with pytest.raises(BadCalibration, match=message):
        PAPER.fit(presses([0, 30, 62], [2e-3, 4e-3], **wrong), small)


def test_the_step_of_a_plate_is_found_with_or_without_frames_in_between():
    stops = np.arange(1, 7) * 1e-3
    assert plate_step(plate(stops)) == pytest.approx(1e-3)
    on_the_way = np.sort(np.concatenate([stops, stops, stops, stops - 0.3e-3, stops - 0.7e-3]))
    assert plate_step(plate(on_the_way)) == pytest.approx(1e-3)


def test_the_filter_reduces_noise_by_a_quarter_and_drops_ended_contacts():
    rng, filter_, sigma, off = np.random.default_rng(0), ContactFilter(), 1e-3, []
    for k in range(90):
        true = np.array([1e-3 * k, -5e-4 * k, -4e-3])
        seen = TouchEstimate(true + rng.normal(0, sigma, 3), 4e-3 + rng.normal(0, sigma), np.eye(3) * sigma**2, sigma)
        found, = filter_.update([seen], [1], k / 30)
        off.append((seen.position - true, found.position - true, found.depth - 4e-3, found.depth_sigma))
    seen, found, depth, stated = (np.array(values[30:]) for values in zip(*off))
    assert np.sqrt((found**2).mean()) < 0.78 * np.sqrt((seen**2).mean())
    assert np.sqrt((depth**2).mean()) == pytest.approx(stated.mean(), rel=0.5)
    filter_.update([], [], 90 / 30)
    again = TouchEstimate(np.zeros(3), 1e-3, np.eye(3) * sigma**2, sigma)
    assert filter_.update([again], [1], 91 / 30)[0].position == pytest.approx(np.zeros(3))


POSITIONS = np.stack(np.meshgrid(np.arange(-6, 7) * 4.5e-3, np.arange(-4, 5) * 4.5e-3), -1)


def bell(centre, height=5e-3, width=7e-3):
    return height * np.exp(-np.sum((POSITIONS - centre) ** 2, axis=-1) / (2 * width**2))


def test_the_papers_fit_is_exact_on_its_own_surface():
    point = grid_point(bell((1.3e-3, -2.1e-3)), POSITIONS)
    assert not point.at_edge
    assert point.position == pytest.approx([1.3e-3, -2.1e-3], abs=1e-9)
    assert point.depth == pytest.approx(5e-3 * np.exp(-(0.8e-3**2 + 1.0e-3**2 + 2.1e-3**2 - 1.0e-3**2) / 4 / 49e-6), rel=0.1)


def test_depths_up_to_zero_are_left_out_and_lines_at_the_border_are_one_sided():
    deep = bell((1e-3, 1e-3))
    deep[4, 8] = -1e-4
    assert grid_point(deep, POSITIONS).position == pytest.approx([1e-3, 1e-3], abs=1e-6)
    point = grid_point(bell((26.5e-3, 0.5e-3)), POSITIONS)
    assert point.at_edge and point.position == pytest.approx([26.5e-3, 0.5e-3], abs=1e-6)


SHEET = MARKER_SENSORS['areal_single']


@pytest.fixture(scope='module')
def fitted(bell_presses):
    return PAPER.fit(bell_presses(), SHEET)


def test_a_gaussian_dent_is_located_to_half_a_pitch(fitted, bell_field):
    method = PAPER.from_fitted(fitted, SHEET)
    touch, = method.estimate(bell_field((9e-3, -4.5e-3), 4e-3))
    assert np.hypot(*(touch.position[:2] - [9e-3, -4.5e-3])) < 2e-3 and touch.depth == pytest.approx(4e-3, abs=3e-4)
    assert touch.position[2] == -touch.depth and np.isfinite(touch.covariance).all()


def test_beyond_the_calibrated_range_and_at_the_edge_it_is_flagged(fitted, bell_field):
    method = PAPER.from_fitted(fitted, SHEET)
    assert method.estimate(bell_field((9e-3, -9e-3), 9e-3))[0].flags & OUT_OF_RANGE
    touch, = method.estimate(bell_field((28e-3, 0), 4e-3))
    assert touch.flags & AT_EDGE and abs(touch.position[0]) <= 30e-3


def test_bad_numbers_are_refused(fitted):
    with pytest.raises(BadCalibration, match='calibrate again'):
        PAPER.from_fitted({'quiet': 1}, SHEET)
    with pytest.raises(BadArgument, match='grid'):
        PAPER.from_fitted(fitted, MARKER_SENSORS['air_cushion'])


RING = np.array([[0, 0], [1, 0], [0, 1], [-1, 0], [0, -1], [2, 2.0]])


def ring_field(positions):
    plain = np.full(len(RING), 1e-6)
    return MarkerField(RING, positions - RING, plain, np.tile([0, 0, -1.0], (6, 1)), RING, positions - RING, plain)


def test_changes_are_those_of_the_mean_distance_to_five_neighbours(ring=RING):
    near = neighbours(RING)
    assert sorted(near[0]) == [1, 2, 3, 4, 5]
    changes = distance_changes(ring_field(RING * 1.1), near)
    assert changes[0] == pytest.approx(0.1 * (4 + np.sqrt(8)) / 5)
    moved = RING.copy()
    moved[5] = np.nan
    of_moved = distance_changes(ring_field(moved), near)
    assert np.isnan(of_moved[5]) and of_moved[0] == pytest.approx(0, abs=1e-12)


def test_the_four_largest_changes_are_the_weights():
    changes = np.array([4.0, 3.0, 2.0, 1.0, 0.5, np.nan])
    position, mean = four_largest(changes, RING, 10.0)
    assert position == pytest.approx(np.array([4, 3, 2, 1]) @ RING[:4] / 10) and mean == 2.5
    position, mean = four_largest(np.array([4.0, 0, 0, 0, 0, 3.0]), RING, 0.5)
    assert position == pytest.approx(RING[0]) and mean == 4.0
    assert four_largest(np.zeros(6), RING, 1.0) is None


def test_a_press_is_located_to_a_pitch_and_nothing_without_contact(bell_field, bell_presses):
    method = CUSHION.from_fitted(CUSHION.fit(bell_presses(), SHEET), SHEET)
    touch, = method.estimate(bell_field((9e-3, 9e-3), 5e-3))
    assert np.hypot(*(touch.position[:2] - 9e-3)) < 9e-3 and touch.depth == pytest.approx(5e-3, abs=2.5e-3)
    assert method.estimate(bell_field((0, 0), 0.0, seed=55)) == []


def test_inconsistent_input_is_refused(bell_presses):
    fitted = CUSHION.fit(bell_presses(), SHEET)
    with pytest.raises(BadArgument, match='117 markers'):
        CUSHION.from_fitted(fitted, SHEET).estimate(ring_field(RING))
    with pytest.raises(BadCalibration, match='calibrate again'):
        CUSHION.from_fitted({}, SHEET)
    with pytest.raises(BadCalibration, match='6 markers'):
        neighbours(RING[:5])
