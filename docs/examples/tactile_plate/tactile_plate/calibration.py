# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibrates the plate: the force of one count, from known loads."""
import numpy as np

from tactile_driver.nodes.messages.images import grey_to_array
from tactile_perception.bags.stamped import TRUTH, pairs_of
from tactile_perception.core.calibration_file import CalibrationFile, Specimen, write_calibration
from tactile_perception.core.errors import BadCalibration
from tactile_perception.core.parameter_files import read_parameters

from .stage import PARAMETERS


def calibrate_plate(bags, params, output, namespace='', serial=''):
    """Fit newtons per count to recordings of known loads (ground_truth/contacts), write the file, and return a report.

    Raises BadCalibration for recordings without an unloaded frame or without loads.
    """
    values = read_parameters(params, 'plate_node', PARAMETERS)
    counts, forces = [], []
    for bag in bags:
        for _, found in pairs_of(bag, namespace, ('image_raw', TRUTH), lambda _camera_info: None):
            counts.append(float(grey_to_array(found['image_raw'], 'plate').sum(dtype=float)))
            forces.append(sum(contact.force for contact in found[TRUTH].contacts))
    counts, forces = np.array(counts), np.array(forces)
    if not (forces > 0).any() or not (forces == 0).any():
        raise BadCalibration('the recordings need frames with a known load and frames without any')
    counts -= counts[forces == 0].mean()
    newtons = float(counts @ forces / (counts @ counts))
    rms = float(np.sqrt(np.mean((newtons * counts - forces) ** 2)))
    write_calibration(output, CalibrationFile(
        'plate', {'newtons_per_count': 'N'}, {'newtons_per_count': newtons}, {'force_rms': rms},
        {'force': [float(forces.min()), float(forces.max())]}, serial=serial, parameters=Specimen(serial, values).parameters('plate')))
    return f'{len(forces)} frames: {newtons:.4g} N per count, error {rms:.3g} N RMS'
