# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The taxel array's methods as functions of arrays."""
from __future__ import annotations

import cv2
import numpy as np
from hard_engine import Estimator
from tactile_perception.taxel.pressure import SoftPad, TaxelArray
from tactile_perception.taxel.estimator import TaxelEstimator, TaxelSettings
from tactile_perception.taxel.response import Response, fit_response

ARRAY, REST = TaxelArray(44, 44, 1e-3), 3.0
KNOWN = Response((500.0, 0.0, 0.0), known=True)


def bar(load=60.0, centre=(0.4, -0.3), angle=0.3, size=(20.0, 8.0), array=ARRAY, blur=0.8):
    """(rows, columns) of a bar's pressure: centre, size and blur in taxels, drawn fine and blurred as a soft pad would."""
    fine = 12
    y, x = ((np.arange(count * fine) + 0.5) / fine - 0.5 * count for count in array.shape)
    x, y = np.meshgrid(x - centre[0], y - centre[1])
    inside = (np.abs(x * np.cos(angle) + y * np.sin(angle)) < size[0] / 2) & (np.abs(y * np.cos(angle) - x * np.sin(angle)) < size[1] / 2)
    blurred = cv2.GaussianBlur(inside.astype(np.float32), (0, 0), blur * fine, borderType=cv2.BORDER_CONSTANT)
    return load * cv2.resize(blurred, array.shape[::-1], interpolation=cv2.INTER_AREA).astype(float)


def begun(method='mechanics', array=ARRAY, response=KNOWN, frames=8, pad=SoftPad()):
    """An estimator that has seen so many untouched frames, the last at 0 s."""
    estimator = TaxelEstimator(array, pad, TaxelSettings(method=method, response=response))
    for k in range(frames):
        estimator.process(np.full(array.shape, REST), 0.01 * (k - frames + 1))
    return estimator


def told(result):
    """What a result tells; without a contact nothing."""
    contacts = result.contacts
    return {'centroid': result.region.centroid, 'area': result.region.area if contacts else np.nan,
            'orientation': result.region.orientation, 'force': np.array([c.force for c in contacts]),
            'place': np.array([c.position for c in contacts])}


def _run(method):
    return lambda inputs: told(begun(method).process(inputs['image'], 0.01))


def _image():
    return {'image': bar() + REST}


def _weights():
    changes = np.array([bar(load) for load in (10, 20, 40, 60, 80, 100.0)])
    truth = Response((500.0, 0.8, 2000.0), 5.0)
    return {'changes': changes, 'forces': np.array([1e-6 * truth.pressure(change).sum() for change in changes])}


def _fitted(inputs):
    response, predicted = fit_response(inputs['changes'], inputs['forces'], 1e-6)
    return {'scale': np.array(response.scale), 'forces': predicted}


TAXELS = {
    'taxels, mechanics': Estimator(_image, _run('mechanics'), ('image',), single=1e-3),
    'taxels, paper': Estimator(_image, _run('paper'), ('image',), single=1e-3),
    'taxel response fit': Estimator(_weights, _fitted, ('forces',), ('changes', 'forces'), ('forces',), single=1e-3),
}
