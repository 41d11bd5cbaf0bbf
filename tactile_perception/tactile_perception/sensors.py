# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The one table of sensor types, which nodes, tools, launch files, recordings and RViz read. No NumPy here: launch reads it.

A new type is a row of SENSOR_TYPES, its parameter files, its stage and its source ("How do I add a sensor" in docs/extending.md).
"""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module

#: Name of a node -> 'module:class' of its Stage (perception) or of the node itself.
NODES = {
    'camera_node': 'tactile_driver.nodes.camera_node:CameraNode',
    'dual_camera_node': 'tactile_driver.nodes.dual_camera_node:DualCameraNode',
    'psd_node': 'tactile_driver.nodes.psd_node:PsdNode',
    'taxel_array_node': 'tactile_driver.nodes.taxel_array_node:TaxelArrayNode',
    'dot_tracker_node': 'tactile_perception.dots.stage:DotStage',
    'contact_region_node': 'tactile_perception.touchpad.stage:ContactRegionStage',
    'contact_point_node': 'tactile_perception.press.stage:ContactPointStage',
    'psd_contact_node': 'tactile_perception.finger.stage:FingerStage',
    'taxel_contact_node': 'tactile_perception.taxel.stage:TaxelStage',
    'markers_node': 'tactile_bringup.nodes.drawing_node:MarkersNode',
    'finger_markers_node': 'tactile_bringup.nodes.drawing_node:FingerMarkersNode',
    'taxel_markers_node': 'tactile_bringup.nodes.drawing_node:TaxelMarkersNode',
}


def load(node: str) -> type:
    """The class that NODES names; its module is imported now."""
    module, _, name = NODES[node].partition(':')
    return getattr(import_module(module), name)


@dataclass(frozen=True)
class MarkerSensorType:
    """A sheet or a dome with printed markers.

    rows, columns: of the printed grid; pitch: (2,) m along x and y; size: (2,) m of the clamped sheet, or rim_radius and height, m, of a
    dome; cameras: 1 or 2; full_force, full_torque: N and N m of the longest arrows in RViz; tip_radius: m, of the tool in most of the
    simulated scenes.
    """

    rows: int
    columns: int
    pitch: tuple[float, float]
    size: tuple[float, float] = (0.0, 0.0)
    rim_radius: float = 0.0
    height: float = 0.0
    cameras: int = 1
    full_force: float = 3.0
    full_torque: float = 0.05
    tip_radius: float = 0.006


@dataclass(frozen=True)
class SensorType:
    """driver, perception, view: its nodes, those of perception in the order of the data flow.

    needs: without which the last node of perception is not started: 'surface' (a parameter), 'presses' (in the calibration file), ''
    nothing; uncalibrated: note of launch without a calibration, '' none; raw: parameter of the driver -> topic of the raw data; sources:
    values of the argument source; arguments: of the launch file besides the common ones, name -> text; markers: of a sheet or a dome.
    """

    driver: str
    perception: tuple[str, ...]
    view: str = 'markers_node'
    needs: str = ''
    uncalibrated: str = ''
    raw: Mapping[str, str] = field(default_factory=lambda: {'topic': 'image_raw'})
    sources: tuple[str, ...] = ('sim', 'device', 'file', 'bag')
    arguments: Mapping[str, str] = field(default_factory=dict)
    markers: MarkerSensorType | None = None

    @property
    def stitched(self) -> bool:
        """Whether the driver stitches two cameras, and so takes the calibration too."""
        return self.markers is not None and self.markers.cameras == 2


#: of sensors with cameras
_CAMERAS = ('sim', 'device', 'file', 'bag', 'topics')
_CAMERA_INFO = {'camera_info_url': "calibration file of camera_calibration (YAML), path or file:// URL; empty: the source's own"}


def _marker_sensor(driver: str = 'camera_node', arguments: Mapping[str, str] | None = None, **kept) -> SensorType:
    return SensorType(driver, ('dot_tracker_node', 'contact_point_node'), needs='presses', sources=_CAMERAS,
                      arguments={**_CAMERA_INFO, **(arguments or {})},
                      uncalibrated='markers are tracked, contacts are not reported; record presses at known positions', **kept)


#: Name -> sensor type. Geometry of markers as in the papers areal_single, areal_dual and air_cushion; arrows: twice the largest wrench of
#: the simulated scenes.
SENSOR_TYPES = {
    'touchpad': SensorType('camera_node', ('dot_tracker_node', 'contact_region_node'), needs='surface', sources=_CAMERAS,
                           arguments=_CAMERA_INFO),
    'areal_single': _marker_sensor(markers=MarkerSensorType(9, 13, (4.5e-3, 4.5e-3), (0.060, 0.045))),
    'areal_dual': _marker_sensor(
        'dual_camera_node', raw={'topic': 'left/image_raw', 'right_topic': 'right/image_raw'},
        arguments={'right_device': 'device: the right camera; device is the left one',
                   'right_path': 'file: the right video or folder of images',
                   'right_topic': 'bag, topics: the right images; topic has the left ones'},
        markers=MarkerSensorType(11, 14, (9.4e-3, 8.2e-3), (0.133, 0.091), cameras=2, full_force=2.0, tip_radius=0.008)),
    'air_cushion': _marker_sensor(markers=MarkerSensorType(
        17, 17, (15.5e-3, 15.5e-3), rim_radius=0.150, height=0.120, full_force=25.0, full_torque=0.7, tip_radius=0.030)),
    'psd_finger': SensorType(
        'psd_node', ('psd_contact_node',), 'finger_markers_node', raw={'topic': 'voltages'}, sources=('sim', 'device', 'bag'),
        uncalibrated='positions are those of a nominal finger, force and depth are unknown; record presses at known positions'),
    'taxel_array': SensorType(
        'taxel_array_node', ('taxel_contact_node',), 'taxel_markers_node',
        uncalibrated='regions, motion and slip are reported, pressure and force are unknown; record known weights'),
}

#: Name -> geometry of the sheets and domes.
MARKER_SENSOR_TYPES = {name: row.markers for name, row in SENSOR_TYPES.items() if row.markers}
