# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of presses with a recorded wrench, and of the stitching."""
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from dual_bags import PARAMETERS, SENSOR, pair, printed, write_pairs

from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_driver.stitching.calibration import load_stitching
from tactile_perception.common.marker_sensor import MARKER_SENSORS
from tactile_perception.core.errors import BadCalibration
from tactile_perception.press.calibration import read_touch
from tactile_perception.press.estimate import TouchEstimate
from tactile_perception.press.methods import SHEET_METHODS
from tactile_perception.press.presses import Presses
from tactile_perception.press.tools import find_stitching, fit_wrench, have_truth
from tactile_perception.tools import calibrate, process_bag


class Pushes:
    """A model of a skin of 50 N/m that finds every press."""

    @classmethod
    def from_fitted(cls, fitted, sensor):
        return cls()

    def estimate(self, field):
        return [TouchEstimate(np.zeros(3), 1e-3, 1e-8 * np.eye(3), 1e-4, wrench=field.wrench / 50)]


def recorded(count, wrench=True):
    depth = np.linspace(1e-3, 5e-3, count)
    wrenches = depth[:, None] * [10.0, 0.0, -100.0, 0.0, 0.2, 0.0]
    return Presses(tuple(SimpleNamespace(wrench=row) for row in wrenches), np.zeros((count, 3)), depth,
                   wrench=wrenches if wrench else None)


@pytest.fixture
def reader(monkeypatch):
    monkeypatch.setitem(SHEET_METHODS, 'model', Pushes)
    return SimpleNamespace(sensor=MARKER_SENSORS['areal_single'], left_out=[])


def test_without_a_recorded_wrench_or_a_model_there_is_no_stiffness(reader):
    assert fit_wrench(recorded(12, wrench=False), reader, {'model': {}}) is None
    assert fit_wrench(recorded(12), reader, {'paper': {}}) is None
    assert reader.left_out == ['wrench: no ground_truth/wrench was recorded with the presses', 'wrench: only the method model gives it']


@pytest.fixture
def params(tmp_path):
    path = tmp_path / 'params.yaml'
    path.write_text(yaml.safe_dump({'/**': {'ros__parameters': PARAMETERS}}))
    return path


def dark():
    return tuple(np.full_like(image, 12) for image in pair())


def test_one_untouched_pair_determines_the_stitching_file(tmp_path, params, capsys):
    bag, output = write_pairs(tmp_path / 'bag', [pair()], truth=False), tmp_path / 'out.yaml'
    assert not have_truth([bag], '')
    assert calibrate.main([str(bag), '--params', str(params), '--output', str(output)]) == 0
    said = capsys.readouterr().out
    assert 'deviation of the markers from the nominal grid: 0.4' in said and ' mm RMS' in said and 'the stitching alone' in said
    found = load_stitching(str(output))
    assert found.camera_centres[0] == pytest.approx([-0.0165, 0.0, -0.046], abs=3e-4) and found.right.gain == pytest.approx(0.8, abs=0.02)
    residuals = yaml.safe_load(output.read_text())['residuals']
    assert 5e-5 < residuals['markers_off_grid'] < 12e-5 and residuals['views_apart'] < 1.5e-5


def test_with_the_stitching_alone_only_markers_are_reported(tmp_path, params):
    output, bag = tmp_path / 'out.yaml', write_pairs(tmp_path / 'bag', [pair()] * 2, truth=False)
    calibrate.main([str(bag), '--params', str(params), '--output', str(output)])
    assert read_touch(output, 'areal_dual').best == ''
    with pytest.raises(BadCalibration, match='presses'):
        read_touch(output, 'areal_dual').fitted('')
    assert process_bag.main([str(bag), str(tmp_path / 'dots'), '--params', str(params), '--calibration', str(output)]) == 0
    with BagReader(tmp_path / 'dots') as reader:
        dots = [raw for raw in reader.messages() if raw.topic == '/pad/dots']
        tracks = decode(dots[0].data, dots[0].type_name)
    assert len(dots) == 2 and '/pad/contacts' not in reader.topics
    assert sorted(tracks.id) == list(range(SENSOR.rows * SENSOR.columns)) and tracks.header.frame_id == 'pad'
    positions = np.stack([tracks.x, tracks.y], axis=1)[np.argsort(tracks.id)]
    assert np.linalg.norm(positions - printed(), axis=1).mean() < 0.04e-3


def test_the_first_usable_untouched_pair_is_used(tmp_path, params):
    pressed = tuple(np.roll(image, 25, axis=0) for image in pair())
    bag = write_pairs(tmp_path / 'bag', [pressed, dark(), pair(), pressed], touched={0, 3})
    assert have_truth([bag], '/pad')
    found = find_stitching([bag], params, SENSOR, '')
    assert found.stitching.camera_centres[1] == pytest.approx([0.017, 0.001, -0.0455], abs=3e-4)


def test_cameras_that_are_not_calibrated_are_refused(tmp_path, params):
    bag = write_pairs(tmp_path / 'bag', [pair()], truth=False, known=False)
    with pytest.raises(BadCalibration, match='calibrate both cameras first'):
        find_stitching([bag], params, SENSOR, 'pad')


def test_pairs_without_markers_are_reported(tmp_path, params, capsys):
    bag = write_pairs(tmp_path / 'bag', [dark()] * 3, truth=False)
    with pytest.raises(BadCalibration, match='left image'):
        find_stitching([bag], params, SENSOR, '')
    assert calibrate.main([str(bag), '--params', str(params), '--output', str(tmp_path / 'out.yaml')]) == 1
    said = capsys.readouterr().err
    assert said.count('calibrate: ') == 1 and 'Traceback' not in said  # where it is slow, it also says how far it is
