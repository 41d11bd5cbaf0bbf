# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""All sensor types, in one table: nodes, raw topics, what contacts need, launch arguments. Those of marker sensors come
from tactile_perception.sensor_types. No ROS here."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from tactile_perception.sensor_types import MARKER_SENSOR_TYPES, MarkerSensorType

_DRIVER, _PERCEPTION, _BRINGUP = 'tactile_driver.nodes', 'tactile_perception.nodes', 'tactile_bringup.nodes'
#: Name -> (package, class); the module has the node's name.
NODES = {
    'camera_node': (_DRIVER, 'CameraNode'), 'dual_camera_node': (_DRIVER, 'DualCameraNode'), 'psd_node': (_DRIVER, 'PsdNode'),
    'taxel_array_node': (_DRIVER, 'TaxelArrayNode'), 'dot_tracker_node': (_PERCEPTION, 'DotTrackerNode'),
    'contact_region_node': (_PERCEPTION, 'ContactRegionNode'), 'contact_point_node': (_PERCEPTION, 'ContactPointNode'),
    'psd_contact_node': (_PERCEPTION, 'PsdContactNode'), 'taxel_contact_node': (_PERCEPTION, 'TaxelContactNode'),
    'markers_node': (_BRINGUP, 'MarkersNode'), 'finger_markers_node': (_BRINGUP, 'FingerMarkersNode'),
    'taxel_markers_node': (_BRINGUP, 'TaxelMarkersNode'),
}


@dataclass(frozen=True)
class SensorType:
    """driver, perception, markers: its nodes, those of perception in the order of the data flow.

    needs: without which the last node of perception is not started: 'surface' (a parameter), 'presses' (in the calibration file), ''
    nothing; uncalibrated: note of launch without a calibration, '' none; raw: parameter of the driver -> topic of the raw data; sources:
    values of the argument source; arguments: of the launch file besides the common ones, name -> text; stitched: whether the driver takes
    the calibration too.
    """

    driver: str
    perception: tuple[str, ...]
    markers: str = 'markers_node'
    needs: str = ''
    uncalibrated: str = ''
    raw: Mapping[str, str] = field(default_factory=lambda: {'topic': 'image_raw'})
    sources: tuple[str, ...] = ('sim', 'device', 'file', 'bag')
    arguments: Mapping[str, str] = field(default_factory=dict)
    stitched: bool = False


_TWO_CAMERAS = {
    'driver': 'dual_camera_node', 'stitched': True, 'raw': {'topic': 'left/image_raw', 'right_topic': 'right/image_raw'},
    'sources': ('sim', 'device', 'file', 'bag', 'topics'),
    'arguments': {'right_device': 'device: the right camera; device is the left one', 'right_path': 'file: the right video or folder of '
                  'images', 'right_topic': 'bag, topics: the right images; topic has the left ones'}}


def _marker_sensor(kind: MarkerSensorType) -> SensorType:
    """A sheet or dome, with one camera or two."""
    driver = {'driver': 'camera_node'} if kind.cameras == 1 else _TWO_CAMERAS
    return SensorType(perception=('dot_tracker_node', 'contact_point_node'), needs='presses',
                      uncalibrated='markers are tracked, contacts are not reported; record presses at known positions', **driver)


#: Name -> sensor type.
SENSOR_TYPES = {
    'touchpad': SensorType('camera_node', ('dot_tracker_node', 'contact_region_node'), needs='surface'),
    **{name: _marker_sensor(kind) for name, kind in MARKER_SENSOR_TYPES.items()},
    'psd_finger': SensorType(
        'psd_node', ('psd_contact_node',), 'finger_markers_node', raw={'topic': 'voltages'}, sources=('sim', 'device', 'bag'),
        uncalibrated='positions are those of a nominal finger, force and depth are unknown; record presses at known positions'),
    'taxel_array': SensorType(
        'taxel_array_node', ('taxel_contact_node',), 'taxel_markers_node',
        uncalibrated='regions, motion and slip are reported, pressure and force are unknown; record known weights'),
}
