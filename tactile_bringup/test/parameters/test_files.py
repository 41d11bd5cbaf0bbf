# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import pytest
from tactile_perception.markers.view.sensor import MARKER_SENSORS
from tactile_perception.parameters.file import read_parameters
from tactile_perception.parameters.markers import POINT_PARAMETERS, marker_sensor
from tactile_perception.parameters.touchpad import DOT_PARAMETERS

from tactile_bringup.parameters.files import parameter_files

FOLDER = Path(__file__).resolve().parents[2] / 'params'


@pytest.fixture(scope='module')
def files():
    return parameter_files()


def test_no_file_is_missing_or_too_many(files):
    assert sorted(p.name for p in FOLDER.glob('*.yaml')) == sorted(files)


@pytest.mark.parametrize('name', sorted(p.name for p in FOLDER.glob('*.yaml')))
def test_files_are_what_the_tables_say(files, name):
    # After a change of a table: python3 -m tactile_bringup.parameters.files tactile_bringup/params
    assert (FOLDER / name).read_text() == files[name]


@pytest.mark.parametrize('name', sorted(MARKER_SENSORS))
def test_the_files_of_marker_sensors_describe_the_sensor_to_every_node(name):
    dots = read_parameters(FOLDER / f'{name}.yaml', 'dot_tracker_node', DOT_PARAMETERS)
    point = read_parameters(FOLDER / f'{name}_sim.yaml', 'contact_point_node', POINT_PARAMETERS)
    assert dots['sensor_type'] == point['sensor_type'] == name
    assert (dots['polarity'], dots['detection']) == ('bright', 'blobs')
    assert marker_sensor(point) == MARKER_SENSORS[name]
    assert dots['surface'] == ('sheet' if MARKER_SENSORS[name].is_sheet else 'dome')
