# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Rigid motions, regions and their moments, cameras and surfaces as functions of arrays."""
from __future__ import annotations

import numpy as np
from hard_engine import Estimator
from tactile_driver.stitching.calibration import SideView
from tactile_perception.common.camera import CameraModel
from tactile_perception.common.rigid_motion import fit_rigid, fit_rigid_robust
from tactile_perception.common.geometry import Cap, rotation_matrix
from tactile_perception.common.estimates import planar_twist
from tactile_perception.markers.places.sheet import SheetSurface
from tactile_perception.markers.published.gaussian_peak import grid_point
from tactile_perception.markers.view.marker_field import CameraView
from tactile_perception.markers.view.sensor import MARKER_SENSORS
from tactile_perception.touchpad.contact.region import ContactDots, describe, find_regions
from tactile_perception.touchpad.contact.object_motion import ObjectMotion
from tactile_perception.touchpad.contact.slip import friction_centre
from tactile_perception.touchpad.contact.tracker import ContactTracker

TURN, SHIFT = np.array([0.02, -0.05, 0.3]), np.array([1e-3, -2e-3, 5e-4])
CAP, COUNT, PITCH = Cap(), 23, 1.14e-3
SIGMA = 1e-5
MATRIX = np.array([[600.0, 0, 320], [0, 605, 240], [0, 0, 1]])
DISTORTION = np.array([-0.1, 0.02, 1e-4, -2e-4, 0.0])
CAMERA = CameraModel(MATRIX, DISTORTION, rotation_matrix(np.array([0.02, -0.03, 0.1])), np.array([1e-3, 2e-3, 0.040]))
SHEET = MARKER_SENSORS['areal_single']


def cloud(count=40, seed=0):
    """(count, 3) m, as dots on a pad."""
    return np.random.default_rng(seed).uniform(-4e-3, 4e-3, (count, 3)) + [1e-3, 2e-3, 11e-3]


def _moved():
    p = cloud()
    noise = np.random.default_rng(1).normal(0, SIGMA, p.shape)
    return {'p': p, 'q': p @ rotation_matrix(TURN).T + SHIFT + noise, 'sigma': np.array(SIGMA)}


def _motion(fit):
    return {'turn': fit.rotation_vector, 'shift': fit.translation, 'spread': np.sqrt(np.diag(fit.covariance))[3:]}


def _object_motion(inputs):
    follow = ObjectMotion(5, 8)
    for k, name in enumerate(('p', 'q')):
        count = len(inputs[name])
        dots = ContactDots(5, 8, inputs['id'].astype(int), inputs[name], inputs['p'], np.ones(count), np.ones(count, np.uint8),
                           sigma=float(inputs['sigma']))
        found = follow.process(dots, 0.1 * k)
    return {'shift': found.motion.translation if found.motion else np.full(3, np.nan), 'slip': found.slip}


def _field():
    place = cloud(30)[:, :2]
    return {'place': place, 'velocity': 2e-3 + 0.5 * np.stack([-place[:, 1], place[:, 0]], axis=1)}


def _twist(inputs):
    linear, turn, centre = planar_twist(inputs['place'], inputs['velocity'])
    return {'linear': linear, 'turn': turn, 'centre': centre}


def _friction(inputs):
    centre = friction_centre(inputs['place'], inputs['velocity'])
    return {'centre': np.full(2, np.nan) if centre is None else centre}


def cap_dots():
    """id (K,), rest (K, 3) m: all dots on the untouched cap."""
    row, column = np.divmod(np.arange(COUNT**2), COUNT)
    xy = np.stack([column - COUNT // 2, row - COUNT // 2], axis=1) * PITCH
    return np.arange(COUNT**2), np.column_stack([xy, CAP.heights(xy)])


def _disc():
    """A flat disc of 5 mm radius, 2 mm in the cap."""
    id, rest = cap_dots()
    distance = np.hypot(*(rest[:, :2] - [1e-3, -5e-4]).T) - 5e-3
    xyz = rest.copy()
    xyz[:, 2] = np.where(distance < 0, 0.011, np.minimum(rest[:, 2], 0.011 + 0.6 * distance))
    return {'id': id, 'xyz': xyz, 'rest': rest, 'score': np.clip(0.5 - distance / PITCH, 0, 1), 'sigma': np.array(SIGMA)}


def _region_dots(inputs):
    state = (np.nan_to_num(inputs['score']) > 0.5).astype(np.uint8)
    return ContactDots(COUNT, COUNT, inputs['id'].astype(int), inputs['xyz'], inputs['rest'], inputs['score'], state,
                       sigma=float(inputs['sigma']))


def _region(inputs):
    dots = _region_dots(inputs)
    found = describe(dots, find_regions(dots))
    area = found.area if found.outlines else np.nan
    return {'area': area, 'centroid': found.centroid, 'normal': found.normal, 'axes': np.array([found.major_axis, found.minor_axis]),
            'outline': np.concatenate(found.outlines).min(axis=0) if found.outlines else np.full(3, np.nan)}


def _contact(inputs):
    dots = _region_dots(inputs)
    found = ContactTracker(CAP).process(dots, find_regions(dots))
    return {'position': np.array([c.position for c in found]), 'depth': np.array([c.depth for c in found]),
            'spread': np.array([np.diag(c.position_covariance) for c in found])}


def _pixels():
    rng = np.random.default_rng(3)
    return {'uv': np.column_stack([rng.uniform(20, 620, 50), rng.uniform(20, 460, 50)])}


def _look(inputs):
    seen, _ = CameraView(CAMERA, 0.0).back_project(inputs['uv'])
    return {'xy': seen[:, :2], 'area': seen[:, 2]}


def _side():
    homography = np.column_stack([CAMERA.rotation[:, :2], CAMERA.translation])
    return SideView((640, 480), MATRIX, DISTORTION, homography, CAMERA.centre)


def _rays():
    uv = _pixels()['uv']
    return {'rays': CAMERA.rays(uv)}


def _bell():
    grid = SHEET.grid()
    eye = np.array([0.0, 0.0, -0.062])
    depth = 3e-3 * np.exp(-np.sum((grid - [4e-3, -3e-3])**2, axis=1) / (2 * 8e-3**2))
    return {'place': grid, 'shift': grid * (depth / (0.062 - depth))[:, None], 'eye': np.tile(eye, (len(grid), 1)),
            'size': np.array(SHEET.size), 'depth': depth}


def _sheet_depths(inputs):
    surface = SheetSurface(inputs['place'], SHEET.rows, SHEET.columns, tuple(inputs['size']))
    return {'depth': surface.depths(inputs['place'], inputs['shift'], inputs['eye'])}


def _gaussian_point(inputs):
    shape = SHEET.rows, SHEET.columns
    pitch = tuple(np.ptp(inputs['place'], axis=0) / (np.array(shape[::-1]) - 1))
    found = grid_point(inputs['depth'].reshape(shape), inputs['place'].reshape(*shape, 2), pitch)
    return {'place': np.full(2, np.nan) if found is None else found.place, 'depth': np.nan if found is None else found.depth}


_POINTS = {'p': 1, 'q': 1, 'sigma': 1, 'shift': 1, 'spread': 1, 'slip': 1}
_PATCH = {'xyz': 1, 'rest': 1, 'sigma': 1, 'area': 2, 'centroid': 1, 'axes': 1, 'outline': 1}
GEOMETRY = {
    'rigid fit': Estimator(_moved, lambda i: _motion(fit_rigid(i['p'], i['q'])), ('q',), ('p', 'q'), metres=_POINTS),
    'rigid fit, robust': Estimator(_moved, lambda i: _motion(fit_rigid_robust(i['p'], i['q'], float(i['sigma']))), ('q',), ('p', 'q'),
                                   metres=_POINTS),
    'object motion': Estimator(lambda: _moved() | {'id': np.arange(40)}, _object_motion, ('q',), ('p', 'q', 'id'), ('slip',), _POINTS,
                               single=1e-4),
    'planar twist': Estimator(_field, _twist, ('velocity',), ('place', 'velocity'),
                              metres={'place': 1, 'velocity': 1, 'linear': 1, 'centre': 1}, sizes={'linear': 1, 'turn': 1}),
    'planar twist, places': Estimator(_field, _twist, ('place',), ('place', 'velocity')),
    'friction centre': Estimator(_field, _friction, ('velocity',), ('place', 'velocity'), metres={'place': 1, 'velocity': 1, 'centre': 1}),
    'region': Estimator(_disc, _region, ('xyz',), ('id', 'xyz', 'rest', 'score'), metres=_PATCH, sizes=_PATCH),
    'region, score': Estimator(_disc, _region, ('score',), ('id', 'xyz', 'rest', 'score'), metres=_PATCH),
    'contact': Estimator(_disc, _contact, ('xyz',), ('id', 'xyz', 'rest', 'score')),
    'camera, rays': Estimator(_pixels, lambda i: {'rays': CAMERA.rays(i['uv'])}, ('uv',), ('uv',), ('rays',), each=True),
    'camera, view': Estimator(_pixels, _look, ('uv',), ('uv',), ('xy', 'area'), each=True),
    'homography': Estimator(_pixels, lambda i: {'place': _side().place(i['uv'])}, ('uv',), ('uv',), ('place',), each=True),
    'cap': Estimator(_rays, lambda i: {'xyz': CAP.meet(CAMERA.centre, i['rays'])}, ('rays',), ('rays',), ('xyz',), each=True),
    'sheet surface': Estimator(_bell, _sheet_depths, ('shift',), metres={'place': 1, 'shift': 1, 'eye': 1, 'size': 1, 'depth': 1},
                               sizes={'depth': 1}, tolerance=1e-6, single=1e-3),
    'Gaussian point': Estimator(_bell, _gaussian_point, ('depth',), metres={'place': 1, 'shift': 1, 'eye': 1, 'size': 1, 'depth': 1},
                                sizes={'depth': 1}),
}
