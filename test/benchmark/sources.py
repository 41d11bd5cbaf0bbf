# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Images of a touchpad with ground truth, from recordings and from simulated scenes, in one form."""
from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from tactile_driver.parameters.table import defaults
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_perception.calibration.files.touchpad import write_touchpad
from tactile_perception.calibration.sphere_presses import Press
from tactile_perception.calibration.touchpad import fit_touchpad
from tactile_perception.errors import BadArgument
from tactile_perception.parameters.touchpad import DOT_PARAMETERS
from tactile_perception.dots.tracker import make_tracker
from tactile_perception.tools.calibrate.touchpad import chosen
from tactile_perception.tools.convert.camera import Recording
from tactile_perception.tools.convert.command import sensor_parameters
from tactile_perception.touchpad.sensor import Touchpad

SCENE = 'scene:'
FIRST_STAMP = 1.0  # s; in ROS, a stamp of zero often means no time
_SCENE_RATE = 15.0
_FROM = 1.2  # s; scenes are untouched for 1.5 s, of which a few frames suffice
CALIBRATION_RADIUS = 0.008  # m, of the sphere in the recording tp_calib and in the scene sphere_calibration


@dataclass
class Source:
    """One touchpad seen for a while.

    parameters: of the sensor, by name; matrix (3, 3), distortion (5,): of its camera; stamps: (T,) s; image(k): frame k, BGR; truth:
    dot_contact, dot_state (T, K), dot_gap, dot_slip (T, K, 3), dot_xyz (T, K, 3), loop_* as recordings have them, force (T, 3) N, residual
    (T,) N, touches: a list a frame. calibration: the source that this touchpad can be calibrated with.
    """

    parameters: dict
    matrix: np.ndarray
    distortion: np.ndarray
    stamps: np.ndarray
    image: Callable[[int], np.ndarray]
    truth: dict
    calibration: str

    def frames(self, most: int = 0) -> Iterator[tuple[float, np.ndarray]]:
        """(stamp s, image) of each frame, of the first `most` where that is not 0."""
        for k in range(min(most or len(self.stamps), len(self.stamps))):
            yield float(self.stamps[k]), self.image(k)


def open_source(name: str, rate: float = _SCENE_RATE, seed: int = 3, size: tuple[int, int] = (640, 480)) -> Source:
    """The recording of that name, or scene:NAME at rate, with that seed and size, px. Raises BadArgument where there is none."""
    if name.startswith(SCENE):
        return _scene(name.removeprefix(SCENE), rate, seed, size)
    return _recording(Recording(recording_folder(name)))


def recording_folder(name: str) -> Path:
    """Folder of a simulated recording. Raises BadArgument where TACTILE_RECORDINGS does not lead to it."""
    folder = Path(os.environ.get('TACTILE_RECORDINGS', '')) / 'simulated' / name
    if not os.environ.get('TACTILE_RECORDINGS') or not (folder / 'truth.npz').exists():
        raise BadArgument(f'no recording {name}: set TACTILE_RECORDINGS to the folder that holds simulated/{name}')
    return folder


def _recording(recording: Recording) -> Source:
    with np.load(recording.path / 'truth.npz') as stored:
        truth = {name: stored[name] for name in stored.files}
    truth['touches'] = [recording.truth(k).contacts for k in range(len(recording))]
    camera = recording.views[0].camera
    return Source(sensor_parameters(recording.sensor), np.array(camera['K'], float), np.array(camera['dist_k1_k2_p1_p2_k3'], float),
                  recording.stamps + FIRST_STAMP, recording.image, truth, 'tp_calib')


def scene_parameters(scene) -> dict[str, object]:
    """Name -> value of the sensor's parameters of a simulated scene."""
    camera, skin = scene.camera, scene.membrane
    return {'rows': scene.rows, 'columns': scene.columns, 'cap.curvature_radius': float(skin.radius), 'cap.height': float(skin.height),
            'membrane.shear_stiffness': float(skin.tension), 'membrane.rest_pressure': float(skin.pressure),
            'camera.rotation': cv2.Rodrigues(camera.rotation)[0].ravel().tolist(), 'camera.translation': camera.translation.tolist()}


def _scene(name: str, rate: float, seed: int, size: tuple[int, int]) -> Source:
    scene = open_scene(name, rate=rate, seed=seed, width=size[0], height=size[1])
    numbers = range(int(_FROM * rate), scene.frames)
    seen = [scene.observe(k).truth for k in numbers]
    state = np.array([t.dot_state for t in seen])
    truth = {'dot_contact': state > 0, 'dot_state': state, 'dot_xyz': np.array([t.dot_xyz for t in seen]),
             'dot_gap': np.array([t.dot_gap for t in seen]), 'dot_slip': np.where(state == 2, 1.0, 0.0)[..., None] * np.ones(3),
             'force': np.array([t.wrench[:3] for t in seen]), 'residual': np.zeros(len(seen)),
             'touches': [t.contacts for t in seen], **_loops(seen)}
    camera = scene.camera
    return Source(scene_parameters(scene), camera.matrix, camera.distortion, np.array(numbers) / rate + FIRST_STAMP,
                  lambda k: scene.render(numbers[k] / rate).image, truth, 'scene:sphere_calibration')


def _loops(seen: list) -> dict[str, np.ndarray]:
    """Outlines and holes of all frames in the recordings' flat form."""
    loops = [(k, loop) for k, truth in enumerate(seen) for loop in truth.outlines + truth.holes]
    return {'loop_start': np.cumsum([0] + [len(loop) for _, loop in loops]), 'loop_frame': np.array([k for k, _ in loops], int),
            'loop_xyz': np.concatenate([loop for _, loop in loops] or [np.zeros((0, 3))])}


def calibrate(name: str, out: Path, rate: float = 5.0, seed: int = 3) -> Path:
    """Fit the calibration to a source of presses of a sphere at known places; out/NAME.yaml, where it is written."""
    source = open_source(name, rate, seed)
    values = {**defaults(DOT_PARAMETERS), **source.parameters}
    sensor = Touchpad.from_parameters(values)
    camera = sensor.camera(source.matrix, source.distortion)
    tracker, presses = make_tracker(sensor, values), []
    for (stamp, image), touches in zip(source.frames(), source.truth['touches']):
        tracks = tracker.process(image, stamp)
        presses.append(Press(image, tracks, touches[0].position, touches[0].depth) if touches else Press(image, tracks))
    found = fit_touchpad(chosen(presses), camera, CALIBRATION_RADIUS, sensor.cap)
    out.mkdir(parents=True, exist_ok=True)
    path = out / f'{name.removeprefix(SCENE)}.yaml'
    write_touchpad(path, found, source.image(0).shape[1::-1])
    return path
