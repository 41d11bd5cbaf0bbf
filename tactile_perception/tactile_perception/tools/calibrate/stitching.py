# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibrates the stitching of two cameras from an untouched pair in a recording."""
from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from tactile_driver.frame import PairFrame
from tactile_driver.nodes.messages.conversions import frame_of_message
from tactile_driver.parameters.drivers import DUAL_CAMERA_PARAMETERS
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_driver.camera.pairs import Pairer

from ...bags.stamped import TRUTH, find_prefix
from ...bags.stitched_bag import VIEWS
from ...calibration.files.format import CalibrationFile, Specimen, write_calibration
from ...calibration.stitching import SIDES, StitchingFit, fit_stitching
from ...errors import BadCalibration, BadFrame, BadRecording
from ...markers.view.sensor import MarkerSensor
from ...nodes.messages import conversions as convert
from ...parameters.file import read_parameters
from ...parameters.touchpad import DOT_PARAMETERS

_TRIES = 5  # chosen: untouched pairs tried before the fit is given up
Matrices = tuple[np.ndarray, np.ndarray] | None


def find_stitching(bags: list[Path], params: Path, sensor: MarkerSensor, namespace: str) -> StitchingFit | None:
    """Fit the stitching to the first usable untouched pair of the bags; None when no bag has both views.

    A pair is untouched when ground_truth/contacts is empty or not recorded. Raises BadCalibration, with the reasons, without a usable pair.
    """
    if not sensor.is_sheet:
        return None
    dots = read_parameters(params, 'dot_tracker_node', DOT_PARAMETERS)
    skew = read_parameters(params, 'dual_camera_node', DUAL_CAMERA_PARAMETERS)['max_skew']
    reasons = []
    for bag in bags:
        for pair, cameras in _untouched(bag, namespace, skew):
            try:
                return fit_stitching((pair.left.image, pair.right.image), cameras, sensor, dots['polarity'], dots['detection'])
            except (BadFrame, BadCalibration) as error:
                reasons.append(f'{bag.name}: {error}')
            if len(reasons) >= _TRIES:
                break
    if reasons:
        raise BadCalibration('no stitching from untouched pairs: ' + '; '.join(dict.fromkeys(reasons)))
    return None


def _untouched(bag: Path, namespace: str, skew: float) -> Iterator[tuple[PairFrame, tuple[Matrices, Matrices]]]:
    """Yield untouched pairs, and the matrices of their cameras."""
    pairer, cameras = Pairer(int(skew * 1e9)), {}
    with BagReader(bag) as reader:
        try:
            prefix = find_prefix(reader.topics, namespace, VIEWS[0])
        except BadRecording:
            return
        free = _free_stamps(reader, prefix)
        sides = {prefix + view: side for side, view in enumerate(VIEWS)}
        infos = {f'{prefix}{name}/camera_info': side for side, name in enumerate(SIDES)}
        for raw in reader.messages({*sides, *infos}):
            message = decode(raw.data, raw.type_name)
            if raw.topic in infos:
                cameras[infos[raw.topic]] = convert.camera_matrices(message)
                continue
            pairer.add(sides[raw.topic], frame_of_message(message, 'image'))
            yield from _taken(pairer, free, cameras)
        yield from _taken(pairer, free, cameras, last=True)


def _taken(pairer: Pairer, free: set | None, cameras: dict, last: bool = False):
    while (pair := pairer.take(last)) is not None:
        if free is None or pair.left.stamp_ns in free:
            yield pair, (cameras.get(0), cameras.get(1))


def _free_stamps(reader: BagReader, prefix: str) -> set[int] | None:
    """Stamps, ns, without contact; None for a recording without ground truth."""
    if prefix + TRUTH not in reader.topics:
        return None
    found = (decode(raw.data, raw.type_name) for raw in reader.messages({prefix + TRUTH}))
    return {m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in found if not m.contacts}


def tell_truth(bags: list[Path], namespace: str) -> bool:
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
