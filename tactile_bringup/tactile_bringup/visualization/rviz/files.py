# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Generates rviz/*.rviz from the sensors' sizes: python3 -m tactile_bringup.visualization.rviz.files FOLDER."""
from __future__ import annotations

import re
import sys
from pathlib import Path

from . import page
from .camera_view import view_of
from ...parameters.files import LICENCE, parameter_files
from .sensor_shape import shape_of
from ...sensor_types import SENSOR_TYPES

_ABOUT = '# Made by: python3 -m tactile_bringup.visualization.rviz.files FOLDER\n'
_FIRM = 0.06  # N per dot or taxel; measured in simulated scenes: 0.059 under the touchpad's rectangle, 0.047 under the array's bar


def rviz_file(sensor_type: str, parameters: str) -> str:
    """Text of a sensor's RViz configuration, with its type as namespace; parameters: text of its parameter file."""
    kind, shape = SENSOR_TYPES[sensor_type], shape_of(parameters)
    pictures = _pictures(sensor_type)
    # The taxel frame lies 2 mm below the sensor frame; its label would cover that of the sensor frame.
    hidden = [f'{sensor_type}_taxels'] if kind.own_frame == 'taxels' else []
    displays = [page.grid('Base plane', shape.width), page.frames(shape.width, hidden),
                page.markers('Touch', f'/{sensor_type}/markers', kind.namespaces), *_points(sensor_type, shape.width), *pictures]
    view = view_of(shape.outermost(), page.room(len(pictures)))
    return LICENCE + _ABOUT + page.page(displays, sensor_type, view)


def moved_file(text: str, sensor_type: str, namespace: str, frame: str) -> str:
    """Text of a shipped configuration changed to another namespace and sensor frame."""
    text = text.replace(f'/{sensor_type}/', f'/{namespace}/'.replace('//', '/'))
    own = SENSOR_TYPES[sensor_type].own_frame
    return re.sub(rf'\b{sensor_type}_{own}\b', f'{frame}_{own}', text).replace(f'Fixed Frame: {sensor_type}\n', f'Fixed Frame: {frame}\n')


def _points(sensor_type: str, width: float) -> list[dict]:
    """Point cloud display of a sensor of this width, m; coloured by force where points have one, otherwise by displacement."""
    kind = SENSOR_TYPES[sensor_type]
    if 'points' not in kind.shown:
        return []
    limits = (0.0, _FIRM) if kind.point_field == 'normal_force' else (-0.1 * width, 0.0)
    return [page.cloud('Points', f'/{sensor_type}/points', width / 40, kind.point_field, limits)]


def _pictures(sensor_type: str) -> list[dict]:
    kind, raw = SENSOR_TYPES[sensor_type], f'/{sensor_type}/image_raw'
    annotated = page.image('Annotated image', f'/{sensor_type}/image_annotated')
    if 'image_raw' not in kind.shown:
        return [annotated]
    taxels = kind.own_frame == 'taxels'  # their values fill only a part of the grey levels
    return [annotated, page.image('Raw image', raw, 'Best Effort', normalize=taxels)]


def rviz_files() -> dict[str, str]:
    """Text of each file by name."""
    parameters = parameter_files()
    return {f'{sensor_type}.rviz': rviz_file(sensor_type, parameters[f'{sensor_type}.yaml']) for sensor_type in SENSOR_TYPES}


def main() -> int:
    """Write the files to the folder named on the command line."""
    for name, text in rviz_files().items():
        Path(sys.argv[1], name).write_text(text)
    return 0


if __name__ == '__main__':
    sys.exit(main())
