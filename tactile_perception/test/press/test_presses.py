# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Presses of a recording, and their calibration."""
from types import SimpleNamespace

import numpy as np
import pytest

from tactile_perception.common.marker_sensor import MARKER_SENSORS
from tactile_perception.core.calibration_file import CalibrationFile, write_calibration
from tactile_perception.core.errors import BadArgument, BadCalibration
from tactile_perception.press.calibration import UNITS, best_method, fit_stiffness, read_touch
from tactile_perception.press.estimate import TouchEstimate
from tactile_perception.press.methods import make_method
from tactile_perception.press.presses import Presses, held_out, marker_residuals, require_coverage, rms_errors, score


def three_positions():
    """Two untouched frames, then three positions pressed to two depths."""
    position = np.vstack([np.full((2, 3), np.nan)] + [np.tile([x, 0.0, -0.001], (2, 1)) for x in (-0.01, 0.0, 0.01)])
    return Presses((None,) * len(position), position, np.array([0, 0] + [1e-3, 2e-3] * 3))


def test_whole_positions_are_held_out():
    folds = list(three_positions().folds(3))
    assert [held.sum() for held in folds] == [4, 2]  # a position and its mirror image, and the middle
    x = np.abs(three_positions().position[:, 0])
    assert all(not held[:2].any() and not set(x[2:][~held[2:]]) & set(x[held]) for held in folds)


def test_a_drag_is_not_a_straight_press():
    x = np.array([np.nan, 0, 0, 5e-4, 1e-3, 0, np.nan, 1e-3, 1.1e-3, 9e-3, 9.5e-3])
    depth = np.array([0, 1, 3, 3, 3, 3, 0, 2, 3, 3, 1]) * 1e-3
    tried = Presses((None,) * len(x), np.stack([x, 0 * x, -depth], axis=1), depth)
    assert tried.straight().tolist() == [False, True, True, False, False, True, False, True, True, True, True]


def presses(positions, depths, segment=None):
    return Presses((None,) * len(positions), np.column_stack([positions, -np.asarray(depths)]), np.asarray(depths, float), segment)


def touch(x, y, depth, sigma=1e-4):
    return TouchEstimate(np.array([x, y, -depth]), depth, sigma**2 * np.eye(3), sigma)


def test_errors_misses_and_splits_are_counted_at_evaluated_presses_only():
    known = presses([[0.0, 0.0], [0.01, 0.0], [0.02, 0.0], [0.03, 0.0], [np.nan, np.nan]], [1e-3, 2e-3, 3e-3, 3e-3, 0.0])
    got = score([[touch(3e-4, 4e-4, 1.2e-3)], [touch(0.01, 0.0, 2e-3), touch(0.02, 0.0, 1e-3)], [], None, None], known)
    assert got['place_mean'] == pytest.approx(0.25e-3) and got['place_95'] == pytest.approx(0.95 * 0.5e-3)
    assert got['depth_mean'] == pytest.approx(0.1e-3) and got['squares'] == pytest.approx((25 + 4) / 3 / 2)
    assert (got['missed'], got['split'], got['presses']) == (1, 1, 3)
    assert np.isnan(score([[], None, None, None, None], known)['place_mean'])


def test_a_few_drags_count_as_much_as_many_presses():
    known = presses([[0.0, 0.0], [0.01, 0.0], [0.02, 0.0], [0.0205, 0.0], [0.021, 0.0]], [1e-3] * 5)
    found = [[touch(*(position[:2] + [off, 0]), 1e-3)] for position, off in zip(known.position, (2e-4, 1e-4, 3e-4, 4e-3, 6e-3))]
    assert score(found, known)['place_median'] == pytest.approx((2e-4 + 5e-3) / 2)


class Remembers:
    """Reports the mean of the positions that it was fitted to."""

    def __init__(self, mean):
        self.mean = mean

    @classmethod
    def fit(cls, presses, sensor, fitted=None):
        return {'mean': presses.position[presses.touching][:, :2].mean(0).tolist()}

    @classmethod
    def from_fitted(cls, fitted, sensor):
        return cls(fitted['mean'])

    def estimate(self, field):
        return [touch(*self.mean, 1e-3)]


def test_each_position_is_evaluated_by_a_fit_without_it():
    known = presses([[0.0, 0.0], [0.0, 0.03], [0.03, 0.0]], [1e-3] * 3)
    got = score(held_out(Remembers, known, None), known)
    # The mean of the other two positions is so far from each.
    expected = [np.hypot(0.015, 0.015), np.hypot(0.015, 0.03), np.hypot(0.015, 0.03)]
    assert got['place_mean'] == pytest.approx(np.mean(expected))
    assert got['presses'] == 3


class Off:
    """Always reports the same position and depth."""

    def estimate(self, field):
        return [touch(1e-3, 0.0, 2e-3)]


def test_rms_errors_are_those_at_the_presses(bell_presses):
    found = rms_errors(Off(), bell_presses([(0, 0), (0, 0.002), (0, -0.002)], depths=(1e-3, 3e-3)))
    assert found['depth_sigma'] == pytest.approx(1e-3) and found['place_sigma'] == pytest.approx(np.sqrt((3 * 1e-6 + 2 * 4e-6) / 6))


def presses_at(positions):
    """Presses at (x, y, depth), m; a depth of 0 is untouched."""
    positions = np.array(positions, float)
    position = np.where(positions[:, 2:] > 0, positions * [1, 1, -1], np.nan)
    return Presses(tuple(object() for _ in positions), position, positions[:, 2])


GRID = [(x, 0.0, depth) for x in (0.0, 0.01, 0.02) for depth in (0.002, 0.004)]


@pytest.mark.parametrize('positions, reason', [
    ([(0, 0, 0), *GRID[:4]], '4 presses at 2 positions; at least 3'),
    ([(0, 0, 0), *[(x, y, 0.003) for x, y, _ in GRID]], 'all presses are 3.00 to 3.00 mm deep: one depth'),
    (GRID, 'no untouched frame')])
def test_insufficient_presses_are_refused_with_what_to_add(positions, reason):
    with pytest.raises(BadCalibration, match=reason):
        require_coverage(presses_at(positions))


def test_residuals_are_over_the_surface_in_mm_and_have_times():
    known = presses_at([(0.0, 0.005, 0.004), (0, 0, 0), (0.01, 0.0, 0.002)])

    def touch(x, y, depth):
        return TouchEstimate(np.array([x, y, -depth]), depth, 1e-8 * np.eye(3), 1e-4)
    found = [[], None, [touch(0.02, 0.02, 0.009), touch(0.0103, 0.0004, 0.0019)]]
    position, depth = marker_residuals(found, known, ['bag at 2.0 s', 'bag at 3.0 s', 'bag at 1.0 s'])
    assert position.value == pytest.approx([np.nan, 0.5], nan_ok=True) and depth.value == pytest.approx([np.nan, -0.1], nan_ok=True)
    assert position.position == pytest.approx(np.array([[0, 5], [10, 0]])) and position.when == ['bag at 2.0 s', 'bag at 1.0 s']


GOOD, BAD = ({'place_median': position, 'depth_median': depth, 'presses': 9, 'missed': 0, 'split': 0}
             for position, depth in ((2e-4, 1e-4), (2e-3, 9e-5)))
SPAN = {'depth': [1e-3, 5e-3], 'x': [-0.01, 0.01], 'y': [-0.02, 0.02]}


def write(path, sensor, fitted, residuals=()):
    write_calibration(path, CalibrationFile(sensor, UNITS, fitted, dict(residuals), SPAN, ['x']))


@pytest.fixture
def path(tmp_path):
    path = tmp_path / 'sheet.yaml'
    write(path, 'areal_single', {'methods': {'far': {'a': 1.0}, 'near': {'a': [2.0]}}},
          {'far': BAD, 'near': GOOD, 'wrench': {'force': float('nan')}})
    return path


def test_a_written_calibration_is_read_back(path):
    found = read_touch(path, 'areal_single')
    assert found.methods == {'far': {'a': 1.0}, 'near': {'a': [2.0]}}
    assert found.fitted('far') == {'a': 1.0}
    assert found.best == 'near'
    assert np.isnan(found.stiffness) and found.stitching is None
    assert found.file.residuals['near']['place_median'] == 2e-4


def test_a_method_that_was_not_fitted_is_refused_with_those_that_were(path):
    with pytest.raises(BadCalibration, match='paper.*far, near'):
        read_touch(path, 'areal_single').fitted('paper')


def test_a_method_of_another_surface_and_one_without_its_numbers_are_refused():
    with pytest.raises(BadArgument, match='no touch method'):
        make_method('paper_cushion', {}, MARKER_SENSORS['areal_single'])
    with pytest.raises(BadCalibration, match='calibrate again'):
        make_method('paper_cushion', {}, MARKER_SENSORS['air_cushion'])


def test_the_stiffness_is_read(path):
    fitted = {'methods': {'one': {}}, 'wrench': {'stiffness': 50.0}}
    write(path, 'areal_single', fitted)
    assert read_touch(path, 'areal_single').stiffness == 50.0
    write(path, 'areal_single', fitted | {'wrench': {'a': 1.0}})
    with pytest.raises(BadCalibration, match='no stiffness'):
        read_touch(path, 'areal_single')


def test_a_file_without_methods_or_for_another_sensor_is_refused(path, tmp_path):
    with pytest.raises(BadCalibration, match='sensor type'):
        read_touch(path, 'air_cushion')
    write(tmp_path / 'none.yaml', 'areal_single', {})
    with pytest.raises(BadCalibration, match='method'):
        read_touch(tmp_path / 'none.yaml', 'areal_single')


@pytest.mark.parametrize('other, name', [({'place_median': 3.6e-4, 'depth_median': 1.8e-4}, 'model'),
                                         ({'place_median': 5e-4, 'depth_median': 2.5e-4}, 'paper')])
def test_the_mechanical_model_is_preferred_unless_clearly_worse(other, name):
    assert best_method({'paper': GOOD, 'model': GOOD | other}, ['paper', 'model']) == name


def test_a_method_that_misses_or_splits_presses_is_worse_than_one_that_finds_them():
    for wrong in ({'missed': 2}, {'place_median': 1.9e-4, 'split': 3}):
        assert best_method({'whole': GOOD, 'wrong': GOOD | wrong}, ['wrong', 'whole']) == 'whole'


def test_the_pattern_of_a_dome_without_a_grid_is_stored(path):
    pattern = [[100.5, 20.25], [310.0, 22.0], [200.0, 230.0]]
    write(path, 'air_cushion', {'methods': {'one': {'a': 1.0}}, 'pattern': np.array(pattern)})
    np.testing.assert_allclose(read_touch(path, 'air_cushion').pattern, pattern)
    write(path, 'air_cushion', {'methods': {'one': {'a': 1.0}}, 'pattern': np.array([1.0, 2.0])})
    with pytest.raises(BadCalibration, match='pairs'):
        read_touch(path, 'air_cushion')


STIFFNESS = 80.0  # N/m


class Model:
    """A method that reports each wrench over the stiffness with small errors, and nothing for a field without a wrench."""

    def estimate(self, field):
        if field.wrench is None:
            return []
        wrench = field.wrench / STIFFNESS * (1 + 0.01 * np.sin(1e5 * field.wrench[0]))
        return [TouchEstimate(np.zeros(3), 1e-3, 1e-8 * np.eye(3), 1e-4, wrench=wrench)]


def recording(count, blind=0):
    rng = np.random.default_rng(3)
    wrench = np.column_stack([rng.normal(0, 0.1, (count, 2)), -rng.uniform(0.5, 2, count), rng.normal(0, 1e-3, (count, 3))])
    fields = tuple(SimpleNamespace(wrench=None if k < blind else row) for k, row in enumerate(wrench))
    depth = rng.uniform(1e-3, 5e-3, count)
    return Presses(fields, np.column_stack([np.zeros((count, 2)), -depth]), depth, wrench=wrench)


def test_the_stiffness_is_fitted_with_the_errors_at_the_presses():
    stiffness, errors = fit_stiffness(recording(30, blind=5), Model())
    assert stiffness == pytest.approx(STIFFNESS, rel=0.01)
    assert 0 < errors['force'] < 0.02 and 0 < errors['moment'] < 0.02


def test_too_few_presses_with_an_estimated_wrench_are_refused():
    with pytest.raises(BadCalibration, match='5 presses .* too few'):
        fit_stiffness(recording(20, blind=15), Model())
