# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The cloud as other people's readers see it: by names, types and offsets of its fields."""
import numpy as np
import pytest
from sensor_msgs.msg import PointField
from std_msgs.msg import Header
from tactile_perception.common.surface_points import UNKNOWN, SurfacePoints
from tactile_perception.nodes.messages.conversions import points_to_message

NAMES = ['x', 'y', 'z', 'normal_x', 'normal_y', 'normal_z', 'displacement_x', 'displacement_y', 'displacement_z', 'force_x', 'force_y',
         'force_z', 'normal_force', 'state']


def some_points(shape=(2, 3)):
    rng, count = np.random.default_rng(4), shape[0] * shape[1]
    vectors = [rng.normal(size=(count, 3)) for _ in range(4)]
    vectors[3][0] = np.nan
    return SurfacePoints(shape, *vectors, rng.normal(size=count), np.array([0, 1, 2, UNKNOWN, 0, 1][:count], np.uint8))


def columns(points):
    """Field name -> values, as the cloud should hold them."""
    vectors = np.hstack([points.xyz, points.normal, points.displacement, points.force])
    return dict(zip(NAMES, (*vectors.T.astype(np.float32), points.normal_force.astype(np.float32), points.state)))


def read(message):
    """Field name -> values, by what the message itself says of its bytes."""
    kinds = {PointField.FLOAT32: np.dtype('<f4'), PointField.UINT8: np.dtype('u1')}
    data = np.frombuffer(message.data, np.uint8).reshape(-1, message.point_step)
    return {f.name: data[:, f.offset:f.offset + kinds[f.datatype].itemsize].copy().view(kinds[f.datatype]).ravel() for f in message.fields}


def test_every_field_comes_back():
    points, header = some_points(), Header(frame_id='pad')
    message = points_to_message(points, header)
    assert message.header is header and [f.name for f in message.fields] == NAMES
    for name, values in read(message).items():
        np.testing.assert_array_equal(values, columns(points)[name], name)


def test_rows_and_columns_are_the_grids():
    message = points_to_message(some_points(), Header())
    assert (message.height, message.width, message.row_step) == (2, 3, 3 * message.point_step)
    assert len(message.data) == 2 * message.row_step and message.is_dense and not message.is_bigendian


def test_a_cloud_with_a_point_that_has_no_place_is_not_dense():
    points = some_points()
    points.xyz[4] = np.nan
    assert not points_to_message(points, Header()).is_dense


def test_sensor_msgs_py_reads_it():
    reader = pytest.importorskip('sensor_msgs_py.point_cloud2')
    points = some_points()
    message = points_to_message(points, Header())
    found = reader.read_points(message)
    for name in NAMES:
        np.testing.assert_array_equal(found[name].ravel(), columns(points)[name], name)
    np.testing.assert_array_equal(reader.read_points_numpy(message, ['x', 'y', 'z']), points.xyz.astype(np.float32))
