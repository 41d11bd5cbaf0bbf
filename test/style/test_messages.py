# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The message definitions are the contract's, field by field, and each field says what it holds."""

import pathlib

MESSAGES = pathlib.Path(__file__).resolve().parents[2] / 'tactile_msgs' / 'msg'
CONTRACT = {
    'DotTracks': 'std_msgs/Header header, uint16 rows, uint16 columns, uint32[] id, float32[] u, float32[] v, float32[] area, '
                 'float32[] du, float32[] dv, float32[] x, float32[] y, float32[] z',
    'ContactRegion': 'uint8 NON_CONTACT=0, uint8 STICKING=1, uint8 SLIPPING=2, std_msgs/Header header, uint32[] dot_id, uint8[] dot_state, '
                     'geometry_msgs/Polygon[] outlines, geometry_msgs/Polygon[] holes, float64 area, geometry_msgs/Point centroid, '
                     'geometry_msgs/Vector3 normal, float64 orientation, float64 major_axis, float64 minor_axis, '
                     'geometry_msgs/Transform motion, float64 motion_interval, geometry_msgs/Transform pose, float32[] dot_confidence',
    'Contact': 'uint8 OUT_OF_RANGE=1, uint8 AT_EDGE=2, uint8 AMBIGUOUS=4, uint8 SATURATED=8, uint32 id, geometry_msgs/Point position, '
               'geometry_msgs/Vector3 normal, float64 depth, float64 force, float64[9] position_covariance, uint8 flags',
    'Contacts': 'std_msgs/Header header, Contact[] contacts',
    'Slip': 'uint8 NONE=0, uint8 INCIPIENT=1, uint8 GROSS=2, std_msgs/Header header, uint8 state, float32 slipping_fraction, '
            'geometry_msgs/Twist velocity, geometry_msgs/Point rotation_center, float32[] x, float32[] y, float32[] vx, float32[] vy, '
            'float32 confidence',
    'PsdVoltages': 'std_msgs/Header header, float64 sample_period, float32[] voltages',
}


def definition(name):
    """Return [(field, comment), ...] of a message file, comment lines and empty ones left out."""
    lines = [line for line in (MESSAGES / f'{name}.msg').read_text().splitlines() if line.strip() and not line.lstrip().startswith('#')]
    return [(' '.join(line.partition('#')[0].split()), line.partition('#')[2].strip()) for line in lines]


def test_no_message_is_missing_or_extra():
    assert sorted(path.stem for path in MESSAGES.glob('*')) == sorted(CONTRACT)


def test_fields_are_the_contract():
    assert {name: ', '.join(field for field, _ in definition(name)) for name in CONTRACT} == CONTRACT


def test_every_field_has_a_comment():
    assert [(name, field) for name in CONTRACT for field, comment in definition(name) if not comment] == []


def test_no_comment_goes_on_under_its_field():
    # `ros2 interface show` puts the fields of a nested type in between
    lines = [(name, line) for name in CONTRACT for line in (MESSAGES / f'{name}.msg').read_text().splitlines()]
    assert [(name, line) for name, line in lines if line.lstrip().startswith('#') and line != line.lstrip()] == []
