# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Makes params/*.yaml from the nodes' parameter tables: python3 -m tactile_bringup.parameter_files FOLDER."""
from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from scipy.spatial.transform import Rotation
from tactile_driver.nodes.camera_parameters import CAMERA_PARAMETERS
from tactile_driver.nodes.parameters import Parameter, to_yaml
from tactile_driver.simulation.scenes import open_scene
from tactile_perception.pipeline.parameters import DOT_PARAMETERS, REGION_PARAMETERS, SENSOR_PARAMETERS

from .parameters import MARKERS_PARAMETERS

_HEAD = '# Copyright 2026 The tactile authors\n# SPDX-License-Identifier: Apache-2.0\n'
_TOUCHPAD = """# Parameters of a touchpad's nodes, all with their defaults. Copy it, change the copy, and give it as params:=FILE.
# Made by: python3 -m tactile_bringup.parameter_files FOLDER
"""
_SIMULATED = """# Parameters of the simulated touchpad (source:=sim): the defaults, with the geometry and the membrane of that specimen.
# Made by: python3 -m tactile_bringup.parameter_files FOLDER
"""
_MARKER_VIDEO = """# Any video of a regular grid of printed dots, without a model of the surface: dots, numbers and the displacement field.
# Copy it and set rows and columns to what the image shows in full, and polarity.
# Made by: python3 -m tactile_bringup.parameter_files FOLDER
"""
# What the launch files set for each sensor anew is left out.
_BY_LAUNCH = {'source', 'frame_id'}


def _without(table: Sequence[Parameter], others: Sequence[Parameter] = ()) -> list[Parameter]:
    names = _BY_LAUNCH | {p.name for p in others}
    return [p for p in table if p.name not in names]


def parameter_file(about: str, changed: Mapping[str, object], left_out: tuple[str, ...] = ()) -> str:
    """The text of a parameter file for a touchpad's nodes.

    about: comment on top; changed: name -> value other than the default; left_out: nodes, and what the names of parameters begin with, that
    are of no use here.
    """
    sections = [('/**', SENSOR_PARAMETERS), ('/**/camera_node', _without(CAMERA_PARAMETERS, SENSOR_PARAMETERS)),
                ('/**/dot_tracker_node', _without(DOT_PARAMETERS, SENSOR_PARAMETERS)),
                ('/**/contact_region_node', _without(REGION_PARAMETERS, SENSOR_PARAMETERS)),
                ('/**/markers_node', _without(MARKERS_PARAMETERS, SENSOR_PARAMETERS))]
    tables = [(node, [replace(p, default=changed.get(p.name, p.default)) for p in table if not p.name.startswith(left_out)])
              for node, table in sections if not node.endswith(left_out)]
    return _HEAD + about + '\n'.join(to_yaml(table, node) for node, table in tables)


def simulated_specimen() -> dict[str, object]:
    """Name -> value of what a user would measure on the simulated pad: where its camera stands, its skin's tension and pressure.

    The skin is stretched so far that all of its stiffness is tension, which a neo-Hookean membrane has at the limit of its stiffness.
    """
    scene = open_scene('rest')
    camera, membrane = scene.camera, scene.membrane
    rotation = Rotation.from_matrix(camera.rotation).as_rotvec()
    return {
        'camera.rotation': [round(float(x), 6) for x in rotation],
        'camera.translation': [round(float(x), 7) for x in camera.translation],
        'membrane.shear_stiffness': round(1.0003 * float(membrane.tension), 2),
        'membrane.rest_pressure': round(float(membrane.pressure), 1),
    }


def parameter_files() -> dict[str, str]:
    """File name -> text."""
    video = {'sensor_type': 'marker_video', 'rows': 7, 'columns': 10, 'surface': 'none'}
    surface_only = ('cap.', 'camera.', 'membrane.', 'calibration', 'contact_region_node', 'markers_node')
    return {'touchpad.yaml': parameter_file(_TOUCHPAD, {}), 'touchpad_sim.yaml': parameter_file(_SIMULATED, simulated_specimen()),
            'marker_video.yaml': parameter_file(_MARKER_VIDEO, video, surface_only)}


def main() -> int:
    """Write the files into the folder named on the command line."""
    for name, text in parameter_files().items():
        Path(sys.argv[1], name).write_text(text)
    return 0


if __name__ == '__main__':
    sys.exit(main())
