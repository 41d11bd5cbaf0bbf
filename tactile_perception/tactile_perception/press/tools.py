# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibrates a sheet or a dome from recordings of a tip pressed at known positions.

Fits the stitching of two cameras, the press methods and the wrench.
"""
from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from tactile_driver.nodes.messages.conversions import frame_of_message
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.parameters.drivers import DUAL_CAMERA_PARAMETERS
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode

from ..bags.stamped import TRUE_WRENCH, TRUTH, find_prefix, pairs_of
from ..bags.stitched_bag import VIEWS, bag_opener, stitching_in
from ..common.camera import camera_pose
from ..common.marker_sensor import MarkerSensor
from ..common.residuals import outliers, report_residuals
from ..core.calibration_file import CalibrationFile, Specimen, write_calibration
from ..core.errors import BadCalibration, BadFrame, BadRecording
from ..core.messages import camera_matrices, stamp_seconds
from ..core.parameter_files import read_parameters
from ..dots.tracker import DotTracker, find_pattern, make_tracker
from .calibration import METHODS, PATTERN, REST, STIFFNESS, STITCHING, UNITS, WRENCH, best_method, fit_stiffness
from .constants import PRESS
from .field import RestMarkers, middle_of_seen, view_maker
from .methods import make_method, methods_for
from .parameters import MARKER_PARAMETERS, NODE, marker_sensor
from .presses import Found, Presses, held_out, marker_residuals, require_coverage, score
from .stitching import SIDES, StitchingFit, fit_stitching

Matrices = tuple[np.ndarray, np.ndarray] | None


def find_stitching(bags: list[Path], params: Path, sensor: MarkerSensor, namespace: str) -> StitchingFit | None:
    """Fit the stitching to the first usable untouched pair of the bags; None when no bag has both views.

    A pair is untouched when ground_truth/contacts is empty or not recorded. Raises BadCalibration, with the reasons, without a usable pair.
    """
    if not sensor.is_sheet:
        return None
    dots, reasons = read_parameters(params, NODE, MARKER_PARAMETERS), []
    method = read_parameters(params, 'dual_camera_node', DUAL_CAMERA_PARAMETERS)['stitching']
    for bag in bags:
        for images, cameras in _untouched(bag, namespace):
            try:
                return fit_stitching(images, cameras, sensor, dots['polarity'], dots['detection'], method)
            except (BadFrame, BadCalibration) as error:
                reasons.append(f'{bag.name}: {error}')
            if len(reasons) >= PRESS.max_reference_tries:
                break
    if reasons:
        raise BadCalibration('no stitching from untouched pairs: ' + '; '.join(dict.fromkeys(reasons)))
    return None


def _untouched(bag: Path, namespace: str) -> Iterator[tuple[tuple[np.ndarray, np.ndarray], tuple[Matrices, Matrices]]]:
    """Yield pairs of images of the untouched sheet, which does not move from one to the other, and the matrices of their cameras."""
    views, cameras = {}, {}
    with BagReader(bag) as reader:
        try:
            prefix = find_prefix(reader.topics, namespace, VIEWS[0])
        except BadRecording:
            return
        free = _free_stamps(reader, prefix)
        infos = {f'{prefix}{name}/camera_info': side for side, name in enumerate(SIDES)}
        sides = {prefix + view: side for side, view in enumerate(VIEWS)}
        for raw in reader.messages({*sides, *infos}):
            message = decode(raw.data, raw.type_name)
            if raw.topic in infos:
                cameras[infos[raw.topic]] = camera_matrices(message)
                continue
            views[sides[raw.topic]] = frame_of_message(message, 'image')
            if len(views) == 2:
                if cameras.get(0) is None or cameras.get(1) is None:
                    raise BadCalibration(f'{bag}: no camera_info with K before the first pair of images; calibrate both cameras first')
                if free is None or views[0].stamp_ns in free:
                    yield (views[0].image, views[1].image), (cameras[0], cameras[1])
                views = {}


def _free_stamps(reader: BagReader, prefix: str) -> set[int] | None:
    """Stamps, ns, without contact; None for a recording without ground truth."""
    if prefix + TRUTH not in reader.topics:
        return None
    found = (decode(raw.data, raw.type_name) for raw in reader.messages({prefix + TRUTH}))
    return {m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in found if not m.contacts}


def have_truth(bags: list[Path], namespace: str) -> bool:
    """Whether one of the bags has ground truth of contacts."""
    for bag in bags:
        with BagReader(bag) as reader:
            if find_prefix(reader.topics, namespace, VIEWS[0]) + TRUTH in reader.topics:
                return True
    return False


def write_stitching(output: Path, sensor_type: str, found: StitchingFit, specimen: Specimen) -> str:
    """Write a calibration that holds only the stitching, for dual_camera_node; a report of the fit."""
    residuals = {'markers_off_grid': found.residual, 'views_apart': found.overlap}
    units = {'lengths': 'm', 'scale': 'px/m', 'size, origin, seam, cut, matrix': 'px', 'residuals': 'm'}
    write_calibration(output, CalibrationFile(sensor_type, units, {'stitching': found.stitching.to_dict()}, residuals, {},
                                              serial=specimen.serial, parameters=specimen.parameters(sensor_type)))
    return '\n'.join([*found.lines(), f'written: {output}, the stitching alone: no ground_truth/contacts in the recordings'])


class PressReader:
    """Reads presses from bags: the markers of each image with the true contact and wrench of the same stamp.

    Attributes
    ----------
    stitching : Stitching or None
        Stitching of two views, by default from the calibration file that the parameters name; None for one camera.
    pattern : ndarray, shape (K, 2), or None
        Untouched positions, in px in the first image, of markers that form no grid; None for a grid.
    names : list of str
        Recording and time of each press.
    values : Mapping
        The parameters.
    params, namespace : Path, str
        As given.
    """

    def __init__(self, params: Path, namespace: str = ''):
        self.values = read_parameters(params, NODE, MARKER_PARAMETERS)
        self.sensor = marker_sensor(self.values)
        self.left_out: list[str] = []
        self.params, self.namespace, self._rows, self._matrices = params, namespace, [], None
        self.names: list[str] = []
        self.pattern: np.ndarray | None = None
        self.stitching = stitching_in(self.values['calibration'], self.sensor.type)

    def read(self, bag: Path) -> None:
        """Read every usable frame of one bag. Raises TactileError for a bag without images, camera or ground truth."""
        tracker, rest = None, None
        for name, found in pairs_of(bag, self.namespace, ('image_raw', TRUTH), self._take_camera,
                                    open_bag=bag_opener(self.params, self.stitching)):
            stamp_s, image = stamp_seconds(found['image_raw'].header), image_to_array(found['image_raw'])
            try:
                if rest is None:
                    tracker, rest = self._begin(image, self._view_maker(bag))
                tracks = tracker.process(image, stamp_s)
                self._rows.append((rest.field(tracks, stamp_s), *_truth(found)))
                self.names.append(name)
            except BadFrame as error:
                self.left_out.append(f'{name}: {error}')

    def _begin(self, image: np.ndarray, make_view) -> tuple[DotTracker, RestMarkers]:
        """Tracker and untouched markers of a recording. Raises BadFrame for a first image without markers."""
        count = self.sensor.rows * self.sensor.columns
        if not count and self.pattern is None:
            self.pattern = find_pattern(image, self.values)
        tracker = make_tracker(self.values, self.pattern)
        return tracker, RestMarkers(count or len(self.pattern), make_view)

    def presses(self) -> Presses:
        """All presses read. Raises BadCalibration without any."""
        if not any(depth > 0 for _, _, depth, _ in self._rows):
            raise BadCalibration(f'no usable press in the recordings; left out: {"; ".join(self.left_out[:3]) or "nothing"}')
        fields, position, depth, wrench = zip(*self._rows)
        position = np.array(position)
        moved = np.r_[True, ~(np.hypot(*np.diff(position[:, :2], axis=0).T) < PRESS.same_position)]
        return Presses(tuple(fields), position, np.array(depth), np.cumsum(moved), np.array(wrench))

    def _view_maker(self, bag: Path):
        make_view = view_maker(self.sensor, self._matrices, self.stitching and self.stitching.to_dict(), camera_pose(self.values))
        if make_view is None:
            raise BadCalibration(f'{bag}: no camera_info before the first image; record it beside image_raw')
        return make_view

    def _take_camera(self, message) -> None:
        self._matrices = camera_matrices(message)
        if self._matrices is None and self.stitching is None:
            raise BadCalibration('camera_info has no K: calibrate the camera first (camera_info_url of camera_node)')


def _truth(found: dict) -> tuple[np.ndarray, float, np.ndarray]:
    """Tip (3,) m, depth m and wrench (6,) of one frame. Raises BadFrame for several contacts and for one that is too shallow."""
    contacts = found[TRUTH].contacts
    if len(contacts) > 1:
        raise BadFrame(f'{len(contacts)} contacts; press one tip at a time')
    force = np.full(6, np.nan)
    if TRUE_WRENCH in found:
        wrench = found[TRUE_WRENCH].wrench
        force = np.array([wrench.force.x, wrench.force.y, wrench.force.z, wrench.torque.x, wrench.torque.y, wrench.torque.z])
    if not contacts:
        return np.full(3, np.nan), 0.0, force
    if not contacts[0].depth >= PRESS.min_recorded_depth:
        raise BadFrame(f'depth {contacts[0].depth * 1e3:.3f} mm: too shallow, the depth of first contact is uncertain')
    position = contacts[0].position
    return np.array([position.x, position.y, position.z]), contacts[0].depth, force


def fit_methods(presses: Presses, reader: PressReader, only: str = '') -> tuple[dict, dict[str, Found]]:
    """Fit each method, or only one, to the presses and cross-validate it.

    Returns fitted numbers and results by method. Raises BadCalibration if none fits.
    """
    known, methods, held = methods_for(reader.sensor), {}, {}
    for name in [only] if only else known:
        print(f'fitting {name} to {presses.touching.sum()} presses, and cross-validating it', file=sys.stderr, flush=True)
        try:
            fitted = known[name].fit(presses, reader.sensor)
            held[name] = held_out(known[name], presses, reader.sensor, fitted)
            methods[name] = fitted
        except BadCalibration as error:
            reader.left_out.append(f'method {name}: {error}')
    if not methods:
        raise BadCalibration('no touch method can be fitted: ' + '; '.join(reader.left_out))
    return methods, held


def fit_wrench(presses: Presses, reader: PressReader, methods: dict) -> tuple[float, dict] | None:
    """Fit the stiffness, N/m, and the errors of the wrench (fit_stiffness).

    None without a model or recorded wrenches, and if the fit fails, which left_out of the reader reports.
    """
    known = presses.touching & np.isfinite(presses.wrench).all(1)
    if not known.any():
        reader.left_out.append('wrench: no ground_truth/wrench was recorded with the presses')
        return None
    if 'model' not in methods:
        reader.left_out.append('wrench: only the method model gives it')
        return None
    print(f'fitting the stiffness to {known.sum()} presses', file=sys.stderr, flush=True)
    try:
        return fit_stiffness(presses, make_method('model', methods['model'], reader.sensor))
    except BadCalibration as error:
        reader.left_out.append(f'wrench: {error}')
        return None


def read_plate(bag: Path, of_tips: PressReader) -> Presses:
    """Read the presses of a plate in the views of the reader of_tips, to whose left_out unusable frames are added.

    Raises TactileError as PressReader does.
    """
    reader = PressReader(of_tips.params, of_tips.namespace)
    reader.stitching = of_tips.stitching
    reader.read(bag)
    of_tips.left_out += reader.left_out
    return reader.presses()


def calibrate_markers(bags: list[Path], params: Path, output: Path, namespace: str = '', serial: str = '',
                      plate: Path | None = None) -> str:
    """Calibrate as `SensorType.calibrate`, or the stitching alone where no truth was recorded; plate: as of `fit_markers`."""
    reader = PressReader(params, namespace)
    if not have_truth(bags, namespace) and (stitched := find_stitching(bags, params, reader.sensor, namespace)):
        return write_stitching(output, reader.sensor.type, stitched, Specimen(serial, reader.values))
    return fit_markers(reader, bags, output, serial, plate)


def fit_markers(reader: PressReader, bags: list[Path], output: Path, serial: str = '', plate: Path | None = None, only: str = '') -> str:
    """Fit the methods, write the calibration file and the plot of its residuals, and return a report.

    plate: bag of a plate that is pressed onto all markers of a sheet, for the paper's method; only: the method to fit, empty for all.
    """
    stitched = find_stitching(bags, reader.params, reader.sensor, reader.namespace)
    reader.stitching = reader.stitching if stitched is None else stitched.stitching
    for bag in bags:
        reader.read(bag)
    presses = reader.presses()
    require_coverage(presses)
    if plate is not None:
        presses = replace(presses, plate=read_plate(plate, reader))
    methods, held = fit_methods(presses, reader, only)
    scores = {name: score(found, presses) for name, found in held.items()}
    best = best_method(scores, methods)
    stiffness, errors = fit_wrench(presses, reader, methods) or (None, {})
    fitted = {METHODS: methods} | ({WRENCH: {STIFFNESS: stiffness}} if errors else {})
    fitted |= {STITCHING: reader.stitching.to_dict()} if reader.stitching else {}
    fitted |= {PATTERN: reader.pattern} if reader.pattern is not None else {}
    fitted |= {REST: middle_of_seen(np.array([field.uv - field.duv for field in presses.fields]))}
    touching = presses.select(presses.touching)
    span = {'depth': _span(touching.depth), 'x': _span(touching.position[:, 0]), 'y': _span(touching.position[:, 1])}
    residuals = marker_residuals(held[best], presses, reader.names)
    standing_out = outliers(residuals)
    write_calibration(output, CalibrationFile(reader.sensor.type, UNITS, fitted, scores | {WRENCH: errors}, span, reader.left_out,
                                              serial=serial, outliers=standing_out,
                                              parameters=Specimen(serial, reader.values).parameters(reader.sensor.type)))
    reported = report(presses, scores, methods, errors, reader.left_out, output)
    drawn = report_residuals(residuals, standing_out, output, f'{reader.sensor.type}, {best}')
    return '\n'.join([*(stitched.lines() if stitched else []), reported, *drawn])


def _span(values: np.ndarray) -> list[float]:
    return [float(values.min()), float(values.max())]


def report(presses: Presses, scores: dict[str, dict], methods: dict, wrench_errors: dict, left_out: list[str], output: Path) -> str:
    """Describe the fit."""
    lines = [f'{presses.touching.sum()} presses at {presses.position_labels().max() + 1} positions, '
             f'{(~presses.touching).sum()} untouched frames',
             'errors at held-out positions, mean / 95 %:']
    lines += [f'  {name}: position {s["place_mean"] * 1e3:.2f} / {s["place_95"] * 1e3:.2f} mm, depth {s["depth_mean"] * 1e3:.2f} / '
              f'{s["depth_95"] * 1e3:.2f} mm, normalised squared error {s["squares"]:.2f}, missed {s["missed"]} of {s["presses"]}'
              for name, s in scores.items()]
    lines.append('best method: ' + best_method(scores, methods))
    if wrench_errors:
        lines.append(f'wrench error at the presses, median: force {wrench_errors["force"]:.1%}, moment {wrench_errors["moment"]:.1%}')
    lines += [f'left out: {line}' for line in left_out]
    return '\n'.join([*lines, f'written: {output}'])
