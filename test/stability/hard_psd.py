# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The PSD finger and the filters of its results as functions of arrays."""
from __future__ import annotations

import copy
import functools

import numpy as np
from hard_engine import Estimator
from tactile_bringup.installed import share
from tactile_driver.simulation.psd.scene import open_psd_scene
from tactile_perception._core.finger import SphereFilter
from tactile_perception.finger.map import MIX, angles, direction, exp_map, log_map, position
from tactile_perception.finger.model import read_psd
from tactile_perception.finger.parameters import PsdFinger
from tactile_perception.finger.published import fit_equidistant_map, paper_finger
from tactile_perception.press.estimate import TouchEstimate
from tactile_perception.press.estimator import TouchTracker

PERIOD, VOLT, REST = 1e-3, 5 / 4096, 400
THRESHOLD = 0.15  # V, of the published method


@functools.cache
def model():
    """Of the simulated finger, as it ships."""
    return read_psd(share('calibration', 'psd_finger_sim.yaml'))


@functools.cache
def _begun(method):
    made = PsdFinger(model()) if method == 'map' else paper_finger(model(), THRESHOLD)
    made.detect(scene()[0][:REST], PERIOD)
    return made


def finger(method='map'):
    """A finger of that method whose reference has been taken."""
    return copy.deepcopy(_begun(method))


@functools.cache
def scene(name='grid', count=1500):
    """(volts (N, 4), truth) of the first samples of a scene."""
    counts, truth = open_psd_scene(name, 1 / PERIOD, 0).play(0, count)
    return counts * VOLT, truth


def _press():
    volts, truth = scene()
    touching = np.flatnonzero(truth.touching > 0)
    first = touching[touching > REST][0]
    return {'volts': volts[first - 30:first + 200]}


def reported(made, volts):
    """Normal of the last contact in samples, and how many were in contact; NaN and 0 where there was none."""
    samples = made.detect(volts, PERIOD)
    runs = [run for run in samples.runs() if samples.contact[slice(*run)].any()]
    if not runs:
        return {'normal': np.full(3, np.nan), 'spread': np.full((3, 3), np.nan)}
    touch = made.touch(samples, *runs[-1])
    return {'normal': touch.normal, 'spread': touch.covariance}


def _run(method):
    return lambda inputs: reported(finger(method), inputs['volts'])


def _places():
    theta = np.linspace(0.0, 1.0, 20)
    normal = direction(2.4 * np.arange(20), theta)
    return {'place': log_map(normal) / 1.4 + [0.03, -0.02], 'normal': normal}


def _paper_map(inputs):
    found, _ = fit_equidistant_map(inputs['place'], inputs['normal'])
    return {'offset': found.offset, 'beta': found.beta}


def _way():
    return {'normal': direction(np.linspace(3.0, 3.3, 40), np.linspace(-0.3, 0.4, 40))}


def _filtered(inputs):
    smooth = SphereFilter(20.0)
    for normal in np.asarray(inputs['normal'], float):
        found, spread = smooth.update(normal, 1e-4 * (np.eye(3) - np.outer(normal, normal)), PERIOD)
    return {'normal': found, 'spread': spread}


def _drag():
    way = np.linspace(0, 1, 30)
    return {'position': np.column_stack([0.01 * way, -0.005 * way, -2e-3 - 1e-3 * way])}


def _tracked(inputs):
    tracker = TouchTracker()
    for k, position_ in enumerate(inputs['position']):
        touch = TouchEstimate(position_, -position_[2], 1e-8 * np.eye(3), 1e-4)
        found, = tracker.process([touch], 0.01 * k)
    return {'position': found.estimate.position, 'spread': found.estimate.covariance}


PSD = {
    'PSD map': Estimator(_press, _run('map'), ('volts',), single=1e-4),
    'PSD paper': Estimator(_press, _run('paper'), ('volts',), single=1e-4),
    'PSD place': Estimator(lambda: {'volts': _press()['volts'] - scene()[0][:REST].mean(axis=0)},
                           lambda i: {'place': position(i['volts'] @ MIX)}, ('volts',), ('volts',), ('place',), each=True, single=1e-3),
    'PSD paper map fit': Estimator(_places, _paper_map, ('place',), ('place', 'normal'), sizes={'offset': 1, 'beta': -1}),
    'sphere, angles': Estimator(_way, lambda i: {'there and back': exp_map(log_map(i['normal'])),
                                 'theta': angles(i['normal'])[1]}, ('normal',),
                                ('normal',), ('there and back', 'theta'), each=True),
    'sphere filter': Estimator(_way, _filtered, ('normal',)),
    'touch filter': Estimator(_drag, _tracked, ('position',), sizes={'position': 1}),
}
