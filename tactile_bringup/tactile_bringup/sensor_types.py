# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Every sensor type, in one table: its nodes, the topics of its raw data, what it needs to report contacts. No ROS here."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

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
    """driver, perception, markers: its nodes, those of perception in the order in which data go through them.

    needs: without which the last node of perception is left out: 'surface' (a parameter), 'presses' (in the calibration file), '' nothing;
    uncalibrated: what launch says without a calibration, '' nothing; raw: parameter of the driver -> topic of the raw data; sources: where
    data may come from; arguments: of the launch file besides those of all sensors, name -> text; stitched: whether the driver takes the
    calibration too; shown: topics of its RViz configuration.
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
    shown: tuple[str, ...] = ('image_raw', 'image_annotated', 'markers', 'points')

    @property
    def annotated(self) -> bool:
        """Whether it has a picture with what it feels drawn into it."""
        return 'image_annotated' in self.shown


_MARKERS = ('dot_tracker_node', 'contact_point_node')
_UNCALIBRATED = 'markers are tracked, touches are not told; record presses at known places'
#: Name -> sensor type.
SENSOR_TYPES = {
    'touchpad': SensorType('camera_node', ('dot_tracker_node', 'contact_region_node'), needs='surface'),
    'areal_single': SensorType('camera_node', _MARKERS, needs='presses', uncalibrated=_UNCALIBRATED),
    'areal_dual': SensorType(
        'dual_camera_node', _MARKERS, needs='presses', uncalibrated=_UNCALIBRATED, stitched=True,
        raw={'topic': 'left/image_raw', 'right_topic': 'right/image_raw'}, sources=('sim', 'device', 'file', 'bag', 'topics'),
        arguments={'right_device': 'device: the right camera; device is the left one', 'right_path': 'file: the right video or folder of '
                   'images', 'right_topic': 'bag, topics: the right images; topic has the left ones'}),
    'air_cushion': SensorType('camera_node', _MARKERS, needs='presses', uncalibrated=_UNCALIBRATED),
    'psd_finger': SensorType(
        'psd_node', ('psd_contact_node',), 'finger_markers_node', raw={'topic': 'voltages'}, sources=('sim', 'device', 'bag'),
        shown=('markers',),
        uncalibrated='places are of a nominal finger, force and depth are not told; record presses at known places'),
    'taxel_array': SensorType(
        'taxel_array_node', ('taxel_contact_node',), 'taxel_markers_node', shown=('image_raw', 'markers', 'points'),
        uncalibrated='regions, motion and slip are told, pressure and force are not; record known weights'),
}
