# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Marker sheets and cushions for calibration and test of contact methods: bags of recordings and of simulated scenes, in one form."""
from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from tactile_bringup.installed import share
from tactile_bringup.simulate.camera import write_scene
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.simulation.sensors.scenes import open_dual_scene
from tactile_driver.stitching.calibration import Stitching
from tactile_driver.stitching.methods import Stitcher, make_stitcher
from tactile_perception.bags.stamped import TRUE_WRENCH, TRUTH, pairs_of
from tactile_perception.bags.stitched_bag import bag_opener
from tactile_perception.press.stitching import fit_stitching
from tactile_perception.dots.tracker import DotTracker
from tactile_perception.errors import BadArgument
from tactile_perception.press.sensor import MARKER_SENSORS, MarkerSensor
from tactile_perception.nodes.messages import conversions as convert
from tactile_perception.tools.convert.camera import Recording
from tactile_perception.tools.convert.command import convert as convert_folder, sensor_parameters

RECORDINGS = {'as': 'areal_single', 'ad': 'areal_dual', 'ac': 'air_cushion'}
_CALIBRATION_RATE, _TEST_RATE = 3.0, 4.0  # Hz, of scenes


@dataclass(frozen=True)
class Source:
    """One sensor. type: of sensor; calibration: bag of presses to fit to; tests: bags to judge on; parameters: file of them; moving:
    whether a place that changes from frame to frame is a drag (recordings hold single presses)."""

    name: str
    type: str
    calibration: Path
    tests: list[Path]
    parameters: Path
    moving: bool

    def with_detection(self, detection: str) -> Path:
        """The parameter file with another method that finds markers; '' for that of the file itself."""
        if not detection:
            return self.parameters
        page = yaml.safe_load(self.parameters.read_text())
        for section in page.values():
            if 'detection' in section['ros__parameters']:
                section['ros__parameters']['detection'] = detection
        path = self.parameters.with_name(f'{self.parameters.stem}_{detection}.yaml')
        path.write_text(yaml.safe_dump(page))
        return path


@dataclass(frozen=True)
class Frame:
    """image: (H, W, 3) or (H, W) uint8; stamp: s; contacts: list of (position (3,) m, depth m); wrench: (6,) N and N m, NaN unknown."""

    image: np.ndarray
    stamp: float
    contacts: list
    wrench: np.ndarray


def open_source(name: str, folder: Path) -> Source:
    """The source as, ad or ac (recordings, found by TACTILE_RECORDINGS) or the simulated areal_single, areal_dual or air_cushion; bags
    are made in folder, those that are there already are taken. Raises BadArgument where there is none of that name."""
    folder = folder / name
    folder.mkdir(parents=True, exist_ok=True)
    if name in RECORDINGS:
        return _recorded(name, folder)
    if name in MARKER_SENSORS:
        return _simulated(name, folder)
    raise BadArgument(f'no source {name!r}; choose one of {", ".join([*RECORDINGS, *MARKER_SENSORS])}')


def recording_folder(name: str) -> Path:
    """Folder of a recording. Raises BadArgument where TACTILE_RECORDINGS does not lead to it."""
    folder = Path(os.environ.get('TACTILE_RECORDINGS', '')) / 'simulated' / name
    if not os.environ.get('TACTILE_RECORDINGS') or not (folder / 'truth.npz').exists():
        raise BadArgument(f'no recording {name}: set TACTILE_RECORDINGS to the folder that holds simulated/{name}')
    return folder


def _recorded(name: str, folder: Path) -> Source:
    bags = []
    for part in ('calib_small', 'test'):
        recording = Recording(recording_folder(f'{name}_{part}'))
        bags.append(folder / part)
        if not bags[-1].exists():
            convert_folder(recording, bags[-1], RECORDINGS[name])
    parameters = folder / 'parameters.yaml'
    parameters.write_text(yaml.safe_dump({'/**': {'ros__parameters': sensor_parameters(recording.sensor)}}))
    return Source(name, RECORDINGS[name], bags[0], bags[1:], parameters, False)


def _simulated(name: str, folder: Path) -> Source:
    scenes = {'calibration': _CALIBRATION_RATE, 'test': _TEST_RATE, 'two': _TEST_RATE}
    for scene, rate in scenes.items():
        if not (folder / scene).exists():
            write_scene(folder / scene, f'{name}_{scene}', rate)
    parameters = folder / 'parameters.yaml'
    parameters.write_text(Path(share('params', f'{name}_sim.yaml')).read_text())
    return Source(name, name, folder / 'calibration', [folder / 'test', folder / 'two'], parameters, True)


class Frames:
    """The frames of a bag with their truth, the two views of one stitched; matrices: K and distortion, once a frame has come."""

    def __init__(self, bag: Path, parameters: Path, stitching: Stitching | None):
        self._bag, self._open = bag, bag_opener(parameters, stitching)
        self.matrices = None

    def __iter__(self) -> Iterator[Frame]:
        for _, found in pairs_of(self._bag, '', ('image_raw', TRUTH), self._take_camera, open_bag=self._open):
            contacts = [(np.array([c.position.x, c.position.y, c.position.z]), c.depth) for c in found[TRUTH].contacts]
            image = found['image_raw']
            yield Frame(image_to_array(image), convert.stamp_seconds(image.header), contacts, _wrench(found.get(TRUE_WRENCH)))

    def _take_camera(self, message) -> None:
        self.matrices = convert.camera_matrices(message)


def _wrench(message) -> np.ndarray:
    if message is None:
        return np.full(6, np.nan)
    force, torque = message.wrench.force, message.wrench.torque
    return np.array([force.x, force.y, force.z, torque.x, torque.y, torque.z])


@dataclass(frozen=True)
class Pair:
    """Two untouched views of a sheet. images: left, right; cameras: K and distortion of each; id: (K,) numbers of the markers; places:
    (K, 2) m, where they truly are."""

    images: tuple[np.ndarray, np.ndarray]
    cameras: tuple
    id: np.ndarray
    places: np.ndarray


def untouched_pair(name: str) -> Pair:
    """Of the recording ad_test (name ad) or the simulated sheet of two cameras. Raises BadArgument where there is no such recording."""
    if name == 'ad':
        recording = Recording(recording_folder('ad_test'))
        first = next(k for k in range(len(recording)) if not recording.truth(k).contacts)
        truth = recording.truth(first)
        cameras = tuple((np.array(view.camera['K'], float), np.array(view.camera['dist_k1_k2_p1_p2_k3'], float))
                        for view in recording.views)
        return Pair((recording.image(first, 0), recording.image(first, 1)), cameras, truth.dot_id, truth.dot_xyz[:, :2])
    scene = open_dual_scene('areal_dual_rest')
    left, right, truth = scene.render(0.0)
    cameras = tuple((camera.matrix, camera.distortion) for camera in scene.cameras)
    return Pair((left, right), cameras, truth.dot_id, truth.dot_xyz[:, :2])


def sensor_of(name: str) -> MarkerSensor:
    """The sheet that untouched_pair shows."""
    if name == 'ad':
        known = sensor_parameters(Recording(recording_folder('ad_test')).sensor)
        return MarkerSensor('areal_dual', known['rows'], known['columns'], tuple(known['pitch']), tuple(known['sheet_size']))
    return MARKER_SENSORS[name]


def stitcher_of(pair: Pair, sensor: MarkerSensor, method: str) -> Stitcher:
    """The stitcher of that name, calibrated by the pair itself."""
    return make_stitcher(method, fit_stitching(pair.images, pair.cameras, sensor).stitching)


def stitch_errors(pair: Pair, sensor: MarkerSensor, stitcher: Stitcher) -> np.ndarray:
    """(N,) m: how far each marker that the stitched picture shows is from where it is, once the picture is shifted, turned and scaled to
    lie on the truth best."""
    tracks = DotTracker(sensor.rows, sensor.columns, 'bright', 'blobs').process(stitcher.stitch(*pair.images), 1.0)
    at = {number: k for k, number in enumerate(pair.id.tolist())}
    true = pair.places[[at[number] for number in tracks.id.tolist()]]
    return np.hypot(*(fitted_to(tracks.uv, true) - true).T)


def fitted_to(places: np.ndarray, others: np.ndarray) -> np.ndarray:
    """places (N, 2) shifted, turned and scaled to lie on others (N, 2) best, in the least squares sense."""
    a, b = (points[:, 0] + 1j * points[:, 1] for points in (places, others))
    off = a - a.mean()
    turned = b.mean() + off * (np.vdot(off, b) / np.vdot(off, off))
    return np.stack([turned.real, turned.imag], axis=1)
