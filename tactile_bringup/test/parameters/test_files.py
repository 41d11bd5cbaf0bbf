# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import pytest
import yaml
from tactile_driver.parameters.camera import CAMERA_PARAMETERS
from tactile_driver.parameters.dual_camera import DUAL_CAMERA_PARAMETERS
from tactile_driver.parameters.psd import PSD_DRIVER_PARAMETERS
from tactile_driver.parameters.table import defaults
from tactile_driver.parameters.taxel import TAXEL_DRIVER_PARAMETERS
from tactile_perception.markers.view.sensor import MARKER_SENSORS
from tactile_perception.parameters.file import read_parameters
from tactile_perception.parameters.markers import POINT_PARAMETERS, marker_sensor
from tactile_perception.finger.parameters import PSD_PARAMETERS
from tactile_perception.taxel.parameters import TAXEL_PARAMETERS
from tactile_perception.parameters.touchpad import DOT_PARAMETERS, REGION_PARAMETERS, SHEET_PARAMETERS

from tactile_bringup.parameters.files import parameter_files
from tactile_bringup.parameters.table import FINGER_MARKERS_PARAMETERS, MARKERS_PARAMETERS

FOLDER = Path(__file__).resolve().parents[2] / 'params'
BY_LAUNCH = {'source', 'frame_id', 'picture_rate'}
NODES = {'camera_node': CAMERA_PARAMETERS, 'dot_tracker_node': DOT_PARAMETERS, 'contact_region_node': REGION_PARAMETERS,
         'markers_node': MARKERS_PARAMETERS}


@pytest.fixture(scope='module')
def files():
    return parameter_files()


def test_no_file_is_missing_or_too_many(files):
    assert sorted(p.name for p in FOLDER.glob('*.yaml')) == sorted(files)


@pytest.mark.parametrize('name', sorted(p.name for p in FOLDER.glob('*.yaml')))
def test_files_are_what_the_tables_say(files, name):
    # After a change of a table: python3 -m tactile_bringup.parameters.files tactile_bringup/params
    assert (FOLDER / name).read_text() == files[name]


@pytest.mark.parametrize('node', sorted(NODES))
def test_the_touchpad_file_holds_every_parameter_with_its_default(node):
    content = yaml.safe_load((FOLDER / 'touchpad.yaml').read_text())
    named = set(content['/**']['ros__parameters']) | set(content[f'/**/{node}']['ros__parameters'])
    table = NODES[node]
    of_others = {p.name for p in SHEET_PARAMETERS}
    assert {p.name for p in table} - BY_LAUNCH - of_others <= named
    read, expected = read_parameters(FOLDER / 'touchpad.yaml', node, table), defaults(table)
    if node == 'camera_node':  # for a camera alone its place in a touchpad is not known
        expected['camera.translation'] = defaults(DOT_PARAMETERS)['camera.translation']
    assert read == expected


def test_the_video_file_is_a_grid_without_a_surface():
    values = read_parameters(FOLDER / 'marker_video.yaml', 'dot_tracker_node', DOT_PARAMETERS)
    assert (values['rows'], values['columns'], values['surface'], values['polarity']) == (7, 10, 'none', 'dark')


@pytest.mark.parametrize('name', sorted(MARKER_SENSORS))
def test_the_files_of_marker_sensors_describe_the_sensor_to_every_node(name):
    dots = read_parameters(FOLDER / f'{name}.yaml', 'dot_tracker_node', DOT_PARAMETERS)
    point = read_parameters(FOLDER / f'{name}_sim.yaml', 'contact_point_node', POINT_PARAMETERS)
    assert dots['sensor_type'] == point['sensor_type'] == name
    assert (dots['polarity'], dots['detection']) == ('bright', 'blobs')
    assert marker_sensor(point) == MARKER_SENSORS[name]
    assert dots['surface'] == ('sheet' if MARKER_SENSORS[name].is_sheet else 'dome')


MARKER_NODES = {**NODES, 'contact_point_node': POINT_PARAMETERS, 'dual_camera_node': DUAL_CAMERA_PARAMETERS}
MEASURED = {'camera.rotation', 'camera.translation', 'scene', 'tip_radius', 'membrane.shear_stiffness', 'membrane.rest_pressure',
            'pad.stiffness', 'pad.shear_modulus', 'pad.friction'}


@pytest.mark.parametrize(('sensor', 'nodes'), [
    ('touchpad', NODES), *((name, {node: MARKER_NODES[node] for node in MARKER_NODES if node != 'contact_region_node'}) for name in
                           MARKER_SENSORS),
    ('psd_finger', {'psd_node': PSD_DRIVER_PARAMETERS, 'psd_contact_node': PSD_PARAMETERS}),
    ('taxel_array', {'taxel_array_node': TAXEL_DRIVER_PARAMETERS, 'taxel_contact_node': TAXEL_PARAMETERS})])
def test_the_short_file_of_a_simulated_sensor_differs_in_what_was_measured_on_it(sensor, nodes):
    for node, table in nodes.items():
        whole, short = (read_parameters(FOLDER / f'{sensor}{part}.yaml', node, table) for part in ('', '_sim'))
        assert {name for name in whole if whole[name] != short[name]} <= MEASURED


@pytest.mark.parametrize(('node', 'table'), [('psd_node', PSD_DRIVER_PARAMETERS), ('psd_contact_node', PSD_PARAMETERS),
                                             ('finger_markers_node', FINGER_MARKERS_PARAMETERS)])
def test_the_finger_file_holds_every_parameter_with_its_default(node, table):
    content = yaml.safe_load((FOLDER / 'psd_finger.yaml').read_text())
    named = set(content['/**']['ros__parameters']) | set(content[f'/**/{node}']['ros__parameters'])
    assert {p.name for p in table} - BY_LAUNCH <= named
    assert read_parameters(FOLDER / 'psd_finger.yaml', node, table) == defaults(table)
