# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A parameter file gives a tool the values that ROS would give the node."""
import pytest

from tactile_driver.parameters.table import Parameter
from tactile_perception.core.errors import BadArgument
from tactile_perception.core.parameter_files import read_parameters

TABLE = (Parameter('rows', int, 23, '', 'rows', 0, 250), Parameter('cap.height', float, 0.013, 'm', 'height', 0.0, 1.0))


def read(tmp_path, text):
    (tmp_path / 'p.yaml').write_text(text)
    return read_parameters(tmp_path / 'p.yaml', 'dot_tracker_node', TABLE)


def test_wild_cards_first_then_the_node_nested_or_dotted(tmp_path):
    text = '/touchpad/dot_tracker_node:\n  ros__parameters: {rows: 9}\n/**:\n  ros__parameters: {rows: 8, cap: {height: 0.02}, other: 1}\n'
    assert read(tmp_path, text) == {'rows': 9, 'cap.height': 0.02}
    assert read(tmp_path, '/**/dot_tracker_node:\n  ros__parameters: {cap.height: 0.5}\n') == {'rows': 23, 'cap.height': 0.5}
    assert read(tmp_path, '/**/camera_node:\n  ros__parameters: {rows: 5}\n') == {'rows': 23, 'cap.height': 0.013}


def test_numbers_are_read_as_ros_reads_them(tmp_path):
    assert read(tmp_path, '/**:\n  ros__parameters: {cap.height: 8e-05}\n')['cap.height'] == 8e-5
    assert read(tmp_path, '/**:\n  ros__parameters: {cap.height: 1}\n')['cap.height'] == 1.0
    with pytest.raises(BadArgument, match='cap.height'):
        read(tmp_path, "/**:\n  ros__parameters: {cap.height: '8e-05'}\n")


@pytest.mark.parametrize('text, message', [
    ('/**:\n  ros__parameters: {rows: 900}\n', 'p.yaml: parameter rows is 900, but must be int, 0 to 250'),
    ('/**: [', 'cannot be read'), ('3', 'no section'), ('/**:\n  ros__parameters: {cap.height: .nan}\n', 'cap.height is nan')])
def test_a_wrong_value_names_file_and_parameter(tmp_path, text, message):
    with pytest.raises(BadArgument, match=message):
        read(tmp_path, text)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(BadArgument, match='none.yaml'):
        read_parameters(tmp_path / 'none.yaml', 'x', TABLE)
