# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of a sheet or a dome: touch methods and the wrench from recordings of a tip pressed at known places."""
from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from ..calibration.touch_file import METHODS, best_method, write_touch
from ..errors import BadCalibration, BadFrame
from ..nodes import conversions as convert
from ..pipeline.dot_stage import make_tracker
from ..pipeline.marker_parameters import MARKER_SENSOR_PARAMETERS, marker_sensor
from ..pipeline.marker_views import view_maker
from ..pipeline.parameter_file import read_parameters
from ..pipeline.parameters import DOT_PARAMETERS
from ..pipeline.sensor import Touchpad, camera_pose
from ..touch.judge import Score, held_out_score
from ..touch.methods import TOUCH_METHODS
from ..touch.presses import SAME_PLACE, Presses
from ..touch.rest_markers import RestMarkers
from .stamped import TRUE_WRENCH, TRUTH, pairs_of

_TOUCHES = 1e-4  # m: depth from which a frame counts as a press


class PressReader:
    """Presses from bags: the markers of each image with the contact and the wrench that ground truth has for its stamp."""

    def __init__(self, params: Path, namespace: str):
        self._values = read_parameters(params, 'contact_point_node', MARKER_SENSOR_PARAMETERS)
        self._dot_values = read_parameters(params, 'dot_tracker_node', DOT_PARAMETERS)
        self.sensor = marker_sensor(self._values)
        self.left_out: list[str] = []
        self._namespace, self._rows, self._matrices = namespace, [], None

    def read(self, bag: Path) -> None:
        """Take every usable frame of one bag. Raises TactileError for a bag without images, camera or ground truth."""
        tracker = make_tracker(Touchpad.from_parameters(self._dot_values), self._dot_values)
        rest: RestMarkers | None = None
        for name, found in pairs_of(bag, self._namespace, ('image_raw', TRUTH), self._take_camera):
            if rest is None:
                rest = RestMarkers(self.sensor.rows * self.sensor.columns, self._view_maker(bag))
            image = found['image_raw']
            try:
                tracks = tracker.process(convert.image_to_array(image), convert.stamp_seconds(image.header))
                self._rows.append((rest.field(tracks), *_truth(found)))
            except BadFrame as error:
                self.left_out.append(f'{name}: {error}')

    def presses(self) -> Presses:
        """All that were read. Raises BadCalibration where there is none."""
        if not any(depth > 0 for _, _, depth, _ in self._rows):
            raise BadCalibration(f'no usable press in the recordings; left out: {"; ".join(self.left_out[:3]) or "nothing"}')
        fields, position, depth, wrench = zip(*self._rows)
        position = np.array(position)
        moved = np.r_[True, ~(np.hypot(*np.diff(position[:, :2], axis=0).T) < SAME_PLACE)]
        return Presses(tuple(fields), position, np.array(depth), np.cumsum(moved), np.array(wrench), np.full(len(depth), np.nan))

    def _view_maker(self, bag: Path):
        make_view = view_maker(self.sensor, self._matrices, None, camera_pose(self._values))
        if make_view is None:
            raise BadCalibration(f'{bag}: no camera_info before the first image; record it beside image_raw')
        return make_view

    def _take_camera(self, message) -> None:
        self._matrices = convert.camera_matrices(message)
        if self._matrices is None:
            raise BadCalibration('camera_info has no K: calibrate the camera first (camera_info_path of camera_node)')


def _truth(found: dict) -> tuple[np.ndarray, float, np.ndarray]:
    """Tip (3,) m, depth m and wrench (6,) of one frame. Raises BadFrame where several tips touch, or hardly one does."""
    contacts = found[TRUTH].contacts
    if len(contacts) > 1:
        raise BadFrame(f'{len(contacts)} contacts; one tip at a time is needed')
    force = np.full(6, np.nan)
    if TRUE_WRENCH in found:
        wrench = found[TRUE_WRENCH].wrench
        force = np.array([wrench.force.x, wrench.force.y, wrench.force.z, wrench.torque.x, wrench.torque.y, wrench.torque.z])
    if not contacts:
        return np.full(3, np.nan), 0.0, force
    if not contacts[0].depth >= _TOUCHES:
        raise BadFrame(f'depth {contacts[0].depth * 1e3:.3f} mm: too little is known of the first touch')
    position = contacts[0].position
    return np.array([position.x, position.y, position.z]), contacts[0].depth, force


def fit_methods(presses: Presses, reader: PressReader) -> tuple[dict, dict[str, Score]]:
    """Numbers and held-out score of each method that fits the presses. Raises BadCalibration where none does."""
    fitted, scores = {}, {}
    for name, method in TOUCH_METHODS.items():
        print(f'fitting {name} to {presses.touching.sum()} presses, and again without a third of the places', file=sys.stderr, flush=True)
        try:
            fitted[name] = method.fit(presses, reader.sensor)
            scores[name] = held_out_score(method, presses, reader.sensor)
        except BadCalibration as error:
            fitted.pop(name, None)
            reader.left_out.append(f'method {name}: {error}')
    if not fitted:
        raise BadCalibration('no touch method can be fitted: ' + '; '.join(reader.left_out))
    return fitted, scores


def calibrate_markers(bags: list[Path], params: Path, output: Path, namespace: str = '') -> str:
    """Fit, write output, and tell how it went. Raises TactileError for recordings that cannot determine any method."""
    reader = PressReader(params, namespace)
    for bag in bags:
        reader.read(bag)
    presses = reader.presses()
    methods, scores = fit_methods(presses, reader)
    touching = presses.select(presses.touching)
    span = {'depth': _span(touching.depth), 'x': _span(touching.position[:, 0]), 'y': _span(touching.position[:, 1])}
    write_touch(output, reader.sensor.type, {METHODS: methods}, scores, span, reader.left_out)
    return report(presses, scores, methods, reader.left_out, output)


def _span(values: np.ndarray) -> list[float]:
    return [float(values.min()), float(values.max())]


def report(presses: Presses, scores: dict[str, Score], methods: dict, left_out: list[str], output: Path) -> str:
    """The fit in words."""
    lines = [f'{presses.touching.sum()} presses at {presses.places().max() + 1} places, {(~presses.touching).sum()} untouched frames',
             'errors on presses at places held out, mean / 95 %:']
    lines += [f'  {name}: place {s.place_mean * 1e3:.2f} / {s.place_95 * 1e3:.2f} mm, depth {s.depth_mean * 1e3:.2f} / '
              f'{s.depth_95 * 1e3:.2f} mm, normalised squared error {s.squares:.2f}, missed {s.missed} of {s.presses}'
              for name, s in scores.items()]
    lines.append('chosen: ' + best_method({name: score.numbers() for name, score in scores.items()}, methods))
    lines += [f'left out: {line}' for line in left_out]
    return '\n'.join([*lines, f'written: {output}'])
