# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""convert_recording: converts a recording of a camera sensor (sensor.json, frames, truth.npz), of a PSD finger or of a taxel array
(meta.json, input.npz, truth.npz) to a bag with ground truth, and writes the parameter file of its sensor beside the bag.
"""
from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import cv2
import numpy as np
import yaml
from tactile_driver.command import tells_errors
from tactile_driver.frame import Frame
from tactile_driver.frame_names import optical_frame
from tactile_driver.nodes.messages.conversions import camera_transforms, header_of, image_to_message, static_transform
from tactile_driver.nodes.messages.ground_truth import TouchNumbers, truth_messages
from tactile_driver.recordings.writer import write_messages

from ...taxel.response import SENSOR as TAXEL_ARRAY
from .camera import KNOWN, Recording
from ...common.progress import progress
from ...nodes.messages.conversions import camera_info_message, description_messages
from ...parameters.touchpad import DOT_PARAMETERS
from ...finger.tools import PsdRecording
from .taxel import TaxelRecording


#: Frames averaged for the reference: the parameter's default.
_USUAL_FRAMES = next(one.default for one in DOT_PARAMETERS if one.name == 'reference.frames')


def open_recording(path: Path) -> Recording | PsdRecording | TaxelRecording:
    """Open the recording of any sensor in a folder or file. Raises BadRecording."""
    meta = path / 'meta.json'
    if path.suffix == '.npz' or meta.exists() and TAXEL_ARRAY in meta.read_text(errors='replace'):
        return TaxelRecording(path)
    return (PsdRecording if meta.exists() else Recording)(path)


def convert(recording: Recording | PsdRecording | TaxelRecording, target: Path, namespace: str) -> int:
    """Write the recording to target, a new bag, with topics under /namespace; returns the number of frames or samples.

    The bag begins with the description of the sensor and the static transforms of its own frames. Raises TactileError.
    """
    messages = iter(_messages(recording, namespace) if isinstance(recording, Recording) else recording.messages(namespace))
    first = next(messages)
    sensor_type, transforms = str(parameters(recording)['sensor_type']), sensor_frames(recording, namespace)
    described = description_messages(first[0], sensor_type, namespace, {'source': 'file', 'path': str(recording.path)}, transforms)
    write_messages(target, namespace, progress(chain(described, [first], messages), 'messages'))
    return len(recording)


def parameters(recording: Recording | PsdRecording | TaxelRecording) -> dict[str, object]:
    """Name -> value of the sensor's parameters that the recording contains; of cameras also the number of frames that make the reference:
    those before the first contact, the usual number at most.
    """
    if not isinstance(recording, Recording):
        return recording.parameters()
    return sensor_parameters(recording.sensor) | {'reference.frames': int(np.clip(recording.untouched, 1, _USUAL_FRAMES))}


def sensor_frames(recording: Recording | PsdRecording | TaxelRecording, frame_id: str) -> list:
    """TransformStamped of the frames of cameras, tip or taxels in the sensor frame, named as the driver of a live sensor names them."""
    if isinstance(recording, Recording):
        return camera_transforms(frame_id, {view.name: _pose(view.camera) for view in recording.views})
    return [static_transform(frame_id, f'{frame_id}_{name}', (0.0, 0.0, z)) for name, z in recording.frames().items()]


def _pose(camera: dict) -> tuple[list[float], list[float]]:
    rotation = cv2.Rodrigues(np.array(camera['R_cam_from_sensor'], float))[0].ravel()
    return rotation.tolist(), [float(x) for x in camera['t_cam_from_sensor']]


def _messages(recording: Recording, frame_id: str) -> Iterator[tuple[int, str, object]]:
    """Yield (stamp in ns, topic, message) in order; the ground truth of a frame follows its image, as from a simulated sensor."""
    numbers = TouchNumbers()
    # Much of ROS takes a stamp of zero for an unknown time.
    shift = 1.0 if recording.stamps[0] < 1.0 else 0.0
    for index, stamp in enumerate(recording.stamps):
        stamp_ns = round((stamp + shift) * 1e9)
        header, truth = header_of(stamp_ns, frame_id), recording.truth(index)
        yield from _views(recording, index, shift, frame_id)
        for name, message in truth_messages(truth, numbers.assign(truth.contacts), recording.interval, header, KNOWN).items():
            yield stamp_ns, f'ground_truth/{name}', message


def _views(recording: Recording, index: int, shift: float, frame_id: str) -> Iterator[tuple[int, str, object]]:
    """Yield camera_info and image of each view of a frame, with the stamp of the view."""
    for number, view in enumerate(recording.views):
        stamp_ns, prefix = round((view.stamps[index] + shift) * 1e9), view.name and view.name + '/'
        header = header_of(stamp_ns, optical_frame(frame_id, view.name))
        yield stamp_ns, prefix + 'camera_info', camera_info_message(view.camera, header)
        yield stamp_ns, prefix + 'image_raw', image_to_message(Frame(recording.image(index, number), stamp_ns, 'bgr8'), '', header)


def sensor_parameters(sensor: dict) -> dict[str, object]:
    """Name -> value of the parameters that sensor.json contains."""
    camera = sensor['cameras'][0]
    rows, columns = (int(n) + 1 for n in np.ptp(sensor['dots']['row_col'], axis=0))
    pose = dict(zip(('camera.rotation', 'camera.translation'), _pose(camera)))
    describe = _touchpad if sensor['sensor'] == 'touchpad' else _markers
    return {'sensor_type': sensor['sensor'], 'rows': rows, 'columns': columns, **describe(sensor), **pose}


def _touchpad(sensor: dict) -> dict[str, object]:
    info = sensor['info']
    return {
        'cap.curvature_radius': float(info['curvature_radius']),
        'cap.height': float(info['cap_height']),
        'membrane.shear_stiffness': float(info['shear_modulus_times_thickness']),
        'membrane.rest_pressure': float(info['rest_gauge_pressure']),
    }


def _markers(sensor: dict) -> dict[str, object]:
    """Parameters of a sheet or a dome with bright markers."""
    info, sheet = sensor['info'], 'size' in sensor['info']
    size = [float(x) for x in info['size']] if sheet else [0.0, 0.0]
    return {
        'pitch': _pitch(sensor['dots']),
        'sheet_size': size,
        'dome.rim_radius': 0.0 if sheet else float(info['base_radius']),
        'dome.height': 0.0 if sheet else float(info['dome_height']),
        'surface': 'sheet' if sheet else 'none',
        'polarity': 'bright',
        'detection': 'blobs',
    }


def _pitch(dots: dict) -> list[float]:
    """Nominal pitch along rows and along columns, m."""
    places = {tuple(rc): np.array(xyz, float) for rc, xyz in zip(dots['row_col'], dots['rest_xyz_nominal'])}
    pitch = []
    for step in ((0, 1), (1, 0)):
        nexts = ((place, places.get((rc[0] + step[0], rc[1] + step[1]))) for rc, place in places.items())
        pitch.append(round(float(np.median([np.linalg.norm(after - place) for place, after in nexts if after is not None])), 7))
    return pitch


@tells_errors('convert_recording')
def main(args: list[str] | None = None) -> int:
    """Run the command; exit code 0, or 1 with a one-line error."""
    parser = argparse.ArgumentParser(prog='convert_recording', description=__doc__)
    parser.add_argument('input', type=Path, help='folder with sensor.json, frames/, truth.npz, or with meta.json, input.npz, truth.npz; '
                        '.npz with imprints of weights')
    parser.add_argument('output', type=Path, help='new rosbag2 folder; the parameter file goes beside it, as OUTPUT.yaml')
    parser.add_argument('--namespace', default='touchpad', help='namespace of the topics, and frame_id')
    given = parser.parse_args(args)
    recording = open_recording(given.input)
    frames = convert(recording, given.output, given.namespace)
    params = given.output.with_name(given.output.name + '.yaml')
    params.write_text(yaml.safe_dump({'/**': {'ros__parameters': parameters(recording)}}, sort_keys=False))
    unit = 'samples' if isinstance(recording, PsdRecording) else 'frames'
    print(f'{given.output}: {frames} {unit}; parameters of the sensor: {params}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
