# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Generates params/*.yaml from the parameter tables of the nodes: python3 -m tactile_bringup.parameters.files FOLDER."""
from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from scipy.spatial.transform import Rotation
from tactile_driver.parameters.camera import CAMERA_PARAMETERS
from tactile_driver.parameters.dual_camera import DUAL_CAMERA_PARAMETERS
from tactile_driver.parameters.psd import PSD_DRIVER_PARAMETERS
from tactile_driver.parameters.table import Parameter, defaults, to_yaml
from tactile_driver.parameters.taxel import TAXEL_DRIVER_PARAMETERS
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_driver.simulation.taxel.pad import PadSpecimen
from tactile_perception.markers.view.sensor import MARKER_SENSORS
from tactile_perception.parameters.markers import MARKER_SENSOR_PARAMETERS, POINT_PARAMETERS
from tactile_perception.finger.parameters import PSD_PARAMETERS, PSD_SENSOR_PARAMETERS
from tactile_perception.parameters.taxel import TAXEL_PARAMETERS, TAXEL_SENSOR_PARAMETERS
from tactile_perception.parameters.touchpad import DOT_PARAMETERS, REGION_PARAMETERS, SENSOR_PARAMETERS, SHEET_PARAMETERS

from tactile_perception.sensors import MARKER_SENSOR_TYPES, SENSOR_TYPES
from .table import FINGER_MARKERS_PARAMETERS, MARKERS_PARAMETERS, TAXEL_MARKERS_PARAMETERS

LICENCE = '# Copyright 2026 The tactile authors\n# SPDX-License-Identifier: Apache-2.0\n'
_TOUCHPAD = """# Parameters of a touchpad's nodes, all with their defaults. Copy it, change the copy, and give it as params:=FILE.
# Made by: python3 -m tactile_bringup.parameters.files FOLDER
"""
_MARKER_VIDEO = """# Any video of a regular grid of printed dots, without a model of the surface: dots, numbers and the displacement field.
# Copy it and set rows and columns to what the image shows in full, and polarity.
# Made by: python3 -m tactile_bringup.parameters.files FOLDER
"""
_GEL = """# A gel with a grid of dark markers over a camera, as GelSight Mini: dots, numbers, displacement field.
# Copy it and set rows and columns to what the image shows in full.
# Made by: python3 -m tactile_bringup.parameters.files FOLDER
"""
_PINS = """# A dome of pins over a camera, as TacTip with 127 or 331 of them: bright, hexagonal, any number.
# Each pin keeps the number that it has in the first image.
# Made by: python3 -m tactile_bringup.parameters.files FOLDER
"""
_WORN = """# Bright markers that are worn, speckled or dirty, in any arrangement, over a camera: dots, tracks, displacements.
# Copy it; set polarity, and where the markers make a grid, its rows and columns and numbering lattice.
# Made by: python3 -m tactile_bringup.parameters.files FOLDER
"""
_PRESSURE = """# A pressure array of 14 x 6 cells, 3.4 mm apart, 12 bits, as on the fingers of an SDH gripper (its other pads: rows 13).
# What the pad is made of is not known: put in yours, or calibrate; until then no force is told.
# Made by: python3 -m tactile_bringup.parameters.files FOLDER
"""
_MARKERS = """# Parameters of the nodes of sensor type {}. Copy it, change the copy, and give it as params:=FILE.
# Made by: python3 -m tactile_bringup.parameters.files FOLDER
"""
_SIMULATED = """# The simulated {0} (source:=sim): the parameters that differ from the nodes' defaults; {0}.yaml explains all.
# Made by: python3 -m tactile_bringup.parameters.files FOLDER
"""
_CAMERAS = {'camera_node': CAMERA_PARAMETERS, 'dual_camera_node': DUAL_CAMERA_PARAMETERS}
# Parameters that the launch files set for each sensor are left out.
_BY_LAUNCH = {'source', 'frame_id', 'stitching_path', 'picture_rate'}


def _without(table: Sequence[Parameter], others: Sequence[Parameter] = ()) -> list[Parameter]:
    names = _BY_LAUNCH | {p.name for p in others}
    return [p for p in table if p.name not in names]


def _text(about: str, sections: Sequence[tuple[str, Sequence[Parameter]]], changed: Mapping[str, object],
          left_out: tuple[str, ...] = (), whole: bool = True) -> str:
    """Text of a parameter file with sections (node, table).

    about: comment at the top; changed: values that differ from the defaults, by name; left_out: names of nodes, and prefixes of parameter
    names, that do not apply; whole: with the values that do not differ, too.
    """
    chosen = [(node, [p for p in table if not p.name.startswith(left_out) and (whole or p.name in {**changed, 'sensor_type': ''})])
              for node, table in sections if not node.endswith(left_out)]
    tables = [(node, [replace(p, default=changed.get(p.name, p.default)) for p in table]) for node, table in chosen if table]
    return LICENCE + about + '\n'.join(to_yaml(table, node) for node, table in tables)


def touchpad_file(about: str, changed: Mapping[str, object], left_out: tuple[str, ...] = (), whole: bool = True) -> str:
    """Text of a parameter file for the nodes of a touchpad; arguments as of _text."""
    left_out = ('dome.', *left_out)
    sections = [('/**', SENSOR_PARAMETERS), ('/**/camera_node', _without(CAMERA_PARAMETERS, SENSOR_PARAMETERS)),
                ('/**/dot_tracker_node', _without(DOT_PARAMETERS, SENSOR_PARAMETERS + SHEET_PARAMETERS)),
                ('/**/contact_region_node', _without(REGION_PARAMETERS, SENSOR_PARAMETERS)),
                ('/**/markers_node', _without(MARKERS_PARAMETERS, SENSOR_PARAMETERS))]
    return _text(about, sections, changed, left_out, whole)


def marker_file(about: str, sensor_type: str, changed: Mapping[str, object], whole: bool = True) -> str:
    """Text of a parameter file for the nodes of a sheet or an air cushion; arguments as of _text."""
    sensor, kind = MARKER_SENSORS[sensor_type], MARKER_SENSOR_TYPES[sensor_type]
    size = min(sensor.pitch) / 4
    values = {'sensor_type': sensor_type, 'rows': sensor.rows, 'columns': sensor.columns, 'pitch': list(sensor.pitch),
              'sheet_size': list(sensor.size), 'dome.rim_radius': sensor.rim_radius,
              'dome.height': sensor.height, 'surface': 'sheet' if sensor.is_sheet else 'dome', 'polarity': 'bright', 'detection': 'blobs',
              'dot_size': size, 'dot_colour': 'depth', 'full_depth': 0.005 if sensor.is_sheet else 0.03, 'normal_length': 8 * size,
              'force_length': 12 * size, 'full_force': kind.full_force, 'full_torque': kind.full_torque,
              'tip_radius': 0.008 if sensor.is_sheet else 0.020, **changed}
    driver = SENSOR_TYPES[sensor_type].driver
    own = [p for p in DOT_PARAMETERS if p.name == 'surface' or p not in SENSOR_PARAMETERS + SHEET_PARAMETERS and p.name != 'frame_id']
    sections = [('/**', MARKER_SENSOR_PARAMETERS), (f'/**/{driver}', _without(_CAMERAS[driver], MARKER_SENSOR_PARAMETERS)),
                ('/**/dot_tracker_node', own), ('/**/contact_point_node', _without(POINT_PARAMETERS, MARKER_SENSOR_PARAMETERS)),
                ('/**/markers_node', _without(MARKERS_PARAMETERS, MARKER_SENSOR_PARAMETERS))]
    return _text(about, sections, values, ('cap.',), whole)


def finger_file(about: str, whole: bool = True) -> str:
    """Text of a parameter file for the nodes of a PSD finger; arguments as of _text."""
    sections = [('/**', PSD_SENSOR_PARAMETERS), ('/**/psd_node', _without(PSD_DRIVER_PARAMETERS, PSD_SENSOR_PARAMETERS)),
                ('/**/psd_contact_node', _without(PSD_PARAMETERS, PSD_SENSOR_PARAMETERS)),
                ('/**/finger_markers_node', _without(FINGER_MARKERS_PARAMETERS, PSD_SENSOR_PARAMETERS))]
    return _text(about, sections, {}, whole=whole)


def array_file(about: str, changed: Mapping[str, object], whole: bool = True) -> str:
    """Text of a parameter file for the nodes of a taxel array; arguments as of _text."""
    sections = [('/**', TAXEL_SENSOR_PARAMETERS), ('/**/taxel_array_node', _without(TAXEL_DRIVER_PARAMETERS, TAXEL_SENSOR_PARAMETERS)),
                ('/**/taxel_contact_node', _without(TAXEL_PARAMETERS, TAXEL_SENSOR_PARAMETERS)),
                ('/**/taxel_markers_node', _without(TAXEL_MARKERS_PARAMETERS, TAXEL_SENSOR_PARAMETERS))]
    return _text(about, sections, changed, whole=whole)


def simulated_pad() -> dict[str, object]:
    """Pad properties that a user would measure on the simulated array, by parameter name."""
    pad = PadSpecimen()
    return {'pad.thickness': pad.thickness, 'pad.stiffness': round(pad.press * pad.thickness, 1),
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


_PRESSURE_ARRAY = {'rows': 14, 'columns': 6, 'pitch': 0.0034, 'bits': 12, 'reference.start': 'zero', 'full_value': 2000.0}


def simulated_markers(sensor_type: str) -> dict[str, object]:
    """Properties that a user would measure on the simulated sheet or cushion, by parameter name, with its scene and pressing tip."""
    scene = {'scene': f'{sensor_type}_demo', 'tip_radius': MARKER_SENSOR_TYPES[sensor_type].tip_radius}
    if SENSOR_TYPES[sensor_type].stitched:  # the calibration holds the camera poses
        return {**scene, 'camera.translation': defaults(MARKER_SENSOR_PARAMETERS)['camera.translation']}
    camera = open_scene(f'{sensor_type}_rest').camera
    return {**scene, 'camera.translation': [round(float(x), 7) for x in camera.translation],
            'camera.rotation': [round(float(x), 6) for x in Rotation.from_matrix(camera.rotation).as_rotvec()]}


def parameter_files() -> dict[str, str]:
    """Text of each file by name."""
    files = {}
    for sensor_type in MARKER_SENSORS:
        files[f'{sensor_type}.yaml'] = marker_file(_MARKERS.format(sensor_type), sensor_type, {})
        files[f'{sensor_type}_sim.yaml'] = marker_file(_SIMULATED.format(sensor_type), sensor_type, simulated_markers(sensor_type), False)
    return files | _touchpad_files() | {'psd_finger.yaml': finger_file(_MARKERS.format('psd_finger')),
                                        'psd_finger_sim.yaml': finger_file(_SIMULATED.format('psd_finger'), False),
                                        'taxel_array.yaml': array_file(_MARKERS.format('taxel_array'), {}),
                                        'taxel_array_sim.yaml': array_file(_SIMULATED.format('taxel_array'), simulated_pad(), False),
                                        'pressure_array_14x6.yaml': array_file(_PRESSURE, _PRESSURE_ARRAY)}


def _touchpad_files() -> dict[str, str]:
    video = {'sensor_type': 'marker_video', 'rows': 7, 'columns': 10, 'surface': 'none'}
    surface_only = ('cap.', 'camera.', 'membrane.', 'calibration', 'contact_region_node', 'markers_node')
    gel = {**video, 'sensor_type': 'marker_gel'}
    pins = {**video, 'sensor_type': 'pin_dome', 'rows': 0, 'columns': 0, 'polarity': 'bright', 'detection': 'blobs',
            'numbering': 'register'}
    worn = {**pins, 'sensor_type': 'worn_markers', 'detection': 'discs', 'numbering': 'tracks'}
    return {'touchpad.yaml': touchpad_file(_TOUCHPAD, {}), 'marker_gel.yaml': touchpad_file(_GEL, gel, surface_only),
            'pin_dome.yaml': touchpad_file(_PINS, pins, surface_only), 'worn_markers.yaml': touchpad_file(_WORN, worn, surface_only),
            'touchpad_sim.yaml': touchpad_file(_SIMULATED.format('touchpad'), simulated_specimen(), whole=False),
            'marker_video.yaml': touchpad_file(_MARKER_VIDEO, video, surface_only)}


def main() -> int:
    """Write the files to the folder named on the command line."""
    for name, text in parameter_files().items():
        Path(sys.argv[1], name).write_text(text)
    return 0


if __name__ == '__main__':
    sys.exit(main())
