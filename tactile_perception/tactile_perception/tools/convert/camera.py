# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reads the recording of a camera sensor: a folder with sensor.json (geometry, material), frames/*.webp or .png (frames_left, frames_right
with two cameras) and truth.npz (true positions, states, loads).
"""
from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple
from zipfile import BadZipFile

import cv2
import numpy as np

from tactile_driver.frame import CameraCalibration, Frame, pinhole_calibration
from tactile_driver.frame_names import optical_frame
from tactile_driver.nodes.messages.conversions import calibration_to_message, camera_transforms, header_of, image_to_message
from tactile_driver.nodes.messages.ground_truth import TouchNumbers, recorded_truth
from tactile_driver.simulation.truth import SLIPPING, Touch, TruthFrame, slip_state_of
from tactile_driver.sources.source import FIRST_S

from ...common.marker_sensor import MARKER_SENSORS
from ...core.errors import BadRecording
from ...dots.parameters import DOT_PARAMETERS

#: What recordings hold of the ground truth.
KNOWN = 'contacts', 'contact_region', 'slip', 'wrench'
#: Frames averaged for the reference: the parameter's default.
_USUAL_FRAMES = next(one.default for one in DOT_PARAMETERS if one.name == 'reference.frames')


class RecordedView(NamedTuple):
    """Images of one camera. name: '' for a single camera, 'left' or 'right'; camera: its entry in sensor.json; stamps: (T,) s; images:
    T files.
    """

    name: str
    camera: dict
    stamps: np.ndarray
    images: list[Path]

    @property
    def calibration(self) -> CameraCalibration:
        """Of the camera."""
        size = int(self.camera['width']), int(self.camera['height'])
        return pinhole_calibration(self.camera['K'], self.camera['dist_k1_k2_p1_p2_k3'], size)


class Recording:
    """A recording, read on demand. Raises BadRecording for a missing or damaged file.

    path: the folder; sensor: content of sensor.json; stamps: (T,) s; views: one, or left and right.
    """

    def __init__(self, folder: str | Path):
        self.path = Path(folder)
        self.sensor = self._read('sensor.json', lambda path: json.loads(path.read_text()))
        self._truth = self._read('truth.npz', read_arrays)
        self.stamps = self._truth['timestamps']
        cameras, self._interval = self.sensor['cameras'], float(self.sensor['frame_interval_s'])  # s, between frames
        names = [''] if len(cameras) == 1 else [camera['name'] for camera in cameras]
        self.views = [self._view(name, camera) for name, camera in zip(names, cameras)]

    def __len__(self) -> int:
        return len(self.stamps)

    def _view(self, name: str, camera: dict) -> RecordedView:
        folder = f'frames_{name}' if name else 'frames'
        images = sorted(p for p in self._file(folder).iterdir() if p.suffix in ('.webp', '.png', '.bmp'))
        stamps = self._truth.get(f'timestamps_{name}', self.stamps)
        if not len(images) == len(stamps) == len(self.stamps):
            raise BadRecording(f'recording {self.path}: {len(images)} images in {folder}/ but {len(stamps)} stamps in truth.npz')
        return RecordedView(name, camera, stamps, images)

    def _file(self, name: str) -> Path:
        path = self.path / name
        if not path.exists():
            raise BadRecording(f'recording {self.path}: {name} is missing; convert_recording --help describes the folder')
        return path

    def _read(self, name: str, read: Callable[[Path], dict]) -> dict:
        path = self._file(name)
        try:
            return read(path)
        except (OSError, ValueError, BadZipFile) as error:
            raise BadRecording(f'recording {self.path}: {name} cannot be read: {error}') from error

    def image(self, index: int, view: int = 0) -> np.ndarray:
        """Frame index of a view as (height, width, 3) uint8 BGR."""
        path = self.views[view].images[index]
        image = cv2.imread(str(path), cv2.IMREAD_COLOR)
        if image is None:
            raise BadRecording(f'recording {self.path}: {path.name} cannot be decoded as an image')
        return image

    def messages(self, frame_id: str) -> Iterator[tuple[int, str, object]]:
        """Yield (stamp in ns, topic, message) in order: camera_info and image of each view with its own stamp, and the ground truth of the
        frame, as from a simulated sensor."""
        numbers, shift = TouchNumbers(), FIRST_S if self.stamps[0] < FIRST_S else 0.0
        for index, stamp in enumerate(self.stamps):
            for k, view in enumerate(self.views):
                stamp_ns, prefix = round((view.stamps[index] + shift) * 1e9), view.name and view.name + '/'
                header = header_of(stamp_ns, optical_frame(frame_id, view.name))
                yield stamp_ns, prefix + 'camera_info', calibration_to_message(view.calibration, header)
                yield stamp_ns, prefix + 'image_raw', image_to_message(Frame(self.image(index, k), stamp_ns, 'bgr8'), '', header)
            stamp_ns, truth = round((stamp + shift) * 1e9), self.truth(index)
            yield from recorded_truth(truth, numbers, self._interval, header_of(stamp_ns, frame_id), KNOWN)

    def parameters(self) -> dict[str, object]:
        """Name -> value of the sensor's parameters; the frames before the first contact, the usual number at most, make the reference."""
        untouched = int(np.argmax(np.append(self._truth['contact_area'] > 0, True)))
        return sensor_parameters(self.sensor) | {'reference.frames': int(np.clip(untouched, 1, _USUAL_FRAMES))}

    def transforms(self, frame_id: str) -> list:
        """TransformStamped of the cameras in the sensor frame, named as the driver of a live sensor names them."""
        return camera_transforms(frame_id, {view.name: _pose(view.camera) for view in self.views})

    def truth(self, index: int) -> TruthFrame:
        """Ground truth of frame index, with dots in the first view; unknown values are NaN."""
        truth = {name: values[index] for name, values in self._truth.items() if len(values) == len(self.stamps)}
        outlines, holes = self._loops(index)
        touched = truth['contact_area'] > 0  # true also for a tip between two dots that touches neither
        fraction = float((truth['dot_state'][truth['dot_contact']] == SLIPPING).mean()) if truth['dot_contact'].any() else np.nan
        return TruthFrame(
            dot_id=self._ids,
            dot_uv=truth['uv' if self.views[0].name == '' else f'uv_{self.views[0].name}'].astype(float),
            dot_xyz=truth['dot_xyz'].astype(float),
            dot_state=truth['dot_state'].astype(np.uint8),
            outlines=outlines,
            holes=holes,
            area=float(truth['contact_area']),
            centroid=truth['contact_centroid'].astype(float),
            contacts=self._touches(truth) if touched else [],
            slip_state=slip_state_of(np.nan_to_num(fraction)),
            slipping_fraction=fraction,
            velocity=self._twist(truth) if touched else np.full(6, np.nan),
            motion=_motion(truth) if touched else np.full(6, np.nan),
            wrench=np.concatenate([truth['force'], truth['moment_sensor']]).astype(float),
            pressure=float(truth['pressure']),
        )

    @property
    def _ids(self) -> np.ndarray:
        row, column = (self._truth['dot_rc'] - self._truth['dot_rc'].min(axis=0)).T
        return row * (int(column.max()) + 1) + column

    def _loops(self, index: int) -> tuple[list, list]:
        start, xyz = self._truth['loop_start'], self._truth['loop_xyz'].astype(float)
        mine = np.flatnonzero(self._truth['loop_frame'] == index)
        loops = [(bool(self._truth['loop_is_hole'][k]), xyz[start[k]:start[k + 1]]) for k in mine]
        return [loop for hole, loop in loops if not hole], [loop for hole, loop in loops if hole]

    def _twist(self, truth: dict) -> np.ndarray:
        """Twist (6,), m/s and rad/s, of the object relative to the dots, at the sensor's origin.

        It is the least-squares fit to the slip of the touched dots; NaN without touched dots.
        """
        touched = truth['dot_contact']
        if not touched.any():
            return np.full(6, np.nan)
        slip, position = truth['dot_slip'][touched].astype(float), truth['dot_xyz'][touched].astype(float)
        if not slip.any():
            return np.zeros(6)
        blocks = np.zeros((len(position), 3, 6))
        blocks[:, :, :3] = np.eye(3)
        for axis in range(3):
            blocks[:, :, 3 + axis] = np.cross(np.eye(3)[axis], position)
        return np.linalg.lstsq(blocks.reshape(-1, 6), -slip.ravel() / self._interval, rcond=None)[0]

    def _touches(self, truth: dict) -> list[Touch]:
        """One touch per tool; of a round tool, pressed at known positions or on any sheet or dome, the position is that of its tip."""
        parts = np.flatnonzero(truth['part_area'] > 0)
        if len(parts) > 1:
            return [_touch(truth['part_centroid'][k], truth['part_depth'][k], truth['part_force'][k]) for k in parts]
        round_tool = self.sensor.get('static') or self.sensor['sensor'] in MARKER_SENSORS
        position = truth['obj_p'] if round_tool else truth['contact_centroid']
        return [_touch(position, truth['depth'], truth['force'])]


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """All arrays of an .npz file."""
    with np.load(path) as stored:
        return {name: stored[name] for name in stored.files}


def _touch(position, depth, force) -> Touch:
    return Touch(np.asarray(position, float), np.full(3, np.nan), float(depth), float(-force[2]))


def _motion(truth: dict) -> np.ndarray:
    """(6,) m, rad: displacement of the tool since the previous frame, at the sensor's origin."""
    now, turn = truth['obj_p'].astype(float), truth['obj_rotvec'].astype(float)
    return np.concatenate([now - cv2.Rodrigues(turn)[0] @ (now - truth['obj_disp']), turn])


def _pose(camera: dict) -> tuple[list[float], list[float]]:
    rotation = cv2.Rodrigues(np.array(camera['R_cam_from_sensor'], float))[0].ravel()
    return rotation.tolist(), [float(x) for x in camera['t_cam_from_sensor']]


def sensor_parameters(sensor: dict) -> dict[str, object]:
    """Name -> value of the parameters that sensor.json contains."""
    camera = sensor['cameras'][0]
    rows, columns = (int(n) + 1 for n in np.ptp(sensor['dots']['row_col'], axis=0))
    pose = dict(zip(('camera.rotation', 'camera.translation'), _pose(camera)))
    info, found = sensor['info'], {'sensor_type': sensor['sensor'], 'rows': rows, 'columns': columns, **pose}
    if sensor['sensor'] == 'touchpad':
        names = {'cap.curvature_radius': 'curvature_radius', 'cap.height': 'cap_height',
                 'membrane.shear_stiffness': 'shear_modulus_times_thickness', 'membrane.rest_pressure': 'rest_gauge_pressure'}
        return found | {name: float(info[key]) for name, key in names.items()}
    found |= {'pitch': _pitch(sensor['dots']), 'polarity': 'bright', 'detection': 'blobs'}
    if 'size' in info:
        return found | {'sheet_size': [float(x) for x in info['size']]}
    return found | {'sheet_size': [0.0, 0.0], 'dome.rim_radius': float(info['base_radius']), 'dome.height': float(info['dome_height'])}


def _pitch(dots: dict) -> list[float]:
    """Nominal pitch along rows and along columns, m."""
    positions = {tuple(rc): np.array(xyz, float) for rc, xyz in zip(dots['row_col'], dots['rest_xyz_nominal'])}
    pitch = []
    for step in ((0, 1), (1, 0)):
        nexts = ((position, positions.get((rc[0] + step[0], rc[1] + step[1]))) for rc, position in positions.items())
        pitch.append(round(float(np.median([np.linalg.norm(after - position) for position, after in nexts if after is not None])), 7))
    return pitch
