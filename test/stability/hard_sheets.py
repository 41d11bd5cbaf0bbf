# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The contact and wrench methods of sheets and cushion, and the touchpad's methods, as functions of arrays."""
from __future__ import annotations

import copy
import functools
from dataclasses import replace

import dome_scenes
import numpy as np
from hard_engine import Estimator
from pad_rig import RATE, shared_pad
from sheet_rig import PRESSED_AT, Sheet
from tactile_perception.calibration.camera_poses import SideMarkers, fit_sides
from tactile_perception.common.camera import CameraModel
from tactile_perception.common.dots import DotTracks
from tactile_perception.common.geometry import rotation_matrix
from tactile_perception.markers.methods import TOUCH_METHODS, make_method
from tactile_perception.markers.touches.presses import Presses
from tactile_perception.markers.view.marker_field import MarkerField, RestMarkers
from tactile_perception.markers.view.sensor import MARKER_SENSORS
from tactile_perception.pipeline.contact_stage import ContactEstimator
from tactile_perception.touchpad.places import DotPlaces
from tactile_perception.touchpad.sensor import Touchpad

SHIPPED = {'sheet, model': ('areal_single', 'model'), 'cushion, model': ('air_cushion', 'model')}
FITTED = {'sheet, paper': 'paper', 'cushion, paper': 'paper_cushion'}
SINGLE = MARKER_SENSORS['areal_single']
GRID, EYE = SINGLE.grid(), np.array([0.0, 0.0, -0.062])
DUAL_MATRIX = np.array([[420.0, 0, 320], [0, 420, 240], [0, 0, 1]])
PLACE, DEPTH = np.array([0.006, -0.004]), 3.5e-3


@functools.cache
def sheet(kind):
    """(Sheet, tracks of its untouched images and of the pressed one)."""
    rig = Sheet(kind, f'{kind}_press', PRESSED_AT[kind])
    chain = rig.chain()
    return rig, [chain.tracker.process(image, chain._next()) for image in (*rig.rest, rig.pressed)]


def bell_field(place, depth, noise=4e-6, seed=0):
    """The MarkerField of a sheet dented into a Gaussian bell, seen from EYE; growth is that of small squares."""
    def seen(xy):
        down = depth * np.exp(-np.sum((xy - place)**2, axis=1) / (2 * 8e-3**2))
        return xy * (-EYE[2] / (-EYE[2] - down))[:, None]
    rng, h = np.random.default_rng(seed), 1e-5
    shift = seen(GRID) - GRID + rng.normal(0, noise, GRID.shape)
    (a, c), (b, d) = ((seen(GRID + step) - seen(GRID - step)).T / (2 * h) for step in ([h, 0], [0, h]))
    growth = np.log(np.abs(a * d - b * c)) + rng.normal(0, 2e-3, len(GRID))
    return MarkerField(GRID, shift, growth, np.tile(EYE, (len(GRID), 1)), np.full(len(GRID), noise), GRID * 9000, shift * 9000,
                       400 * np.exp(growth))


def _bell_presses():
    pressed = [((x, y), depth) for x in (-18e-3, 0, 18e-3) for y in (-9e-3, 0, 9e-3) for depth in (1.5e-3, 3e-3, 4.5e-3, 6e-3)]
    fields = [bell_field((0, 0), 0.0, seed=k) for k in range(3)] + [bell_field(*one, seed=5 + k) for k, one in enumerate(pressed)]
    position = np.array([[np.nan] * 3] * 3 + [[*place, -depth] for place, depth in pressed])
    count = len(fields)
    return Presses(tuple(fields), position, np.array([0.0] * 3 + [depth for _, depth in pressed]), np.arange(count),
                   np.full((count, 6), np.nan), np.full(count, np.nan))


def method(name):
    """A touch method with the numbers that ship, or fitted to presses of a bell, or of an idealised balloon; it has seen no frame."""
    return copy.deepcopy(_fitted(name))


@functools.cache
def _fitted(name):
    if name in SHIPPED:
        rig, chosen = sheet(SHIPPED[name][0])[0], SHIPPED[name][1]
        return make_method(chosen, rig.calibration.fitted(chosen), rig.sensor)
    made, sensor = TOUCH_METHODS[FITTED[name]], SINGLE if name.startswith('sheet') else dome_scenes.DOME
    presses = _bell_presses() if sensor is SINGLE else dome_scenes.calibration()
    return made.from_fitted(made.fit(presses, sensor), sensor)


def field_of(name, uv=None, duv=None, area=None, sigma=None, id=None):
    """The MarkerField of a pressed frame, some of it replaced."""
    rig, (*rest, pressed) = sheet(SHIPPED[name][0])
    kept = RestMarkers(rig.sensor.rows * rig.sensor.columns, rig.make_view)
    for tracks in rest:
        kept.field(tracks)
    new = [old if value is None else value for old, value in zip((pressed.id, pressed.uv, pressed.area, pressed.sigma, pressed.duv),
                                                                 (id, uv, area, sigma, duv))]
    return kept.field(DotTracks(pressed.rows, pressed.columns, np.asarray(new[0], int), *new[1:]))


def told(touches):
    """What touches tell, arrays without entries where there is none."""
    return {'position': np.array([t.position for t in touches]).reshape(-1, 3), 'depth': np.array([t.depth for t in touches]),
            'spread': np.array([np.sqrt(np.diag(t.covariance)) for t in touches]).reshape(-1, 3),
            'flags': np.array([t.flags for t in touches])}


def track_inputs(name):
    pressed = sheet(SHIPPED[name][0])[1][-1]
    return {'id': pressed.id, 'uv': pressed.uv, 'duv': pressed.duv, 'area': pressed.area, 'sigma': pressed.sigma}


def _touch(name, *spoiled):
    """By tracks; a marker seen elsewhere has moved, so that uv and duv are spoiled alike."""
    return Estimator(lambda: track_inputs(name), lambda inputs: told(method(name).estimate(field_of(name, **inputs))), spoiled,
                     ('id', 'uv', 'duv', 'area', 'sigma'), tolerance=1e-6, single=1e-3)


def _made_up(name):
    return bell_field(PLACE, DEPTH) if name.startswith('sheet') else dome_scenes.dome_field([((0.02, -0.015), 0.025)])


def _field(name, *spoiled):
    """By a field."""
    names = ('shift', 'growth', 'sigma')
    return Estimator(lambda: {part: getattr(_made_up(name), part) for part in names},
                     lambda inputs: told(method(name).estimate(replace(_made_up(name), **inputs))), spoiled, tolerance=1e-6, single=1e-2,
                     kept=0.1)


@functools.cache
def _pad_tracks():
    """Tracks of the untouched and the pressed pad, places and all, by the whole chain on images."""
    pad = shared_pad()
    chain = pad.chain()
    return [chain(image)[0] for image in (*pad.rest[:3], pad.pressed)]


def stage_of_pad(contact='membrane'):
    """A ContactEstimator that has seen the untouched pad until 1.3 s."""
    pad = shared_pad()
    values = pad.values(contact=contact)
    sensor = Touchpad.from_parameters(values)
    stage = ContactEstimator(sensor, sensor.camera(pad.scene.camera.matrix, pad.scene.camera.distortion), values)
    for k, tracks in enumerate(_pad_tracks()[:3]):
        stage.process(tracks, 1.1 + k / RATE)
    return stage


def pad_inputs():
    """The dots of the pressed pad."""
    tracks = _pad_tracks()[-1]
    return {'id': tracks.id, 'uv': tracks.uv, 'duv': tracks.duv, 'area': tracks.area, 'sigma': tracks.sigma, 'xyz': tracks.xyz}


def pad_tracks(inputs):
    """DotTracks of such arrays."""
    i = inputs
    return DotTracks(23, 23, i['id'].astype(int), i['uv'], i['area'], i['sigma'], i['duv'], i['xyz'])


@functools.cache
def _begun_places():
    pad, tracks = shared_pad(), _pad_tracks()
    sensor = Touchpad.from_parameters(pad.values())
    places = DotPlaces(sensor, sensor.camera(pad.scene.camera.matrix, pad.scene.camera.distortion))
    for image, one in zip(pad.rest, tracks[:3]):
        places.locate(image, one)
    return places


def _located(inputs):
    """Places by colour and membrane of the dots of the pressed image."""
    return {'xyz': copy.deepcopy(_begun_places()).locate(shared_pad().pressed, pad_tracks(inputs))}


def _stitched():
    """The markers of a dual sheet as two cameras see them, exactly but for a hundredth of a pixel."""
    rng, found = np.random.default_rng(4), {}
    for name, turn, x in (('left', 0.02, -0.033), ('right', -0.03, 0.033)):
        camera = CameraModel(DUAL_MATRIX, np.zeros(5), rotation_matrix(np.array([0.01, -0.02, turn])), np.array([-x, 0.0, 0.050]))
        grid = MARKER_SENSORS['areal_dual'].grid()
        uv = camera.project(np.column_stack([grid, np.zeros(len(grid))]))
        seen = np.flatnonzero((uv[:, 0] > 0) & (uv[:, 0] < 639))
        found |= {f'{name}_id': seen, name: uv[seen] + rng.normal(0, 0.01, (len(seen), 2))}
    return found


def _fitted_sides(inputs):
    sides = fit_sides([SideMarkers((640, 480), inputs[f'{name}_id'].astype(int), inputs[name], (DUAL_MATRIX, np.zeros(5)))
                       for name in ('left', 'right')], MARKER_SENSORS['areal_dual'].grid())
    return {'eye': np.stack([side.eye for side in sides])}


def _pad(contact, spoiled='xyz'):
    def run(inputs):
        found = stage_of_pad(contact).process(pad_tracks(inputs), 1.5)
        touched = found.region.dot_state > 0
        return {'position': np.array([c.position for c in found.contacts]).reshape(-1, 3),
                'depth': np.array([c.depth for c in found.contacts]), 'area': found.region.area if touched.any() else np.nan,
                'wrench': found.wrench if touched.any() else np.full(6, np.nan)}
    return Estimator(pad_inputs, run, (spoiled,), ('id', 'uv', 'duv', 'area', 'sigma', 'xyz'), tolerance=1e-6, single=1e-2)


SHEETS = {
    'sheet, model': _touch('sheet, model', 'uv', 'duv'), 'sheet, model, areas': _touch('sheet, model', 'area'),
    'sheet, paper': _field('sheet, paper', 'shift'),
    'sheet, paper, growth': _field('sheet, paper', 'growth'),
    'cushion, model': _touch('cushion, model', 'uv', 'duv'), 'cushion, paper': _field('cushion, paper', 'shift'),
    'stitching fit': Estimator(_stitched, _fitted_sides, ('left',), tolerance=1e-6, single=1e-3),
    'pad, places': Estimator(pad_inputs, _located, ('uv', 'duv'), ('id', 'uv', 'duv', 'area', 'sigma', 'xyz'), ('xyz',), tolerance=1e-6,
                             single=1e-3),
    'pad, membrane': _pad('membrane'), 'pad, paper': _pad('paper'),
}
