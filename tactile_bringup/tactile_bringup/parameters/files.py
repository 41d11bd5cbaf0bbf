# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Generates params/*.yaml from the parameter tables of the nodes: python3 -m tactile_bringup.parameters.files FOLDER."""
from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from scipy.spatial.transform import Rotation

from tactile_driver.parameters.table import Parameter, defaults, to_yaml
from tactile_driver.simulation.sensors import gel
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_driver.simulation.taxel.pad import PadSpecimen
from tactile_perception.common.marker_sensor import MARKER_SENSORS
from tactile_perception.core.sensor_type import NODES, SENSOR_TYPES
from tactile_perception.press.parameters import MARKER_SENSOR_PARAMETERS

LICENCE = '# Copyright 2026 The tactile authors\n# SPDX-License-Identifier: Apache-2.0\n'
_MADE = '# Made by: python3 -m tactile_bringup.parameters.files FOLDER\n'
_TOUCHPAD = "# Parameters of a touchpad's nodes, all with their defaults. Copy it, change the copy, and give it as params:=FILE.\n"
_WHOLE = '# Parameters of the nodes of sensor type {}. Copy it, change the copy, and give it as params:=FILE.\n'
_SIMULATED = "# The simulated {0} (source:=sim): the parameters that differ from the nodes' defaults; {0}.yaml explains all.\n"
_MARKER_VIDEO = ('# Any camera or video of dots, dark or bright, of any size, in a grid or not: dots, numbers or tracks.\n'
                 '# What the dots are is measured in the first image, of the untouched sensor, and reported on /diagnostics.\n')
_PIN_DOME = ('# A dome of pins over a camera, such as TacTip with 127 or 331 pins, in any pattern: dots, contact region;\n'
             '# after calibrate with known presses also position and depth of a contact. Pins keep the numbers of the first image.\n'
             '# Distances are not public: put in yours as gel.pitch. Until then no area is reported.\n')
_GELSIGHT_MINI = ('# Any flat gel with dots over a camera, as GelSight Mini: contact region, contacts, wrench.\n'
                  '# What the dots are, and their grid, is measured in the first image, of the untouched gel.\n'
                  "# The pitch is that of GelSight Mini by its maker's software: 0.0634 mm a pixel of 320 x 240, in which dots are 31 px\n"
                  '# apart.\n'
                  '# Thickness and modulus are not public: put in yours (docs/gel.md). Until then force and depth are NaN.\n')
_GEL_SIM = ("# A simulated gel with dots (source:=sim): the parameters that differ from the nodes' defaults;\n"
            '# gelsight_mini.yaml explains all.\n')
_PINS_SIM = ("# A simulated dome of pins (source:=sim): the parameters that differ from the nodes' defaults; pin_dome.yaml explains all.\n"
             '# Their mean distance is the 1.35 mm that a user would measure on it.\n')
_DOTS_SIM = ("# Dots of a simulated gel (source:=sim): the parameters that differ from the nodes' defaults;\n"
             '# marker_video.yaml explains all.\n')
_PRESSURE = ('# A pressure array of 14 x 6 cells, 3.4 mm apart, 12 bits, as on the fingers of an SDH gripper (its other pads: rows 13).\n'
             '# What the pad is made of is not known: put in yours, or calibrate; until then no force is reported.\n')
_PRESSURE_ARRAY = {'rows': 14, 'columns': 6, 'pitch': 0.0034, 'bits': 12, 'full_value': 2000.0}
#: N and N m of the longest arrows in RViz, twice the largest wrench of the simulated scenes, and m, radius of the tool in most of them.
_SIMULATED_PRESSES = {'areal_single': (3.0, 0.05, 0.006), 'areal_dual': (2.0, 0.05, 0.008), 'air_cushion': (25.0, 0.7, 0.030)}
# Parameters that the launch files set for each sensor are left out.
_BY_LAUNCH = {'source', 'frame_id', 'stitching_path', 'picture_rate', 'text.height', 'text.side', 'text.up'}


def _tables(sensor_type: str) -> tuple[Sequence[Parameter], dict[str, Sequence[Parameter]]]:
    """Parameters of all nodes of a sensor type, and name -> those of each."""
    kind = SENSOR_TYPES[sensor_type]
    return kind.shared_parameters, {name: NODES[name].parameters for name in (kind.driver, kind.perception, kind.view)}


def _text(sensor_type: str, about: str, changed: Mapping[str, object], left_out: tuple[str, ...] = (), whole: bool = True) -> str:
    """Text of a parameter file.

    sensor_type: whose nodes it is of; about: comment at the top; changed: values that differ from the defaults, by name; left_out: names of
    nodes, and prefixes of parameter names, that do not apply; whole: with the values that do not differ, too.
    """
    shared, nodes = _tables(sensor_type)
    known, text = _BY_LAUNCH | {p.name for p in shared}, []
    sections = {'/**': shared, **{f'/**/{name}': [p for p in table if p.name not in known] for name, table in nodes.items()}}
    for node, table in sections.items():
        selected = [replace(p, default=changed.get(p.name, p.default)) for p in table
                  if not p.name.startswith(left_out) and (whole or p.name in {**changed, 'sensor_type': ''})]
        text += [to_yaml(selected, node)] if selected and not node.endswith(left_out) else []
    return LICENCE + about + _MADE + '\n'.join(text)


def _markers(sensor_type: str) -> dict[str, object]:
    """Values of a sheet or an air cushion that differ from the defaults."""
    sensor, (force, torque, _) = MARKER_SENSORS[sensor_type], _SIMULATED_PRESSES[sensor_type]
    size = min(sensor.pitch) / 4
    return {'sensor_type': sensor_type, 'rows': sensor.rows, 'columns': sensor.columns, 'pitch': list(sensor.pitch),
            'sheet_size': list(sensor.size), 'dome.rim_radius': sensor.rim_radius, 'dome.height': sensor.height,
            'dot_size': size, 'dot_colour': 'depth', 'full_depth': 0.005 if sensor.is_sheet else 0.03, 'normal_length': 8 * size,
            'force_length': (24 if sensor.is_sheet else 12) * size, 'full_force': force, 'full_torque': torque,
            'tip_radius': 0.008 if sensor.is_sheet else 0.020}


def simulated_pad() -> dict[str, object]:
    """Properties that a user knows or would measure of the simulated array, by parameter name."""
    pad = PadSpecimen()
    return {'bits': 8, 'pad.thickness': pad.thickness, 'pad.stiffness': round(pad.press * pad.thickness, 1),
            'pad.shear_modulus': round(pad.pull * pad.thickness, 1), 'pad.friction': pad.grip}


def simulated_specimen() -> dict[str, object]:
    """Properties that a user would measure on the simulated touchpad, by parameter name: camera pose, tension and pressure of the skin.

    The simulated skin has a constant tension. The tension of a neo-Hookean membrane approaches its shear stiffness at large stretch, so
    the shear stiffness is set just above that tension.
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


def simulated_gel() -> dict[str, object]:
    """What a user would measure on the simulated gel, by parameter name, with its scene."""
    distance = gel.GEL.distance - gel.MATERIAL.depth
    return {'scene': 'gel_demo', 'rows': gel.GEL.rows, 'columns': gel.GEL.columns, 'gel.thickness': gel.MATERIAL.thickness,
            'gel.dot_depth': gel.MATERIAL.depth, 'gel.young_modulus': gel.MATERIAL.young, 'gel.poisson_ratio': gel.MATERIAL.poisson,
            'gel.friction': gel.GelScript.friction, 'camera.translation': [0.0, 0.0, round(distance, 6)]}


def simulated_markers(sensor_type: str) -> dict[str, object]:
    """Properties that a user would measure on the simulated sheet or cushion, by parameter name, with its scene and pressing tip."""
    scene = {'scene': f'{sensor_type}_demo', 'tip_radius': _SIMULATED_PRESSES[sensor_type][2]}
    if SENSOR_TYPES[sensor_type].stitched:  # the calibration holds the camera poses
        return {**scene, 'camera.translation': defaults(MARKER_SENSOR_PARAMETERS)['camera.translation']}
    camera = open_scene(f'{sensor_type}_rest').camera
    return {**scene, 'camera.translation': [round(float(x), 7) for x in camera.translation],
            'camera.rotation': [round(float(x), 6) for x in Rotation.from_matrix(camera.rotation).as_rotvec()]}


def parameter_files() -> dict[str, str]:
    """Text of each file by name."""
    other = ('dome.', 'cap.', 'camera.', 'calibration')  # of surfaces that these do not have; markers_node draws them flat
    texts = {
        'touchpad': _text('touchpad', _TOUCHPAD, {}, ('dome.',)),
        'gelsight_mini': _text('gel', _GELSIGHT_MINI, {'gel.pitch': 0.00197}, other[:3]),
        'pin_dome': _text('pins', _PIN_DOME, {}, other[:3]),
        'marker_video': _text('dots', _MARKER_VIDEO, {}, (*other, 'markers_node')),
        'gel_sim': _text('gel', _GEL_SIM, simulated_gel(), ('dome.', 'cap.'), whole=False),
        'pins_sim': _text('pins', _PINS_SIM, {'scene': 'pins_demo', 'gel.pitch': 0.00135}, whole=False),
        'dots_sim': _text('dots', _DOTS_SIM, {'scene': 'gel_demo'}, whole=False),
        'pressure_array_14x6': _text('taxel_array', _PRESSURE, _PRESSURE_ARRAY)}
    for name in ('touchpad', *MARKER_SENSORS, 'psd_finger', 'taxel_array'):
        markers, left_out = (_markers(name), ('cap.',)) if name in MARKER_SENSORS else ({}, ('dome.',))
        simulated = {'touchpad': simulated_specimen, 'taxel_array': simulated_pad, 'psd_finger': dict}
        own = simulated[name]() if name in simulated else simulated_markers(name)
        texts.setdefault(name, _text(name, _WHOLE.format(name), markers, left_out))
        texts[f'{name}_sim'] = _text(name, _SIMULATED.format(name), markers | own, left_out, whole=False)
    for name, kind in SENSOR_TYPES.items():
        if kind.package == 'tactile_bringup':
            texts |= {file: _text(name, comment, changed) for file, (comment, changed) in kind.files.items()}
            texts |= {f'{name}_sim': _text(name, _SIMULATED.format(name), kind.simulated, whole=False)} if kind.simulated else {}
    return {f'{name}.yaml': text for name, text in texts.items()}


if __name__ == '__main__':
    for file, content in parameter_files().items():
        Path(sys.argv[1], file).write_text(content)
