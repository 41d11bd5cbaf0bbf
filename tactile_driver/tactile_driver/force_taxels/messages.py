# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Force vectors of taxels as point clouds, and back."""
from __future__ import annotations

import numpy as np
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

from ..errors import BadFrame
from ..nodes.messages.conversions import bytes_of
from .constants import FORCE_TAXEL_DRIVER
from .layout import TaxelFrame

POSITION, FORCE, NORMAL = ('x', 'y', 'z'), ('fx', 'fy', 'fz'), ('normal_x', 'normal_y', 'normal_z')
_FIELDS = (*POSITION, *FORCE, *NORMAL)
_TYPES = {PointField.FLOAT32: 'f4', PointField.FLOAT64: 'f8'}


def taxels_to_message(frame: TaxelFrame, header: Header) -> PointCloud2:
    """Make the point cloud of a frame.

    Parameters
    ----------
    frame : TaxelFrame
        A frame.
    header : Header
        Header of the message, in the sensor frame.

    Returns
    -------
    PointCloud2
        Fields x, y, z (m), fx, fy, fz (force of the object on the sensor), normal_x, normal_y, normal_z, all float32 in the sensor frame.
    """
    rows = np.concatenate([frame.positions, frame.forces, frame.normals], axis=1, dtype=np.float32, casting='unsafe')
    fields = [PointField(name=name, offset=4 * k, datatype=PointField.FLOAT32, count=1) for k, name in enumerate(_FIELDS)]
    count, step = len(rows), 4 * len(_FIELDS)
    message = PointCloud2(header=header, height=1, width=count, fields=fields, is_bigendian=False, point_step=step, row_step=step * count,
                          is_dense=bool(np.isfinite(rows).all()), check_fields=True)
    message.data = bytes_of(rows)
    return message


def taxels_of_message(message: PointCloud2) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Positions, forces and normals of a point cloud.

    Parameters
    ----------
    message : PointCloud2
        With fields x, y, z, fx, fy, fz, and perhaps normal_x, normal_y, normal_z, of float32 or float64.

    Returns
    -------
    positions, forces : ndarray, shape (N, 3)
        A taxel that reports NaN keeps it.
    normals : ndarray, shape (N, 3), or None
        None where the message has none.

    Raises
    ------
    BadFrame
        If a field is missing, the data do not have the stated length, or a position is not finite or beyond all sensors.
    """
    known = {field.name: field for field in message.fields}
    missing = [name for name in (*POSITION, *FORCE) if name not in known]
    if missing:
        raise BadFrame(f'taxels: field {", ".join(missing)} is missing; the cloud needs x, y, z, fx, fy, fz')
    count, step = message.width * message.height, message.point_step
    is_gapless = len(message.data) == count * step and (message.height == 1 or message.row_step == message.width * step)
    if not (0 < count <= FORCE_TAXEL_DRIVER.max_taxels and is_gapless):
        raise BadFrame(f'taxels: {len(message.data)} bytes for {count} points of {step} bytes in rows of {message.row_step}; 1 to '
                       f'{FORCE_TAXEL_DRIVER.max_taxels} points without gaps are expected')
    names = [*POSITION, *FORCE, *(NORMAL if all(name in known for name in NORMAL) else ())]
    values = _columns(message, [known[name] for name in names])
    positions, forces, normals = values[:, :3], values[:, 3:6], values[:, 6:] if len(names) > 6 else None
    if not (np.abs(positions) <= FORCE_TAXEL_DRIVER.max_position).all() or (np.abs(forces) > FORCE_TAXEL_DRIVER.max_force).any():
        raise BadFrame(f'taxels: a position is not finite or beyond {FORCE_TAXEL_DRIVER.max_position:g} m, or a force beyond '
                       f'{FORCE_TAXEL_DRIVER.max_force:g}')
    if normals is not None and not (np.abs(np.linalg.norm(normals, axis=1) - 1) < 0.01).all():
        raise BadFrame('taxels: a normal does not have length 1; publish unit vectors')
    return positions, forces, normals


def _columns(message: PointCloud2, fields: list[PointField]) -> np.ndarray:
    """Fields (N, K) as float64. Raises BadFrame."""
    order, offsets = '>' if message.is_bigendian else '<', [field.offset for field in fields]
    if all(field.datatype == PointField.FLOAT32 for field in fields) and not message.is_bigendian and message.point_step % 4 == 0 \
            and not any(offset % 4 for offset in offsets) and max(offsets) + 4 <= message.point_step:
        rows = np.frombuffer(message.data, np.float32).reshape(-1, message.point_step // 4)
        return rows[:, [offset // 4 for offset in offsets]].astype(float)
    for field in fields:
        kind = _TYPES.get(field.datatype)
        if kind is None or field.offset + int(kind[1]) > message.point_step:
            raise BadFrame(f'taxels: field {field.name} has to be float32 or float64 within the point')
    kind = np.dtype({'names': [field.name for field in fields], 'formats': [order + _TYPES[field.datatype] for field in fields],
                     'offsets': offsets, 'itemsize': message.point_step})
    rows = np.frombuffer(bytes(message.data), kind)
    return np.column_stack([rows[field.name] for field in fields]).astype(float)
