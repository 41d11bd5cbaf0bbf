# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration files: written whole, read back the same, and every way of being broken named."""
import logging
import math

import pytest
import yaml
from tactile_perception.calibration.files.format import (
    BELONGS_TO, CalibrationFile, Specimen, check_numbers, read_calibration, write_calibration)
from tactile_perception.errors import BadCalibration


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


def test_numbers_have_nine_digits_and_lists_of_them_few_lines(tmp_path):
    path = tmp_path / 'pad.yaml'
    write_calibration(path, CalibrationFile('touchpad', {}, {'a': [(0.1 + 0.2) * 10**k for k in range(-9, 9)]}, {}, {}))
    assert read_calibration(path, 'touchpad').fitted['a'] == pytest.approx([0.3 * 10**k for k in range(-9, 9)], rel=1e-12)
    assert len(path.read_text().splitlines()) < 24


def test_a_missing_file(tmp_path):
    with pytest.raises(BadCalibration, match='no such file'):
        read_calibration(tmp_path / 'none.yaml', 'touchpad')


def test_a_file_cut_anywhere_is_never_taken_for_whole(path):
    text = path.read_text()
    for length in range(0, len(text) - len('complete: true\n') + 1, 7):
        path.write_text(text[:length])
        with pytest.raises(BadCalibration):
            read_calibration(path, 'touchpad')


def test_another_sensor(path):
    with pytest.raises(BadCalibration, match="'touchpad'.*'areal_single'"):
        read_calibration(path, 'areal_single')


@pytest.mark.parametrize('text', ['', '- 1\n- 2\n', 'a: [1, 2', '\x00\x01', 'format: something else\n',
                                  '!!python/object/apply:os.getcwd []'])
def test_files_of_another_kind(path, text):
    path.write_text(text)
    with pytest.raises(BadCalibration, match='pad.yaml'):
        read_calibration(path, 'touchpad')


def test_bytes_that_are_no_text(path):
    path.write_bytes(b'\xff\xfe\x80')
    with pytest.raises(BadCalibration, match='cannot be read'):
        read_calibration(path, 'touchpad')


@pytest.mark.parametrize('value', [float('nan'), float('inf'), 'seven', None, True])
def test_numbers_that_are_none(path, value):
    page = yaml.safe_load(path.read_text())
    page['fitted']['b'][1] = value
    path.write_text(yaml.safe_dump(page, sort_keys=False))
    with pytest.raises(BadCalibration, match=r'fitted\.b\[1\]'):
        read_calibration(path, 'touchpad')


def test_not_finite_numbers_are_not_even_written(tmp_path):
    with pytest.raises(BadCalibration, match=r'fitted\.a'):
        write_calibration(tmp_path / 'pad.yaml', CalibrationFile('touchpad', {}, {'a': float('nan')}, {}, {}))
    assert not list(tmp_path.iterdir())


def test_check_numbers_passes_nested_numbers():
    check_numbers({'a': [1, 2.0, {'b': 3}]}, 'fitted', 'x.yaml')


def page_of(path):
    return yaml.safe_load(path.read_text())


def test_a_later_version_and_a_missing_key_are_named(path):
    page = page_of(path)
    assert page['format'] == 'tactile calibration 2' and len(page['parameters']['hash']) == 16
    path.write_text(yaml.safe_dump(page | {'format': 'tactile calibration 3'}))
    with pytest.raises(BadCalibration, match='version 3'):
        read_calibration(path, 'touchpad')
    for name in ('serial', 'parameters', 'units', 'outliers', 'residuals'):
        path.write_text(yaml.safe_dump({key: value for key, value in page.items() if key != name}))
        with pytest.raises(BadCalibration, match=name):
            read_calibration(path, 'touchpad')


def test_a_file_of_the_first_version_is_read_without_what_it_does_not_say(path):
    page = page_of(path)
    old = {key: value for key, value in page.items() if key not in ('serial', 'software', 'parameters', 'outliers')}
    path.write_text(yaml.safe_dump(old | {'format': 'tactile calibration 1'}))
    content = read_calibration(path, 'touchpad', {'rows': 5})
    assert (content.serial, content.parameters, content.outliers) == ('', {}, []) and content.fitted['a'] == 0.1


def test_other_parameters_are_warned_of_once(path, caplog, monkeypatch):
    monkeypatch.setattr(logging.getLogger('tactile_perception.calibration.files.format'), 'propagate', True)
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
    assert set(BELONGS_TO) == {'touchpad', 'areal_single', 'areal_dual', 'air_cushion', 'psd_finger', 'taxel_array'}
    assert Specimen('1', {'rows': 9, 'pitch': [1, 2], 'contact': 'membrane'}).parameters('areal_single') == {'rows': 9, 'pitch': [1, 2]}
    assert Specimen().parameters('touchpad') == {}
