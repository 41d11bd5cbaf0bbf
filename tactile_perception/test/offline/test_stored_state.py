# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A stage's state comes back as it was, and nothing else does."""
import os
import pickle
from pathlib import Path

import numpy as np
import pytest
from tactile_perception.dots.dots import DotTracks
from tactile_perception.errors import BadRecording
from tactile_perception.offline.stored_state import load_state, store_state
from tactile_perception.pipeline.marker_parameters import POINT_PARAMETERS
from tactile_perception.pipeline.parameter_file import read_parameters


def test_numbers_arrays_and_own_objects_come_back():
    values = np.array([1.0, np.nan, 3e-308])
    stored = store_state({'tracks': DotTracks(0, 0, np.arange(3), np.zeros((3, 2)), values, values, np.zeros((3, 2))), 'both': values})
    state = load_state(stored)
    assert state['tracks'].area.tobytes() == values.tobytes() and state['tracks'].area is state['both']


class _Evil:
    def __reduce__(self):
        return os.system, ('true',)


def test_what_is_no_part_of_a_state_is_not_made():
    with pytest.raises(BadRecording, match='posix.system is no part of it'):
        load_state(pickle.dumps(_Evil()))
    for data in (b'', b'nothing', store_state(np.zeros(3))[:-4]):
        with pytest.raises(BadRecording, match='cannot be read'):
            load_state(data)


def _calling(module, name, *arguments):
    """A pickle that calls a function with text."""
    words = b''.join(pickle.UNICODE + word.encode() + b'\n' for word in arguments)
    return pickle.PROTO + b'\x04' + b''.join(pickle.SHORT_BINUNICODE + bytes([len(word)]) + word.encode() for word in (module, name)) \
        + pickle.STACK_GLOBAL + pickle.MARK + words + pickle.TUPLE + pickle.REDUCE + pickle.STOP


@pytest.mark.parametrize(('module', 'name'), [
    ('tactile_perception.offline.part_writer', 'shutil.rmtree'), ('tactile_perception.offline.part_writer', 'os.replace'),
    ('tactile_perception.offline.bags', 'Path'), ('tactile_perception.offline.storage', 'unpacked'),
    ('tactile_driver.port_emulator', 'serve'),
    ('numpy', 'ndarray.tofile'), ('tactile_perception.dots.grid', 'number_grid.__globals__'), ('builtins', 'eval')])
def test_nothing_is_called_that_a_module_has_only_imported_or_that_has_to_do_with_files(module, name):
    with pytest.raises(BadRecording, match='is no part of it'):
        load_state(_calling(module, name, 'precious', 'elsewhere'))


def test_of_objects_only_own_public_methods_are_reached():
    track = DotTracks(0, 0, np.arange(3), np.zeros((3, 2)), np.zeros(3), np.zeros(3), np.zeros((3, 2)))
    assert len(load_state(store_state(track.take))(track.id > 0)) == 2
    with pytest.raises(BadRecording, match='__init__ of DotTracks is no part of it'):
        load_state(pickle.dumps(track.__init__))
    with pytest.raises(BadRecording, match='tofile of ndarray is no part of it'):
        load_state(pickle.dumps(np.zeros(3).tofile))


@pytest.mark.parametrize('sensor_type', ['areal_single', 'air_cushion'])
def test_the_stage_of_a_calibrated_sensor_can_be_stored(sensor_type):
    pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')
    from tactile_perception.nodes.touch_stages import TouchMessages
    bringup = Path(__file__).resolve().parents[3] / 'tactile_bringup'
    values = read_parameters(bringup / f'params/{sensor_type}_sim.yaml', 'contact_point_node', POINT_PARAMETERS)
    messages = TouchMessages(values | {'calibration': str(bringup / f'calibration/{sensor_type}_sim.yaml')})
    messages.stage = messages.make_stage((np.array([[400.0, 0, 320], [0, 400, 240], [0, 0, 1]]), np.zeros(5)), (640, 480))
    assert load_state(store_state(messages)).sensor == messages.sensor
