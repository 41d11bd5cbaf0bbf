# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Sensor types and nodes by name: what launch files, tools, recordings, the guide and RViz know of a sensor. No NumPy here.

Each sensor type is a `SensorType` object in the folder of its sensor, or in a package of somebody else, which names it by an entry point of
the group ``tactile_perception.sensor_types`` (docs/extending.md).
"""
from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from pkgutil import resolve_name

from tactile_driver.plugins import PluginTable

#: Values of the launch argument `source` of a sensor with cameras.
CAMERA_SOURCES = ('sim', 'device', 'file', 'bag', 'topics')
#: Launch argument of a sensor with cameras.
CAMERA_INFO = {'camera_info_url': "calibration file of camera_calibration (YAML), path or file:// URL; empty: the source's own"}
#: Parameters of the camera's pose.
CAMERA_POSE = ('camera.rotation', 'camera.translation')


@dataclass(frozen=True)
class SensorType:
    """What the packages know of a sensor type.

    Functions are named as ``module:function``, so that a launch file imports none of them.

    Parameters
    ----------
    driver : str
        Node that publishes the raw data.
    perception : str
        Node that computes all results from the raw data.
    view : str
        Node that draws the results.
    package : str
        Package with the type's parameter files, calibrations and RViz configuration: ``params/TYPE.yaml``, ``params/TYPE_sim.yaml``,
        ``calibration/TYPE_sim.yaml`` and ``rviz/TYPE.rviz`` in its share folder.
    params : str
        Name of the parameter file of a real sensor; ``''``, ``TYPE.yaml``.
    rviz : str
        Name of the type whose RViz configuration serves this one too; ``''``, its own.
    uncalibrated : str
        What a launch file says when no calibration is given; ``''``, nothing.
    known_by : str
        Number of the perception node that, above 0, replaces a calibration, as the unit of a sensor that its maker has calibrated; ``''``,
        none.
    raw : Mapping
        Parameter of the driver to topic of the raw data.
    sources : tuple of str
        Values of the launch argument `source`.
    arguments : Mapping
        Launch arguments of this type alone, with their descriptions.
    stitched : bool
        Whether the driver stitches two cameras, and therefore reads the calibration too.
    calibration_parameters : tuple of str
        Parameters on which a calibration depends: it is valid only while these are unchanged.
    calibrate : str
        Function of ``(bags, params, output, namespace, serial, **options)`` that writes a calibration file, and beside it the plots of
        its residuals, and returns a report (str); ``''``, none. `bags`: list of Path, the recordings; `params`: Path, parameter file of
        the sensor; `output`: Path, the calibration file; `namespace`: str, of the sensor in the recordings, ``''`` if there is one
        sensor; `serial`: str, serial number of the device. It raises TactileError if the recordings do not determine the model.
    calibrate_options : tuple of str
        The options of `calibrate` that the function takes: ``sphere_radius``, ``plate``, ``weight``.
    pressed_surface : str
        Function of a parameter file that returns the undeformed surface on which a guided calibration presses: a `MarkerSensor`, or the
        radius of a hemisphere in m; ``''``, where a guided calibration does not press.
    loaded : str
        How a guided calibration loads the sensor with known weights instead of pressing it, as in ``lay 5 N on, evenly``; ``''``, where it
        does not.
    parameters : str
        Table of the parameters that all its nodes share, the section ``/**`` of its parameter files, as ``module:TABLE``.
    files : Mapping
        Parameter files of real sensors that are generated from the tables of the nodes: name to the comment at the top, and the values
        that differ from the defaults.
    simulated : Mapping
        Values of ``TYPE_sim.yaml`` that differ from the defaults.
    simulation : str
        The `SceneWriter` of its simulated scenes, as ``module:NAME``; ``''``, that of the driver.
    calibration_scene : tuple
        Scene, rate in Hz and options of `calibrate` by which ``calibration/TYPE_sim.yaml`` is made; empty, there is none.
    has_motion : bool
        Whether the `motion` of its contact region is that of the object in space, by which a hand follows what it holds.
    """

    driver: str
    perception: str
    view: str = 'markers_node'
    package: str = 'tactile_bringup'
    params: str = ''
    rviz: str = ''
    uncalibrated: str = ''
    known_by: str = ''
    raw: Mapping[str, str] = field(default_factory=lambda: {'topic': 'image_raw'})
    sources: tuple[str, ...] = ('sim', 'device', 'file', 'bag')
    arguments: Mapping[str, str] = field(default_factory=dict)
    stitched: bool = False
    calibration_parameters: tuple[str, ...] = ()
    calibrate: str = ''
    calibrate_options: tuple[str, ...] = ()
    pressed_surface: str = ''
    loaded: str = ''
    parameters: str = ''
    files: Mapping[str, tuple[str, Mapping]] = field(default_factory=dict)
    simulated: Mapping = field(default_factory=dict)
    simulation: str = ''
    calibration_scene: tuple[str, float, Mapping] | tuple[()] = ()
    has_motion: bool = False

    @property
    def calibrator(self) -> Callable[..., str] | None:
        """The function that `calibrate` names, imported now; None for a type that is not calibrated."""
        return resolve_name(self.calibrate) if self.calibrate else None

    @property
    def shared_parameters(self) -> Sequence:
        """The table that `parameters` names, imported now."""
        return resolve_name(self.parameters)

    @property
    def scenes(self) -> object | None:
        """The SceneWriter that `simulation` names, imported now; None for a type that names none."""
        return resolve_name(self.simulation) if self.simulation else None

    def read_pressed_surface(self, params: Path) -> object:
        """Surface on which a guided calibration presses.

        Parameters
        ----------
        params : Path
            Parameter file of the sensor.

        Returns
        -------
        object
            What the function that `pressed_surface` names returns.

        Raises
        ------
        BadArgument
            If a parameter is wrong.
        """
        return resolve_name(self.pressed_surface)(params)


_ROOM = 'tactile_perception.'
#: Name -> SensorType.
SENSOR_TYPES: Mapping[str, SensorType] = PluginTable('tactile_perception.sensor_types', {
    'touchpad': _ROOM + 'touchpad.sensor_type:TOUCHPAD',
    'areal_single': _ROOM + 'press.sensor_types:AREAL_SINGLE',
    'areal_dual': _ROOM + 'press.sensor_types:AREAL_DUAL',
    'air_cushion': _ROOM + 'press.sensor_types:AIR_CUSHION',
    'gel': _ROOM + 'gel.sensor_types:GEL',
    'pins': _ROOM + 'gel.sensor_types:PINS',
    'photometric_gel': _ROOM + 'photometric.sensor_type:PHOTOMETRIC_GEL',
    'dots': _ROOM + 'dots.sensor_type:DOTS',
    'psd_finger': _ROOM + 'finger.sensor_type:PSD_FINGER',
    'taxel_array': _ROOM + 'taxel.sensor_type:TAXEL_ARRAY',
    'force_taxels': _ROOM + 'force_taxels.sensor_type:FORCE_TAXELS',
})

#: Name of a node -> class of its Stage (perception), or of the node itself. The nodes that draw are entry points of tactile_bringup.
NODES: Mapping[str, type] = PluginTable('tactile_perception.nodes', {
    'camera_node': 'tactile_driver.nodes.camera_node:CameraNode',
    'dual_camera_node': 'tactile_driver.nodes.dual_camera_node:DualCameraNode',
    'psd_node': 'tactile_driver.nodes.psd_node:PsdNode',
    'taxel_array_node': 'tactile_driver.nodes.taxel_array_node:TaxelArrayNode',
    'force_taxel_node': 'tactile_driver.force_taxels.node:ForceTaxelNode',
    'dot_tracker_node': _ROOM + 'dots.stage:DotStage',
    'touchpad_contact_node': _ROOM + 'touchpad.stage:TouchpadStage',
    'press_contact_node': _ROOM + 'press.stage:MarkerStage',
    'gel_contact_node': _ROOM + 'gel.stage:GelStage',
    'pins_contact_node': _ROOM + 'gel.stage:PinsStage',
    'photometric_contact_node': _ROOM + 'photometric.stage:PhotometricStage',
    'psd_contact_node': _ROOM + 'finger.stage:FingerStage',
    'taxel_contact_node': _ROOM + 'taxel.stage:TaxelStage',
    'force_contact_node': _ROOM + 'force_taxels.stage:ForceTaxelsStage',
})
