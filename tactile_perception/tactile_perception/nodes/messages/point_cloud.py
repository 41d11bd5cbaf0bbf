# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Surface points as a sensor_msgs/PointCloud2 that RViz, PCL and sensor_msgs_py read by the names of its fields."""
from __future__ import annotations

import numpy as np
from sensor_msgs.msg import PointCloud2, PointField
from tactile_driver.nodes.messages.conversions import bytes_of

from ...common.surface_points import SurfacePoints

POINTS = {'points': PointCloud2}
#: Fields in their order: of a vector three, of a number one.
_VECTORS = {'xyz': ('x', 'y', 'z'), 'normal': ('normal_x', 'normal_y', 'normal_z'),
            'displacement': ('displacement_x', 'displacement_y', 'displacement_z'), 'force': ('force_x', 'force_y', 'force_z')}
_FLOATS = (*(name for names in _VECTORS.values() for name in names), 'normal_force')
_STEP = 56  # bytes a point: its floats and the state, filled up to a multiple of four
_POINT = np.dtype({'names': [*_FLOATS, 'state'], 'formats': ['<f4'] * len(_FLOATS) + ['u1'],
                   'offsets': [4 * k for k in range(len(_FLOATS) + 1)], 'itemsize': _STEP})


def points_to_message(points: SurfacePoints, header) -> PointCloud2:
    """The cloud under the raw message's header: as many rows and columns as the grid, a point where its number says."""
    rows, columns = points.shape
    packed = np.zeros(rows * columns, _POINT)
    for vector, names in _VECTORS.items():
        for name, values in zip(names, getattr(points, vector).T):
            packed[name] = values
    packed['normal_force'], packed['state'] = points.normal_force, points.state
    fields = [PointField(name=name, offset=offset, datatype=PointField.UINT8 if kind == 'u1' else PointField.FLOAT32, count=1)
              for name, (kind, offset) in _POINT.fields.items()]
    message = PointCloud2(header=header, height=rows, width=columns, fields=fields, is_bigendian=False, point_step=_STEP,
                          row_step=_STEP * columns, is_dense=bool(np.isfinite(points.xyz).all()), check_fields=True)
    message.data = bytes_of(packed.view(np.uint8))
    return message
