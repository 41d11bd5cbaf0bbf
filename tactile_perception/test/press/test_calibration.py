# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from types import SimpleNamespace

import numpy as np
import pytest
from tactile_perception.errors import BadArgument, BadCalibration
from tactile_perception.press.calibration import best_method, fit_stiffness, read_touch, write_touch
from tactile_perception.press.estimate import TouchEstimate
from tactile_perception.press.methods import make_method
from tactile_perception.press.presses import Presses
from tactile_perception.press.sensor import MARKER_SENSORS

NAN = float('nan')
GOOD, BAD = ({'place_median': place, 'depth_median': depth, 'presses': 9, 'missed': 0, 'split': 0}
             for place, depth in ((2e-4, 1e-4), (2e-3, 9e-5)))
SPAN = {'depth': [1e-3, 5e-3], 'x': [-0.01, 0.01], 'y': [-0.02, 0.02]}


@pytest.fixture
def path(tmp_path):
    path = tmp_path / 'sheet.yaml'
    write_touch(path, 'areal_single', {'methods': {'far': {'a': 1.0}, 'near': {'a': [2.0]}}}, {'far': BAD, 'near': GOOD},
                {'force': NAN}, SPAN, ['x'])
    return path


def test_what_is_written_is_read(path):
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
    write_touch(path, 'areal_single', fitted, {}, {}, SPAN, [])
    assert read_touch(path, 'areal_single').stiffness == 50.0
    write_touch(path, 'areal_single', fitted | {'wrench': {'a': 1.0}}, {}, {}, SPAN, [])
    with pytest.raises(BadCalibration, match='no stiffness'):
        read_touch(path, 'areal_single')


def test_a_file_without_methods_or_for_another_sensor_is_refused(path, tmp_path):
    with pytest.raises(BadCalibration, match='sensor type'):
        read_touch(path, 'air_cushion')
    write_touch(tmp_path / 'none.yaml', 'areal_single', {}, {}, {}, SPAN, [])
    with pytest.raises(BadCalibration, match='method'):
        read_touch(tmp_path / 'none.yaml', 'areal_single')


@pytest.mark.parametrize('other, name', [({'place_median': 3.6e-4, 'depth_median': 1.8e-4}, 'model'),
                                         ({'place_median': 5e-4, 'depth_median': 2.5e-4}, 'paper')])
def test_mechanics_come_before_what_was_only_learned_unless_clearly_worse(other, name):
    assert best_method({'paper': GOOD, 'model': GOOD | other}, ['paper', 'model']) == name


def test_a_method_that_misses_or_splits_presses_is_worse_than_one_that_finds_them():
    for wrong in ({'missed': 2}, {'place_median': 1.9e-4, 'split': 3}):
        assert best_method({'whole': GOOD, 'wrong': GOOD | wrong}, ['wrong', 'whole']) == 'whole'


def test_the_pattern_of_a_dome_without_a_grid_is_kept(path):
    pattern = [[100.5, 20.25], [310.0, 22.0], [200.0, 230.0]]
    write_touch(path, 'air_cushion', {'methods': {'one': {'a': 1.0}}, 'pattern': np.array(pattern)}, {}, {}, SPAN, [])
    np.testing.assert_allclose(read_touch(path, 'air_cushion').pattern, pattern)
    write_touch(path, 'air_cushion', {'methods': {'one': {'a': 1.0}}, 'pattern': np.array([1.0, 2.0])}, {}, {}, SPAN, [])
    with pytest.raises(BadCalibration, match='pairs'):
        read_touch(path, 'air_cushion')


STIFFNESS = 80.0  # N/m


class Model:
    """A method that knows each wrench over the stiffness, with small errors; of a field without a wrench it finds nothing."""

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


def test_the_stiffness_is_found_with_the_errors_at_the_presses():
    stiffness, errors = fit_stiffness(recording(30, blind=5), Model())
    assert stiffness == pytest.approx(STIFFNESS, rel=0.01)
    assert 0 < errors['force'] < 0.02 and 0 < errors['moment'] < 0.02


def test_too_few_presses_with_an_estimated_wrench_are_refused():
    with pytest.raises(BadCalibration, match='5 presses .* too few'):
        fit_stiffness(recording(20, blind=15), Model())
