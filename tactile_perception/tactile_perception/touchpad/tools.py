# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibrates a touchpad: fits its optical model to recordings of a sphere pressed at known positions (ground_truth/contacts)."""
from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from tactile_driver.nodes.messages.images import image_to_array

from ..bags.stamped import TRUTH, pairs_of
from ..common.camera import CameraModel
from ..common.marker_sensor import MarkerSensor
from ..common.residuals import write_and_report
from ..core.calibration_file import Specimen
from ..core.errors import BadCalibration, BadFrame
from ..core.messages import camera_matrices, stamp_seconds
from ..core.parameter_files import read_parameters
from ..dots.tracker import make_tracker
from .calibration import Press, TouchpadCalibration, find_sphere_radius, fit_touchpad, sphere_misfit, touchpad_file
from .constants import TOUCHPAD
from .parameters import NODE, TOUCHPAD_PARAMETERS
from .sensor import Touchpad


class PressReader:
    """Reads presses from bags: each image with the ground-truth contact of the same stamp."""

    def __init__(self, values: dict, namespace: str):
        self.sensor = Touchpad.from_parameters(values)
        self.camera: CameraModel | None = None
        self.left_out: list[str] = []
        self._values, self._namespace = values, namespace

    def read(self, bag: Path) -> list[Press]:
        """Read every usable frame of one bag. Raises TactileError for a bag without images or ground truth."""
        tracker = make_tracker(self._values)
        presses = []
        for name, found in pairs_of(bag, self._namespace, ('image_raw', TRUTH), self._take_camera):
            image, contacts = found['image_raw'], found[TRUTH].contacts
            try:
                tracks = tracker.process(image_to_array(image), stamp_seconds(image.header))
                presses.append(_press(name, image_to_array(image), tracks, contacts))
            except BadFrame as error:
                self.left_out.append(f'{name}: {error}')
        return presses

    def _take_camera(self, message) -> None:
        matrices = camera_matrices(message)
        if matrices is None:
            raise BadCalibration('camera_info has no K: calibrate the camera first (camera_info_url of camera_node)')
        self.camera = self.sensor.camera(*matrices)


def _press(name: str, image: np.ndarray, tracks, contacts: list) -> Press:
    if len(contacts) > 1:
        raise BadFrame(f'{len(contacts)} contacts; press one sphere at a time')
    if not contacts:
        return Press(image, tracks, name=name)
    tip = contacts[0].position
    return Press(image, tracks, np.array([tip.x, tip.y, tip.z]), contacts[0].depth, name)


def select_frames(presses: list[Press], max_presses: int = TOUCHPAD.max_presses) -> list[Press]:
    """Evenly spaced selections of untouched frames and of presses; presses shallower than MIN_DEPTH are left out."""
    untouched = [p for p in presses if not p.touching]
    touching = [p for p in presses if p.touching and p.depth >= TOUCHPAD.min_depth]
    return _evenly(untouched, TOUCHPAD.max_untouched) + _evenly(touching, max_presses)


def _evenly(items: list, count: int) -> list:
    return [items[k] for k in np.unique(np.linspace(0, len(items) - 1, min(count, len(items))).round().astype(int))] if items else []


def report(found: TouchpadCalibration) -> list[str]:
    """Lines that describe the fit."""
    model = found.model
    shallow, deep = (1e3 * depth for depth in found.depth_range)
    return [
        f'{found.presses} presses, {found.dots} dots on a sphere of {found.sphere_radius * 1e3:.2f} mm radius',
        f'range residual: {found.residual_rms * 1e3:.3f} mm RMS, {found.residual_bias * 1e3:+.3f} mm mean; '
        f'cross-validation {found.held_out_rms * 1e3:.3f} mm RMS',
        f'absorption relative to red: blue {model.absorptions[0]:.2f}, green {model.absorptions[1]:.2f} 1/m',
        f'standard deviation of the depth scale {model.scale_sigma:.1%}; calibrated for depths of {shallow:.2f} to {deep:.2f} mm',
    ]


def pressed_cap(params: Path) -> MarkerSensor:
    """Read the undeformed cap of a touchpad from a parameter file, as a dome without markers.

    Raises BadArgument for wrong parameters.
    """
    cap = Touchpad.from_parameters(read_parameters(params, NODE, TOUCHPAD_PARAMETERS)).cap
    return MarkerSensor(0, 0, (1e-3, 1e-3), rim_radius=cap.rim_radius, height=cap.height, type='touchpad')


def calibrate_touchpad(bags: list[Path], params: Path, output: Path, namespace: str = '', serial: str = '',
                       sphere_radius: float | None = None) -> str:
    """Fit the model, write the calibration file and the plot of its residuals, and return a report.

    Parameters
    ----------
    bags : list of Path
        Recordings of presses with ground_truth/contacts.
    params, output, namespace, serial
        See `SensorType.calibrate`.
    sphere_radius : float, optional
        Radius of the sphere in m; fitted by default.

    Returns
    -------
    str
        The report.

    Raises
    ------
    TactileError
        If the recordings do not determine the model.
    """
    values = read_parameters(params, NODE, TOUCHPAD_PARAMETERS)
    reader = PressReader(values, namespace)
    presses = select_frames([press for bag in bags for press in reader.read(bag)])
    if reader.camera is None:
        raise BadCalibration('no camera_info in the recordings; record it beside image_raw')
    cap = reader.sensor.cap
    if sphere_radius is None:
        print('fitting the radius of the sphere; --sphere-radius saves this step', file=sys.stderr, flush=True)
        few = select_frames(presses, 12)  # presses used in the search for the sphere's radius
        sphere_radius = find_sphere_radius(lambda radius: sphere_misfit(few, reader.camera, radius, cap))
    found = fit_touchpad(presses, reader.camera, sphere_radius, cap)
    height, width = presses[0].image.shape[:2]
    content = touchpad_file(found, (width, height), reader.left_out, Specimen(serial, values))
    return write_and_report(output, content, found.held_out, report(found))
