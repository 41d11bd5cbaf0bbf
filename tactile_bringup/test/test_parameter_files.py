# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The table of sensors, and the parameter files that ship: what the tables say, and other sensors read with them."""
import os
import time
from pathlib import Path

import numpy as np
import pytest

from tactile_bringup.parameters.files import parameter_files
from tactile_driver.nodes.messages.conversions import header_of, image_to_message
from tactile_driver.parameters.drivers import CAMERA_PARAMETERS, TAXEL_DRIVER_PARAMETERS
from tactile_driver.sources.registry import CAMERA_SOURCES, TAXEL_SOURCES, make_source
from tactile_driver.sources.source import EndOfSource
from tactile_perception.bags.replay import make_stage, read_sensor_type
from tactile_perception.common.marker_sensor import MARKER_SENSORS
from tactile_perception.core.parameter_files import read_parameters
from tactile_perception.core.sensor_type import NODES, SENSOR_TYPES
from tactile_perception.press.parameters import MARKER_PARAMETERS, NODE, marker_sensor
from tactile_perception.taxel.parameters import TAXEL_PARAMETERS
from tactile_perception.taxel.stage import TaxelStage

FOLDER = Path(__file__).resolve().parents[1] / 'params'


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
def test_the_files_of_marker_sensors_describe_the_sensor(name):
    for file in (f'{name}.yaml', f'{name}_sim.yaml'):
        values = read_parameters(FOLDER / file, NODE, MARKER_PARAMETERS)
        assert (values['sensor_type'], values['polarity'], values['detection']) == (name, 'bright', 'blobs')
        assert marker_sensor(values) == MARKER_SENSORS[name]


@pytest.mark.parametrize('name', sorted(p.name for p in FOLDER.glob('*.yaml')))
def test_driver_and_perception_accept_each_file(name):
    kind = SENSOR_TYPES[read_sensor_type(FOLDER / name)]
    make_stage(FOLDER / name)
    if kind.driver == 'camera_node':
        read_parameters(FOLDER / name, kind.driver, CAMERA_PARAMETERS)


def test_a_digit_is_read_in_a_format_that_it_has():
    values = read_parameters(FOLDER / 'digit_photometric.yaml', 'camera_node', CAMERA_PARAMETERS)
    assert (values['width'], values['height'], values['rate']) in {(320, 240, 60.0), (320, 240, 30.0), (640, 480, 30.0), (640, 480, 15.0)}


RECORDINGS = Path(os.environ.get('TACTILE_RECORDINGS', ''))
GEL, PINS = RECORDINGS / 'gelsight_mini' / 'mini_example.avi', RECORDINGS / 'pin_array_127'
GRASP = RECORDINGS / 'dsa_slip' / 'slip_hockey_ball.npz'
recorded = pytest.mark.skipif(not GEL.is_file(), reason='TACTILE_RECORDINGS holds no gelsight_mini')


def images(source, most, step=1):
    """Messages of the first frames of a source, every step-th."""
    source.open()
    try:
        for number in range(most):
            frame = source.read()
            if number % step == 0:
                yield image_to_message(frame, '', header_of(frame.stamp_ns, 'pad'))
    except EndOfSource:
        pass
    finally:
        source.close()


def results_of(name, path, most, step=1, **changes):
    """Results of every step-th image, as camera_node and the sensor's node make them of a file with these parameters."""
    file = FOLDER / f'{name}.yaml'
    values = read_parameters(file, 'camera_node', CAMERA_PARAMETERS) | {'source': 'file', 'path': str(path), 'rate': 0.0}
    source = make_source(CAMERA_SOURCES, values, time.time_ns)
    stage = make_stage(file, **changes)
    return [stage.process(image) for image in images(source, most, step)]


def dots_of(*given, **changes):
    """Dots of results_of."""
    return [results['dots'][0] for results in results_of(*given, **changes)]


def counts(dots):
    return np.array([len(message.id) for message in dots])


@pytest.mark.full
@recorded
def test_a_gel_with_a_grid_of_dark_markers():
    dots = dots_of('gelsight_mini', GEL, 219)
    assert len(dots) == 219 and np.median(counts(dots)) >= 67 and counts(dots).max() <= 70, '7 x 10 markers are in view in full'
    assert np.nanmedian(np.hypot(dots[-1].du, dots[-1].dv)) < 0.7, 'px; the finger has gone'


@pytest.mark.full
@recorded
def test_a_finger_on_a_gel_is_one_contact():
    results = results_of('gelsight_mini', GEL, 125, 3)
    regions = [result['contact_region'][0] for result in results]
    assert not any(region.area for region in regions[:17]), 'nothing touches yet'
    pressed = regions[34:]  # a fingertip of about 10 mm in the middle of the picture, by eye
    assert all(region.area > 15e-6 for region in pressed) and 40e-6 < np.median([region.area for region in pressed]) < 130e-6
    middle = np.array([(region.centroid.x, region.centroid.y) for region in pressed])
    assert np.hypot(*np.median(middle, axis=0)) < 5e-3 and np.mean([len(region.outlines) == 1 for region in pressed]) > 0.7
    assert all(np.isnan(result['wrench'][0].wrench.force.z) for result in results), 'its modulus is not known'


@pytest.mark.full
@recorded
def test_a_dome_of_127_pins():
    dots = dots_of('pin_dome', PINS, 125)
    assert len(dots) == 125 and counts(dots).min() >= 123 and np.mean(counts(dots)) > 125


@pytest.mark.full
@recorded
@pytest.mark.parametrize(('path', 'true', 'rows', 'columns'), [(PINS, 127, 0, 0), (GEL, 70, 7, 10)])
def test_dots_that_nobody_described(path, true, rows, columns):
    dots = dots_of('marker_video', path, 40)
    assert len(dots) == 40 and abs(np.median(counts(dots)) - true) <= 3
    assert (dots[0].rows, dots[0].columns) == (rows, columns)


@pytest.mark.full
@recorded
def test_a_pressure_array_in_a_grasp():
    file, pad, most = FOLDER / 'pressure_array_14x6.yaml', 'pad0', 360
    own = {'source': 'file', 'path': str(GRASP), 'topic': pad, 'rate': 0.0}
    source = make_source(TAXEL_SOURCES, read_parameters(file, 'taxel_array_node', TAXEL_DRIVER_PARAMETERS) | own, time.time_ns)
    stage = TaxelStage(read_parameters(file, 'taxel_contact_node', TAXEL_PARAMETERS))
    results = [stage.process(image) for image in images(source, most)]
    reported = np.array([len(result['contacts'][0].contacts) > 0 for result in results])
    pressed = np.load(GRASP)[pad][:most].any(axis=(1, 2))  # untouched cells of this array give 0
    assert pressed.sum() > 60 and not (reported & ~pressed).any() and (reported & pressed).sum() >= 0.95 * pressed.sum()
    assert all(result['contact_region'][0].area > 0 for result, one in zip(results, reported) if one)


PACKAGE = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize('name', SENSOR_TYPES)
def test_each_type_is_there_in_full(name):
    kind = SENSOR_TYPES[name]
    assert {kind.driver, kind.perception, kind.view} <= set(NODES)
    for file in (f'launch/{name}.launch.py', f'params/{kind.params or f"{name}.yaml"}', f'params/{name}_sim.yaml',
                 f'rviz/{kind.rviz or name}.rviz'):
        assert (PACKAGE / file).is_file(), file


def test_every_node_belongs_to_a_type():
    assert set(NODES) == {name for kind in SENSOR_TYPES.values() for name in (kind.driver, kind.perception, kind.view)}


def test_the_sources_are_those_of_the_drivers():
    for kind in SENSOR_TYPES.values():
        assert kind.sources == tuple(next(p for p in NODES[kind.driver].parameters if p.name == 'source').choices)
