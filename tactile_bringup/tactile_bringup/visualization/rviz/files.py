# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Makes rviz/*.rviz from the sensors' own sizes: python3 -m tactile_bringup.visualization.rviz.files FOLDER."""
from __future__ import annotations

import sys
from pathlib import Path

from . import page
from .camera_view import view_of
from ...parameters.files import LICENCE, parameter_files
from .sensor_shape import shape_of

_ABOUT = '# Made by: python3 -m tactile_bringup.visualization.rviz.files FOLDER\n'
_FIRM = 0.06  # N on a dot or taxel, measured in the simulated scenes: 0.059 under the touchpad's rectangle, 0.047 under the array's bar
_DOTS = ('skin', 'dots', 'region', 'outlines', 'holes', 'normals', 'covariances', 'force', 'torque')
#: Sensor type -> the namespaces of its markers.
NAMESPACES = {'touchpad': (*_DOTS, 'slip_center'), 'areal_single': _DOTS, 'areal_dual': _DOTS, 'air_cushion': _DOTS,
              'psd_finger': ('finger', 'points', 'normals', 'covariances', 'trail'),
              'taxel_array': ('cells', 'outlines', 'holes', 'axes', 'normals', 'flow', 'slip', 'slip_center', 'force', 'torque')}


def rviz_file(sensor_type: str, parameters: str) -> str:
    """The text of a sensor's configuration, under topics of the type's own name; parameters: text of its parameter file."""
    shape, pictures = shape_of(parameters), _pictures(sensor_type)
    hidden = [f'{sensor_type}_taxels'] if sensor_type == 'taxel_array' else []  # 2 mm under the sensor's own
    displays = [page.grid('Base plane', shape.width), page.frames(shape.width, hidden),
                page.markers('Touch', f'/{sensor_type}/markers', NAMESPACES[sensor_type]), *_points(sensor_type, shape.width),
                *pictures]
    view = view_of(shape.outermost(), page.room(len(pictures)))
    return LICENCE + _ABOUT + page.page(displays, sensor_type, view)


def _points(sensor_type: str, width: float) -> list[dict]:
    """The cloud of a sensor so wide, m: by force where it is known for each point, else by how far the surface has given way."""
    if sensor_type == 'psd_finger':
        return []
    by_force = sensor_type in ('touchpad', 'taxel_array')
    channel, limits = ('normal_force', (0.0, _FIRM)) if by_force else ('displacement_z', (-0.1 * width, 0.0))
    return [page.cloud('Points', f'/{sensor_type}/points', width / 40, channel, limits)]


def _pictures(sensor_type: str) -> list[dict]:
    if sensor_type == 'psd_finger':
        return []
    raw = f'/{sensor_type}/image_raw'
    if sensor_type == 'taxel_array':
        return [page.image('Taxels', raw, 'Best Effort', normalize=True)]
    return [page.image('Annotated image', f'/{sensor_type}/image_annotated'), page.image('Raw image', raw, 'Best Effort')]


def rviz_files() -> dict[str, str]:
    """File name -> text."""
    parameters = parameter_files()
    return {f'{sensor_type}.rviz': rviz_file(sensor_type, parameters[f'{sensor_type}.yaml']) for sensor_type in NAMESPACES}


def main() -> int:
    """Write the files into the folder named on the command line."""
    for name, text in rviz_files().items():
        Path(sys.argv[1], name).write_text(text)
    return 0


if __name__ == '__main__':
    sys.exit(main())
