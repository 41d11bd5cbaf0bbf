# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""calibrate of force taxels: the force of a reading, from an untouched second and a weight along each axis."""
from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tactile_driver.force_taxels.messages import taxels_of_message
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode

from ..bags.stamped import TRUE_WRENCH, find_prefix
from ..common.progress import progress
from ..common.residuals import Residuals, write_and_report
from ..core.calibration_file import CalibrationFile, Specimen
from ..core.errors import BadCalibration, BadFrame
from ..core.messages import stamp_seconds
from ..core.parameter_files import read_parameters
from .baseline import Baseline
from .calibration import Load, fit_response
from .constants import FORCE_TAXEL
from .parameters import FORCE_NODE, FORCE_PARAMETERS, SENSOR
from .taxels import Taxels

_TOPIC, _TYPE = 'taxels', 'sensor_msgs/msg/PointCloud2'


def calibrate_weights(bags: list[Path], params: Path, output: Path, namespace: str = '', serial: str = '',
                      weight: float | None = None) -> str:
    """Fit the force of a reading to known loads, and write the calibration file.

    Parameters
    ----------
    bags : list of Path
        Recordings of taxels, each of which begins with an untouched second. With ``ground_truth/wrench`` they hold any loads; without, one
        weight each: the first presses along -z, the second pulls along x, the third along y, and so on.
    params, output, namespace, serial
        See `SensorType.calibrate`.
    weight : float
        Force of the weight in N, where no wrench is recorded.

    Returns
    -------
    str
        Report.

    Raises
    ------
    BadCalibration
        If the weight is missing, or the recordings do not determine the response along all axes.
    """
    values = read_parameters(params, FORCE_NODE, FORCE_PARAMETERS)
    directions = np.array([(0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])  # in which the weight acts, a recording each
    loads, left_out, taxels = [], [], None
    for number, bag in enumerate(bags):
        direction = None if weight is None else weight * directions[number % len(directions)]
        taxels, found = read_loads(bag, namespace, direction, left_out)
        loads += found
    matrix, error, errors = fit_response(taxels, loads)
    forces = np.array([load.force for load in loads])
    sizes = np.linalg.norm(forces, axis=1)
    content = CalibrationFile(
        SENSOR, {'matrix': 'N per unit of a reading, along two tangents and inwards', 'error': 'relative'},
        {'matrix': matrix, 'error': error}, {'force_rms_percent': 100 * float(np.sqrt(np.mean(errors**2)))},
        {'force': [float(sizes.min()), float(sizes.max())]}, left_out, serial=serial,
        parameters=Specimen(serial, values).parameters(SENSOR))
    shown = [Residuals('force', '%', 100 * errors, np.column_stack([sizes, 100 * errors]), ('force (N)', 'error (% of it)'),
                       [load.name for load in loads])]
    held_out = 'left out of the fit' if len(loads) > 3 else 'fitted, as there are no others'
    return write_and_report(output, content, shown, [
        f'{len(loads)} loads of {sizes.min():.3g} to {sizes.max():.3g} N',
        f'error of the force of loads that were {held_out}: {100 * np.sqrt(np.mean(errors**2)):.1f} % RMS',
        f'standard deviation of the force of one taxel: {100 * error:.1f} %'])


def read_loads(bag: Path, namespace: str, direction: np.ndarray | None,
               left_out: list[str]) -> tuple[Taxels, list[Load]]:
    """The sensor, and the loads in a recording: stretches of equal force. direction: (3,) N, force of all that touches; None: as recorded.

    Raises BadCalibration without any.
    """
    baseline = taxels = last_s = None
    stretches: list[tuple[np.ndarray, float, list[np.ndarray]]] = []
    for stamp_s, cloud, force in _frames(bag, namespace, direction is None, left_out):
        positions, vectors, normals = cloud
        if taxels is None or not taxels.fits(positions, normals):
            taxels, last_s = Taxels(positions, normals), stamp_s
            baseline = Baseline(len(positions))
        above = baseline.update(taxels.local(vectors), max(stamp_s - last_s, 0.0), stamp_s)
        last_s = stamp_s
        if not baseline.is_known:
            if force is not None and np.linalg.norm(force) > FORCE_TAXEL.min_force:
                raise BadCalibration(f'{bag}: the sensor is loaded within the first {FORCE_TAXEL.reference_s:g} s; leave it untouched '
                                     'for so long')
            continue
        force = force if direction is None else direction * (baseline.touch > 0.5)
        change = FORCE_TAXEL.equal * max(np.linalg.norm(force), FORCE_TAXEL.min_force)
        if not stretches or np.linalg.norm(force - stretches[-1][0]) > change:
            stretches.append((force, stamp_s, []))
        stretches[-1][2].append(taxels.filled(above, baseline.alive)[0])
    loads = [Load(_middle(readings), force, f'{bag.name} at {begin:.2f} s') for force, begin, readings in stretches
             if np.linalg.norm(force) > FORCE_TAXEL.min_force and len(readings) >= FORCE_TAXEL.min_frames]
    if not loads:
        raise BadCalibration(f'{bag}: no load after the first {FORCE_TAXEL.reference_s:g} s, which have to be without one')
    return taxels, loads


def _middle(readings: list[np.ndarray]) -> np.ndarray:
    """Mean of the middle of a load."""
    first, last = (int(part * len(readings)) for part in FORCE_TAXEL.middle)
    return np.mean(readings[first:max(last, first + 1)], axis=0)


def _frames(bag: Path, namespace: str, is_recorded: bool, left_out: list[str]) -> Iterator[tuple]:
    """(stamp in s, arrays of the cloud, force (3,) or None) of each frame. Raises BadCalibration."""
    waiting = None
    with BagReader(bag) as reader:
        prefix = find_prefix(reader.topics, namespace, _TOPIC, _TYPE)
        if is_recorded and prefix + TRUE_WRENCH not in reader.topics:
            raise BadCalibration(f'{bag}: no {prefix}{TRUE_WRENCH}; give the force of the weight in N, as --weight 4.9')
        topics = {prefix + _TOPIC, *((prefix + TRUE_WRENCH,) if is_recorded else ())}
        for raw in progress(reader.messages(topics), f'messages of {bag.name}'):
            message = decode(raw.data, raw.type_name)
            stamp_s = stamp_seconds(message.header)
            if raw.topic == prefix + _TOPIC:
                try:
                    cloud = taxels_of_message(message)
                except BadFrame as error:
                    left_out.append(f'{bag.name} at {stamp_s:.2f} s: {error}')
                    continue
                if not is_recorded:
                    yield stamp_s, cloud, None
                waiting = stamp_s, cloud
            elif waiting is not None and waiting[0] == stamp_s:
                force = message.wrench.force
                yield *waiting, np.array([force.x, force.y, force.z])
