# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration files, and the report of residuals."""
import logging
import math
import time

import cv2
import numpy as np
import pytest
import yaml

from tactile_perception.common.residuals import Residuals, draw_residuals, outliers, report_residuals
from tactile_perception.core.calibration_file import CalibrationFile, Specimen, read_calibration, write_calibration
from tactile_perception.core.errors import BadCalibration
from tactile_perception.core.sensor_type import SENSOR_TYPES


@pytest.fixture
def path(tmp_path):
    content = CalibrationFile('touchpad', {'a': 'm'}, {'a': 0.1, 'b': [1, 2.5]}, {'rms': float('nan')}, {'depth': [0.0, 0.004]},
                              ['one press'], serial='A7', parameters={'rows': 23, 'camera.translation': [0.0, 0.0, 0.1 + 0.2]},
                              outliers=['bag at 1.0 s'])
    write_calibration(tmp_path / 'pad.yaml', content)
    return tmp_path / 'pad.yaml'


def test_what_was_written_is_read_back(path):
    content = read_calibration(path, 'touchpad')
    assert content.fitted == {'a': 0.1, 'b': [1, 2.5]}
    assert math.isnan(content.residuals['rms'])
    assert content.calibrated_range == {'depth': [0.0, 0.004]} and content.left_out == ['one press']
    assert content.serial == 'A7' and content.outliers == ['bag at 1.0 s'] and content.software
    assert content.parameters == {'rows': 23, 'camera.translation': [0.0, 0.0, 0.3]}
    assert content.date.endswith('Z') and len(content.date) == 20
    assert [p.name for p in path.parent.iterdir()] == ['pad.yaml']


ARRAYS = {'one': {'digits': np.arange(6, dtype=np.uint16).reshape(2, 3)}, 'several': [np.array([0.1 + 0.2, np.nan]), 7]}


@pytest.fixture
def with_arrays(tmp_path):
    path = tmp_path / 'sheet.yaml'
    write_calibration(path, CalibrationFile('areal_single', {}, ARRAYS, {}, {}, date='today', software='1'))
    return path


def test_arrays_are_read_back_to_the_bit(with_arrays):
    found = read_calibration(with_arrays, 'areal_single').fitted
    for array, known in ((found['one']['digits'], ARRAYS['one']['digits']), (found['several'][0], ARRAYS['several'][0])):
        assert array.dtype == known.dtype and array.tobytes() == known.tobytes()
    assert found['several'][1] == 7 and 'digits: array 2 x 3 uint16' in with_arrays.read_text()


def test_the_same_calibration_gives_the_same_bytes(with_arrays, monkeypatch):
    files = [with_arrays, with_arrays.with_suffix('.npz')]
    before = [file.read_bytes() for file in files]
    monkeypatch.setattr(time, 'time', lambda: 2e9)
    write_calibration(with_arrays, read_calibration(with_arrays, 'areal_single'))
    assert [file.read_bytes() for file in files] == before


def test_an_array_file_that_is_missing_damaged_or_another_is_named(with_arrays, tmp_path):
    file = with_arrays.with_suffix('.npz')
    content = file.read_bytes()
    other = tmp_path / 'other.yaml'
    write_calibration(other, CalibrationFile('areal_single', {}, {'a': np.zeros(3)}, {}, {}))
    for wrong in (b'', content[:-5], content[:99] + b'x' + content[100:], other.with_suffix('.npz').read_bytes()):
        file.write_bytes(wrong)
        with pytest.raises(BadCalibration, match='sheet.npz is damaged or of another calibration; copy both files of one, or'):
            read_calibration(with_arrays, 'areal_single')
    file.unlink()
    with pytest.raises(BadCalibration, match='sheet.npz, which belongs beside it, cannot be read.*copy both files, or'):
        read_calibration(with_arrays, 'areal_single')


@pytest.mark.parametrize('name', ['../sheet.npz', '/etc/passwd', 3, None])
def test_arrays_come_from_beside_the_file_only(with_arrays, name):
    page = yaml.safe_load(with_arrays.read_text())
    page['arrays']['file'] = name
    with_arrays.write_text(yaml.safe_dump(page))
    with pytest.raises(BadCalibration, match='names no file beside this one'):
        read_calibration(with_arrays, 'areal_single')


def test_a_file_cut_anywhere_is_never_taken_for_whole(path):
    text = path.read_text()
    for length in range(0, len(text) - len('complete: true\n') + 1, 7):
        path.write_text(text[:length])
        with pytest.raises(BadCalibration):
            read_calibration(path, 'touchpad')


@pytest.mark.parametrize('text', ['', '- 1\n- 2\n', 'a: [1, 2', '\x00\x01', 'format: something else\n',
                                  '!!python/object/apply:os.getcwd []'])
def test_files_of_another_kind(path, text):
    path.write_text(text)
    with pytest.raises(BadCalibration, match='pad.yaml'):
        read_calibration(path, 'touchpad')


@pytest.mark.parametrize('value', [float('nan'), float('inf'), 'seven', None, True])
def test_numbers_that_are_none(path, value):
    page = yaml.safe_load(path.read_text())
    page['fitted']['b'][1] = value
    path.write_text(yaml.safe_dump(page, sort_keys=False))
    with pytest.raises(BadCalibration, match=r'fitted\.b\.1'):
        read_calibration(path, 'touchpad')


@pytest.mark.parametrize('value', [float('nan'), np.full(2, np.inf)])
def test_not_finite_numbers_are_not_even_written(tmp_path, value):
    with pytest.raises(BadCalibration, match=r'fitted\.a'):
        write_calibration(tmp_path / 'pad.yaml', CalibrationFile('touchpad', {}, {'a': value}, {}, {}))
    assert not list(tmp_path.iterdir())


def test_the_yaml_file_cannot_have_the_name_of_its_arrays(tmp_path):
    with pytest.raises(BadCalibration, match='NAME.yaml'):
        write_calibration(tmp_path / 'pad.npz', CalibrationFile('touchpad', {}, {}, {}, {}))


def page_of(path):
    return yaml.safe_load(path.read_text())


def test_another_version_and_a_missing_key_are_named(path):
    page = page_of(path)
    assert page['format'] == 'tactile calibration 2' and len(page['parameters']['hash']) == 16
    for version in (1, 3):
        path.write_text(yaml.safe_dump(page | {'format': f'tactile calibration {version}'}))
        with pytest.raises(BadCalibration, match=f'calibration {version}.*calibration 2.*again'):
            read_calibration(path, 'touchpad')
    for name in ('serial', 'parameters', 'units', 'outliers', 'residuals'):
        path.write_text(yaml.safe_dump({key: value for key, value in page.items() if key != name}))
        with pytest.raises(BadCalibration, match=name):
            read_calibration(path, 'touchpad')


def test_other_parameters_are_warned_of_once(path, caplog, monkeypatch):
    # launch, which other tests import, makes loggers that keep to themselves
    log = logging.getLogger('tactile_perception.core.calibration_file')
    monkeypatch.setattr(log, 'handlers', [caplog.handler])
    monkeypatch.setattr(log, 'propagate', False)
    same = {'rows': 23, 'camera.translation': [0.0, 0.0, 0.3], 'contact': 'membrane'}
    read_calibration(path, 'touchpad', same)
    assert caplog.messages == []
    for _ in range(2):
        read_calibration(path, 'touchpad', same | {'camera.translation': [0.0, 0.0, 0.31]})
    assert len(caplog.messages) == 1
    assert 'camera.translation is [0.0, 0.0, 0.31], was [0.0, 0.0, 0.3]; correct them' in caplog.messages[0]


def test_edited_parameters_are_refused(path):
    page = page_of(path)
    page['parameters']['values']['rows'] = 22
    path.write_text(yaml.safe_dump(page))
    with pytest.raises(BadCalibration, match='hash'):
        read_calibration(path, 'touchpad')


def test_each_sensor_has_its_parameters():
    assert all(row.calibration_parameters for row in SENSOR_TYPES.values() if row.calibrate)
    assert Specimen('1', {'rows': 9, 'pitch': [1, 2], 'contact': 'membrane'}).parameters('areal_single') == {'rows': 9, 'pitch': [1, 2]}
    assert Specimen().parameters('touchpad') == {}


def made(value):
    value = np.asarray(value, float)
    when = [f'bag at {k}.000 s' for k in range(len(value))]
    return Residuals('depth', 'mm', value, np.zeros((len(value), 2)), ('x (mm)', 'y (mm)'), when)


def test_the_press_that_stands_out_is_named_with_its_error_and_what_is_usual():
    value = np.random.default_rng(0).normal(0, 0.1, 40)
    value[[7, 30]] = 1.9, -2.5
    assert outliers([made(value)]) == ['bag at 30.000 s: depth error 2.5 mm, the median is 0.054 mm',
                                       'bag at 7.000 s: depth error 1.9 mm, the median is 0.054 mm']


def test_nothing_stands_out_of_even_errors_of_few_or_of_unknown_ones():
    assert outliers([made(np.random.default_rng(1).normal(0, 0.1, 200))]) == []
    assert outliers([made([0, 0, 0, 5.0]), made(np.full(9, np.nan)), made([])]) == []
    assert outliers([made([*np.full(9, 0.1), np.nan])]) == []


@pytest.mark.parametrize('value', [np.linspace(0, 1, 9), np.linspace(-1, 1, 9), np.full(9, np.nan), np.zeros(0)])
def test_a_panel_for_each_quantity(tmp_path, value):
    position = np.random.default_rng(0).normal(size=(len(value), 2))
    path = tmp_path / 'residuals.png'
    draw_residuals(path, 'touchpad', [Residuals('depth', 'mm', value, position, ('x (mm)', 'y (mm)'), ())] * 2)
    picture = cv2.imread(str(path))
    assert picture.shape[1] > 800 and picture.shape[0] > 300 and len(np.unique(picture)) > 10


FOUND = [Residuals('depth', 'mm', np.arange(3.0), np.zeros((3, 2)), ('x (mm)', 'y (mm)'), ('a', 'b', 'c'))]


def test_lines_and_the_picture(tmp_path):
    lines = report_residuals(FOUND, ['c: far off'], tmp_path / 'pad.yaml', 'touchpad')
    assert lines == ['outlier: c: far off', f'plot of the errors: {tmp_path / "pad_residuals.png"}']
    assert (tmp_path / 'pad_residuals.png').stat().st_size > 1000


def test_no_picture_is_reported(tmp_path):
    lines = report_residuals(FOUND, [], tmp_path / 'none' / 'pad.yaml', 'touchpad')
    assert len(lines) == 1 and lines[0].startswith('the plot of the errors was not written: ')
